"""The study as data: frozen models, every value in internal units (mm, tonne, s, N, MPa, degrees).

Only `Factor` keeps the unit its author chose: designs, tables and results show levels in that unit, and
`Factor.internal` converts where a solver needs it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PrivateAttr,
    StringConstraints,
    ValidationInfo,
    WithJsonSchema,
)
from pydantic.dataclasses import dataclass
from pydantic.json_schema import SkipJsonSchema

from stemcal.naming import CUTTING, Naming
from stemcal.study import units
from stemcal.study.outside import CommandSolver, LsDynaSolver, OpenRadiossSolver
from stemcal.study.parameters import PARAMETERS
from stemcal.study.spec.fields import (
    ColumnName,
    FactorName,
    Label,
    Number,
    Quantity,
    Readable,
    SpecFile,
    StudyName,
    Title,
    Whole,
    complain,
)
from stemcal.study.spec.lengths import Length, StemLength, StemLengthOrZero
from stemcal.study.spec.named import OwnCondition, OwnResponse, internal_names, naming_of

__all__ = [
    "Blade",
    "ClimbOptions",
    "CodingEntry",
    "Condition",
    "Contact",
    "EmbeddedSolver",
    "Factor",
    "Failure",
    "Hourglass",
    "InvertOptions",
    "Loading",
    "Material",
    "MeshOptions",
    "Published",
    "RefineOptions",
    "RsmOptions",
    "RunsOptions",
    "ScreenOptions",
    "Specimen",
    "Study",
    "StudyForm",
    "Supports",
    "TableSolver",
    "Target",
    "Targets",
]

MOST_FACTORS = 100

Size = Annotated[float, Quantity("length", above=0)]
AtSize = Annotated[float, OwnCondition("length", above=0)]
SizeOrZero = Annotated[float, Quantity("length", at_least=0)]
Time = Annotated[float, Quantity("time", above=0)]
Force = Annotated[float, OwnResponse("force", above=0)]
Work = Annotated[float, Quantity("energy", above=0)]


def _not_from_yaml(given: Any, info: ValidationInfo) -> Any:
    """Refuse what a spec writes in another way."""
    if info.context is not None and info.context.get("naming", CUTTING).is_cutting:
        raise complain("unknown key 'further'", "name each response under responses, and give its mean by that name")
    return given


class _Frozen(BaseModel):
    """Immutable, no unknown keys, finite numbers only."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


UnitText = Annotated[
    str,
    BeforeValidator(lambda given: "1" if given == 1 and not isinstance(given, bool) else given),
    StringConstraints(strict=True, min_length=1, max_length=24),
    Readable,
]


class Factor(_Frozen):
    """One parameter to calibrate, with the range to search; `low` and `high` are in `unit`."""

    name: FactorName
    symbol: Annotated[str, StringConstraints(strict=True, min_length=1, max_length=12), Readable]
    label: Label
    unit: UnitText = "1"
    low: Number
    high: Number
    expected_sign: Literal["+", "-"] | None = None

    @property
    def centre(self) -> float:
        """The mid-level, in `unit`."""
        # twelve digits: the middle of 0.2 and 0.4 is 0.3
        return float(f"{0.5 * (self.low + self.high):.12g}")

    @property
    def half_range(self) -> float:
        """Half the distance from low to high, in `unit`."""
        return 0.5 * (self.high - self.low)

    def internal(self, value: float) -> float:
        """Convert a value in `unit` to internal units."""
        return units.convert(value, self.unit)


class Response(_Frozen):
    """What a run gives and the laboratory measures, where it is not the maximum force; values are in `unit`."""

    name: ColumnName
    symbol: Annotated[str, StringConstraints(strict=True, min_length=1, max_length=12), Readable] = "Y"
    label: Label | None = None
    unit: UnitText = "1"


class Condition(_Frozen):
    """At what the responses are measured, where it is not the stem's diameter; values are in `unit`."""

    name: ColumnName
    symbol: Annotated[str, StringConstraints(strict=True, min_length=1, max_length=12), Readable] = "x"
    label: Label | None = None
    unit: UnitText = "1"


