"""How a screening is shown: the effects with every test of them, the design, two figures."""

from dataclasses import replace

from stemcal.doe.regression.least_squares import stars
from stemcal.files.rows import Column, Table
from stemcal.files.typed import to_json
from stemcal.naming import Names
from stemcal.numbers import fixed, percent
from stemcal.report.figures.plot import Plot
from stemcal.report.showing import Setting, Showing
from stemcal.report.tables.columns import factor, ratio, response_decimals, squares, starred, to_decimals
from stemcal.report.tables.of_designs import design_table
from stemcal.report.tables.printed import STARS, PaperTable, printed, run_heads
from stemcal.stages.screen import figures, words
from stemcal.stages.screen.result import ScreenResult


class ScreenShowing(Showing[ScreenResult]):
    """The words, tables and figures of a screening."""

    def outcome(self, result: ScreenResult, names: Names) -> list[str]:
        return words.outcome(result, names)

    def certainty(self, result: ScreenResult, names: Names) -> list[str]:
        return words.certainty(result, names)

    def tables(self, result: ScreenResult, names: Names, judged: bool = False) -> list[Table]:
        return [effects_table(one, names.of(one.naming), judged) for one in result.all_responses]

    def early(self, result: ScreenResult, names: Names) -> list[Table]:
        return [effects_table(result, names)]

    def figures(self, result: ScreenResult, setting: Setting) -> list[Plot]:
        return figures.plots(result, setting.labels)

    def printed(self, result: ScreenResult, setting: Setting) -> list[PaperTable]:
        design, runs = design_table(result.design, setting.symbols), run_heads(setting.study, "run")
        effects = effects_table(result, setting.labelled)
        effects = replace(effects, rows=effects.rows[:-1])  # who publishes effects leaves the residual out
        heads = {"symbol": "Parameters", "effect": "Effect", "contribution_percent": "Contribution"}
        heads |= {"sum_of_squares": "", "f": "F-Value", "p": "p-Value"}
        caption = "Significance analysis of the screening test parameters."
        return [
            printed("screening-runs", "Design scheme and results of the screening test.", design, runs),
            printed("screening", caption, effects, heads, STARS),
        ]


def effects_table(stage: ScreenResult, names: Names, judged: bool = False) -> Table:
    """Return the effects as papers print them, with F test and Lenth's t; a `judged` table has a verdict in words."""
    effects, response, residual, lenth = stage.effects, names.response, stage.residual, stage.lenth
    rows = [{**to_json(e), "p": (e.p, stars(e.p)), "standing": words.standing(e, stage)} for e in effects]
    empty = dict.fromkeys(("symbol", "standing", "effect", "f", "lenth_t"), "")
    share = 100.0 * residual.sum_of_squares / (stage.total_sum_of_squares or 1.0)
    rows.append({**empty, "factor": "Residual", "contribution_percent": share, **to_json(residual)})
    places = response_decimals(response, [e.effect for e in effects])
    columns = [
        Column("symbol", ""),
        factor(names),
        *([Column("standing", "Verdict")] if judged else []),
        Column("effect", "Effect", response.written, to_decimals(places)),
        Column("contribution_percent", "Share", "%", percent),
        Column("sum_of_squares", "Sum of squares", form=squares),
        Column("f", "F", form=ratio),
        Column("p", "p", form=starred),
        Column("lenth_t", "Lenth t", form=fixed),
    ]
    rule = (
        "Lenth's method selects the factors: the residual has fewer than 3 degrees of freedom or is zero."
        if stage.by_lenth
        else "The F test selects the factors: its residual has at least 3 degrees of freedom."
    )
    margins = []
    if lenth.pse is not None and lenth.me is not None and lenth.sme is not None:
        pse, me, sme = (names.quantity(value) for value in (lenth.pse, lenth.me, lenth.sme))
        margins.append(
            f"Lenth: pseudo standard error {pse}; an effect beyond ±{me} is significant, beyond ±{sme} also after "
            "correction for the number of effects."
        )
    shares = "** p < 0.01, * p < 0.05. Share: of the total sum of squares."
    strong = frozenset(i for i, e in enumerate(effects) if e.factor in stage.significant)
    return Table.of(columns, rows, f"Effects on the {response.long}", (rule, *margins, shares), strong=strong)
