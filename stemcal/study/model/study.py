"""The study as data: frozen models, every value in internal units (mm, tonne, s, N, MPa, degrees).

A key of a spec is a field, and its meaning is the docstring below it: the JSON schema, the reference page, the spec
that `stemcal init` writes, `check` and `explain` all read it there. Only the levels of a `Factor` keep the unit in the
spec, in which designs, tables and results show them; `Factor.internal` converts a level for the solvers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, create_model

from stemcal.errors import UsageError
from stemcal.formats import counted, did_you_mean
from stemcal.study.model import shear_test
from stemcal.study.model.goal import GoalSection
from stemcal.study.model.laboratory_kind import AnyTest, LaboratorySection, naming_with
from stemcal.study.model.layers import MOST_LAYERS, NO_RATE, LayerSection, Place, own_values, places
from stemcal.study.model.measured_targets import Target, Targets
from stemcal.study.types.factor import FRICTION, MOST_FACTORS, PARAMETERS, SETTINGS, Factor, OwnQuantity
from stemcal.study.types.field_types import Frozen, Length, StudyName, Title
from stemcal.study.types.named import naming_of
from stemcal.study.types.solver_kind import AnySolver, SolverKind, kind_of, usual_solver
from stemcal.study.types.stage_kind import STAGES
from stemcal.vocabulary import Vocabulary

F = TypeVar("F", bound=Frozen)


class OwnSections(Frozen):
    """The keys of a spec except the sections of stages."""

    model_config = ConfigDict(validate_by_name=True, validate_by_alias=True)

    name: StudyName
    """Name of the study and of its folder in `runs`."""
    title: Title = ""
    """Title of the report and of its tables; by default the name of the study."""
    factors: Annotated[tuple[Factor, ...], Field(min_length=1, max_length=MOST_FACTORS)]
    """Unknown parameters to calibrate; by default their symbols are X1, X2, … in this order."""
    responses: Annotated[tuple[OwnQuantity, ...], Field(max_length=20)] = ()
    """Measured and simulated responses other than the maximum force; a program can return several responses."""
    conditions: Annotated[tuple[OwnQuantity, ...], Field(max_length=1)] | None = None
    """Condition of the measurements other than the stem diameter; `[]` means no condition. A study with `responses`
    has no condition by default."""
    specimen: shear_test.SpecimenSection = shear_test.SpecimenSection()
    """The specimen: a piece of stem."""
    blade: shear_test.BladeSection = shear_test.BladeSection()
    """The rigid blade."""
    supports: shear_test.SupportsSection = shear_test.SupportsSection()
    """Supports of the stem: two rigid blocks, or a clamp."""
    loading: shear_test.LoadingSection = shear_test.LoadingSection()
    """Motion of the blade."""
    contact: shear_test.ContactSection = shear_test.ContactSection()
    """Friction and contact between stem, blade and supports."""
    material: shear_test.StemMaterialSection = shear_test.StemMaterialSection()
    """Fixed values of the material parameters that are not factors, and the internal length."""
    layers: Annotated[tuple[LayerSection, ...], Field(max_length=MOST_LAYERS)] = ()
    """Layers of the stem from the outside to the inside, such as skin and pith; by default the stem is one layer."""
    solver: AnySolver = Field(default_factory=usual_solver)
    """The solver that simulates the response at given levels of the factors."""
    tests: Annotated[tuple[AnyTest, ...], Field(max_length=20)] = ()
    """Laboratory tests other than cutting, on pieces of the same stems."""
    machine: shear_test.MachineSection = shear_test.MachineSection()
    """The testing machine with which the `curves` of `targets` were measured."""
    goal: GoalSection | None = None
    """Responses to minimise or maximise, instead of `targets`."""
    targets: Targets
    """Measured responses, one row per test and diameter. A study with a `goal` has none."""


def _form() -> type[OwnSections]:
    """Return the class of a spec: the sections of `OwnSections`, then the sections of the stages in their order.

    For a stage that runs only if the spec has its section, the default of the section is None.
    """
    fields: dict[str, Any] = {}
    for stage in STAGES.built_in:
        kind = stage.section()
        name = f"{stage.name}_" if hasattr(BaseModel, stage.name) else stage.name
        key = None if name == stage.name else stage.name
        default = None if stage.by_section else kind()
        section_field = Field(default=default, validation_alias=key, serialization_alias=key)
        fields[name] = (kind | None if stage.by_section else kind, section_field)
        FIELDS[kind] = name
    return create_model("StudyForm", __base__=OwnSections, __module__=__name__, __doc__="The keys of a spec.", **fields)


FIELDS: dict[type[Frozen], str] = {}
"""Name of the field of each stage's section, by class."""