class Specimen(_Frozen):
    """The piece of stem, a hollow cylinder."""

    outer_diameter: Size = 8.0
    diameter_ratio: Annotated[Number, Field(ge=0, lt=1)] = 0.41
    length: Size = 50.0


class Blade(_Frozen):
    """The rigid blade; `edge_angle` is the angle between its two edge faces.

    `edge_spread` is how far from its own profile the blade of the embedded solver bears on the surface beside its edge.
    """

    length: Size = 90.0
    width: Size = 28.0
    thickness: Size = 2.3
    edge_angle: Annotated[float, Quantity("angle", above=0, below=180)] = 37.5
    bevel: Literal["both", "one"] = "both"
    edge_radius: SizeOrZero = 0.1
    edge_spread: StemLengthOrZero = Length(divisor=9.5)


class Supports(_Frozen):
    """The two rigid supports; `clearance` is the gap between them."""

    clearance: Size = 20.0
    fillet_radius: SizeOrZero = 1.0


class Loading(_Frozen):
    """How the blade moves; `gap` is its distance from the stem at the start."""

    speed: Annotated[float, Quantity("speed", above=0)] = 100 / 60
    duration: Time = 0.5
    gap: SizeOrZero = 0.001

    @property
    def stroke(self) -> float:
        """How far the blade comes from touching the stem on, mm."""
        return self.speed * self.duration - self.gap


class Contact(_Frozen):
    """Friction and penalty: µ = µd + (µs − µd)·exp(−decay·|v|)."""

    static_friction: Annotated[Number, Field(ge=0, le=2)] = 0.15
    dynamic_friction: Annotated[Number, Field(ge=0, le=2)] = 0.10
    decay: Annotated[float, Quantity("decay", at_least=0)] = 0.0
    penalty: Annotated[Number, Field(gt=0, le=1)] = 0.25
    damping: Annotated[Number, Field(ge=0, le=1)] = 0.5


Stress = Annotated[float, Quantity("stress")]
_NO_RATE = {"strain_rate_c": 0.0, "strain_rate_p": 1.0}  # what solvers take for a yield stress without rate
PrintedText = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=40), Readable]


class Material(_Frozen):
    """Fixed values of the material parameters that are no factors, in internal units.

    `internal_length` is the length over which the embedded solver averages the strain that decides failure.
    """

    density: Annotated[float, Quantity("density")] | None = None
    elastic_modulus: Stress | None = None
    poisson_ratio: Number | None = None
    yield_stress: Stress | None = None
    tangent_modulus: Stress | None = None
    hardening_parameter: Number | None = None
    strain_rate_c: Annotated[float, Quantity("rate")] | None = None
    strain_rate_p: Number | None = None
    failure_strain: Number | None = None
    internal_length: StemLengthOrZero = Length(divisor=4.5)

    def given(self) -> dict[str, float]:
        """Return the parameters that have a value."""
        return {name: value for name in PARAMETERS if (value := getattr(self, name, None)) is not None}


class Failure(_Frozen):
    """How the stem fails: elements by their plastic strain, or the plane of the cut by `strength` and `toughness`.

    Elements have no failure strain in the second case, which is experimental.
    """

    kind: Literal["strain", "toughness"] = "strain"
    strength: Annotated[float, Quantity("stress", above=0)] | None = None
    toughness: Annotated[float, Quantity("toughness", above=0)] | None = None


class Hourglass(_Frozen):
    """Hourglass control of the one-point elements."""

    form: Literal["stiffness", "viscous"] = "stiffness"
    coefficient: Annotated[Number, Field(ge=0, le=1)] = 0.01


