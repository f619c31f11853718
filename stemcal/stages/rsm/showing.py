"""Sentences, tables and figures of a response surface: analysis of variance, coefficients, fit, shape."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from stemcal.doe.calibration.solution_ranges import Assessment
from stemcal.doe.regression.anova import Coefficient
from stemcal.doe.regression.canonical import CanonicalForm
from stemcal.drawing.columns import condition, levels, ratio, response_decimals, squares, starred, to_decimals
from stemcal.drawing.plot import Plot
from stemcal.drawing.showing import Setting, Showing
from stemcal.drawing.table import Column, Table
from stemcal.errors import UsageError
from stemcal.formats import counted, fixed, short, significant, with_unit
from stemcal.stages.fitting import fitted_surfaces, measured_means
from stemcal.stages.rsm import figures
from stemcal.stages.rsm.figures import Solution
from stemcal.stages.rsm.profiler import profiler_data
from stemcal.stages.rsm.result import RsmResult
from stemcal.study.reading.messages import checked_number
from stemcal.vocabulary import FIRST, FORCE, Variable, Wording

MANY = 3  # with more factors, columns are headed by symbols instead of names
ONE = "1"  # the term of the constant


class RsmShowing(Showing[RsmResult]):
    """Sentences, tables and figures of a response surface."""

    def outcome(self, result: RsmResult, names: Wording) -> list[str]:
        """Return a sentence on the surface and its number of runs; repeated deterministic runs count once."""
        responses = [run.response for run in result.design.runs if run.response is not None]
        count = len(result.runs_diagnostics)
        of = "" if result.regressed == result.naming else f" of the {result.regressed.response.long}"
        text = (
            f"A quadratic response surface{of} in {names.factors(result.axes)} was fitted to {count} runs with "
            f"responses from {names.quantity(min(responses))} to {names.quantity(max(responses))}."
        )
        copies = len(responses) - count
        if result.deterministic and copies > 0:
            added = "adds" if copies == 1 else "add"
            text += f" {counted(copies, 'replicate run')} of the deterministic solver {added} no information."
        return [text]

    def tables(self, result: RsmResult, names: Wording) -> list[Table]:
        shape = [canonical_table(result, result.canonical, names)] if result.canonical else []
        coefficients = _coefficient_table(result, replace(names, naming=result.regressed))
        first = [_anova_shown(result), coefficients, _fit_table(result), *shape]
        return [*first, *_further_tables(result, names), *_fits_table(result, names)]

    def figures(self, result: RsmResult, setting: Setting) -> list[Plot]:
        # the first calibrated levels are a solution of the surface; a refinement corrects them
        settled = (each.settles for each in setting.results.done)
        levels = next((point for point in settled if point is not None), None)
        study = setting.study
        shown = (FIRST, study.targets.calibrate_at)
        means = zip(measured_means(study), fitted_surfaces(study, result), strict=True) if levels else ()
        further = tuple((mean, fit) for mean, fit in means if (mean.response, mean.condition) != shown)
        solved = None if levels is None else Solution(levels, study.calibration_target.response, further)
        return figures.rsm_plots(result, solved, setting.labels)

    def profiler(self, result: RsmResult, setting: Setting) -> dict[str, Any]:
        values = setting.results.parameters if setting.results.calibrated else {}
        values, present = next((r.best for r in setting.results.done if r.best is not None), (values, None))
        return profiler_data(setting.study, result, values, setting.holds, present)

    def in_notebook(self, result: RsmResult, setting: Setting) -> RsmResult:
        surface = object.__new__(NotebookSurface)
        surface.__dict__.update(vars(result), _setting=setting)
        return surface


class NotebookSurface(RsmResult):
    """A surface for notebooks: it checks the levels of a prediction and is displayed as the profiler of the report."""

    _setting: Setting

    def predict(self, levels: Mapping[str, float]) -> Assessment:
        """Return the response at these levels (units of the spec); raise `UsageError` if one is missing or wrong."""
        known = levels if isinstance(levels, Mapping) else {}
        if missing := [name for name in self.names if name not in known]:
            raise UsageError(
                f"predict: no level is given for {', '.join(missing)}. Pass levels: {{{missing[0]!r}: …}}."
            )
        return super().predict({name: checked_number(known[name], name) for name in self.names})

    def _repr_html_(self) -> str:
        return self._setting.frame(RsmShowing().profiler(self, self._setting))


def written(term: str, symbols: Mapping[str, str]) -> str:
    """Return a term in the notation of an equation.

    >>> written("yield_stress:failure_strain", {"yield_stress": "X4", "failure_strain": "X9"})
    'X4·X9'
    """
    if term.endswith("^2"):
        name = term.removesuffix("^2")
        return f"{symbols.get(name, name)}²"
    return "·".join(symbols.get(name, name) for name in term.split(":"))


def equation(coefficients: Sequence[Coefficient], symbols: Mapping[str, str], response: Variable = FORCE) -> str:
    """Return the surface of a response as an equation in coded units.

    >>> from types import SimpleNamespace as C
    >>> equation([C(term="1", value=120.415), C(term="a^2", value=-0.829)], {"a": "X9"})
    'F = 120.42 − 0.83·X9²'
    """
    text, places = "", response_decimals(response, [row.value for row in coefficients if row.term != ONE])
    for row in coefficients:
        size = fixed(abs(row.value), places) + ("" if row.term == ONE else f"·{written(row.term, symbols)}")
        text += f" {'−' if row.value < 0.0 else '+'} {size}" if text else f"{'−' if row.value < 0.0 else ''}{size}"
    return f"{response.symbol} = {text}"


def _anova_shown(stage: RsmResult) -> Table:
    symbols = stage.symbols()
    columns = [
        Column("source", "Source", of=lambda row: written(row.source, symbols)),
        Column("sum_of_squares", "Sum of squares", form=squares),
        Column("df", "df", form=format),
        Column("mean_square", "Mean square", form=squares),
        Column("f", "F", form=ratio),
        Column("p", "p", form=starred, of=lambda row: (row.p, row.stars)),
    ]
    foot = ["** p < 0.01, * p < 0.05."]
    foot += [] if stage.lack_of_fit_testable else ["Lack of fit cannot be tested without an estimate of pure error."]
    strong = frozenset(i for i, row in enumerate(stage.anova) if row.stars)
    return Table.of(columns, stage.anova, "Analysis of variance", foot, strong=strong, detail=True)


def _coefficient_table(stage: RsmResult, names: Wording) -> Table:
    symbols, response = stage.symbols(), names.response
    form = to_decimals(response_decimals(response, [row.value for row in stage.coefficients[1:]], 3))
    columns = [
        Column("term", "Term", of=lambda row: written(row.term, symbols)),
        Column("value", "Coefficient", response.written, form),
        Column("standard_error", "Std. error", response.written, form),
        Column("low", "95 % low", response.written, form),
        Column("high", "95 % high", response.written, form),
    ]
    coded = (
        f"{entry.symbol or entry.factor} = ({names.in_text(entry.factor, entry.unit)} − {short(entry.center)}) / "
        f"{short(entry.half_step)}"
        for entry in stage.factors
        if entry.factor in stage.axes
    )
    foot = equation(stage.coefficients, symbols, response), "; ".join([*coded, *_coded_condition(stage, names)])
    return Table.of(columns, stage.coefficients, "Response surface in coded units", foot, detail=True)


def _coded_condition(stage: RsmResult, names: Wording) -> Iterator[str]:
    """Yield the coding of the condition, and the power laws of factors that grow with it."""
    if (axis := stage.over) is None:
        return
    symbol = stage.symbols()[axis.name]
    value = f"ln {axis.name}" if axis.logarithmic else axis.name
    yield f"{symbol} = ({value} − {short(axis.center)}) / {short(axis.half_step)}"
    for name, (exponent, at) in axis.growing.items():
        middle = short(stage.factor(exponent).center)
        yield f"{name} is multiplied by ({axis.name} / {names.conditions([at])})^({exponent} − {middle})"


def _fit_table(stage: RsmResult) -> Table:
    rows = (
        ("R²", fixed(stage.r2, 4)),
        ("Adjusted R²", fixed(stage.adjusted_r2, 4)),
        ("Predicted R²", fixed(stage.predicted_r2, 4)),
        ("Adequate precision", fixed(stage.adequate_precision, 2)),
        ("PRESS", significant(stage.press, 6)),
        ("Coefficient of variation, %", fixed(stage.cv_percent, 2)),
    )
    return Table((Column("statistic", "Statistic"), Column("value", "Value", form=str)), rows, "Goodness of fit")


def canonical_table(stage: RsmResult, shape: CanonicalForm, names: Wording) -> Table:
    """Return the table of the canonical axes: curvature, and direction in coded units."""
    heads = Wording(names.naming, stage.symbols()) if len(stage.names) > MANY else names
    axes = enumerate(zip(shape.eigenvalues, shape.axes, strict=True), 1)
    columns = [
        Column("axis", "Axis", form=format),
        Column("curvature", "Curvature", names.response.written, significant),
        *levels(stage.names, heads, to_decimals(3)),
    ]
    point = "The response surface has no unique stationary point because it is linear or constant in one direction."
    if shape.natural is not None and shape.predicted is not None:
        where = "inside" if shape.inside else "outside"
        point = (
            f"The stationary point is a {shape.called} {where} the experimental region, at a coded distance of "
            f"{shape.coded_radius:.2f} from the design centre."
        )
        if shape.inside:  # outside the region the surface extrapolates
            place = ", ".join(
                f"{names.in_text(f.factor, f.unit)} {with_unit(significant(shape.natural[f.factor]), f.unit)}"
                for f in stage.factors
            )
            point += f" The predicted {names.response.long} there is {names.quantity(shape.predicted)} ({place})."
    curved = (
        f"Along an axis of negative curvature, the {names.response.long} decreases in both directions from the "
        "stationary point. The last columns of the table give the direction of each axis in coded units."
    )
    rows = ({"axis": number, "curvature": value, **axis} for number, (value, axis) in axes)
    return Table.of(columns, rows, "Canonical analysis", (point, curved), detail=True)


def _further_tables(stage: RsmResult, names: Wording) -> list[Table]:
    tables, over = list[Table](), stage.over
    for part in stage.conditions:
        for name in part.responses or {}:
            fit = stage.refitted(part.runs, response=name) if over is None else stage.section(over.at, name).whole
            seen = replace(stage, anova=fit.anova, coefficients=fit.coefficients, pure_error=None,
                           lack_of_fit_testable=fit.lack_of_fit_testable)  # fmt: skip
            naming = stage.naming.with_primary(name)
            its = replace(names, naming=naming if over is None or name not in over.logarithms else naming.of_logarithm)
            title = f"{its.response.long}{its.at(part.condition) if over is None else ''}"
            both = _anova_shown(seen), _coefficient_table(seen, its)
            tables += [replace(table, title=f"{table.title}: {title}") for table in both]
    return tables


def _fits_table(stage: RsmResult, names: Wording) -> list[Table]:
    """Return a table of the statistics of all surfaces of a joint fit; empty for a fit to a single value."""
    rows = [
        {**vars(fit), "response": name, "condition": part.condition}
        for part in stage.conditions
        for name, fit in {FIRST: part.fit, **(part.responses or {})}.items()
    ]
    determinations = {"r2": "R²", "adjusted_r2": "Adjusted R²", "predicted_r2": "Predicted R²"}
    columns = [
        Column("response", "Response", of=lambda row: names.naming.named(row["response"]).noun),
        *(condition(names.naming) if stage.over is None else ()),
        *(Column(key, label, form=to_decimals(4)) for key, label in determinations.items()),
        Column("cv_percent", "Coefficient of variation", "%", fixed),
    ]
    return [Table.of(columns, rows, "Fit quality of all response surfaces", detail=True)] if rows else []
