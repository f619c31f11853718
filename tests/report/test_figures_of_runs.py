"""The data, ends and labels of the figures of runs, of the cut stem and of laboratory measurements."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from stemcal.cutting.end_state import Shape
from stemcal.drawing.style import BLUE, FAINT, GREEN, INK, ORANGE, new_figure
from stemcal.fem.mesh import brick
from stemcal.measured.diameters import measure_diameters
from stemcal.measured.shear import find_files, measure_shear
from stemcal.measured.shear_curves import CurveOptions
from stemcal.measured.tables import Form
from stemcal.report import fracture as pictures
from stemcal.report.curves import energies, force_travel, measured_band
from stemcal.report.fracture import fracture, half_width, write_animation
from stemcal.report.gallery import _run_plots
from stemcal.report.measured import diameter_histogram, force_over_diameter, shear_curves
from stemcal.report.records import Details, RunCurve
from stemcal.solvers.film import Frame

DATA = Path(__file__).parents[2] / "configs" / "data"
CURVE = RunCurve((0.0, 0.5, 1.0, 1.5), (0.0, 100.0, 20.0, 10.0))


# ---- runs


def test_a_curve_is_dotted_from_the_fracture_on() -> None:
    broken = RunCurve(CURVE.travel, CURVE.force, 1.0)
    axes: Any = force_travel({"a": broken, "b": CURVE}, ["a"]).axes[0]
    whole, after, solid, dotted = axes.lines
    assert (list(whole.get_xdata()), list(after.get_xdata())) == ([0.0, 0.5, 1.0, 1.5], [1.5])
    assert (list(solid.get_xdata()), list(dotted.get_xdata())) == ([0.0, 0.5, 1.0], [1.0, 1.5])
    assert (list(solid.get_ydata()), list(dotted.get_ydata())) == ([0.0, 100.0, 20.0], [20.0, 10.0])
    assert (solid.get_linestyle(), dotted.get_linestyle()) == ("-", ":")
    assert (solid.get_label(), solid.get_color(), dotted.get_color(), whole.get_color()) == ("a", BLUE, BLUE, FAINT)
    assert str(dotted.get_label()).startswith("_")
    assert axes.get_xlim() == (0.0, 1.5) and axes.get_ylim()[0] == 0.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("blade travel, mm", "force, N")
    assert force_travel({"a": CURVE}, of_blade=False).axes[0].get_xlabel() == "travel, mm"
    assert force_travel({"a": CURVE}).axes[0].get_legend() is None


def test_many_curves_have_a_wide_figure_and_six_colours() -> None:
    names = [f"run {n}" for n in range(7)]
    wide = force_travel(dict.fromkeys(names, CURVE), names)
    colours = [line.get_color() for line in wide.axes[0].lines[::2]]
    assert colours == [BLUE, ORANGE, GREEN, "#cc79a7", "#e69f00", "#56b4e9", BLUE]
    assert wide.get_figwidth() == pytest.approx(6.4)
    widths = [force_travel(dict.fromkeys(names[:n], CURVE)).get_figwidth() for n in (3, 4)]
    assert widths == pytest.approx([4.7, 6.4])


def test_the_band_of_measured_curves() -> None:
    travel, mean, sd = np.array([0.0, 0.5, 1.0]), np.array([40.0, 100.0, 80.0]), np.array([0.0, 10.0, 20.0])
    asked = []

    def at_shares(x: Any, y: Any) -> Any:
        asked.append((list(x), list(y)))
        return np.array([40.0, 90.0, 120.0])

    modes: Any = SimpleNamespace(band=(travel, mean, sd), at_shares=at_shares)
    above, below = measured_band(modes, RunCurve(CURVE.travel, CURVE.force, 1.0)).axes
    assert asked == [([0.0, 0.5, 1.0], [0.0, 100.0, 20.0])]  # up to the fracture
    assert [(line.get_label(), line.get_color(), list(line.get_ydata())) for line in above.lines] == [
        ("mean", INK, [40.0, 100.0, 80.0]),
        ("simulated", BLUE, [40.0, 90.0, 120.0]),
    ]
    assert list(below.lines[0].get_ydata()) == pytest.approx([0.0, -1.0, 2.0])
    span = below.patches[0].get_extents().transformed(below.transData.inverted())
    assert (span.y0, span.y1) == pytest.approx((-2.0, 2.0))
    assert (above.get_ylabel(), below.get_xlabel(), below.get_ylabel()) == ("force, N", "travel, mm", "difference, SD")
    assert above.get_ylim()[0] == 0.0 and above.get_xlim() == (0.0, 1.0)
    assert above.get_position().height == pytest.approx(3.0 * below.get_position().height, rel=0.01)


def test_energies_have_their_labels() -> None:
    names = ("external", "internal", "eroded", "contact", "hourglass", "kinetic")
    rows = {"travel": [0.0, 2.0], **{name: [0.0, 1.0 + n] for n, name in enumerate(names)}}
    axes: Any = energies(rows).axes[0]
    assert [(line.get_label(), line.get_linestyle()) for line in axes.lines] == [
        *(("work done by the blade", "-"), ("internal", "-"), ("deleted elements", "-")),
        *(("friction and contact", "-"), ("hourglass", "--"), ("kinetic", "--")),
    ]
    assert axes.get_xlim() == (0.0, 2.0) and axes.get_ylim()[0] == 0.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("blade travel, mm", "energy, mJ")


# ---- which figures a study has


def study_of(ratio: float = 0.4, goal: Any = None, modes: Any = None) -> Any:
    targets = SimpleNamespace(calibrate_at=8.0, modes=modes or {})
    return SimpleNamespace(targets=targets, specimen=SimpleNamespace(ratio_at=lambda _: ratio), goal=goal)


def records_of(**details: tuple[Details, bool]) -> Any:
    return {
        label.replace("_", " ").strip(): SimpleNamespace(details=kept, at_solution=solved)
        for label, (kept, solved) in details.items()
    }


def test_runs_at_the_solution_have_energies_and_a_picture() -> None:
    shape = box((4, 2, 2)).packed()
    energy = dict.fromkeys(("travel", "external", "internal", "eroded", "contact", "hourglass"), (0.0, 1.0))
    whole = Details(CURVE, {**energy, "kinetic": (0.0, 1.0)}, shape, break_travel=1.0)
    plots = _run_plots(study_of(), records_of(_8_mm=(whole, True), _9_mm=(whole, True), rsm_1=(whole, False)))
    named = {plot.name: plot for plot in plots}
    assert list(named) == ["force-travel", "energies-8mm", "fracture-8mm", "energies-9mm", "fracture-9mm"]
    assert {name: (plot.on_page, plot.detail, plot.wide) for name, plot in named.items()} == {
        "force-travel": (True, False, False),
        "energies-8mm": (True, True, False),
        "fracture-8mm": (True, False, True),
        "energies-9mm": (False, True, False),
        "fracture-9mm": (False, False, True),
    }
    assert {plot.section for plot in plots} == {"runs"}
    assert named["energies-8mm"].caption == "Energies versus blade travel in the simulation of the 8 mm stem."
    assert named["fracture-8mm"].caption == (
        "The 8 mm stem at the end of the simulation: side view and section (the bore is between the walls). "
        "The simulation stops after the peak force, before the stem is cut through. "
        "Colours show the plastic strain; failed elements are removed. The blade and the supports are grey."
    )
    assert len(named["energies-8mm"].make().axes[0].lines) == 6
    assert len(named["fracture-8mm"].make().axes) == 3  # two views and the colour bar


@pytest.mark.parametrize(
    ("severed", "words"),
    [
        (None, "The simulation stops after the peak force, before the stem is cut through."),
        (True, "The stem is cut through."),
        (False, "The stem is not cut through within the stroke."),
    ],
)
def test_the_picture_of_a_solid_stem_says_how_the_cut_ended(severed: bool | None, words: str) -> None:
    details = Details(shape=box((2, 2, 2)).packed(), severed=severed)
    (plot,) = _run_plots(study_of(0.0), records_of(_8_mm=(details, True)))
    assert plot.caption.startswith(
        f"The 8 mm stem at the end of the simulation: side view and section. {words} Colours"
    )


@pytest.mark.parametrize("label", ["optimum", "present", "front_1"])
def test_pictures_of_an_optimised_cutter(label: str) -> None:
    details = Details(CURVE, shape=box((2, 2, 2)).packed())
    force, picture = _run_plots(study_of(goal=object()), records_of(**{label: (details, True)}))
    name = label.replace("_", " ")
    assert picture.caption.startswith(f"The {name} cutter at the end")
    assert (picture.name, picture.on_page) == (f"fracture-{label.replace('_', '')}", label != "front_1")
    assert force.caption == (
        "Force versus blade travel. Runs of the optimum, the present cutter and the front are in colour; "
        "all other runs are grey."
    )


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        ({}, ""),
        ({"_8_mm": 1.25}, " Curves are dotted beyond the first fracture (at 1.25 mm in the validation runs)."),
        (
            {"_8_mm": 1.25, "_9_mm": 0.5},
            " Curves are dotted beyond the first fracture (at 0.500 to 1.25 mm in the validation runs).",
        ),
        ({"rsm_1": 0.3}, " Curves are dotted beyond the first fracture."),
    ],
)
def test_the_caption_has_the_travel_at_the_fractures(broken: dict[str, float], words: str) -> None:
    labels = {"_8_mm": True, "_9_mm": True, "rsm_1": False}
    details = {label: (Details(CURVE, break_travel=broken.get(label)), solved) for label, solved in labels.items()}
    (plot,) = _run_plots(study_of(), records_of(**details))
    assert plot.caption == f"Force versus blade travel. Validation runs are in colour; all other runs are grey.{words}"
    assert _run_plots(study_of(), records_of(_8_mm=(Details(), True))) == []


def test_a_measured_band_is_at_a_simulated_diameter_of_the_solution() -> None:
    details = {"_8_mm": (Details(CURVE), True), "_9_mm": (Details(CURVE), False), "_7_mm": (Details(CURVE), True)}
    plots = _run_plots(study_of(modes=dict.fromkeys((7.0, 8.0, 9.0, 10.0))), records_of(**details))
    assert [plot.name for plot in plots] == ["force-travel", "measured-curves-7mm", "measured-curves"]
    assert "up to the peak force. The lower panel shows the difference" in plots[1].caption


# ---- the cut stem


def box(counts: tuple[int, int, int], symmetry: str = "none", **changes: Any) -> Shape:
    """A box of unit elements, centred on y = 0 and z = 0; blade above and two supports, at 10 mm, below."""
    mesh = brick(tuple(float(n) for n in counts), counts)
    nodes = mesh.nodes - np.array([0.0 if symmetry == "quarter" else counts[0] / 2, counts[1] / 2, counts[2] / 2])
    blade = np.array([[-1.0, 4.0], [0.0, 1.0], [1.0, 4.0]])
    support = np.array([[10.0, -2.0], [20.0, -2.0], [20.0, -4.0], [10.0, -4.0]])
    count = len(mesh.hexes)
    standing, strain = np.ones(count, bool), np.arange(count) / 10.0
    shape = Shape(nodes, nodes, mesh.hexes, standing, strain, (blade, support, support * (-1.0, 1.0)), symmetry)
    return Shape(**{**vars(shape), **changes})


@pytest.mark.parametrize(
    ("length", "height", "drawn"),
    [
        (60, 8, 13.5),  # 1.35 of the distance to the supports
        (20, 8, 10.0),  # the stem ends before
        (60, 16, 16.0),  # at least one diameter
    ],
)
def test_as_much_of_the_stem_is_drawn_as_is_between_the_supports(length: int, height: int, drawn: float) -> None:
    assert half_width(box((length, 2, height))) == pytest.approx(drawn)
    alone = box((length, 2, 8), tools=(np.array([[0.0, 1.0], [1.0, 2.0]]),))
    assert half_width(alone) == pytest.approx(length / 2)


def bodies(axes: Any) -> list[Any]:
    return [each for each in axes.collections if isinstance(each, PolyCollection)]


def test_views_of_a_stem_have_its_faces_strains_and_tools() -> None:
    """A box of 4 × 2 × 2 elements seen from y > 0: the row of elements behind is hidden, and in the section shown."""
    shape = box((4, 2, 2))
    figure: Any = fracture(shape)
    side, section, bar = figure.axes
    assert (figure.get_figwidth(), figure.get_figheight()) == pytest.approx((6.4, 2.3))
    centre = shape.nodes[shape.hexes].mean(axis=1)
    near = np.flatnonzero(centre[:, 1] > 0)
    for axes, title in ((side, "side view"), (section, "section")):
        (body,) = bodies(axes)
        assert sorted(body.get_array()) == pytest.approx(sorted(shape.plastic_strain[near]))
        corners = np.concatenate([path.vertices for path in body.get_paths()])
        assert (corners[:, 0].min(), corners[:, 0].max()) == (-2.0, 2.0)
        assert (corners[:, 1].min(), corners[:, 1].max()) == (-1.0, 1.0)
        assert (axes.get_title(), axes.get_xlabel(), axes.get_aspect()) == (title, "x, mm", 1.0)
        assert axes.get_xlim() == (-2.0, 2.0) and axes.get_ylim() == pytest.approx((-1.6, 2.0))
        outlines = [np.asarray(patch.get_xy())[:3] for patch in axes.patches]
        assert [outline.tolist() for outline in outlines] == [tool[:3].tolist() for tool in shape.tools]
        assert body.norm.vmin == 0.0 and body.norm.vmax == pytest.approx(1.5)
    assert side.get_ylabel() == "z, mm" and bar.get_ylabel() == "plastic strain"


def test_a_quarter_is_mirrored_and_what_failed_has_no_colour() -> None:
    """The largest strain is that of remaining elements; without any strain the scale still has an extent."""
    quarter = box((2, 2, 2), "quarter")
    (right, left) = bodies(fracture(quarter).axes[0])
    x = [np.concatenate([path.vertices for path in body.get_paths()])[:, 0] for body in (right, left)]
    assert (x[0].min(), x[0].max(), x[1].min(), x[1].max()) == (0.0, 2.0, -2.0, 0.0)
    assert len(fracture(quarter).axes[0].patches) == 6
    standing = np.ones(8, bool)
    standing[7] = False
    failed = box((2, 2, 2), standing=standing)
    (body,) = bodies(fracture(failed).axes[0])
    assert body.norm.vmax == pytest.approx(0.6) and 0.7 not in body.get_array()
    flat = box((2, 2, 2), plastic_strain=np.zeros(8))
    assert bodies(fracture(flat).axes[0])[0].norm.vmax == 1e-6


def test_the_farthest_faces_are_drawn_first() -> None:
    """An opening in the near row shows the row behind it."""
    shape = box((1, 2, 2))
    standing = np.ones(4, bool)
    centre = shape.nodes[shape.hexes].mean(axis=1)
    standing[(centre[:, 1] > 0) & (centre[:, 2] > 0)] = False
    (body,) = bodies(fracture(box((1, 2, 2), standing=standing)).axes[0])
    behind = np.flatnonzero((centre[:, 1] < 0) & (centre[:, 2] > 0))[0]
    assert body.get_array()[0] == pytest.approx(behind / 10.0) and len(body.get_array()) == 2


def test_an_animation_has_a_frame_for_each_moment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Titles of each frame: travel, force, and the work up to there, of a force that rises by 10 N a millimetre."""
    from PIL import Image

    frames = [Frame(travel, 10.0 * travel, box((2, 2, 2))) for travel in (0.0, 1.0, 2.0)]
    titles: list[str] = []
    stage = pictures._stage

    def staged(figure: Any, *given: Any) -> Any:
        show = stage(figure, *given)

        def shown(frame: Frame) -> None:
            show(frame)
            curve = next(axes for axes in figure.axes if axes.get_ylabel() == "force, N")
            marker = curve.lines[1]
            titles.append(f"{curve.get_title()} {marker.get_xdata()[0]:g} {marker.get_ydata()[0]:g}")
            assert [len(bodies(axes)) for axes in figure.axes[:2]] == [1, 1]  # those of the frame before are gone

        return shown

    monkeypatch.setattr(pictures, "_stage", staged)
    path = write_animation(frames, tmp_path / "a.gif")
    assert titles[1:] == [
        "travel 0.00 mm, force 0 N, work 0 mJ 0 0",
        "travel 1.00 mm, force 10 N, work 5 mJ 1 10",
        "travel 2.00 mm, force 20 N, work 20 mJ 2 20",
    ]
    with Image.open(path) as image:
        assert (image.size, image.info["duration"]) == ((704, 550), 160)  # 6.4 by 5 inches; a sixth of a second
    curve = ([0.0, 2.0], [40.0, 40.0])
    titles.clear()
    write_animation(frames[:1] + frames[2:], tmp_path / "b.gif", curve)
    assert titles[-1].startswith("travel 2.00 mm, force 20 N, work 80 mJ")