class EmbeddedSolver(_Frozen):
    """The explicit finite element solver that comes with stemcal."""

    kind: Literal["embedded"] = "embedded"
    rate_law: Literal["paper", "cowper_symonds", "none"] = "paper"
    symmetry: Literal["none", "half", "quarter"] = "quarter"
    element_size: StemLength = Length(divisor=16.0)
    elements_through_wall: Annotated[Whole, Field(ge=1, le=50)] | None = None
    edge_over: Literal["elements", "nodes"] = "nodes"
    element: Literal["one_point", "full"] = "one_point"
    hourglass: Hourglass = Hourglass()
    mass_scaling: Annotated[Number, Field(ge=1)] = 1e4
    time_step: Time | None = 4e-5
    time_step_safety: Annotated[Number, Field(ge=0.001, le=1)] = 0.9
    precision: Literal["mixed", "double"] = "mixed"
    outputs: Annotated[Whole, Field(ge=10, le=100_000)] = 500
    filter_window: Annotated[float, Quantity("time", at_least=0)] = 0.010
    coarsening: Annotated[Number, Field(ge=1, le=10)] = 6.0
    coarsening_around: Annotated[Number, Field(ge=1, le=10)] = 2.0
    phases: Annotated[Whole, Field(ge=1, le=100)] = 1
    perturb: Annotated[Whole, Field(ge=0, le=2**31)] | None = None
    break_drop: Annotated[Number, Field(gt=0, le=1)] = 0.5
    stop_after_peak: Annotated[bool, Field(strict=True)] = True
    failure_length: Size | None = None
    threads: Annotated[Whole, Field(ge=1, le=256)] = 1


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class TableSolver:
    """Tables that answer in place of a solver: columns named by factor, the response last.

    A dataclass, because a model of pydantic cannot have a field called `validate`.
    """

    kind: Literal["table"] = "table"
    screen: SpecFile | None = None
    rsm: SpecFile | None = None
    validate: SpecFile | None = None


class Mean(_Frozen):
    """The measured mean of a further response, with its standard deviation, in its own unit."""

    value: float
    sd: float | None = None


class Target(_Frozen):
    """The measured maximum force at one stem diameter, with its standard deviation over n specimens.

    `travel` is how far the blade has come from first touch to that maximum, `work` what it has done by then. Where the
    study names its own responses, `force` is the first of them, `diameter` the condition, and `further` has the others.
    """

    diameter: AtSize
    force: Force
    sd: Annotated[float, OwnResponse("force", at_least=0)] | None = None
    n: Annotated[Whole, Field(ge=1)] | None = None
    travel: Size | None = None
    travel_sd: SizeOrZero | None = None
    work: Work | None = None
    work_sd: Annotated[float, Quantity("energy", at_least=0)] | None = None
    further: SkipJsonSchema[Annotated[dict[str, Mean], BeforeValidator(_not_from_yaml)]] = {}

    def mean_of(self, response: str) -> tuple[float | None, float | None]:
        """Return mean and standard deviation of a response."""
        if response in self.further:
            return self.further[response].value, self.further[response].sd
        known = {
            "force": (self.force, self.sd),
            "travel": (self.travel, self.travel_sd),
            "work": (self.work, self.work_sd),
        }
        return known.get(response, (None, None))


class Targets(_Frozen):
    """What the laboratory measured, and the diameter at which the parameters are calibrated."""

    calibrate_at: AtSize
    forces: Annotated[tuple[Target, ...], Field(min_length=1, max_length=1000)]
    equivalent_within_percent: Annotated[Number, Field(gt=0, lt=100)] = 10.0


_FIELD_NAMES = {
    "PB": "plackett-burman",
    "CCD": "central-composite",
    "BBD": "box-behnken",
    "DSD": "definitive-screening",
}


def _in_full(given: Any) -> Any:
    """Return the name of a design for what the field calls it."""
    return _FIELD_NAMES.get(given.upper(), given) if isinstance(given, str) else given


ScreeningDesign = Literal[
    "plackett-burman", "plackett-burman-pydoe", "fractional-factorial", "full-factorial", "definitive-screening"
]
SurfaceDesign = Literal["central-composite", "box-behnken", "full-factorial", "latin-hypercube", "sobol", "i-optimal"]


def _names_of(designs: Any) -> dict[str, Any]:
    """Return the JSON schema of a design's name: in full, or what the field calls it."""
    known = get_args(designs)
    return {"enum": [*known, *(short for short, name in _FIELD_NAMES.items() if name in known)], "type": "string"}


