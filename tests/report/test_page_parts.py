"""Parts of the page on their own: folded items, links, pictures of the first screen, the scope, and the profiler."""

import base64
import hashlib
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fakes import TWO_FACTORS

from stemcal.drawing.table import MOST_ROWS, Table
from stemcal.report.glossary import Term, glossary
from stemcal.report.page import page as pages
from stemcal.report.page.headline import scope
from stemcal.report.page.page import _first_pictures, _Part, coded, environment, for_notebook, page_part, policy
from stemcal.stages.invert.result import InvertResult
from stemcal.study.reading import load_study


def table(title: str, detail: bool = False, rows: int = 1) -> Table:
    return Table.of(["a"], [{"a": n} for n in range(rows)], title, detail=detail)


@pytest.mark.parametrize(
    ("tables", "plates", "notes", "text"),
    [
        ((), 0, 0, ""),
        (("Runs",), 0, 0, "runs"),
        (("Runs",), 1, 2, "runs, 1 figure and 2 notes"),
        (("ANOVA", "Runs"), 0, 1, "ANOVA, runs and 1 note"),
    ],
)
def test_folded_items_are_named_and_counted(tables: tuple[str, ...], plates: int, notes: int, text: str) -> None:
    part = _Part(details=tuple(map(table, tables)), plates=({},) * plates, notes=("A note.",) * notes)
    assert part.folded == text


