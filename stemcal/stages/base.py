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
    return "refine" if study.refined_here else "invert"


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
        lambda study: "invert" if study.refine is None or study.refined_here else "validate",
        """Simulate at the solution, correct it and step, until the simulated response is right.

        It ends within refine.tolerance_percent of the measured value, or after refine.budget simulations. A joint fit
        (invert.diameters) is simulated at each of its diameters; it also ends when the fit no longer moves. With a
        section refine in the spec it is part of `stemcal run`, and the validation uses the refined parameters. With
        refine.in it runs after the validation, in the program or on the mesh where the parameters will be used.
        """,
        lambda study: study.refine is not None,
        pictured=True,
    ),
    Stage(
        "validate",
        "Validation",
        "stemcal.stages.validate.stage.validate",
        "stemcal.stages.validate.result.ValidateResult",
        ("targets", "validation"),
        _before_validation,
        "Simulate whatever was measured, at every diameter or other condition, with the calibrated parameters.",
        pictured=True,
    ),
)
_BY_NAME = {stage.name: stage for stage in STAGES}


def stage_called(name: str) -> Stage:
    """Return a stage by its name."""
    return _BY_NAME[name]


def stages_of(study: Study) -> tuple[Stage, ...]:
    """Return the stages of a whole study, in order: a refinement in another model comes last."""
    stages = [stage for stage in STAGES if stage.asked_for(study)]
    return tuple(sorted(stages, key=lambda stage: stage.name == "refine" and not study.refined_here))


def study_of(stage: str, study: Study) -> Study:
    """Return the study as a stage simulates it: the refinement may have another model."""
    return study.there if stage == "refine" else study