class ScreenOptions(_Frozen):
    """The screening design, what its effects are tested against, and the significance level that keeps a factor.

    `runs` overrides the usual size of the design; `fold_over` repeats every run with all signs turned.
    `centre_points` are added in the middle of all ranges: they tell whether the response is curved there, and how a
    program with chance in it scatters. PB stands for plackett-burman.
    """

    design: Annotated[ScreeningDesign, BeforeValidator(_in_full), WithJsonSchema(_names_of(ScreeningDesign))] = (
        "plackett-burman"
    )
    centre_points: Annotated[Whole, Field(ge=0, le=50)] = 0
    runs: Annotated[Whole, Field(ge=4, le=512)] | None = None
    fold_over: Annotated[bool, Field(strict=True)] = False
    error: Literal["residual", "pooled", "replicates", "lenth"] = "residual"
    alpha: Annotated[Number, Field(gt=0, lt=1)] = 0.05


class CodingEntry(_Frozen):
    """Coded 0 and coded 1 of one factor: centre, and centre + half step, in the factor's unit."""

    center: Number
    half_step: Annotated[Number, Field(gt=0)]


_STRONGEST = r"strongest ([1-9][0-9]?)"


def _chosen_or_names(given: Any) -> Any:
    if isinstance(given, list | tuple) or given == "significant":
        return given
    if isinstance(given, str) and re.fullmatch(_STRONGEST, " ".join(given.split())):
        return " ".join(given.split())
    message = "should be 'significant', 'strongest 3' or a list of factor names"
    raise complain(message, "write factors: significant")


def strongest_asked(factors: str | tuple[str, ...]) -> int:
    """Return how many of the strongest factors `rsm.factors` asks for; 0 where it says something else.

    >>> strongest_asked("strongest 3"), strongest_asked("significant")
    (3, 0)
    """
    found = re.fullmatch(_STRONGEST, factors) if isinstance(factors, str) else None
    return int(found[1]) if found else 0


def factors_taken(design: str) -> tuple[int, int]:
    """Return how few and how many factors a design for the surface takes."""
    return (3, 7) if design == "box-behnken" else (2, MOST_FACTORS)


AlphaRule = Literal["rotatable", "face", "spherical", "orthogonal", "practical"]


def _axial_distance(given: Any) -> Any:
    number = isinstance(given, int | float) and not isinstance(given, bool)
    if given in get_args(AlphaRule) or (number and 0 < given <= 100):
        return given
    shown = f"{given:g}" if number else repr(given)[:60]
    raise complain(f"{shown} is no axial distance", f"write {', '.join(get_args(AlphaRule))} or a number above 0")


def _batches(given: Any) -> Any:
    for count in given if isinstance(given, list | tuple) and 1 <= len(given) <= 20 else [given]:
        if not isinstance(count, int) or isinstance(count, bool) or not 0 <= count <= 200:
            remedy = "write a whole number up to 200, or a list of them"
            raise complain(f"{str(count)[:60]} is no number of runs", remedy)
    return given


ExtraRuns = Annotated[
    int | tuple[int, ...],
    BeforeValidator(_batches),
    WithJsonSchema(
        {"anyOf": [{"type": "integer", "minimum": 0}, {"type": "array", "items": {"type": "integer", "minimum": 0}}]}
    ),
]


class Constraint(_Frozen):
    """Σ coefficient·level ≤ `at_most`, in the units of the factors."""

    of: Annotated[dict[str, Number], Field(min_length=1)]
    at_most: Number


class CoarseOptions(_Frozen):
    """Elements of another, larger size for the runs of the surface's design; the study's own correct it in a few.

    `fine_runs` of the design are simulated with the study's own element size too, which everything else belongs to.
    """

    element_size: StemLength
    fine_runs: Annotated[Whole, Field(ge=3, le=100)] = 4


