"""What the page has beyond the terminal: verdicts, the surface's own axes, diagnostics."""

from dataclasses import replace
from typing import Any

import pytest

from stemcal.report.outcome import tables_of
from stemcal.report.study_tables import design_tables, setting_tables
from stemcal.stages.rsm.figures import diagnostics
from stemcal.stages.rsm.showing import canonical_table
from stemcal.stages.screen.showing import pareto
from stemcal.storage.rows import Rows
from stemcal.vocabulary import Wording


def test_significant_effects_are_bold(stages: dict[str, Any]) -> None:
    (table,) = tables_of(stages["screen"])
    assert [table.rows[i][0] for i in sorted(table.strong)] == ["X4", "X9"]
    assert [column.left for column in table.columns][:3] == [True, True, False]
    assert all(len(row) == len(table.columns) for row in table.rows)


def test_canonical_axes_of_the_published_surface(stages: dict[str, Any]) -> None:
    """Eigenvalues of B = [[1.294, …], …]: their sum is its trace, 1.29 − 0.83 + 2.88 (Table 9's squares)."""
    surface = stages["rsm"]
    table = canonical_table(surface, surface.canonical, Wording())
    assert [row[1] for row in table.cells] == ["3.981", "2.204", "−2.839"]
    squares = {row.term: row.value for row in surface.coefficients if row.term.endswith("^2")}
    assert sum(surface.canonical.eigenvalues) == pytest.approx(sum(squares.values()))
    assert "a saddle" in table.foot[0] and "outside" in table.foot[0] and "6.04" in table.foot[0]
    assert "154.4" not in table.foot[0]  # an extrapolation far outside the runs
    inside = replace(surface.canonical, inside=True)
    found = canonical_table(surface, inside, Wording(labels={"yield_stress": "Yield stress (MPa)"})).foot[0]
    assert "154.4 N" in found and "yield stress 14.71 MPa" in found


def test_crowded_designs_bear_symbols(stages: dict[str, Any]) -> None:
    symbols = {effect.factor: effect.symbol for effect in stages["screen"].effects}
    (table,) = design_tables(stages["screen"], symbols)
    assert table.heads == ("Run", *(f"X{n}" for n in range(1, 10)), "Force, N")
    assert design_tables(stages["rsm"], symbols)[0].heads[1] == "yield_stress"


def test_runs_over_diameters_have_their_diameter(stages: dict[str, Any]) -> None:
    """Otherwise, rows with equal levels would have different forces."""
    surface = stages["rsm"]
    runs = [replace(run, condition=7.0 + (run.run % 2)) for run in surface.design.runs]
    over = replace(surface, design=replace(surface.design, runs=Rows(runs)))
    (table,) = design_tables(over, {})
    assert table.heads[-2:] == ("Diameter, mm", "Force, N")
    assert [row[-2] for row in table.cells[:2]] == ["8", "7"]
    assert "Diameter, mm" not in design_tables(surface, {})[0].heads


def test_residuals_over_their_errors(stages: dict[str, Any]) -> None:
    """Run 1 of the published design: r = 1.585 N, h = 0.1663, s² = 23.88 N² of 10 degrees of freedom."""
    values = [row.studentised for row in stages["rsm"].runs_diagnostics]
    own = 1.5849 / (23.8848 * (1 - 0.16634)) ** 0.5
    assert values[0] == pytest.approx(own * (9.0 / (10.0 - own**2)) ** 0.5, abs=1e-3)
    normal, over, influence = diagnostics(stages["rsm"]).axes
    assert sorted(values) == pytest.approx(list(normal.lines[1].get_ydata()))
    assert over.lines[1].get_ydata()[0] == values[0]
    assert max(bar.get_height() for bar in influence.patches) == pytest.approx(1.13, abs=0.01)


def test_limit_of_the_screening_figure(stages: dict[str, Any], edited: Any) -> None:
    """Lenth of 9 effects 23.8 N; t(0.975, 3) = 3.182 times the standard error of an effect, 3.768 N."""
    (lenth,) = pareto(stages["screen"]).axes[0].lines
    assert lenth.get_label() == "Lenth ME" and lenth.get_xdata()[0] == pytest.approx(23.79, abs=0.01)
    tested = edited(stages["screen"], lambda content: content["residual"].update(df=3))
    (t_test,) = pareto(tested).axes[0].lines
    assert t_test.get_label() == "t test, p = 0.05"
    assert t_test.get_xdata()[0] == pytest.approx(3.1824 * 3.7677, abs=0.01)


def test_setting_tells_what_was_measured(replayed: tuple[Any, Any]) -> None:
    study, _ = replayed
    factors, measured, *_ = setting_tables(study)
    assert len(factors.rows) == 9 and factors.cells[2][3] == ""
    assert measured.cells[1][:2] == ("8", "159.2") and measured.strong == {1}


def test_every_stage_names_its_runs(stages: dict[str, Any], edited: Any) -> None:
    def add_diameter(content: dict[str, Any]) -> None:
        kept = ("coefficients", "r2", "adjusted_r2", "predicted_r2", "press", "cv_percent", "runs_failed")
        run = {"run": 1, "response": 90.0, "key": "c" * 32}
        content["conditions"] = [{"condition": 7.0, "runs": [run], **{name: content[name] for name in kept}}]

    labels = [label for label, _ in edited(stages["rsm"], add_diameter).runs()]
    assert labels[:2] == ["rsm 1 at a diameter of 7 mm", "rsm 1"] and len(labels) == 21
    assert [label for label, _ in stages["validate"].runs()] == ["7 mm", "8 mm", "9 mm", "10 mm", "11 mm"]
