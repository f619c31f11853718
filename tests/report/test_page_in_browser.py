"""The page in a real Chromium: the profiler against numpy, everything a reader can do, nothing loaded or cut off.

Needs `pip install stemcal[test-browser]` and a Chromium, found on the PATH or named in STEMCAL_CHROMIUM. Accessibility
needs axe.min.js of the npm package axe-core, named in STEMCAL_AXE, and is not checked without it.
"""

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest
from fakes import SPEC, FakeSolver

from stemcal.report.page.page import PageContent, page_content, render
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import RESPONSES, Answer, Request
from stemcal.stages.fitting import fitted_surfaces
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import Results
from stemcal.stages.rsm.analysis import rsm
from stemcal.stages.rsm.profiler import profiler_data
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.storage.rows import Rows
from stemcal.study.reading import load_study

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed (extra test-browser)")
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
CHROMIUM = os.environ.get("STEMCAL_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on the PATH or in STEMCAL_CHROMIUM")
QUIET = "--no-sandbox --disable-gpu --disable-quic --disable-background-networking --disable-component-update"
LOOKS = [(1440, "light"), (1440, "dark"), (390, "light"), (390, "dark")]
# What is copied is kept; the time of each frame is taken until it is laid out.
WATCHED = """
Object.defineProperty(navigator, 'clipboard', {value: {writeText: async text => { window.copied = text; }}});
const request = window.requestAnimationFrame;
window.next_frame = request.bind(window);
window.frames_ms = [];
window.requestAnimationFrame = draw => request(time => {
  const begin = performance.now();
  draw(time);
  document.body.getBoundingClientRect();
  window.frames_ms.push(performance.now() - begin);
});"""
STICKING_OUT = """() => [...document.querySelectorAll('body *')].filter(e =>
  (e.matches('.scroll, svg') || !e.closest('.scroll, svg, nav ul')) && e.getBoundingClientRect().right > innerWidth + 1
).map(e => e.tagName + '.' + e.className).slice(0, 5)"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=CHROMIUM, args=QUIET.split())
        yield started
        started.close()


@contextmanager
def opened(browser: Any, path: Path, width: int = 1440, scheme: str = "light", **more: Any) -> Iterator[Any]:
    """Open a page; anything on the console, an error or a request fails the test."""
    found: list[str] = []
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme, **more)
    context.add_init_script(WATCHED)
    view, address = context.new_page(), path.resolve().as_uri()
    view.on("console", lambda message: found.append(f"console: {message.text}"))
    view.on("pageerror", lambda error: found.append(f"error: {error}"))
    view.on("request", lambda asked: asked.url.startswith((address, "data:")) or found.append(f"request: {asked.url}"))
    view.goto(address)
    yield view
    context.close()
    assert found == []


@pytest.fixture(scope="module")
def page(replayed: tuple[Any, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(render(page_content(*replayed)), "utf-8")
    return path


@pytest.fixture(scope="module", params=LOOKS, ids=lambda look: f"{look[0]}-{look[1]}")
def view(request: pytest.FixtureRequest, browser: Any, page: Path) -> Iterator[Any]:
    with opened(browser, page, *request.param) as open_page:
        yield open_page


# ---- the numbers


FACTORS = ("yield_stress", "failure_strain", "elastic_modulus", "strain_rate_c")


@dataclass(frozen=True)
class Rough(FakeSolver):
    """A quadratic of all factors at every diameter, rough by some 2 %."""

    def solve(self, request: Request) -> Answer:
        x = np.array([request.levels[name] / mean for name, mean in zip(FACTORS, (15, 0.03, 1000, 90), strict=True)])
        force = request.condition * (5.0 + 20.0 * x.sum() + 6.0 * x[0] * x[1] + np.sin(1e3 * x @ np.arange(1.0, 5.0)))
        travel = 1.0 + 0.3 * x[1] ** 2 + 0.02 * np.cos(1e3 * x.sum())
        return Answer("ok", response=force, details={RESPONSES: {"travel": travel}})


def fitted(folder: Path, k: int, responses: str) -> tuple[Any, Any]:
    """Return a study with the surfaces of its first k factors at five diameters."""
    row = "  - {{diameter: {0} mm, force: {0}00 N, travel: 1.3 mm, sd: {{force: 9 N, travel: 0.1 mm}}, n: 6}}\n"
    rows = "".join(map(row.format, range(7, 12)))
    more = f"screen: {{design: none}}\nrsm: {{factors: [{', '.join(FACTORS[:k])}]}}\n"
    spec = SPEC[: SPEC.index("  - {diameter")] + rows + more + f"invert: {{diameters: all, responses: [{responses}]}}\n"
    (folder / "rough.yaml").write_text(spec, "utf-8")
    study = load_study(folder / "rough.yaml")
    return study, rsm(study, StudyFolder(folder / "runs"), solver=Rough())


@pytest.mark.parametrize(("k", "responses"), [(1, "force"), (2, "force, travel"), (4, "force, travel")])
def test_values_and_intervals_are_those_of_python(browser: Any, tmp_path: Path, k: int, responses: str) -> None:
    """A thousand random points, also outside the ranges: value and both intervals to 1e-12."""
    study, rsm = fitted(tmp_path, k, responses)
    data, surfaces = profiler_data(study, rsm, {}, True), fitted_surfaces(study, rsm)
    assert len(data["surfaces"]) == len(surfaces) == 5 * len(responses.split())
    path, coded = tmp_path / "alone.html", np.random.default_rng(k).uniform(-2.0, 2.0, (1000, k))
    levels = rsm.scales.to_natural(coded)
    results, folder = Results((rsm,)), StudyFolder(tmp_path)
    page = render(PageContent(study, results, {}, [], verdict_of(study, folder, results)))
    path.write_text(page, "utf-8")
    with opened(browser, path) as view:
        found = view.evaluate("points => points.map(point => predict(point))", levels.tolist())
    coded = rsm.scales.to_coded(levels)
    for number, surface in enumerate(surfaces):
        js = [row[number] for row in found]
        expected = np.column_stack(
            [surface.predict(coded), surface.mean_interval(coded), surface.prediction_interval(coded)]
        )
        got = np.array([[one["y"], *one["mean"], *one["run"]] for one in js])
        assert np.max(np.abs(got / expected - 1.0)) <= 1e-12


# ---- what a reader does, at each width in each scheme


@pytest.fixture
def fresh(view: Any, results: Any) -> Any:
    """The page as it opens, its profiler in sight."""
    view.evaluate("history.replaceState(null, '', location.pathname)")
    view.reload()
    view.locator("#prediction").scroll_into_view_if_needed()
    return view


def drawn(view: Any) -> Any:
    """Wait for the next picture."""
    view.evaluate("new Promise(done => next_frame(() => next_frame(done)))")
    return view


def levels_of(view: Any) -> list[float]:
    drawn(view)
    return [float(field.input_value()) for field in view.locator(".panels input[type=number]").all()]


def shown_force(view: Any) -> str:
    text: str = drawn(view).locator(".live .cards strong").first.inner_text()
    return text


def predicted(results: Any, levels: list[float]) -> str:
    rsm = results.of(RsmResult)
    return f"{rsm.predict(dict(zip(rsm.names, levels, strict=True))).response:.4g} N"


def test_dragging_sets_a_factor(fresh: Any, results: Any) -> None:
    figure = fresh.locator(".panels svg").first
    figure.scroll_into_view_if_needed()
    box = figure.bounding_box()
    at = [box["x"] + share * box["width"] for share in (0.3, 0.5)]
    fresh.mouse.move(at[0], box["y"] + 50)
    fresh.mouse.down()
    fresh.mouse.move(at[1], box["y"] + 50)
    fresh.mouse.up()
    scale = results.of(RsmResult).coding["yield_stress"]
    low, high = scale.natural(-1.6818), scale.natural(1.6818)
    assert levels_of(fresh)[0] == pytest.approx(low + (high - low) * (0.5 * 280 - 44) / (272 - 44), rel=0.01)
    assert shown_force(fresh) == predicted(results, levels_of(fresh))


def test_the_card_says_the_direction_of_the_error(fresh: Any, results: Any) -> None:
    """A low and a high yield stress give forces below and above the measured 159.2 N."""
    card, slider = fresh.locator(".live .cards label").first, fresh.locator(".panels input[type=range]").first
    for key, words in (("Home", "too low"), ("End", "too high")):
        slider.press(key)
        force = float(shown_force(fresh).split()[0])
        error = f"{abs(100 * (159.2 - force) / 159.2):.1f} % {words}"
        assert float(error.split()[0]) > 1.0
        assert card.inner_text().endswith(error)


def test_arrow_keys_set_a_factor(fresh: Any, results: Any) -> None:
    slider, before = fresh.locator(".panels input[type=range]").first, levels_of(fresh)
    assert slider.get_attribute("aria-label") == "Yield stress, MPa"
    slider.press("ArrowRight")
    slider.press("ArrowRight")
    assert before[0] < levels_of(fresh)[0] < before[0] + 0.2 and levels_of(fresh)[1:] == before[1:]
    assert shown_force(fresh) == predicted(results, levels_of(fresh))


def test_typing_sets_a_factor_and_says_where_it_extrapolates(fresh: Any, results: Any) -> None:
    field, outside = fresh.locator(".panels input[type=number]").first, fresh.locator(".outside")
    field.fill("16.25")
    assert shown_force(fresh) == predicted(results, [16.25, *levels_of(fresh)[1:]]) and outside.inner_text() == ""
    field.fill("30")
    assert shown_force(fresh) == predicted(results, [30.0, *levels_of(fresh)[1:]])
    assert "Yield stress 30 MPa is outside its range (10 to 20 MPa)" in outside.inner_text()


def test_a_click_on_the_contours_sets_two_factors(fresh: Any, results: Any) -> None:
    figure = fresh.locator(".map svg").first
    figure.scroll_into_view_if_needed()
    box, before = figure.bounding_box(), levels_of(fresh)
    fresh.mouse.click(box["x"] + 248 / 530 * box["width"], box["y"] + 150 / 330 * box["height"])
    after = levels_of(fresh)
    assert after[:2] == pytest.approx([15.0, 0.03], rel=0.02) and after[2] == before[2]
    assert shown_force(fresh) == predicted(results, after)


def test_settings_are_stored_copied_and_linked(fresh: Any, results: Any, browser: Any) -> None:
    fresh.locator(".panels input[type=number]").first.fill("16.25")
    fresh.locator(".name").fill('=1+1 "A", <b>')
    fresh.get_by_role("button", name="Store setting").click()
    rows = fresh.locator(".kept tbody tr")
    assert [row.locator("th").inner_text() for row in rows.all()] == ["Current", "Calibrated", '=1+1 "A", <b>']
    fresh.get_by_role("button", name="Copy settings as CSV").click()
    heads, _, calibrated, kept, *_ = fresh.evaluate("copied").split("\n")
    assert heads.startswith("setting,yield_stress,") and kept.startswith('"\'=1+1 ""A"", <b>",16.25,')
    assert float(calibrated.split(",")[1]) == results.of(InvertResult).point.solution["yield_stress"]
    fresh.get_by_role("button", name="Copy current as YAML").click()
    assert fresh.evaluate("copied").startswith("yield_stress: 16.25\n")
    link = fresh.locator(".link").evaluate("node => node.href")
    rows.nth(1).get_by_role("button").click()
    assert levels_of(fresh)[0] == pytest.approx(results.of(InvertResult).point.solution["yield_stress"], rel=1e-5)
    fresh.goto(link)
    assert levels_of(fresh)[0] == 16.25 and rows.nth(2).locator("th").inner_text() == '=1+1 "A", <b>'


def test_tables_are_sorted_and_copied(fresh: Any) -> None:
    sheet = fresh.locator(".sheet", has_text="Effects on the maximum force").first
    sheet.scroll_into_view_if_needed()
    head = sheet.locator("thead th", has_text="Effect").first
    head.get_by_role("button").click()
    place = head.evaluate("node => node.cellIndex")
    column = [row.locator("th, td").nth(place).inner_text() for row in sheet.locator("tbody tr").all()]
    values = [float(text.replace("−", "-")) for text in column if text]
    assert values == sorted(values) and head.get_attribute("aria-sort") == "ascending" and values[0] < 0
    sheet.get_by_role("button", name="Copy as CSV").click()
    lines = fresh.evaluate("copied").splitlines()
    assert len(lines) == len(column) + 1 and f"{values[0]:g}" in lines[1]
    fresh.get_by_role("button", name="Copy parameters").click()
    assert fresh.evaluate("copied").startswith(
        "Yield stress = 18.37 MPa (95 % confidence interval: ≤ 15.35 to ≥ 19.96 MPa)"
    )


def test_figures_tell_the_value_under_the_pointer(fresh: Any) -> None:
    figure = fresh.locator(".seen svg").first
    figure.scroll_into_view_if_needed()
    axes = json.loads(figure.get_attribute("data-read"))[0]
    box, view = figure.bounding_box(), [float(side) for side in figure.get_attribute("viewBox").split()[2:]]
    place = [a["ends"][0] + (a["ends"][1] - a["ends"][0]) * (v - a["from"]) / (a["to"] - a["from"])
             for a, v in ((axes["x"], 10.0), (axes["y"], 300.0))]  # fmt: skip
    fresh.mouse.move(box["x"] + place[0] * box["width"] / view[0], box["y"] + place[1] * box["height"] / view[1])
    assert fresh.locator(".tip").inner_text() == "measured, stem diameter 10 mm, maximum force 300 N"


def test_nothing_sticks_out_and_axe_finds_nothing(fresh: Any) -> None:
    fresh.evaluate("document.querySelectorAll('details').forEach(part => { part.open = true; })")
    assert fresh.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert fresh.evaluate(STICKING_OUT) == []
    if script := os.environ.get("STEMCAL_AXE"):
        fresh.evaluate(Path(script).read_text("utf-8"))
        found = fresh.evaluate("axe.run(document, {resultTypes: ['violations']})")["violations"]
        assert [(one["id"], one["nodes"][0]["html"][:90]) for one in found] == []


# ---- once


def test_a_frame_is_drawn_within_16_ms(browser: Any, page: Path) -> None:
    """The median of 100 pictures, contours among them; the best of three, as other programs may run here."""
    with opened(browser, page) as view:
        figure = view.locator(".panels svg").nth(2)  # the contours are those of the others
        figure.scroll_into_view_if_needed()
        box = figure.bounding_box()
        view.mouse.move(box["x"] + 60, box["y"] + 50)
        view.mouse.down()
        for step in range(300):
            view.mouse.move(box["x"] + 60 + step % 100, box["y"] + 50)
            drawn(view)
        times = view.evaluate("frames_ms")[-300:]
    assert min(median(times[part : part + 100]) for part in (0, 100, 200)) <= 16.0


def test_without_scripts_the_page_is_what_it_was(browser: Any, page: Path) -> None:
    with opened(browser, page, java_script_enabled=False) as view:
        assert not view.locator("#prediction").is_visible()
        assert view.locator("button:visible").count() == 0
        assert view.locator("h2:visible").count() > 6


def test_nothing_is_cut_off_on_paper(browser: Any, page: Path) -> None:
    with opened(browser, page) as view:
        view.emulate_media(media="print")
        view.set_viewport_size({"width": 680, "height": 962})  # A4, 180 mm between the margins
        cut = (
            "[...document.querySelectorAll('table, svg')].filter(e => e.getBoundingClientRect().right > innerWidth + 1)"
        )
        assert view.evaluate(f"{cut}.length") == 0


def test_names_of_the_study_are_never_markup(browser: Any, replayed: tuple[Any, Any], tmp_path: Path) -> None:
    study, folder = replayed
    hostile = "</script><img src=x onerror='window.hacked=1'>\"'&\u2028" + "x" * 10_000
    what = page_content(study, folder)
    factors = tuple(factor.model_copy(update={"label": hostile, "unit": hostile}) for factor in study.factors)
    surface = what.results.of(RsmResult)
    entries = Rows(replace(entry, label=hostile, unit=hostile) for entry in surface.factors)
    done = tuple(replace(one, factors=entries) if one is surface else one for one in what.results.done)
    named = study.model_copy(update={"title": hostile, "factors": factors})
    path = tmp_path / "report.html"
    path.write_text(render(replace(what, study=named, results=Results(done))), "utf-8")
    with opened(browser, path) as view:
        view.locator(".panels input[type=number]").first.fill("16.25")
        assert shown_force(view).endswith(" N") and view.evaluate("window.hacked") is None
        assert view.locator("img").count() == 0 and view.evaluate(STICKING_OUT) == []