class RsmOptions(_Frozen):
    """The design behind the response surface, and the terms that are fitted.

    `factors` are those the screening finds significant, its ``strongest 3``, or those named. CCD stands for
    central-composite, BBD for box-behnken.

    `core` chooses the corners of a composite with five factors or more, `runs` and `seed` belong to the
    space-filling designs. `extra_runs` are added where they teach most (D-optimal; a list adds one batch after the
    other), `axial` adds axial points at that coded distance. `blocks` splits a composite into two orthogonal blocks,
    `weights` lets runs of small scatter over mesh phases count more, `inestimable` says what becomes of terms that
    failed runs have made so. `constraints` cut the region of an I-optimal design. `coarse` runs the design with larger
    elements and corrects the surface by a few runs with the study's own.
    """

    design: Annotated[SurfaceDesign, BeforeValidator(_in_full), WithJsonSchema(_names_of(SurfaceDesign))] = (
        "central-composite"
    )

    factors: Annotated[
        str | tuple[str, ...],
        BeforeValidator(_chosen_or_names),
        WithJsonSchema(
            {
                "anyOf": [
                    {"const": "significant"},
                    {"type": "string", "pattern": f"^{_STRONGEST}$"},
                    {"type": "array", "items": {"type": "string"}},
                ]
            }
        ),
    ] = "significant"
    centre_points: Annotated[Whole, Field(ge=0, le=100)] = 6
    alpha: Annotated[
        AlphaRule | float,
        BeforeValidator(_axial_distance),
        WithJsonSchema({"anyOf": [{"enum": list(get_args(AlphaRule))}, {"type": "number", "minimum": 0}]}),
    ] = "rotatable"
    core: Literal["full", "fractional"] = "full"
    runs: Annotated[Whole, Field(ge=6, le=10_000)] | None = None
    seed: Annotated[Whole, Field(ge=0, le=2**31)] = 0
    extra_runs: ExtraRuns = 0
    axial: Annotated[Number, Field(gt=0, le=100)] | None = None
    blocks: Literal["none", "orthogonal"] = "none"
    weights: Literal["equal", "phases"] = "equal"
    inestimable: Literal["refuse", "drop"] = "refuse"
    reduce: Literal["none", "backward", "forward", "aicc"] = "none"
    reduce_alpha: Annotated[Number, Field(gt=0, lt=1)] = 0.1
    sums_of_squares: Literal["partial", "sequential"] = "partial"
    constraints: Annotated[tuple[Constraint, ...], Field(max_length=20)] = ()
    coarse: CoarseOptions | None = None
    coding: dict[str, CodingEntry] = {}


Responses = Annotated[
    tuple[str, ...],
    BeforeValidator(internal_names),
    WithJsonSchema({"anyOf": [{"const": "all"}, {"type": "array", "items": {"type": "string"}}]}),
]


class InvertOptions(_Frozen):
    """Which of the points that give the target is called the solution; with `diameters`, the joint fit over them.

    `responses` chooses what is fitted there; more than the force makes a joint fit even of one diameter.
    `posterior` adds samples of what the measured forces leave possible (needs emcee). `ranges_chosen` says whether the
    factors' ranges were fixed before the measured forces were seen; after that no diameter left out is a check.
    `desirability` puts the most desirable point of several responses beside the fit, by default where the study
    declares them. `discrepancy` takes one scale with scatter, or one that changes smoothly (a Gaussian process), for
    what the model misses over the fitted diameters, and gives prediction intervals of the measured forces.
    """

    rule: Literal["least_coded_distance", "least_prediction_variance", "others_at_centre"] = "least_coded_distance"
    diameters: Literal["all"] | Annotated[tuple[AtSize, ...], Field(min_length=1)] | None = None
    responses: Responses = ("force",)
    posterior: Annotated[bool, Field(strict=True)] = False
    ranges_chosen: Literal["before", "after"] = "before"
    discrepancy: Literal["none", "scale", "process"] = "none"
    desirability: Annotated[bool, Field(strict=True)] | None = None


class ClimbOptions(_Frozen):
    """The walk towards the target between screening and surface: `steps` from the middle to the edge of the ranges.

    The surface's design is centred on the best step and reaches over the share `shrink` of each range.
    `step_sizes` are steps of one's own in the units of the factors: such a walk has as many as stay in the ranges, at
    most `steps`; active factors without a size go along in proportion to their slopes.
    """

    steps: Annotated[Whole, Field(ge=1, le=50)] = 5
    step_sizes: dict[str, Annotated[Number, Field(gt=0)]] = {}
    shrink: Annotated[Number, Field(gt=0, le=1)] = 0.5


class RefineOptions(_Frozen):
    """When simulating at the solution and refitting ends: force within the tolerance, or runs spent.

    `model` proposes the points: the quadratic one by one, or a Gaussian process in batches, or whichever predicts
    better the runs left out.
    """

    tolerance_percent: Annotated[Number, Field(gt=0, le=50)] = 1.0
    budget: Annotated[Whole, Field(ge=1, le=1000)] = 10
    model: Literal["quadratic", "process", "better"] = "quadratic"
    batch: Annotated[Whole, Field(ge=1, le=64)] = 4


