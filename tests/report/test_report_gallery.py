"""Every figure by name, also for the laboratory, and the words of the glossary."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stemcal.cli.explain import glossary, look_up
from stemcal.drawing.style import BLUE, FAINT, resize, styled
from stemcal.report.curves import energies, force_travel, measured_band
from stemcal.report.gallery import _run_plots
from stemcal.report.records import Details, RunCurve
from stemcal.stages.rsm.figures import Solution, contours, relief
from stemcal.stages.validate.showing import draw_validation


def test_relief_has_the_measured_force_at_the_solution(stages: dict[str, Any]) -> None:
    solved = Solution(stages["invert"].parameters, stages["invert"].target)
    axes: Any = relief(stages["rsm"], ("yield_stress", "failure_strain"), solved).axes[0]
    (star,) = axes.lines
    assert star.get_data_3d()[2][0] == pytest.approx(159.2)
    assert axes.get_xlabel() == "yield_stress, MPa"
    assert axes.get_zlim()[0] < min(axes.get_zticks())


@pytest.mark.parametrize("name", ["Equivalent plastic strain at which elements are eroded, averaged", "单元失效" * 8])
@pytest.mark.parametrize("width", [80.0, 160.0])
def test_long_names_in_space_lie_within_the_figure(stages: dict[str, Any], name: str, width: float) -> None:
    pair = ("yield_stress", "failure_strain")
    figure = relief(
        stages["rsm"], pair, Solution(stages["invert"].parameters, stages["invert"].target), dict.fromkeys(pair, name)
    )
    for size in (None, width):
        if size is not None:
            resize(figure, size)
        with styled():
            figure.draw_without_rendering()
        axes: Any = figure.axes[0]
        for axis in (axes.xaxis, axes.yaxis):
            assert axis.get_label_text().replace("\n", "").replace(" ", "").startswith(name.replace(" ", ""))
            box = axis.label.get_window_extent()
            assert box.x0 >= 0.0 and box.y0 >= 0.0 and box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1


def test_contours_end_with_the_ranges(stages: dict[str, Any]) -> None:
    """Of a design of corners and middles of faces the radius is that of its corners, √3, beyond all that was run."""
    whole = stages["rsm"]
    runs = [run.levels["failure_strain"] for run in whole.design.runs]
    axes = contours(replace(whole, radius=3.0), ("yield_stress", "failure_strain")).axes[0]
    assert axes.get_xlim() == pytest.approx((9.99167, 20.0), abs=1e-4)  # a run lies just below its range
    assert axes.get_ylim() == pytest.approx((0.01, 0.05)) and min(runs) > 0.013


def test_scatter_of_the_measurements_is_drawn(stages: dict[str, Any]) -> None:
    bars = draw_validation(stages["validate"], {7.0: 10.0, 8.0: 5.0}).axes[0].collections[0]
    lengths = [np.ptp(segment[:, 1]) for segment in bars.get_segments()]
    assert lengths == pytest.approx([20.0, 10.0])


def test_energies_have_a_line_each() -> None:
    names = ("external", "internal", "eroded", "contact", "hourglass", "kinetic")
    rows = {"travel": [0.0, 1.0], **{name: [0.0, float(n)] for n, name in enumerate(names)}}
    assert [line.get_ydata()[1] for line in energies(rows).axes[0].lines] == [0, 1, 2, 3, 4, 5]


def test_histogram_counts_all_stems_and_says_what_is_synthetic() -> None:
    from stemcal.measured.diameters import measure_diameters
    from stemcal.report.measured import diameter_histogram

    found = measure_diameters(Path(__file__).parents[2] / "configs/data/measured-diameters.csv")
    figure = diameter_histogram(found)
    assert sum(bar.get_height() for bar in figure.axes[0].patches) == 50
    assert figure.get_suptitle() == "synthetic data, not measured"
    x, y = figure.axes[0].lines[0].get_data()
    width = figure.axes[0].patches[0].get_width()
    assert np.trapezoid(y, x) == pytest.approx(50 * width, rel=0.02)


def test_glossary_knows_every_factor_and_statistic_of_the_reports() -> None:
    from stemcal.study.types.factor import PARAMETERS

    words = ("PRESS", "lack of fit", "adequate precision", "coded radius", "prediction interval")
    for word in (*PARAMETERS, *words, "hourglass_ratio_percent", "kinetic_ratio_percent", "Lenth", "shapiro-wilk test"):
        entry = look_up(word)[0]
        assert entry.meaning.endswith(".") and entry.source
    names = [name.lower() for entry in glossary() for name in entry.names]
    assert len(names) == len(set(names))
    assert [entry.term for entry in glossary() if not entry.chinese] == []
    assert look_up("失拟") == look_up("lack of fit")


def test_measured_curves_are_drawn_at_each_condition_that_was_simulated_at_the_solution() -> None:
    curve = Details(RunCurve((0.0, 0.5, 1.0), (0.0, 100.0, 20.0)))
    kept = {"7 mm": (curve, True), "8 mm": (curve, True), "9 mm": (curve, False), "10 mm": (Details(), True)}
    records: Any = {
        label: SimpleNamespace(details=details, at_solution=solved) for label, (details, solved) in kept.items()
    }
    targets = SimpleNamespace(calibrate_at=8.0, modes=dict.fromkeys((7.0, 8.0, 9.0, 10.0, 11.0)))
    study: Any = SimpleNamespace(targets=targets, specimen=SimpleNamespace(ratio_at=lambda _: 0.41), goal=None)
    plots = _run_plots(study, records)
    assert [plot.name for plot in plots] == ["force-travel", "measured-curves-7mm", "measured-curves"]
    made: Any = plots[0].make
    drawn, coloured = made.args
    assert list(drawn) == ["7 mm", "8 mm", "9 mm"] and coloured == ["7 mm", "8 mm"]


def test_points_of_several_runs_have_their_number(stages: dict[str, Any]) -> None:
    pair = ("yield_stress", "failure_strain")
    runs = stages["rsm"].design.runs
    several = Counter((run.levels[pair[0]], run.levels[pair[1]]) for run in runs)
    texts = {
        tuple(each.xy): each.get_text() for each in contours(stages["rsm"], pair).axes[0].texts if hasattr(each, "xy")
    }
    assert texts == {place: str(count) for place, count in several.items() if count > 1} and len(texts) < len(several)


def test_an_axis_without_a_radius_ends_with_the_runs(stages: dict[str, Any]) -> None:
    whole = replace(stages["rsm"], radius=None)
    coded = [run.coded["yield_stress"] for run in whole.design.runs]
    assert whole.drawn_between("yield_stress") == pytest.approx((min(-1.0, *coded), max(1.0, *coded)))


def test_only_highlighted_curves_are_coloured_and_named() -> None:
    curve = RunCurve((0.0, 0.5, 1.0), (0.0, 100.0, 20.0), 0.5)
    axes = force_travel(dict.fromkeys(("7 mm", "8 mm", "9 mm"), curve), ["8 mm"]).axes[0]
    named = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
    assert [(line.get_label(), line.get_color()) for line in named] == [("8 mm", BLUE)]
    assert [line.get_color() for line in axes.lines].count(FAINT) == 4
    assert [len(line.get_xdata()) for line in axes.lines[:2]] == [2, 2]  # dotted from the first fracture at 0.5 mm


def test_the_band_is_two_standard_deviations_about_the_mean() -> None:
    travel, mean, sd = np.array([0.0, 0.5, 1.0]), np.array([40.0, 100.0, 80.0]), np.array([5.0, 10.0, 20.0])
    modes: Any = SimpleNamespace(band=(travel, mean, sd), at_shares=lambda _, force: force)
    above, below = measured_band(modes, RunCurve((0.0, 0.5, 1.0), (45.0, 90.0, 80.0))).axes
    ends = above.collections[0].get_paths()[0].vertices
    assert (ends[:, 1].min(), ends[:, 1].max()) == (30.0, 120.0)
    assert below.lines[0].get_ydata() == pytest.approx([1.0, -1.0, 0.0])
