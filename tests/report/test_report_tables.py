"""The terminal's tables hold what the paper prints, in 80 columns."""

import io
from typing import Any

import pytest
from rich.cells import cell_len
from rich.console import Console

from stemcal.drawing.columns import from_means, measured_columns, scores
from stemcal.drawing.showing import Setting
from stemcal.drawing.table import Column, Table
from stemcal.formats import short, significant
from stemcal.report.outcome import tables_of
from stemcal.report.terminal import stage_tables, table_drawn
from stemcal.stages.invert.showing import InvertShowing
from stemcal.stages.results import fresh_results
from stemcal.stages.validate.showing import ValidateShowing
from stemcal.vocabulary import DIAMETER, FORCE, Variable, Vocabulary, Wording


def printed(stage: Any, width: int = 80) -> str:
    out = io.StringIO()
    console = Console(file=out, width=width)
    for part in stage_tables(stage):
        console.print(part)
    return out.getvalue()


def cells(text: str, begin: str) -> list[str]:
    return next(line.split() for line in text.splitlines() if line.lstrip().startswith(begin))


@pytest.mark.parametrize("name", ["screen", "rsm", "invert", "validate"])
def test_no_line_is_wider_than_80_columns(stages: dict[str, Any], name: str) -> None:
    assert max(map(cell_len, printed(stages[name]).splitlines())) <= 80


def test_long_and_chinese_names_fold(stages: dict[str, Any], edited: Any) -> None:
    def rename(content: dict[str, Any]) -> None:
        content["effects"][0]["factor"] = "a_very_long_name_of_a_factor_" * 3
        content["effects"][1]["factor"] = "屈服应力" * 12

    stage = edited(stages["screen"], rename)
    assert max(map(cell_len, printed(stage).splitlines())) <= 80


def test_a_table_too_wide_keeps_every_word() -> None:
    heads = ("Response", "Diameter, mm", "Measured ± SD (n)", "95 % of the mean", "Simulated", "p different", "p equal")
    rows = [
        ("bending slope", "8", "43.3 ± 2.6 (10) N/mm", "41.44 to 45.16 N/mm", "43.30 N/mm", "0.9996", "0.0003"),
        ("pull maximum force", "8", "621 ± 37 (10) N", "594.5 to 647.5 N", "621.1 N", "0.9954", "0.0002"),
    ]
    table = Table(tuple(Column(head, head, form=None if head == "Response" else str) for head in heads), tuple(rows))
    out = io.StringIO()
    for part in table_drawn(table):
        Console(file=out, width=80).print(part)
    assert max(map(cell_len, out.getvalue().splitlines())) <= 80
    for text in (*heads, *rows[0], *rows[1]):
        assert set(text.split()) <= set(out.getvalue().split())


def test_equation_has_the_sign_of_the_data(stages: dict[str, Any]) -> None:
    text = " ".join(printed(stages["rsm"]).split())
    assert (
        "F = 120.42 + 31.82·X4 + 11.20·X9 + 4.22·X7 − 4.75·X4·X9 − 3.25·X4·X7 − 1.75·X9·X7 "
        "+ 1.29·X4² − 0.83·X9² + 2.88·X7²" in text
    )
    assert "X4 = (yield_stress − 14.995) / 2.975" in text


def test_calibration_with_ranges(stages: dict[str, Any]) -> None:
    text = printed(stages["invert"])
    assert cells(text, "yield_stress") == ["yield_stress", "18.37", "≤", "15.35", "to", "≥", "19.96", "1.134"]
    assert "147.1 to 171.3" in " ".join(text.split())
    assert "yield_stress 17.63 to 18.96" in " ".join(text.split())


def test_scores_of_curves_stand_by_how_far_they_are_from_the_mean_curve() -> None:
    """Of 180 N measured and 178.5 N simulated, which are the mean force and what a mode adds to it."""
    mode = Variable("curve_1", "Score on the first curve mode", "c1", "N", apart=True)
    names = Wording(Vocabulary(DIAMETER, (FORCE, mode)))
    row = {"condition": 8.0, "response": "curve_1", "measured": 180.0, "simulated": 178.5, "error_percent": 0.83}
    columns = measured_columns(names, True, [("measured", "Measured", short), ("simulated", "Simulated", significant)])
    table = Table.of(columns, from_means([row], names), foot=scores(names))
    assert table.cells == (("score on the first curve mode", "8", "0", "−1.500", "N"),)
    assert table.foot[-1].startswith("A score is the signed deviation")


def test_failed_runs_show_their_reason(stages: dict[str, Any], edited: Any) -> None:
    failed = {"simulated": None, "error_percent": None, "response": None, "status": "failed", "reason": "nan"}
    stage = edited(stages["validate"], lambda content: content["rows"][0].update(failed))
    assert cells(printed(stage), "7 ") == ["7", "held", "out", "120", "failed", "(nan)", "–"]


def test_markup_in_names_is_text(stages: dict[str, Any], edited: Any) -> None:
    stage = edited(stages["screen"], lambda content: content["effects"][0].update(factor="[red]x[/red]"))
    assert "[red]x[/red]" in printed(stage)


def test_screening_without_lenth_and_f(stages: dict[str, Any], edited: Any) -> None:
    def take_out(content: dict[str, Any]) -> None:
        content["lenth"] = {"pse": None, "me": None, "sme": None}
        for effect in content["effects"]:
            effect |= {"f": None, "p": None, "lenth_t": None}

    stage = edited(stages["screen"], take_out)
    assert "–" in printed(stage)
    assert len(tables_of(stage)[0].foot) == 2


def test_units_below_the_terminal_are_written_as_on_paper(replayed: tuple[Any, Any], stages: dict[str, Any]) -> None:
    study = replayed[0]
    results = fresh_results(*replayed)
    (table,) = InvertShowing().closing(stages["invert"], Setting(study, results))
    assert [row[2] for row in table.cells] == ["MPa", "", "1/s"]
    (compared, *_) = ValidateShowing().tables(stages["validate"], Wording())
    assert not any("Cross-val" in head for head in compared.heads)


def test_tables_of_many_columns_have_narrow_gaps() -> None:
    few, many = (Table(tuple(Column(f"c{n}") for n in range(count)), (("a",) * count,)) for count in (3, 12))
    assert [table_drawn(table)[0].padding[1] for table in (few, many)] == [1, 0]  # type: ignore[attr-defined]
