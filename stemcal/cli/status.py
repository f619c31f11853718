"""`stemcal status`: how far a study has come."""

from stemcal.cli.console import say_json, say_tables
from stemcal.cli.options import AsJson, Out, Spec
from stemcal.cli.session import existing_folder, read_study
from stemcal.files.typed import to_json


def status(spec: Spec, out: Out = None, as_json: AsJson = False) -> None:
    """Show how many runs of each stage are done, running, failed (and why) and left, and what the study comes to.

    It may be asked while the study runs.

    Example: [bold]stemcal status configs/smoke.yaml[/bold]
    """
    from stemcal.files.rows import Column, Table
    from stemcal.overview.status import status as count
    from stemcal.stages.verdict.words import verdict_json
    from stemcal.text.names import Names
    from stemcal.text.status import lines

    study = read_study(spec)
    found, names = count(study, existing_folder(study, out)), Names(study.naming)
    if as_json:
        say_json(to_json(found) | verdict_json(found.verdict, names))
    else:
        heads = {"rows": "Runs", "done": "Done", "running": "Running", "failed": "Failed", "left": "Left"}
        # what a stage before has to decide is open
        counts = (Column(key, head, form=lambda n: "?" if n is None else str(n)) for key, head in heads.items())
        columns = [Column("stage", "Stage"), Column("file", "File"), *counts]
        say_tables(Table.of(columns, found.stages, f"Study {found.study}", lines(found, names)))