# ---- laboratory measurements


def test_the_histogram_has_a_normal_curve_of_the_stems_and_the_limits_of_the_grades(tmp_path: Path) -> None:
    values = [6.6, 6.9, 7.0, 7.1, 7.3, 7.4, 7.6, 8.0, 8.2, 8.3]
    (tmp_path / "d.csv").write_text("diameter_mm\n" + "".join(f"{v}\n" for v in values), encoding="utf-8")
    measured = measure_diameters(tmp_path / "d.csv", Form(), [7.0, 8.0])
    figure: Any = diameter_histogram(measured)
    axes = figure.axes[0]
    mean, sd = np.mean(values), np.std(values, ddof=1)
    (curve, *limits) = axes.lines
    x, y = curve.get_data()
    width = axes.patches[0].get_width()
    # 10 stems in bins of this width: n w / (s √(2π)) at the mean
    assert np.interp(mean, x, y) == pytest.approx(10 * width / (sd * np.sqrt(2 * np.pi)), rel=1e-3)
    assert np.interp(mean + sd, x, y) / np.interp(mean, x, y) == pytest.approx(np.exp(-0.5), rel=1e-3)
    assert (x[0], x[-1], len(x)) == (pytest.approx(mean - 3 * sd), pytest.approx(mean + 3 * sd), 200)
    assert curve.get_label() == f"normal, {mean:.2f} ± {sd:.2f} mm"
    assert [line.get_xdata()[0] for line in limits] == [6.5, 7.5, 8.5]
    assert [line.get_linestyle() for line in limits] == [":"] * 3
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("stem diameter, mm", "stems")
    assert figure.get_suptitle() == "" and sum(bar.get_height() for bar in axes.patches) == 10
    highest = max(*(bar.get_height() for bar in axes.patches), *y)
    assert axes.get_ylim()[1] == pytest.approx(1.25 * 1.05 * highest, rel=0.01)


