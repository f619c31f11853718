"""The `rsm` section: design and terms of the response surface, its rules, and the choice of its factors."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, WithJsonSchema
from pydantic_core import PydanticKnownError

from stemcal.doe.designs import SURFACES, SurfaceOptions, surface_design
from stemcal.formats import series
from stemcal.notes import Note
from stemcal.stages.screen.options import ScreenOptions
from stemcal.study.types import units
from stemcal.study.types.factor import MOST_FACTORS, Factor, in_unit
from stemcal.study.types.field_types import Frozen, Number, Whole, complain
from stemcal.study.types.strict_yaml import Finding

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.stages.screen.result import ScreenResult
    from stemcal.study.model.study import Study
    from stemcal.study.rules import Draft


_NONE = "none"
WITHOUT_SURFACE: Mapping[str, object] = {"rsm": {"design": _NONE}}
"""Change of a spec that removes the response surface."""


class _OfSurfaces:
    """JSON schema of the name of a design, taken from the registered designs when the schema is written."""

    def __get_pydantic_json_schema__(self, _schema: Any, _handler: Any) -> dict[str, Any]:
        return {"enum": [*(design.name for design in SURFACES.all), _NONE], "type": "string"}


def _surface_design(value: Any) -> str:
    """Return the name of a design for the surface; raise a validation error if no package has this design."""
    if isinstance(value, str) and (value == _NONE or SURFACES.named(value) is not None):
        return value
    others = (repr(design.name) for design in SURFACES.all)
    raise PydanticKnownError("literal_error", {"expected": f"{', '.join(others)} or {_NONE!r}"})


_STRONGEST = r"strongest ([1-9][0-9]?)"
_NAMES = {"type": "array", "items": {"type": "string"}}


def _chosen_or_names(value: Any) -> Any:
    if isinstance(value, list | tuple) or value == "significant":
        return value
    if isinstance(value, str) and re.fullmatch(_STRONGEST, " ".join(value.split())):
        return " ".join(value.split())
    message = "the value must be `significant`, `strongest 3` or a list of factor names"
    raise complain(message, "write `factors: significant`")


def _factor_limits(design: str) -> tuple[int, int]:
    known = SURFACES.named(design)
    return (2, MOST_FACTORS) if known is None else known.factors


_AlphaRule = Literal["rotatable", "face"]


def _axial_distance(value: Any) -> Any:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if value in get_args(_AlphaRule) or (number and 0 < value <= 100):
        return value
    shown = f"{value:g}" if number else repr(value)[:60]
    raise complain(f"{shown} is not a valid axial distance", "write `rotatable`, `face` or a number above 0")


class RsmOptions(Frozen):
    """The experimental design and the terms of the response surface.

    Write `central-composite` for a CCD and `box-behnken` for a BBD.
    """

    design: Annotated[str, BeforeValidator(_surface_design), _OfSurfaces()] = "central-composite"
    """The design. A Box–Behnken design requires 3 to 7 factors. With five or more factors, a central composite design
    uses only a fraction of the corners, which is sufficient to estimate the same terms (resolution V). With `none`, as
    with `stemcal run --quick`, the study has neither screening nor response surface: the refinement determines the
    factors in their order, from the middle of their ranges and without confidence intervals."""

    factors: Annotated[
        str | tuple[str, ...],
        BeforeValidator(_chosen_or_names),
        WithJsonSchema({"anyOf": [{"const": "significant"}, {"type": "string", "pattern": f"^{_STRONGEST}$"}, _NAMES]}),
    ] = "significant"
    """The factors of the response surface: `significant` (in the screening), `strongest 3`, or a list of names."""
    over: Literal["factors", "conditions"] = "factors"
    """With `conditions`, a joint fit has one design and one response surface over the factors and the diameter or other
    condition. With two factors, this design has 15 runs instead of 9 runs at each fitted diameter. By default, each
    fitted diameter has a response surface."""
    centre_points: Annotated[Whole, Field(ge=0, le=100)] = 6
    """Number of runs at the centre. Repeated runs of a deterministic solver add no information."""
    alpha: Annotated[
        _AlphaRule | float,
        BeforeValidator(_axial_distance),
        WithJsonSchema({"anyOf": [{"enum": list(get_args(_AlphaRule))}, {"type": "number", "minimum": 0}]}),
    ] = "rotatable"
    """Distance of the axial points from the centre: a rule or a number in coded units."""
    runs: Annotated[Whole, Field(ge=6, le=10_000)] | None = None
    """Number of runs of a Latin hypercube design."""
    extra_runs: Annotated[Whole, Field(ge=0, le=200)] = 0
    """Number of additional runs at points where the uncertainty of the response surface is largest. Earlier runs are
    reused."""
    reduce: Literal["none", "backward"] = "none"
    """With `backward`, terms with a p-value above 0.1 are removed one by one; the model hierarchy is preserved."""
    coding: dict[str, tuple[Number, Number]] = {}
    """Factor values at coded −1 and +1, as in `yield_stress: [12, 18]`. For all other factors, the range
    of the factor is used."""

    def coded(self, name: str) -> tuple[float, float]:
        """Return the centre and half step of a factor that is listed in `coding`."""
        low, high = self.coding[name]
        return float(f"{0.5 * (low + high):.12g}"), float(f"{0.5 * (high - low):.12g}")

    @property
    def wanted(self) -> bool:
        """Whether the study has a response surface."""
        return self.design != _NONE

    @property
    def strongest(self) -> int:
        """Number of strongest factors that `factors` requests; 0 for other values of `factors`.

        >>> RsmOptions(factors="strongest 3").strongest, RsmOptions().strongest
        (3, 0)
        """
        strongest = re.fullmatch(_STRONGEST, self.factors) if isinstance(self.factors, str) else None
        return int(strongest[1]) if strongest else 0

    def chosen(self) -> SurfaceOptions:
        """Return the settings of the design."""
        return SurfaceOptions(self.design, self.centre_points, self.alpha, self.runs, self.extra_runs)

    def reach(self, k: int) -> float:
        """Return the distance of the outermost runs of `k` factors from the centre along an axis, in coded units."""
        return surface_design(self.design).reach(k, self.chosen())

    def radius(self, k: int) -> float:
        """Return the largest distance from the centre, in coded units, at which a surface of `k` factors is valid."""
        return surface_design(self.design).radius(k, self.chosen())


def growing_with(study: Study, names: Sequence[str]) -> dict[str, tuple[str, float]]:
    """Return n and d₀ for each factor θ that grows with the diameter d as θ·(d/d₀)ⁿ, if the exponent n is a factor too.

    θ and n act only through this value, so one coordinate of a surface represents both. Shared exponents are excluded.
    """
    growing = study.material.growing()
    exponents = [growth.exponent for growth in growing.values()]
    return {
        name: (str(growth.exponent), growth.at)
        for name, growth in growing.items()
        if name in names and growth.exponent in names and exponents.count(growth.exponent) == 1
    }


def dimensions(study: Study, names: Sequence[str]) -> int:
    """Return the number of coordinates of the surface; one over conditions has the condition and no exponents."""
    return len(names) + (1 - len(growing_with(study, names)) if study.of(RsmOptions).over == "conditions" else 0)


_MOST_CCD_FACTORS = 8
_LATIN_HYPERCUBE = "latin-hypercube"


def _surface_factors_exist(draft: Draft) -> Iterator[Finding]:
    if isinstance(chosen := draft.study.of(RsmOptions).factors, str):
        return
    for index, name in enumerate(chosen):
        path = ("rsm", "factors", index)
        if name not in draft.names:
            yield draft.unknown_factor(path, name, at_key=False)
        elif name in chosen[:index]:
            yield Finding(path, f"{name} is listed twice", "remove one")
    if not chosen:
        yield Finding(("rsm", "factors"), "a response surface requires at least one factor", "list a factor")
    if len(chosen) > _MOST_CCD_FACTORS:
        message = f"{len(chosen)} factors require too many corner runs"
        yield Finding(("rsm", "factors"), message, f"list at most {_MOST_CCD_FACTORS} factors")


def _selection_needs_screening(draft: Draft) -> Iterator[Finding]:
    chosen = draft.study.of(RsmOptions).factors
    if draft.study.of(RsmOptions).wanted and not draft.study.of(ScreenOptions).wanted and isinstance(chosen, str):
        names = ", ".join(draft.names[:3])
        message = f"`factors: {chosen}` requires a screening, which this study does not have"
        remedy = f"list the factors, as in `factors: [{names}]`, or remove `screen.design: none`"
        yield Finding(("rsm",), message, remedy)


def _design_allows_factors(draft: Draft) -> Iterator[Finding]:
    rsm, known = draft.study.of(RsmOptions), len(draft.names)
    if not rsm.wanted:
        return
    listed, (fewest, most) = not isinstance(rsm.factors, str), _factor_limits(rsm.design)
    k = dimensions(draft.study, rsm.factors) if listed else (rsm.strongest or known) + (rsm.over == "conditions")
    if rsm.strongest:
        most = min(most, _MOST_CCD_FACTORS, known)
    if (k < fewest and (fewest > 2 or rsm.strongest)) or (k > most and (listed or rsm.strongest)):
        path, remedy = ("rsm", "design"), "write `central-composite`"
        if rsm.strongest:
            path, remedy = ("rsm", "factors"), f"write `strongest {fewest}`"
        yield Finding(path, f"the `{rsm.design}` design requires {fewest} to {most} factors, not {k}", remedy)
    least = (k + 1) * (k + 2) // 2
    if listed and rsm.design == _LATIN_HYPERCUBE and rsm.runs is not None and rsm.runs < least:
        message = f"{rsm.runs} runs cannot determine the {least} coefficients of a response surface in {k} factors"
        yield Finding(("rsm", "runs"), message, f"write {2 * least}")


def _runs_are_used(draft: Draft) -> Iterator[Finding]:
    rsm = draft.study.of(RsmOptions)
    if rsm.wanted and rsm.runs is not None and rsm.design != _LATIN_HYPERCUBE:
        message = f"the number of runs of the `{rsm.design}` design is determined by the number of factors"
        yield Finding(("rsm", "runs"), message, f"omit `runs` or write `design: {_LATIN_HYPERCUBE}`")


def _coding_fits(draft: Draft) -> Iterator[Finding]:
    coding = draft.study.of(RsmOptions).coding
    yield from (draft.unknown_factor(("rsm", "coding", name), name) for name in coding if name not in draft.names)
    for factor in draft.factors.values():
        if factor.name not in coding:
            continue
        path, (low, high) = ("rsm", "coding", factor.name), coding[factor.name]
        centre, ends = 0.5 * (low + high), f"{factor.low:g} to {factor.high:g}"
        if low >= high:
            message = f"the value at coded −1 ({low:g}) is not below the value at coded +1 ({high:g})"
            smaller_and_larger = f"write a smaller and a larger value than {low:g}"
            yield Finding(path, message, "swap the two values" if low > high else smaller_and_larger)
        elif factor.low < factor.high and not factor.low <= centre <= factor.high:
            message = f"the centre {centre:g} is outside the range of the factor ({ends})"
            yield Finding(path, message, f"choose a centre near {factor.centre:g}")
        else:
            yield from _unphysical_runs(draft, factor)


def _unphysical_runs(draft: Draft, factor: Factor) -> Iterator[Finding]:
    """Yield a finding if corner runs or (for a known number of factors) axial runs exceed bounds of a parameter."""
    rsm, parameter = draft.study.of(RsmOptions), draft.kind.parameters.get(factor.name)
    if parameter is None or not units.fits(factor.unit, parameter.dimension):
        return
    k = 0 if isinstance(rsm.factors, str) or factor.name not in rsm.factors else dimensions(draft.study, rsm.factors)
    has_axes = rsm.design == "central-composite" and 1 <= k <= _MOST_CCD_FACTORS
    reach, (centre, half_step) = rsm.reach(k) if has_axes else 1.0, rsm.coded(factor.name)
    for end, sign in enumerate("−+"):
        shown = units.from_internal(factor.internal(centre + (2 * end - 1) * reach * half_step), parameter.unit)
        if wrong := parameter.outside(shown):
            message = f"the value at coded {sign}{reach:.3g} ({in_unit(shown, parameter.unit)}) {wrong}"
            other = rsm.coding[factor.name][1 - end]
            yield Finding(("rsm", "coding", factor.name, end), message, f"write a value closer to {other:g}")


RsmOptions.rules = (_surface_factors_exist, _selection_needs_screening, _design_allows_factors)
RsmOptions.rules += (_runs_are_used, _coding_fits)


def _doubts(study: Study) -> Iterator[Finding]:
    at, chosen = study.targets.calibrate_at, study.of(RsmOptions).factors
    if not study.of(RsmOptions).wanted:
        return
    exponents = {
        getattr(growth, "exponent", None): name
        for name, growth in study.material.growing().items()
        if math.isclose(getattr(growth, "at", 0.0), at)
    }
    fixed = []
    for factor in study.factors:
        screened, unseen = study.of(ScreenOptions).wanted, factor.name in exponents
        if isinstance(chosen, str) and screened and unseen:
            message = f"{factor.name} has no effect at {at:g} mm, the diameter of the screening runs"
            remedy = "list the factors of the response surface in `rsm.factors`, or write another diameter for `at`"
            yield Finding(("material", exponents[factor.name], "at"), message, remedy)
        elif not isinstance(chosen, str) and factor.name not in chosen and (unseen or not screened):
            fixed.append(factor.name)
    if fixed:
        message = f"not screened, not listed in `rsm.factors` and therefore not varied in any run: {', '.join(fixed)}"
        yield Finding(("rsm", "factors"), message, "list each factor, or replace its range with a fixed value")


RsmOptions.doubts = _doubts


def surface_factors(study: Study, solver: Solver, screened: ScreenResult) -> tuple[list[str], list[Note]]:
    """Return the factors of the surface (the significant ones, or the number that spec or design require) and notes."""
    rsm, table = study.of(RsmOptions), solver.given_design("rsm")
    if not isinstance(rsm.factors, str):
        return list(rsm.factors), []
    shares, (least, most) = screened.shares, _factor_limits(rsm.design)
    ranked = sorted(shares, key=lambda name: -shares[name])
    chosen = significant = [name for name in ranked if name in screened.active_factors]
    notes = []
    if rsm.strongest or not least <= len(significant) <= most:
        chosen = ranked[: rsm.strongest or min(max(len(significant), least), most)]
        text = f"The response surface uses the factors with the largest contributions: {series(chosen)}."
        if weak := [name for name in chosen if name not in significant]:
            text += f" {series(weak)} {'is' if len(weak) == 1 else 'are'} not significant."
        if left := [name for name in significant if name not in chosen]:
            omitted = f"{'factor' if len(left) == 1 else 'factors'} {series(left)}"
            text += f" The response surface omits the significant {omitted}."
        notes = [Note("strongest_factors", "caution", text)]
    if table is None:
        return chosen, notes
    columns = [name for name in table[0] if name in study.names]
    if set(columns) != set(chosen):
        text = f"In the solver table, the factors are {series(columns)}, but the screening selected {series(chosen)}."
        notes = [Note("table_varies", "warning", text)]
    return columns, notes
