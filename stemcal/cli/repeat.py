"""The circumstances of a recorded run, to repeat it alone: `stemcal simulate --from-run`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from stemcal.cli.console import warn
from stemcal.cli.session import existing_folder
from stemcal.errors import UsageError
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request

if TYPE_CHECKING:
    from stemcal.study.model import Study


def recorded_run(study: Study, out: Path | None, short: str) -> tuple[dict[str, float], float]:
    """Return levels and diameter of the run whose key begins with `short`; warn if the spec has changed since."""
    from stemcal.overview.status import complete_key
    from stemcal.runs.outcome import record_key

    folder = existing_folder(study, out)
    key = complete_key(short, folder.keys())
    record = folder.peek(key)
    if record is None:
        raise UsageError(f"the record {folder.record_path(key)} is damaged; `stemcal verify SPEC` tells more")
    request = Request(**record["request"])
    unknown = sorted(set(request.levels) - set(study.names))
    if unknown:
        raise UsageError(f"run {short}: the spec has no factor {', '.join(unknown)} now; use the spec it was made with")
    if record_key(make_solver(study.seen_by(request.stage)), request) != key:
        warn(f"the spec has changed since run {short}: same levels and diameter, but not the same model")
    return dict(request.levels), request.condition
