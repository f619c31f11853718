"""Sentences, tables and figures of a screening: effects with all tests, and a Pareto chart."""

from collections.abc import Mapping
from functools import partial

from stemcal.doe.regression.least_squares import stars
from stemcal.drawing.columns import factor, ratio, response_decimals, squares, starred, to_decimals
from stemcal.drawing.plot import Plot
from stemcal.drawing.showing import Setting, Showing
from stemcal.drawing.style import BLUE, INK, ORANGE, Figure, literal, new_figure
from stemcal.drawing.table import Column, Table
from stemcal.formats import fixed, minus, percent, series
from stemcal.stages.screen.result import ScreenResult
from stemcal.storage.typed import to_json
from stemcal.vocabulary import Wording


class ScreenShowing(Showing[ScreenResult]):
    """Sentences, tables and figures of a screening."""

    def outcome(self, result: ScreenResult, names: Wording) -> list[str]:
        effects, response = {effect.factor: effect for effect in result.effects}, names.response.long
        count = f"In the screening, {len(effects)} factors were varied in {len(result.design.runs)} runs."
        chosen = sorted(result.significant, key=lambda name: -abs(effects[name].effect))
        if chosen:
            shares = (f"{fixed(effects[name].contribution_percent, 1)} % of the variation" for name in chosen)
            listed = series(f"{names.in_text(name)} ({share})" for name, share in zip(chosen, shares, strict=True))
            verb = "factor is" if len(chosen) == 1 else "factors are"
            return [count, f"For the {response}, the significant {verb} {listed}."]
        if result.lenth.me is not None or not any(effect.effect and effect.p is None for effect in result.effects):
            return [count, f"No factor has a significant effect on the {response}."]
        return [count, f"The effects on the {response} cannot be tested without an estimate of the error."]

    def tables(self, result: ScreenResult, names: Wording) -> list[Table]:
        return [_effects_table(each, Wording(each.naming, names.labels)) for each in result.all_responses]

    def findings(self, result: ScreenResult, names: Wording) -> list[Table]:
        return [_effects_table(result, names)]

    def figures(self, result: ScreenResult, setting: Setting) -> list[Plot]:
        response = result.naming.response.noun
        text = (
            f"Pareto chart of the effects. Blue bars show effects that increase the {response}; orange bars show "
            f"effects that decrease the {response}. Effects whose bars extend beyond the dashed line are significant."
        )
        return [Plot("pareto", "screen", text, partial(pareto, result, setting.labels))]


def _effects_table(stage: ScreenResult, names: Wording) -> Table:
    effects, response, residual, lenth = stage.effects, names.response, stage.residual, stage.lenth
    rows = [{**to_json(e), "p": (e.p, stars(e.p))} for e in effects]
    empty = dict.fromkeys(("symbol", "effect", "f", "lenth_t"), "")
    share = 100.0 * residual.sum_of_squares / (stage.total_sum_of_squares or 1.0)
    rows.append({**empty, "factor": "Residual", "contribution_percent": share, **to_json(residual)})
    places = response_decimals(response, [e.effect for e in effects])
    columns = [
        Column("symbol", ""),
        factor(names),
        Column("effect", "Effect", response.written, to_decimals(places)),
        Column("contribution_percent", "Share", "%", percent),
        Column("sum_of_squares", "Sum of squares", form=squares),
        Column("f", "F", form=ratio),
        Column("p", "p", form=starred),
        Column("lenth_t", "Lenth t", form=fixed),
    ]
    method = "Lenth's method" if stage.by_lenth else "the F test"
    rule = f"The effects of the factors in bold are significant by {method}."
    margins = []
    if lenth.pse is not None and lenth.me is not None and lenth.sme is not None:
        pse, me, sme = (names.quantity(value) for value in (lenth.pse, lenth.me, lenth.sme))
        margins.append(
            f"Lenth's method yields a pseudo standard error of {pse}, a margin of error of {me} and a simultaneous "
            f"margin of error of {sme}."
        )
    shares = "** p < 0.01, * p < 0.05. The share of a factor is its percentage of the total sum of squares."
    strong = frozenset(i for i, e in enumerate(effects) if e.factor in stage.significant)
    return Table.of(columns, rows, f"Effects on the {response.long}", (rule, *margins, shares), strong=strong)


def pareto(screen: ScreenResult, labels: Mapping[str, str] | None = None) -> Figure:
    """Draw the effects by size, and the limit of significance; `labels` replace factor names."""
    effects = sorted(screen.effects, key=lambda e: abs(e.effect))
    with new_figure(height=max(2.2, 0.9 + 0.24 * len(effects))) as figure:
        axes = figure.add_subplot()
        places = response_decimals(screen.naming.response, [e.effect for e in effects], 1)
        called = {e.factor: literal((labels or {}).get(e.factor, e.factor)) for e in effects}
        names = [f"{called[e.factor]}  {minus(f'{e.effect:+.{places}f}')}" for e in effects]
        colours = [ORANGE if e.effect < 0 else BLUE for e in effects]
        axes.barh(names, [abs(e.effect) for e in effects], color=colours, height=0.7)
        if (limit := screen.limit) is not None:
            method = "Lenth ME" if screen.by_lenth else f"t test, p = {screen.alpha:g}"
            axes.axvline(limit, color=INK, linestyle="--", linewidth=1, label=method)
            figure.legend(loc="outside upper right")
        axes.set_xlabel(literal(screen.naming.response.headed(f"|effect| on the {screen.naming.response.long}")))
    return figure