if TYPE_CHECKING:
    StudyForm = OwnSections
else:
    StudyForm = _form()


class Study(StudyForm):
    """A study, with a field for each section of its spec; the fields below are left out if it is serialised."""

    source: Path = Field(default=Path("study.yaml"), exclude=True)
    warnings: tuple[str, ...] = Field(default=(), exclude=True)
    further: dict[str, Frozen] = Field(default={}, exclude=True)
    """Sections of stages from other packages, by stage name."""
    materials: tuple[dict[str, Any], ...] = Field(default=(), exclude=True)
    """Sections of other materials, one standard deviation from the calibrated material of `material.from`."""
    pending: str = Field(default="", exclude=True)
    """The study that must be run before this one; empty if there is none."""
    _manual_runs: Any = PrivateAttr(default=None)  # lists runs that people must perform, and records their results

    def ask(self, out: str | Path | None = None) -> list[dict[str, Any]]:
        """Continue as far as the results allow; return the runs without results (an empty list at the end).

        The study must have ``solver: {kind: sheet}``. Each run is a row of the sheet: values by column name, None for
        the results that `tell` records. The study folder `out` is by default ``runs/<study name>``.
        """
        runs: list[dict[str, Any]] = self._required_manual_runs().ask(self, out)
        return runs

    def tell(self, rows: Sequence[Mapping[str, Any]], out: str | Path | None = None, *, replace: str = "") -> int:
        """Record results; return the number of accepted rows.

        The rows are those of `ask` with the responses filled in, or ``failed`` with the reason; levels may be omitted.
        `replace` is the reason for replacing earlier results, without which such rows are refused. Raises `UsageError`
        with every refused row; all other rows are recorded.
        """
        return int(self._required_manual_runs().tell(self, rows, out, replace=replace))

    def _required_manual_runs(self) -> Any:
        if self._manual_runs is None:
            raise TypeError("`ask` and `tell` require a study from `stemcal.load_study`")
        return self._manual_runs

    def __repr__(self) -> str:
        measured = counted(len(self.targets.means), "target") if self.goal is None else "a goal"
        return f"Study {self.name}: {counted(len(self.factors), 'factor')}, {measured}, solver {self.solver.kind}"

    __str__ = __repr__

    @property
    def kind(self) -> SolverKind:
        """Kind of the solver, which declares the capabilities of the solver."""
        return kind_of(self.solver)

    @cached_property
    def naming(self) -> Vocabulary:
        """Names, symbols and units of the responses and of the condition."""
        declared = naming_of(self.responses, self.conditions)
        cut = declared.is_cutting or bool(self.targets.modes)
        naming = naming_with(self.targets, self.tests) if cut else declared
        return naming if self.goal is None or not cut else naming.measuring(self.goal.responses)

    @property
    def own_further(self) -> tuple[str, ...]:
        """Names of further responses that a program, laboratory tests or curves provide, or that the goal contains."""
        goal = () if self.goal is None else self.goal.responses[1:]
        return tuple(dict.fromkeys((*(named.name for named in self.naming.others), *goal)))

    def of(self, kind: type[F]) -> F:
        """Return the section of a stage by its class; all keys have their defaults if the spec has no such section."""
        return self.section(kind) or kind()

    def section(self, kind: type[F]) -> F | None:
        """Return the section of a stage by its class; None if the stage is omitted because the spec has no section."""
        if (name := FIELDS.get(kind)) is None:
            return next((section for section in self.further.values() if isinstance(section, kind)), None)
        section: F | None = getattr(self, name)
        return section

    def test_of(self, response: str) -> str:
        """Return the name of the laboratory test that measures a response (its name in the study), otherwise empty."""
        names = (test.name for test in self.tests if response in map(test.called, test.measured))
        return next(names, "")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the factors, in the order of the spec."""
        return tuple(factor.name for factor in self.factors)

    def factor(self, name: str) -> Factor:
        """Return the factor called `name`; raise `UsageError` if there is none."""
        for factor in self.factors:
            if factor.name == name:
                return factor
        raise UsageError(f"no factor is named {name!r}; {did_you_mean(str(name), self.names)}")

    @property
    def is_layered(self) -> bool:
        """Whether the stems have layers or fibres."""
        return bool(self.layers) or self.material.transverse is not None

    @property
    def places(self) -> dict[str, Place]:
        """The parameters of the stems with their places in the spec, by their names as factors."""
        return places(self.material, self.layers)

    @property
    def lengths(self) -> dict[tuple[str, str], Length]:
        """The lengths that make the force independent of the mesh, by their places in the spec."""
        spread, internal = self.blade.edge_spread, self.material.internal_length
        return {("blade", "edge_spread"): spread, ("material", "internal_length"): internal}

    def midlevels(self) -> dict[str, float]:
        """Return the mid-level of every factor, in the units of the spec."""
        return {factor.name: factor.centre for factor in self.factors}

    def in_material(self, number: int) -> Study:
        """Return the study with one of its other `materials`, numbered from 1."""
        return self.model_copy(update=self.materials[number - 1])

    def parameters(self, levels: Mapping[str, float], condition: float | None = None) -> dict[str, float]:
        """Return the nine material parameters in internal units; factors without a level are at mid-level.

        Parameters that depend on the diameter are evaluated at `condition`, by default the calibration diameter.
        """
        chosen, diameter = self._internal(levels), self.targets.calibrate_at if condition is None else condition
        varied = {name: value for name, value in chosen.items() if name in PARAMETERS}
        for name, growth in self.material.growing().items():
            varied[name] = growth.parameter_at(diameter, varied.get(name), chosen)
        innermost = own_values(self.layers[-1], diameter, chosen) if self.layers else {}
        return {**innermost, **self.material.fixed(), **varied, **(NO_RATE if self.solver.rate == "none" else {})}

    def at(self, levels: Mapping[str, float]) -> Study:
        """Return the study in which the levels of factors replace its settings of the test and its stem friction."""
        chosen = self._internal(levels) if self.kind.parameters else {}
        study = self.with_settings({name: value for name, value in chosen.items() if name in self.kind.parameters})
        if (friction := chosen.get(FRICTION)) is None:
            return study
        contact = {"static_friction": friction, "dynamic_friction": friction, "decay": 0.0}
        return study.model_copy(update={"contact": study.contact.model_copy(update=contact)})

    def with_settings(self, values: Mapping[str, float]) -> Study:
        """Return the study with new values (internal units) of settings of the test; all other names are ignored."""
        changes: dict[str, dict[str, float]] = {}
        for name in values.keys() & SETTINGS.keys():
            changes.setdefault(SETTINGS[name].section, {})[name] = values[name]
        sections = {name: getattr(self, name).model_copy(update=new) for name, new in changes.items()}
        return self.model_copy(update=sections) if sections else self

    def stem_at(self, levels: Mapping[str, float], condition: float) -> float:
        """Return the diameter of the stem, mm: the level of the factor `outer_diameter`; without it, `condition`."""
        is_factor = "outer_diameter" in self.names and bool(self.kind.parameters)
        return self._internal(levels)["outer_diameter"] if is_factor else condition

    def cut_as(self, test: LaboratorySection, diameter: float) -> Study:
        """Return the study whose cutting test is replaced by a further one, at a stem diameter in mm."""
        speed = test.speed if "speed" in test.model_fields_set else self.loading.speed
        travel = shear_test.GAP + (test.stroke_at(diameter) or self.loading.stroke_at(diameter))
        moved = self.loading.model_copy(update={"speed": speed, "duration": travel / speed, "stroke": None})
        return self.model_copy(update={**test.in_place_of(self), "loading": moved})

    @property
    def there(self) -> Study:
        """The study with the solver of `refine.in`, with which `refine` simulates; this study if there is none."""
        seen = (stage.seen(self) for stage in STAGES.built_in)
        return next((study for study in seen if study is not self), self)

    @property
    def by_hand(self) -> Study:
        """The study whose runs people perform: this one, or `there` if only the runs of `refine.in` are manual."""
        there = self.there
        people = [study.kind.answers == "asks_people" for study in (self, there)]
        return there if people == [False, True] else self

    def _internal(self, levels: Mapping[str, float]) -> dict[str, float]:
        chosen = {**self.midlevels(), **levels}
        return {factor.name: factor.internal(chosen[factor.name]) for factor in self.factors}

    @property
    def calibration_target(self) -> Target:
        """The target at the condition of the calibration."""
        at = self.targets.calibrate_at
        return min(self.targets.means or self.joint_targets, key=lambda target: abs(target.condition - at))

    @property
    def joint_targets(self) -> tuple[Target, ...]:
        """Targets of a fit to several means, or to one mean and prior distributions; empty for a fit to one force."""
        return self._fitted[0]

    @property
    def fitted_responses(self) -> tuple[str, ...]:
        """Names of the responses to which the parameters are fitted, for `Target.mean_of`; `FIRST` for the first."""
        return self._fitted[1]

    @property
    def _fitted(self) -> tuple[tuple[Target, ...], tuple[str, ...]]:
        if self.goal is not None:
            return (self.goal.unmeasured(self.targets.calibrate_at),), self.goal.responses
        fits: tuple[tuple[Target, ...], tuple[str, ...]]
        fits = next(fitted for stage in STAGES.built_in if (fitted := stage.fits(self)) is not None)
        return fits
