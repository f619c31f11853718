"""The page: self-contained, escaped, the same each time, readable by machines that read aloud."""

import json
import re
import shutil
from base64 import b64encode
from dataclasses import replace
from hashlib import sha256
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from stemcal.cutting.checks import hourglass_energy, nothing_deleted
from stemcal.errors import UsageError
from stemcal.notes import Note
from stemcal.report.page.page import coded, page_content, page_part, render, write_page
from stemcal.report.records import Details, _RunRecord, run_warnings
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.results import Results
from stemcal.stages.verdict.result import Verdict

BLANK = pytest.mark.usefixtures("blank_figures")
VOID = {"meta", "br", "link", "img", "input"}


class Outline(HTMLParser):
    """Collects what the tests ask: tags in balance, headings, ids, links, attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.headings: list[int] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def page(replayed: tuple[Any, Any]) -> str:
    return render(page_content(*replayed))


def test_words_come_first(page: str) -> None:
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", page[page.index("<body") :]))
    place = text.index("Outcome", text.index("Which parameter values reproduce the measured"))
    assert place < text.index("Confidence") < text.index("Effects on the maximum")
    assert "At yield stress = 18.37 MPa, failure strain = " in text
    assert "constrains yield stress to between ≤ 15.35 and ≥ 19.96 MPa" in text
    assert "of the parameter combinations that fit equally well" in text
    assert "was read from a table" in text


def test_the_first_screen_has_question_verdict_next_step_parameters_and_comparison(page: str) -> None:
    first = page[page.index("<main>") : page.index('id="prediction"')]
    order = ("Which parameter values reproduce the measured", "Calibrated, with reservations", "<strong>Next:</strong>",
             "<span>≤ 15.35 to ≥ 19.96", "Copy parameters", "<svg", "Measured and simulated maximum force")  # fmt: skip
    places = [first.index(text) for text in order]
    assert places == sorted(places)
    verdict = first[places[1] :].partition("</section>")[0]
    assert verdict.count("<p>") == 0 and verdict.count("<li>") > 1  # a line for each reason
    assert page.count("Measured and simulated maximum force; the circled values were used in the fit.<") == 1


def test_the_title_and_the_spec_are_those_of_the_study(page: str) -> None:
    """Its title, not its name, and every line of its file."""
    title = re.search(r"<title>([^<]*)</title>", page)
    assert title is not None and "Wild chrysanthemum, reanalysis of the published tables" in title[1]
    text = unescape(page)
    lines = (Path(__file__).parents[2] / "configs" / "paper-replay.yaml").read_text("utf-8").splitlines()
    assert [line for line in lines if line not in text] == []


def test_commands_and_keys_stand_as_code_and_no_mark_is_left(page: str) -> None:
    assert "`" not in re.sub(r"<pre.*?</pre>", "", page[: page.index("<script>")], flags=re.S)


def test_details_are_folded_and_named(page: str) -> None:
    folded = re.findall(r'<details class="more">\s*<summary>Details: ([^<]*)</summary>', page)
    assert "analysis of variance, response surface in coded units, canonical analysis" in folded[1]
    story = re.sub(r"<details.*?</details>", "", page, flags=re.DOTALL)
    assert "Effects on the maximum force" in story and "Calibrated parameters" in story
    assert "Analysis of variance</h3>" in page and "Analysis of variance</h3>" not in story
    assert page.count("<h3>Notes</h3>") > 2 and "<h3>Notes</h3>" not in story
    assert "details::details-content { content-visibility: visible" in page[page.index("@media print") :]


def test_factors_bear_their_labels_and_units(page: str) -> None:
    assert "kg/m³" in page and "kg/m3" not in page[: page.index('id="asked"')]
    story = page[page.index('id="screen"') : page.index('id="asked"')]
    assert not re.search(
        r">[^<]*\b(yield_stress|strain_rate_c)\b", re.sub(r"<details.*?</details>", "", story, flags=re.S)
    )


def test_nothing_is_loaded_from_anywhere(page: str) -> None:
    outline = Outline(page)
    policy = [meta["content"] or "" for meta in outline.all("meta") if "http-equiv" in meta]
    assert len(policy) == 1 and policy[0].startswith("default-src 'none';") and "unsafe" not in policy[0]
    for kind, text in re.findall(r"<(style|script)>(.*?)</\1>", page, re.DOTALL):
        assert f"{kind}-src 'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'" in policy[0]
    assert not {"link", "img", "iframe"} & {tag for tag, _ in outline.tags} and "style=" not in page
    assert not re.search(r"https?:", page)
    assert "@import" not in page
    references = re.findall(r'(?:href|src|xlink:href)="([^"]*)"|url\(([^)]*)\)', page)
    assert references
    assert all((a or b).startswith("#") for a, b in references)
    assert len(page.encode()) < 400_000 and len(page_part("page.js").encode()) <= 22_400


def test_structure(page: str) -> None:
    outline = Outline(page)
    assert outline.open == []
    assert outline.headings[0] == 1
    assert outline.headings.count(1) == 1
    assert all(after <= before + 1 for before, after in zip(outline.headings, outline.headings[1:], strict=False))
    ids = [attributes["id"] for _, attributes in outline.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert outline.all("html") == [{"lang": "en"}]
    assert all(th.get("scope") in ("row", "col") for th in outline.all("th"))
    pictures = [svg for svg in outline.all("svg") if svg.get("role") == "img"]
    assert len(pictures) == 12 and all(svg.get("aria-label") for svg in pictures)
    anchors = {a["href"] for a in outline.all("a")}
    assert anchors <= {f"#{name}" for name in ids}


def test_every_table_scrolls_in_its_own_box(page: str) -> None:
    assert page.count("<table>") == len(re.findall(r'<div class="scroll"[^>]*>\s*<table>', page)) > 8


def test_the_same_bytes_each_time(replayed: tuple[Any, Any], page: str) -> None:
    assert render(page_content(*replayed)) == page


@BLANK
def test_markup_is_escaped(replayed: tuple[Any, Any], tmp_path: Path) -> None:
    """A hostile name everywhere a stage file or the spec has one."""
    study, folder = replayed
    hostile = '<script>alert("x")</script>'
    for name, old in (("screen", "density"), ("rsm", "strain_rate_c")):
        text = json.dumps(folder.read_stage(name)).replace(old, json.dumps(hostile)[1:-1])
        StudyFolder(tmp_path).write_stage(name, json.loads(text))
    named = study.model_copy(update={"title": hostile, "warnings": (hostile,)})
    text = render(page_content(named, StudyFolder(tmp_path)))
    assert text.count("<script") == 3 and "</script><" not in text  # the page's own
    assert text.count("&lt;script&gt;") > 12


def test_what_stands_between_backticks_is_escaped_too() -> None:
    assert coded("a < b: `<script>` or `plan`") == "a &lt; b: <code>&lt;script&gt;</code> or <code>plan</code>"
    assert coded("one ` alone") == "one ` alone"


@BLANK
def test_unfinished_study(replayed: tuple[Any, Any], tmp_path: Path) -> None:
    study, folder = replayed
    with pytest.raises(UsageError, match="stemcal run SPEC"):
        page_content(study, StudyFolder(tmp_path))
    shutil.copy(folder.path / "screen.json", tmp_path)
    page = render(page_content(study, StudyFolder(tmp_path)))
    assert "Unfinished stages: Response surface, Calibration, Validation." in page


@BLANK
def test_failed_runs_are_told_on_top(replayed: tuple[Any, Any], tmp_path: Path) -> None:
    study, folder = replayed
    for name in ("screen", "rsm", "invert"):
        shutil.copy(folder.path / f"{name}.json", tmp_path)
    stage = folder.read_stage("validate")
    none = dict.fromkeys(("simulated", "error_percent", "response"))
    stage["rows"][0] |= {**none, "status": "failed", "message": "too soft"}
    StudyFolder(tmp_path).write_stage("validate", stage)
    text = render(page_content(study, StudyFolder(tmp_path)))
    assert text.index("no reason given (1); first message (7 mm): too soft") < text.index('id="outcome"')


@BLANK
def test_stale_stages_are_left_out(replayed: tuple[Any, Any]) -> None:
    """Another significance level makes the screening stale, not the surface of named factors."""
    study, folder = replayed
    options = study.screen.model_copy(update={"alpha": 0.01})
    text = render(page_content(study.model_copy(update={"screen": options}), folder))
    assert "screen.json is out of date" in text
    assert "Unfinished stages: Screening." in text
    assert "Effects on the maximum force" not in text
    assert "Analysis of variance" in text


@BLANK
def test_curves_of_the_runs(replayed: tuple[Any, Any], tmp_path: Path) -> None:
    """Records that keep a curve give the figure of force over travel."""
    study, folder = replayed
    copy = StudyFolder(tmp_path)
    stage = folder.read_stage("validate")
    for name in ("screen", "rsm", "invert", "validate"):
        shutil.copy(folder.path / f"{name}.json", tmp_path)
    with copy:
        for row in stage["rows"]:
            record = folder.peek(row["key"])
            record["details"] = {"curve": {"travel": [0.0, 0.4, 0.8], "force": [0.0, row["simulated"], 20.0]}}
            copy.save(record)
    assert "Force versus blade travel" in render(page_content(study, copy))


def test_warnings_of_the_runs_are_told_once_per_kind() -> None:
    def record(key: str, *warnings: Note) -> _RunRecord:
        return _RunRecord(key, Details(warnings=warnings))

    records = {
        "screen 1": record("a", hourglass_energy(16.3), hourglass_energy(17.0)),
        "screen 2": record("b", hourglass_energy(17.1), nothing_deleted()),
        "rsm 1": record("b", hourglass_energy(17.1), nothing_deleted()),
        "8 mm": record("c"),
    }
    assert [note.text for note in run_warnings(records)] == [
        "2 of 3 runs (first: screen 1): The hourglass energy is 16.3 % of the internal energy. Use smaller elements "
        "(`solver.element_size`).",
        "1 of 3 runs (first: screen 2): The material law does not delete failed elements: they lose their shear "
        "strength at the failure strain but remain in the mesh.",
    ]
    doubtful = Verdict.of([Note("physics", "error", "The physical validity of 2 of 3 runs is doubtful.")], None)
    assert [note.kind for note in run_warnings(records, doubtful)] == ["nothing_deleted"]


@BLANK
def test_written_file(replayed: tuple[Any, Any]) -> None:
    study, folder = replayed
    path = folder.path / "report.html"
    write_page(path, page_content(study, folder))
    assert path.read_bytes().startswith(b"<!doctype html>")
    assert path.read_text("utf-8").rstrip().endswith("</html>")


@BLANK
def test_what_the_values_belong_to_stands_below_them(replayed: tuple[Any, Any]) -> None:
    study, folder = replayed
    what = page_content(study, folder)
    found = {result.name: result for result in what.results.done}
    found["invert"] = replace(found["invert"], depends_on={"element_size": "d/16 (0.5 mm)"})  # type: ignore[type-var]
    first = render(replace(what, results=Results(tuple(found.values()))))
    assert first.index('class="scope"') < first.index("element_size d/16.") < first.index('class="cards"')