OPTIONS = CurveOptions(Form(), None, None, None, None, 5.0)


@pytest.fixture(scope="module")
def sheared() -> Any:
    return measure_shear(find_files(DATA / "measured-shear"), OPTIONS, {}, [])


def test_a_grade_of_one_specimen_has_no_interval() -> None:
    files = find_files(DATA / "measured-shear")
    first = next(n for n, path in enumerate(files) if path.name.split("-")[0] != files[0].name.split("-")[0])
    tests = measure_shear([files[0], *files[first : first + 3]], OPTIONS, {}, [])
    assert [grade.summary.mean_interval is None for grade in tests.grades] == [True, False]
    (bars,) = force_over_diameter(tests).axes[0].containers
    assert list(bars.lines[0].get_xdata()) == [tests.grades[1].diameter]
    (alone,) = force_over_diameter(measure_shear(files[:1], OPTIONS, {}, [])).axes[0].containers
    assert list(alone.lines[0].get_xdata()) == []


def test_measured_curves_are_coloured_by_their_grade(sheared: Any) -> None:
    figure: Any = shear_curves(sheared)
    axes = figure.axes[0]
    assert len(axes.lines) == len(sheared.specimens) and figure.get_figwidth() == pytest.approx(6.4)
    named = [line.get_label() for line in axes.lines if not str(line.get_label()).startswith("_")]
    assert named == [f"{grade.diameter:g} mm" for grade in sheared.grades]
    colours = list(dict.fromkeys(line.get_color() for line in axes.lines))
    viridis = mpl.colormaps["viridis"]
    last = len(sheared.grades) - 1
    assert colours == [viridis(0.9 * number / last) for number in range(last + 1)]
    first = next(specimen for specimen in sheared.specimens if specimen.grade == sheared.grades[0].diameter)
    assert list(axes.lines[0].get_ydata()) == list(first.curve.force)
    assert axes.get_ylim()[0] == 0.0 and axes.get_xlabel() == "blade travel after preload, mm"
    assert figure.get_suptitle() == "synthetic data, not measured"