def test_parts_of_a_section(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables and pictures of detail are folded, in their order; notes are folded too."""
    monkeypatch.setattr(pages, "_picture", lambda plot, shared: {"name": plot.name})
    plots: Any = [SimpleNamespace(name=name, detail=name.startswith("d")) for name in ("a", "d1", "b", "d2")]
    tables = [table("T1"), table("D1", True), table("T2")]
    part = pages._part_of(iter(tables), plots, SimpleNamespace(), ["one"])  # type: ignore[arg-type]
    assert [each.title for each in part.tables] == ["T1", "T2"] and [each.title for each in part.details] == ["D1"]
    assert [picture["name"] for picture in part.pictures] == ["a", "b"]
    assert [picture["name"] for picture in part.plates] == ["d1", "d2"] and part.notes == ("one",)


def test_code_is_marked_and_csv_files_are_linked() -> None:
    text = coded("Set `a < b` as in `rsm_runs.csv`; x_y.csv, `no file.csv`.")
    assert str(text) == (
        'Set <code>a &lt; b</code> as in <a href="rsm_runs.csv">rsm_runs.csv</a>; x_y.csv, <code>no file.csv</code>.'
    )


def test_the_first_pictures_compare_and_show_the_stem_of_the_calibration() -> None:
    names = ["pareto", "fracture-8mm", "validation-work", "validation", "fracture-9mm", "validation-travel"]
    plots: Any = [SimpleNamespace(name=name, on_page=True) for name in names]
    plots.append(SimpleNamespace(name="validation-own", on_page=False))
    others = [SimpleNamespace(name="own"), SimpleNamespace(name="work")]
    study: Any = SimpleNamespace(naming=SimpleNamespace(others=others), targets=SimpleNamespace(calibrate_at=8.0))
    assert [plot.name for plot in _first_pictures(study, plots)] == ["validation", "validation-work", "fracture-8mm"]


def test_tables_of_runs_name_the_file_with_all_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[dict[str, str]] = []

    def design(result: Any, symbols: dict[str, str]) -> list[Table]:
        asked.append(symbols)
        return [table("Runs", rows=MOST_ROWS + 1)]

    monkeypatch.setattr(pages, "design_tables", design)
    study: Any = SimpleNamespace(factors=[SimpleNamespace(name="k", symbol="X1")])
    results: Any = SimpleNamespace(done=[SimpleNamespace(name="rsm")])
    (found,) = pages._run_tables(study, results)
    assert asked == [{"k": "X1"}] and found.foot[-1].endswith("`rsm_runs.csv` contains all rows.")


def test_the_policy_allows_this_style_and_this_script_only() -> None:
    def digest(text: str) -> str:
        return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()

    assert policy("a{}", "f()") == (
        f"default-src 'none'; style-src 'sha256-{digest('a{}')}'; script-src 'sha256-{digest('f()')}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    script = page_part("page.js")
    assert not re.search(r"(?m)^(\s|//)", script) and "=>" in script


def test_a_profiler_for_a_notebook_is_as_high_as_its_factors(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Any] = []
    template = SimpleNamespace(render=lambda **given: drawn.append(given) or '<p title="x">&</p>')
    monkeypatch.setattr(pages, "environment", lambda: SimpleNamespace(get_template=lambda name: template))
    frame = for_notebook({"factors": ["a", "b", "c"]})
    assert 'height="1310"' in frame and 'sandbox="allow-scripts"' in frame  # 500 and 270 for each factor
    assert "&lt;p title=&#34;x&#34;&gt;&amp;&lt;/p&gt;" in frame
    (given,) = drawn
    assert given["policy"] == policy(given["css"], given["script"]) and given["profiler"] == {
        "factors": ["a", "b", "c"]
    }
    made = environment()
    assert (made.autoescape, made.trim_blocks, made.lstrip_blocks) == (True, True, True)


def test_terms_of_the_glossary_have_their_names() -> None:
    term = Term("PRESS", "Meaning.", "Source", ("predicted sum",), "预测")
    assert term.names == ("PRESS", "predicted sum", "预测") and Term("a", "b", "c").names == ("a",)
    entries = {entry.term: entry for entry in glossary()}
    assert all(entry.meaning and entry.source and "" not in entry.aliases for entry in entries.values())
    assert any(len(entry.aliases) > 1 for entry in entries.values())


EXTRA = """\
supports: {clearance: 18 mm}
blade: {edge_angle: 40 deg, thickness: 2 mm, edge_radius: 0.15 mm}
loading: {speed: SPEED}
contact: {static_friction: 0.2, dynamic_friction: 0.15}
specimen: {diameter_ratio: RATIO}
solver: {kind: embedded, rate_law: paper}
targets: TARGETS
"""


def scope_of(folder: Path, speed: str, ratio: str, targets: str) -> dict[str, str]:
    text = TWO_FACTORS + EXTRA.replace("SPEED", speed).replace("RATIO", ratio).replace("TARGETS", targets)
    (folder / "s.yaml").write_text(text, encoding="utf-8")
    point = SimpleNamespace(solution={"yield_stress": 15.0})
    prior = SimpleNamespace(factor="yield_stress", mean=15.0, sd=2.5, unit="MPa")
    settings = {"element_size": "d/16 (0.5 mm)"}
    solved = SimpleNamespace(point=point, depends_on=settings, priors=[prior])
    return dict(scope(load_study(folder / "s.yaml"), SimpleNamespace(of={InvertResult: solved}.get)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("speed", "ratio", "targets", "words"),
    [
        (
            "60 mm/min",
            "0.5",
            "[{diameter: 9 mm, force: 120 N}, {diameter: 7 mm, force: 90 N}]",
            ("7 to 9 mm", "60 mm/min", "a hollow stem with a bore of 0.5 times the diameter"),
        ),
        ("99.9 mm/s", "0", "[{diameter: 8 mm, force: 90 N}]", ("8 mm", "5994 mm/min", "a solid stem")),
        ("100 mm/s", "0", "[{diameter: 8 mm, force: 90 N}]", ("8 mm", "100 mm/s", "a solid stem")),
    ],
)
def test_the_scope_of_a_calibration_word_for_word(
    tmp_path: Path, speed: str, ratio: str, targets: str, words: tuple[str, str, str]
) -> None:
    found = scope_of(tmp_path, speed, ratio, targets)
    diameters, travels, stem = words
    assert found["Valid for"] == (
        f"stem diameter {diameters}, the cut up to the first fracture, clearance between the supports 18 mm, "
        f"edge angle 40°, edge radius 0.15 mm, blade thickness 2 mm, blade speed {travels} and element_size d/16."
    )
    assert found["Assumed"] == (
        "the middle of the ranges of all other factors (failure_strain 0.03), one mesh position (the intervals exclude "
        "the scatter over positions; add `replicates: 5`), density 1100 kg/m³, elastic modulus 1000 MPa, "
        "Poisson's ratio 0.3, tangent modulus 0.5 MPa, hardening parameter 0.05, strain rate parameter C 90 1/s, "
        "strain rate parameter P 8, "
        f"friction 0.2 (static) and 0.15 (dynamic), {stem}, rate law `paper` and a prior for yield_stress of 15 MPa "
        "(standard deviation 2.5 MPa)."
    )


def test_before_the_calibration_there_is_no_scope(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(TWO_FACTORS + "targets: [{diameter: 8 mm, force: 90 N}]\n", encoding="utf-8")
    assert scope(load_study(tmp_path / "s.yaml"), SimpleNamespace(of=lambda _: None)) == []  # type: ignore[arg-type]
