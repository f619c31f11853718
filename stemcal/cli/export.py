"""`stemcal export`: the tables of a study as papers print them."""

from typing import Annotated, Literal

import typer

from stemcal.cli.console import say, say_json, warn
from stemcal.cli.options import AsJson, Out, Spec
from stemcal.cli.session import existing_folder, read_study

Format = Annotated[
    Literal["csv", "md", "tex", "docx"],
    typer.Option("--format", "-f", help="CSV (a file per table), Markdown, LaTeX or Word."),
]


First = Annotated[
    int | None, typer.Option("--first", min=1, metavar="N", help="Count the tables from N, as your paper does.")
]
Apart = Annotated[bool, typer.Option("--stars-apart", help="The stars of p-values in cells of their own.")]


def export(
    spec: Spec,
    kind: Format = "csv",
    first: First = None,
    apart: Apart = False,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Write the tables of a study as papers print them, into the folder tables of the study folder.

    Factors, screening design and analysis, coding, response surface design, ANOVA, calibration, parameters and
    validation: Tables 5 to 13 of the wild chrysanthemum study, for yours; with those of steepest ascent and refinement,
    where your study has them, they are counted through.

    Example: [bold]stemcal export configs/smoke.yaml --format docx --first 1[/bold]
    """
    from stemcal.report.export.formats import export_tables
    from stemcal.report.export.paper import numbered, paper_tables, stars_apart
    from stemcal.stages.results import fresh_results
    from stemcal.stages.verdict.rules import verdict_of

    study = read_study(spec)
    folder = existing_folder(study, out)
    results = fresh_results(study, folder)
    for sentence in results.stale:
        warn(sentence)
    tables = numbered(paper_tables(study, results, verdict_of(study, folder, results).holds), first)
    tables = [stars_apart(table) for table in tables] if apart else tables
    paths = [str(path) for path in export_tables(tables, kind, folder.path / "tables")]
    if as_json:
        say_json({"schema_version": 1, "stage": "export", "files": paths})
    else:
        say(*paths)
