from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.colors import to_hex

from stemcal.drawing.plot import Plot, Shared, inline_svg
from stemcal.drawing.style import ORANGE, resize, save, svg
from stemcal.report.curves import force_travel
from stemcal.report.gallery import _run_plots, write_figures
from stemcal.report.records import Details, RunCurve, _RunRecord
from stemcal.stages.fitting import Measured
from stemcal.stages.rsm.figures import Solution, contours, levels_of, observed_predicted, relief
from stemcal.stages.screen.showing import pareto
from stemcal.stages.validate.showing import draw_validation
from stemcal.vocabulary import FIRST

NAMES = {"density": "$x^$", "elastic_modulus": "屈服应力", "poisson_ratio": "<script>"}
CURVES = {
    "screen 1": RunCurve((0.0, 0.4, 0.8), (0.0, 100.0, 30.0)),
    "8 mm": RunCurve((0.0, 0.4, 0.8), (0.0, 150.0, 60.0)),
}


def drawn(stages: dict[str, Any]) -> dict[str, Any]:
    pair = ("yield_stress", "failure_strain")
    return {
        "pareto": pareto(stages["screen"]),
        "observed_predicted": observed_predicted(stages["rsm"]),
        "contours": contours(stages["rsm"], pair, Solution(stages["invert"].parameters, stages["invert"].target)),
        "contours_only": contours(stages["rsm"], pair),
        "validation": draw_validation(stages["validate"]),
        "force_travel": force_travel(CURVES, ["8 mm"]),
    }


def test_every_figure_is_valid_svg_and_the_same_each_time(stages: dict[str, Any]) -> None:
    first, again = drawn(stages), drawn(stages)
    for name, figure in first.items():
        text = svg(figure)
        assert ElementTree.fromstring(text).tag == "{http://www.w3.org/2000/svg}svg", name
        assert text == svg(again[name]), name


def test_files_lie_on_white(stages: dict[str, Any], tmp_path: Path) -> None:
    """The page's own document has no ground; the file made of it has a white one below everything, as the pixels."""
    from PIL import Image

    plot = Plot("pareto", "screen", "", lambda: pareto(stages["screen"], {}))
    write_figures([plot], tmp_path)
    document, pixels = plot.document, tmp_path / "pareto.png"
    ground, rest = (tmp_path / "pareto.svg").read_text("utf-8").split("#ffffff", 1)
    assert "patch_1" in ground and "patch_2" not in ground
    assert ground + "none" + rest == document
    with Image.open(pixels) as image:
        assert image.convert("RGBA").getpixel((0, 0)) == (255, 255, 255, 255)


def test_the_figure_of_the_curves_has_the_travels_of_the_first_fracture(replayed: tuple[Any, Any]) -> None:
    """Those at the solution: a run stops there, long before the stem is cut through."""

    def record(broke: float | None, at_solution: bool) -> _RunRecord:
        details = Details(curve=RunCurve((0.0, 0.4, 0.8), (0.0, 150.0, 60.0)), break_travel=broke)
        return _RunRecord("a", details, at_solution=at_solution)

    records = {"screen 1": record(0.5, False), "7 mm": record(0.6461, True), "8 mm": record(0.679, True)}
    (plot,) = _run_plots(replayed[0], records)
    assert "first fracture (at 0.646 to 0.679 mm in" in plot.caption
    (plot,) = _run_plots(replayed[0], {"8 mm": record(None, True)})
    assert "fracture" not in plot.caption


def test_pareto_has_a_bar_per_factor_and_lenths_line(stages: dict[str, Any]) -> None:
    (axes,) = pareto(stages["screen"]).axes
    lengths = sorted(bar.get_width() for bar in axes.patches)
    assert lengths == pytest.approx(sorted(abs(e.effect) for e in stages["screen"].effects))
    assert axes.lines[0].get_xdata()[0] == pytest.approx(stages["screen"].lenth.me)


def test_contour_shows_the_solution_in_natural_units(stages: dict[str, Any]) -> None:
    figure = contours(
        stages["rsm"], ("yield_stress", "strain_rate_c"), Solution(stages["invert"].parameters, stages["invert"].target)
    )
    star = next(line for line in figure.axes[0].lines if line.get_marker() == "*")
    assert (star.get_xdata()[0], star.get_ydata()[0]) == pytest.approx((18.3687, 90.0525), abs=1e-3)
    assert figure.axes[0].get_xlabel() == "yield_stress, MPa"


