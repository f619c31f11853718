"""`stemcal verify`: is everything in the study folder as it was written?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from stemcal.cli.console import fail, say, say_json
from stemcal.cli.options import AsJson, Out, Spec
from stemcal.cli.session import existing_folder, read_study
from stemcal.files.typed import to_json

if TYPE_CHECKING:
    from stemcal.overview.verify import Inspection

DAMAGED = 1
MOST_NAMES = 20


def verify(spec: Spec, out: Out = None, as_json: AsJson = False) -> None:
    """Check every record and stage file against its SHA-256, and the stages against the spec; change nothing.

    Ends with 1 if something is damaged. `stemcal run` sets damaged records aside and does their runs again.

    Example: [bold]stemcal verify configs/smoke.yaml[/bold]
    """
    from stemcal.overview.verify import inspect

    study = read_study(spec)
    found = inspect(study, existing_folder(study, out))
    if as_json:
        say_json(to_json(found))
    else:
        say(*_lines(found))
    if not found.ok:
        for entry in found.damaged[:MOST_NAMES]:
            fail(f"{entry.file} {entry.problem}")
        raise typer.Exit(DAMAGED)


def _lines(found: Inspection) -> list[str]:
    intact = found.records - sum(entry.file.startswith("runs/") for entry in found.damaged)
    lines = [f"{found.folder}: {intact} of {found.records} records are intact."]
    if found.set_aside:
        lines.append(f"{found.set_aside} damaged records were set aside earlier, in runs/damaged.")
    lines += _named("belongs to no run", "belong to no run", found.orphans)
    stale = [key[:8] for key in found.stale_records]
    lines += _named("is a run that the spec asks for no more", "are runs that the spec asks for no more", stale)
    for stage in found.stages:
        if stage.changed:
            lines.append(f"{stage.stage}.json is stale: {', '.join(stage.changed)} changed since.")
    return lines


def _named(one: str, many: str, names: Sequence[str]) -> list[str]:
    """Return a line that names up to twenty things, none if there are none."""
    if not names:
        return []
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return [f"{', '.join(names[:MOST_NAMES])}{more} {one if len(names) == 1 else many}."]
