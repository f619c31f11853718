"""`stemcal augment`: add runs to a design already run."""

from typing import Annotated

import typer

from stemcal.cli.console import note
from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers
from stemcal.cli.session import existing_folder, opened, read_study
from stemcal.stages.base import stage_called


def augment(
    spec: Spec,
    fold_over: Annotated[
        bool, typer.Option("--fold-over", help="Screening: every run again with all signs turned.")
    ] = False,
    extra_runs: Annotated[
        int, typer.Option("--extra-runs", metavar="N", min=0, max=200, help="Surface: N runs where they teach most.")
    ] = 0,
    axial: Annotated[
        float | None,
        typer.Option("--axial", metavar="DISTANCE", help="Surface: axial points at that coded distance."),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Tell what would be added; change and run nothing.")
    ] = False,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Add runs to a design already run; what is there is kept and not computed again.

    The keys are written into the spec (screen.fold_over, rsm.extra_runs, rsm.axial), comments and layout stay; then
    the stage is made anew. A fold-over frees main effects of two-factor interactions.

    Example: [bold]stemcal augment my-stems.yaml --extra-runs 4[/bold]
    """
    from stemcal.cli.show import show_stage
    from stemcal.overview import augment as augmenting
    from stemcal.stages.fresh import make
    from stemcal.stages.verdict.rules import verdict_of
    from stemcal.study.reading.amend import rewrite

    study = read_study(spec)
    added = augmenting.Augmentation(fold_over, extra_runs, axial)
    larger, changes = augmenting.augment(study, added)
    folder = existing_folder(study, out)
    for part in augmenting.growth(study, larger, added.stages, folder):
        note(f"{part.stage}: {part.had} runs become {part.rows}, {part.to_run} of them to compute")
    if dry_run:
        return
    rewrite(spec, larger, changes)
    note(f"{spec.name}: " + "; ".join(f"{section}.{key}: {value}" for section, key, value in changes))
    with opened(spec, out, workers, executor, quiet) as work:
        changed = {section for section, _, _ in changes}
        for name in added.stages:
            before = stage_called(name).needs(work.study)
            if before is not None and changed & set(stage_called(before).options) and before not in added.stages:
                make(stage_called(before), work.study, work.folder, work.executor, work.watch)  # its runs are there
            result = make(stage_called(name), work.study, work.folder, work.executor, work.watch)
            show_stage(result, verdict_of(work.study, work.folder), work.folder, as_json, quiet)