def test_contours_of_a_joint_fit_show_the_line_of_each_mean(stages: dict[str, Any]) -> None:
    """On a surface twice as high, the line of a mean twice as large is that of the first."""
    rsm, target = stages["rsm"], stages["invert"].target
    double = replace(rsm.fitted, beta=2.0 * rsm.fitted.beta)
    further = ((Measured(9.0, FIRST, 2.0 * target), double), (Measured(10.0, FIRST, 1.1 * target), rsm.fitted))
    solved = Solution(stages["invert"].parameters, target, further)
    axes = contours(rsm, ("yield_stress", "failure_strain"), solved).axes[0]
    orange = [one for one in axes.collections if [to_hex(colour) for colour in one.get_edgecolor()] == [ORANGE]]
    same, higher, own = (one.get_paths()[0].vertices for one in orange)
    assert same == pytest.approx(own) and higher.mean(axis=0)[0] > own.mean(axis=0)[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["runs", "9 mm", "10 mm"]


LONG = "Yield stress of the outer layer along the grain of the stem at harvest"


@pytest.mark.parametrize("width", [None, 90.0, 170.0])
@pytest.mark.parametrize("label", ["", LONG])
def test_names_next_to_a_surface_in_space_are_not_cut(stages: dict[str, Any], label: str, width: float | None) -> None:
    pair = ("yield_stress", "strain_rate_c")
    figure = relief(stages["rsm"], pair, None, dict.fromkeys(pair, label) if label else None)
    if width is not None:
        resize(figure, width)
    figure.draw_without_rendering()
    axes: Any = figure.axes[0]
    boxes = [axis.label.get_window_extent() for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    assert all(figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1 for box in boxes)
    assert all(figure.bbox.y0 <= box.y0 and box.y1 <= figure.bbox.y1 for box in boxes)


def test_failed_runs_are_left_out(stages: dict[str, Any], edited: Any) -> None:
    rsm = edited(stages["rsm"], lambda content: content["design"]["runs"][0].update(response=None))
    validate = edited(stages["validate"], lambda content: content["rows"][0].update(simulated=None))
    assert len(observed_predicted(rsm).axes[0].lines[1].get_xdata()) == 19
    assert len(draw_validation(validate).axes[0].lines[1].get_xdata()) == 4


def test_inline_figures_share_styles_and_marks(stages: dict[str, Any]) -> None:
    """Every style and mark is there once however many figures have it; curves are where they were, to 0.1 pt."""
    shared, document = Shared(), svg(draw_validation(stages["validate"]))
    text = inline_svg(document, 'a "quoted" <caption>', shared)
    classes, marks = len(shared.styles), len(shared.marks)
    assert inline_svg(document, 'a "quoted" <caption>', shared) == text
    assert (len(shared.styles), len(shared.marks)) == (classes, marks)
    root, defs = ElementTree.fromstring(text), ElementTree.fromstring(f"<defs>{shared.defs}</defs>")
    known = {f"#{element.get('id')}" for element in defs}
    assert {element.get("href") for element in root.iter("use")} <= known
    assert root.get("aria-label") == 'a "quoted" <caption>'
    assert "style=" not in text and "http" not in text and "currentColor" in shared.css
    assert len(text) + len(shared.css) + len(shared.defs) < 0.5 * len(document)


def test_names_with_dollars_chinese_and_markup(stages: dict[str, Any], edited: Any, tmp_path: Path) -> None:
    def rename(content: dict[str, Any]) -> None:
        for entry in content["effects"]:
            entry["factor"] = NAMES.get(entry["factor"], entry["factor"])

    screen = edited(stages["screen"], rename)
    ElementTree.fromstring(svg(pareto(screen)))
    save(pareto(screen), tmp_path / "pareto.png")
    assert (tmp_path / "pareto.png").stat().st_size > 5000


def test_levels_of_contours_are_round_and_at_most_ten() -> None:
    assert levels_of(np.array([0.0, 21.0])) == pytest.approx(np.arange(0.0, 23.0, 2.5))
