"""The one list of stages: commands, `run`, `status`, `verify`, progress and page take them from here.

Light: what a stage is made of is imported when it runs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stemcal.study.model import Study


@dataclass(frozen=True)
class Stage:
    """One stage of a study.

    Parameters
    ----------
    name : str
        Of its command, of its files.
    title : str
        For people.
    function, result : str
        What makes it and the class of what it comes to, by their places: a result is read without what makes it.
    options : tuple of str
        The sections of the spec that it reads.
    needs : callable
        Study → the name of the stage whose file it reads, None if it reads none.
    help : str
        What its command says of it.
    asked_for : callable
        Whether the whole study has it.
    simulates : bool
        Whether it has runs of its own.
    pictured : bool
        Whether its runs keep what pictures are made from: those at a solution do.
    """

    name: str
    title: str
    function: str
    result: str
    options: tuple[str, ...]
    needs: Callable[[Study], str | None]
    help: str
    asked_for: Callable[[Study], bool] = lambda _study: True
    simulates: bool = True
    pictured: bool = False


def _before_surface(study: Study) -> str | None:
    """A climb if there is one, else the screening; a surface of named factors needs neither."""
    if study.climb is not None:
        return "climb"
    return "screen" if isinstance(study.rsm.factors, str) else None


def _before_validation(study: Study) -> str:
    """The last stage at the solution that the study asks for."""
    return "invert" if study.refine is None else "refine"


STAGES: tuple[Stage, ...] = (
    Stage(
        "screen",
        "Screening",
        "stemcal.stages.screen.screen",
        "stemcal.stages.screen.ScreenResult",
        ("screen",),
        lambda _study: None,
        "Simulate the screening design and find the factors that matter.",
        lambda study: study.screen.design != "none",
    ),
    Stage(
        "climb",
        "Climb",
        "stemcal.stages.climb.climb",
        "stemcal.stages.climb.ClimbResult",
        ("climb", "rsm", "targets"),
        lambda _study: "screen",
        """Step the active factors together towards the measured value; the best step centres the surface's design.

        It walks along the slope that the screening found, climb.steps at most, until the response is past the target.
        With a section climb in the spec it is part of `stemcal run`.
        """,
        lambda study: study.climb is not None,
    ),
    Stage(
        "rsm",
        "Response surface",
        "stemcal.stages.surface.stage.fit_response_surface",
        "stemcal.stages.surface.result.SurfaceResult",
        ("rsm",),
        _before_surface,
        "Simulate the central composite design and fit the response surface.",
    ),
    Stage(
        "invert",
        "Calibration",
        "stemcal.stages.invert.stage.invert",
        "stemcal.stages.invert.result.InvertResult",
        ("invert", "targets"),
        lambda _study: "rsm",
        "Solve the surface for the measured value: calibrated parameters and how well they are known.",
        simulates=False,
    ),
    Stage(
        "refine",
        "Refinement",
        "stemcal.stages.refine.stage.refine",
        "stemcal.stages.refine.result.RefineResult",
        ("refine", "targets"),
        lambda _study: "invert",
        """Simulate at the solution, add the point, refit and step, until the simulated response is right.

        It ends within refine.tolerance_percent of the measured value, or after refine.budget simulations. A joint fit
        (invert.diameters) is simulated at each of its diameters; it also ends when the fit no longer moves. With a
        section refine in the spec it is part of `stemcal run`, and the validation takes the refined parameters.
        """,
        lambda study: study.refine is not None,
        pictured=True,
    ),
    Stage(
        "validate",
        "Validation",
        "stemcal.stages.validate.stage.validate",
        "stemcal.stages.validate.result.ValidateResult",
        ("targets",),
        _before_validation,
        "Simulate whatever was measured, at every diameter or other condition, with the calibrated parameters.",
        pictured=True,
    ),
    Stage(
        "transfer",
        "Transfer",
        "stemcal.stages.transfer.stage.transfer",
        "stemcal.stages.transfer.result.TransferResult",
        ("transfer", "targets"),
        lambda _study: "validate",
        """Run the calibrated point in another program or on another mesh, and correct it there.

        What answers there stands under transfer.solver. It ends within transfer.tolerance_percent of the measured
        value, or after transfer.budget runs of that program. With a section transfer in the spec it is part of
        `stemcal run`.
        """,
        lambda study: study.transfer is not None,
    ),
)
_BY_NAME = {stage.name: stage for stage in STAGES}


def stage_called(name: str) -> Stage:
    """Return a stage by its name."""
    return _BY_NAME[name]


def stages_of(study: Study) -> tuple[Stage, ...]:
    """Return the stages of a whole study, in order."""
    return tuple(stage for stage in STAGES if stage.asked_for(study))