class MeshOptions(_Frozen):
    """Which other meshes the solution is simulated on: `phases` places along the stem, elements of other `sizes`.

    Their scatter enters every interval; what a size does to all diameters alike is told beside the calibrated values.
    """

    phases: Annotated[Whole, Field(ge=2, le=50)] = 5
    sizes: Annotated[tuple[StemLength, ...], Field(max_length=10)] = ()


class RunsOptions(_Frozen):
    """What becomes of runs that fail, and how long one may take.

    `tries` counts accidents (its process died, the solver raised an exception); what fails for a physical reason
    would fail again. `time_limit` is counted from the start of a run. A stage needs the share `quorum` of its rows
    to succeed; without `keep_going` the first failed run stops it. A force that still rises when the stroke
    ends is a lower bound: `censored` says whether that is a warning or a failure.
    """

    tries: Annotated[Whole, Field(ge=1, le=20)] = 2
    time_limit: Time | None = None
    quorum: Annotated[Number, Field(ge=0, le=1)] = 0.5
    keep_going: Annotated[bool, Field(strict=True)] = True
    censored: Literal["warn", "fail"] = "warn"


class Published(_Frozen):
    """Printed results to compare with, when a published study is analysed again.

    `runs` says whether the paper's runs were computed, so that repeated ones must agree; `bounds` in which units its
    coded equation is searched; `rate_law` which form it prints; `called` what it calls a factor.
    """

    screening: SpecFile | None = None
    coefficients: SpecFile | None = None
    anova: SpecFile | None = None
    solution: dict[str, Number] = {}
    validation: SpecFile | None = None
    levels: SpecFile | None = None
    design: SpecFile | None = None
    claims: dict[str, PrintedText] = {}
    runs: Literal["computed", "measured"] | None = None
    bounds: Literal["coded", "natural"] | None = None
    rate_law: Literal["paper", "cowper_symonds"] | None = None
    called: dict[str, PrintedText] = {}


class StudyForm(_Frozen):
    """What stands in a spec."""

    schema_version: Annotated[Whole, Field(ge=1, le=1)] = 1
    name: StudyName
    title: Title = ""
    factors: Annotated[tuple[Factor, ...], Field(min_length=1, max_length=MOST_FACTORS)]
    responses: Annotated[tuple[Response, ...], Field(max_length=20)] = ()
    conditions: Annotated[tuple[Condition, ...], Field(max_length=1)] | None = None
    specimen: Specimen = Specimen()
    blade: Blade = Blade()
    supports: Supports = Supports()
    loading: Loading = Loading()
    contact: Contact = Contact()
    material: Material = Material()
    failure: Failure = Failure()
    solver: Annotated[
        EmbeddedSolver | TableSolver | CommandSolver | LsDynaSolver | OpenRadiossSolver, Field(discriminator="kind")
    ] = EmbeddedSolver()
    targets: Targets
    screen: ScreenOptions = ScreenOptions()
    climb: ClimbOptions | None = None
    rsm: RsmOptions = RsmOptions()
    invert: InvertOptions = InvertOptions()
    refine: RefineOptions | None = None
    mesh: MeshOptions | None = None
    runs: RunsOptions = RunsOptions()
    published: Published | None = None


