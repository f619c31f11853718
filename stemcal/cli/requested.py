"""Pictures that are drawn only when they are asked for: the cut as a film, and the cut stem in space."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from stemcal.cli.console import note
from stemcal.errors import UsageError
from stemcal.numbers import short
from stemcal.outputs import make_folder

if TYPE_CHECKING:
    from stemcal.folder.study_folder import StudyFolder
    from stemcal.report.records import Details
    from stemcal.study.model import Study

NEEDS = {"animation": "film", "view": "shape"}  # what a run must have kept for it
CAPTIONS = {"animation": "The cut as a short film.", "view": "The cut stem in space."}


def is_requested(name: str) -> bool:
    """Tell whether a figure's name is one of these."""
    return name.partition("-")[0] in NEEDS


def requestable(study: Study, folder: StudyFolder) -> dict[str, Details]:
    """Return the details of the runs that can be shown so, by the name of the picture."""
    from stemcal.report.records import read_records
    from stemcal.stages.results import fresh_results

    records = read_records(fresh_results(study, folder), folder)
    return {
        f"{kind}-{label.replace(' ', '')}": record.details
        for kind, needed in NEEDS.items()
        for label, record in records.items()
        if getattr(record.details, needed) and record.at_solution
    }


def write_requested(study: Study, folder: StudyFolder, name: str, suffix: str) -> Path:
    """Write the picture called `name`; the bare word means the calibration diameter. Returns the file."""
    known = requestable(study, folder)
    if not study.naming.is_cutting:
        raise UsageError(f"no figure {name!r}: only the embedded solver's runs keep what it is made from")
    wanted = f"{name}-{short(study.targets.calibrate_at)}mm" if name in NEEDS else name
    if wanted not in known:
        raise UsageError(f"no figure {wanted!r}; {_known(known)}")
    figures = make_folder(folder.path / "figures")
    if wanted.startswith("view"):
        return _view(known[wanted], figures / f"{wanted}.png")
    return _animation(known[wanted], figures / f"{wanted}.{suffix}")


def _animation(details: Details, path: Path) -> Path:
    from stemcal.cutting.end_state import Shape
    from stemcal.report.figures.animation import write_animation
    from stemcal.solvers.film import frames_of

    curve = details.curve
    frames = frames_of(Shape.unpacked(details.shape), details.film)
    return write_animation(frames, path, None if curve is None else (curve.travel, curve.force))


def _view(details: Details, path: Path) -> Path:
    from stemcal.cutting.end_state import Shape
    from stemcal.report.figures.view import write_view

    note(f"{path.name}: {write_view(Shape.unpacked(details.shape), path)}")
    return path


def _known(known: Mapping[str, object]) -> str:
    if known:
        return f"there are {', '.join(known)}"
    return (
        "no run kept what it is made from: with the embedded solver those of the stages refine and validate do; "
        "runs of an earlier version get it when `stemcal run SPEC --out NEW` makes them again"
    )
