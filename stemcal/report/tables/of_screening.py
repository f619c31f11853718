"""Tables of a screening: the effects, with what each of them means."""

from __future__ import annotations

from stemcal.files.rows import Column, Table
from stemcal.files.typed import to_json
from stemcal.report.tables.columns import factor, ratio, response_decimals, squares, starred, to_decimals
from stemcal.stages.screen import ScreenResult
from stemcal.text.names import Names
from stemcal.text.numbers import fixed, percent, probability
from stemcal.text.screening import standing
from stemcal.text.tables import line


def effects_table(stage: ScreenResult, names: Names, judged: bool = False) -> Table:
    """Return the effects as papers print them, with Lenth's t and the p-value adjusted by Holm.

    Those of a `judged` table have a column that says in words what each of them means.
    """
    effects, response, residual = stage.effects, names.response, stage.residual
    rows = [{**to_json(e), "p": (e.p, e.stars), "standing": standing(e)} for e in effects]
    empty = dict.fromkeys(("symbol", "standing", "effect", "f", "p_holm", "lenth_t"), "")
    share = 100.0 * residual.sum_of_squares / (stage.total_sum_of_squares or 1.0)
    rows.append({**empty, "factor": "Residual", "contribution_percent": share, **to_json(residual)})
    columns = [
        Column("symbol", ""),
        factor(names),
        *([Column("standing", "Verdict")] if judged and any(row["standing"] for row in rows) else []),
        Column(
            "effect", "Effect", response.written, to_decimals(response_decimals(response, [e.effect for e in effects]))
        ),
        Column("contribution_percent", "Share", "%", percent),
        Column("sum_of_squares", "Sum of squares", form=squares),
        Column("f", "F", form=ratio),
        Column("p", "p", form=starred),
        Column("p_holm", "p Holm", form=probability),
        Column("lenth_t", "Lenth t", form=fixed),
    ]
    strong = frozenset(i for i, e in enumerate(effects) if e.factor in stage.significant)
    lenth = stage.lenth
    active = [line("lenth", names, **vars(lenth))] if lenth is not None and lenth.pse is not None else []
    return Table.of(columns, rows, line("effects", names), (*active, line("stars")), strong=strong)