class Study(StudyForm):
    """A whole study. `source` (the spec file) and `warnings` are no part of its dump."""

    source: Path = Field(default=Path("study.yaml"), exclude=True)
    warnings: tuple[str, ...] = Field(default=(), exclude=True)
    _reread: Callable[[Mapping[str, object]], Study] | None = PrivateAttr(default=None)

    def with_(self, **changes: object) -> Study:
        """Return the study that its spec gives with some changes, checked as a spec is.

        Parameters
        ----------
        changes
            By the name of a factor or of a section: a mapping is laid over what stands there, anything else takes its
            place. Quantities are written as in a spec.

        Raises
        ------
        SpecError
            With every problem of the changed spec.

        Examples
        --------
        ``study.with_(yield_stress={"high": 25}, rsm={"alpha": "face"})``
        """
        if self._reread is None:
            raise TypeError("only a study that was read from a spec can be changed so")
        return self._reread(changes)

    def __repr__(self) -> str:
        return (
            f"Study {self.name}: {len(self.factors)} factors, {len(self.targets.forces)} measured "
            f"{self.naming.response.plural}, solver {self.solver.kind}"
        )

    __str__ = __repr__

    @cached_property
    def naming(self) -> Naming:
        """What the responses and the condition are called."""
        return naming_of(self.responses, self.conditions)

    @property
    def own_further(self) -> tuple[str, ...]:
        """The names of the responses that the study declares beside its first."""
        return () if self.naming.is_cutting else tuple(named.name for named in self.naming.further)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the factors, in the order of the spec."""
        return tuple(factor.name for factor in self.factors)

    def factor(self, name: str) -> Factor:
        """Return the factor called `name`; raise `KeyError` if there is none."""
        for factor in self.factors:
            if factor.name == name:
                return factor
        raise KeyError(name)

    def midlevels(self) -> dict[str, float]:
        """Return the mid-level of every factor, in the units of the spec."""
        return {factor.name: factor.centre for factor in self.factors}

    def parameters(self, levels: Mapping[str, float]) -> dict[str, float]:
        """Return the nine material parameters in internal units; factors without a level stay at mid-level."""
        chosen = self._internal(levels)
        varied = {name: value for name, value in chosen.items() if name in PARAMETERS}
        never = {"failure_strain": inf} if self.failure.kind == "toughness" else {}
        return {**self.material.given(), **varied, **(_NO_RATE if self.without_rate else {}), **never}

    def at(self, levels: Mapping[str, float]) -> Study:
        """Return the study whose specimen, contact and failure are what the levels of such factors say.

        `stem_friction` is the coefficient of friction at any speed; `wall_thickness` is that of the stem at the
        calibration diameter, and stems of other diameters have the same ratio of inner to outer diameter.
        """
        chosen = self._internal(levels)
        sections: dict[str, BaseModel] = {}
        if (friction := chosen.get("stem_friction")) is not None:
            given = {"static_friction": friction, "dynamic_friction": friction, "decay": 0.0}
            sections["contact"] = self.contact.model_copy(update=given)
        if (wall := chosen.get("wall_thickness")) is not None:
            ratio = 1.0 - 2.0 * wall / self.targets.calibrate_at
            sections["specimen"] = self.specimen.model_copy(update={"diameter_ratio": ratio})
        if cut := {name: value for name, value in chosen.items() if name in ("strength", "toughness")}:
            sections["failure"] = self.failure.model_copy(update=cut)
        return self.model_copy(update=sections) if sections else self

    def _internal(self, levels: Mapping[str, float]) -> dict[str, float]:
        """Return the value of every factor in internal units; those without a level stay at mid-level."""
        chosen = {**self.midlevels(), **levels}
        return {factor.name: factor.internal(chosen[factor.name]) for factor in self.factors}

    @property
    def without_rate(self) -> bool:
        """Whether the speed of straining is to leave the yield stress as it is."""
        return isinstance(self.solver, EmbeddedSolver) and self.solver.rate_law == "none"

    @property
    def replicates(self) -> int:
        """How often the solver is asked for the same levels; 0 where it answers the same every time."""
        return self.solver.replicates if isinstance(self.solver, CommandSolver) and self.solver.by_chance else 0

    @property
    def calibration_target(self) -> Target:
        """The target at the diameter the parameters are calibrated at."""
        return min(self.targets.forces, key=lambda target: abs(target.diameter - self.targets.calibrate_at))

    @property
    def unvalidated(self) -> bool:
        """Whether the tables that answer have none for the validation."""
        return isinstance(self.solver, TableSolver) and self.solver.validate is None

    @property
    def joint_targets(self) -> tuple[Target, ...]:
        """The targets that the parameters are fitted to together; empty if one force alone is."""
        wanted = self.invert.diameters
        if wanted is None:
            return (self.calibration_target,) if len(self.invert.responses) > 1 else ()
        forces = self.targets.forces
        return tuple(t for t in forces if wanted == "all" or any(abs(t.diameter - d) < 1e-6 for d in wanted))