def test_forces_over_diameters_with_means_intervals_and_the_power_law(sheared: Any) -> None:
    axes: Any = force_over_diameter(sheared).axes[0]
    points, law = axes.lines[0], axes.lines[-1]
    assert sorted(points.get_ydata()) == pytest.approx(sorted(s.curve.max_force for s in sheared.specimens))
    assert points.get_label() == "specimens"
    bars = axes.containers[0]
    known = [grade for grade in sheared.grades if grade.summary.mean_interval]
    assert list(bars.lines[0].get_ydata()) == pytest.approx([grade.summary.mean for grade in known])
    ends = [segment[:, 1] for segment in bars.lines[2][0].get_segments()]
    assert [list(end) for end in ends] == [pytest.approx(list(grade.summary.mean_interval)) for grade in known]
    assert bars.get_label() == "mean, 95 %"
    assert law.get_label() == f"∝ d^{sheared.power_law.exponent:.2f}" and len(law.get_xdata()) == 100
    x, y = law.get_data()
    assert y[-1] / y[0] == pytest.approx((x[-1] / x[0]) ** sheared.power_law.exponent)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("stem diameter, mm", "maximum shear force, N")
    assert axes.get_ylim()[0] == 0.0 and axes.get_legend() is not None
    with new_figure() as empty:
        assert empty.axes == []
