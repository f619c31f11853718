"""The report page: one self-contained HTML file, made from spec, stage files and run records alone."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

from stemcal.drawing.plot import Plot, Shared, inline_svg
from stemcal.drawing.showing import Setting
from stemcal.drawing.table import Table
from stemcal.errors import UsageError
from stemcal.formats import counted, series, short
from stemcal.report.gallery import gallery
from stemcal.report.glossary import glossary
from stemcal.report.outcome import certainty, failures_of, outcome_sentences, shown_notes, tables_of
from stemcal.report.page.headline import first_remedy, headline, lead, made_with, quantity_calibrated, question, scope
from stemcal.report.records import Records, provenance_rows, read_records, run_warnings, spec_hash
from stemcal.report.study_tables import design_tables, setting_tables
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.stage import stage_called, stages_of
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.stages.verdict.words import uses, word
from stemcal.storage.atomic import write_atomic
from stemcal.study.model.study import Study
from stemcal.vocabulary import Wording, small

if TYPE_CHECKING:
    from jinja2 import Environment


_Picture = dict[str, Any]  # keys: `svg`, `caption`, `wide`


@dataclass(frozen=True)
class _Part:
    """Part of the page: visible tables and pictures; folded tables (`details`), pictures (`plates`) and notes."""

    tables: tuple[Table, ...] = ()
    pictures: tuple[_Picture, ...] = ()
    details: tuple[Table, ...] = ()
    plates: tuple[_Picture, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def folded(self) -> str:
        """The names and numbers of all folded items, as text; empty if nothing is folded."""
        numbers = {"figure": len(self.plates), "note": len(self.notes)}
        counts = [counted(number, noun) for noun, number in numbers.items() if number]
        return series([*(small(table.title) for table in self.details), *counts])


@dataclass(frozen=True)
class PageContent:
    """The content of the page and of the figures folder."""

    study: Study
    results: Results
    records: Records
    plots: list[Plot]
    verdict: Verdict


def page_content(
    study: Study, folder: StudyFolder, results: Results | None = None, verdict: Verdict | None = None
) -> PageContent:
    """Collect the content of the page; results and verdict are read from the folder unless they are passed."""
    results = results or fresh_results(study, folder)
    if not results.done:
        unfinished = f"{folder.path}: no stage has finished yet; run `stemcal run SPEC` first"
        raise UsageError("\n".join(results.stale) or unfinished)
    records, verdict = read_records(results, folder), verdict or verdict_of(study, folder, results)
    return PageContent(study, results, records, gallery(study, results, records), verdict)


def write_page(path: Path, content: PageContent, last_line: str = "") -> None:
    """Write the page to a file that ends with `last_line`."""
    write_atomic(path, f"{render(content).rstrip()}\n{last_line}")


def render(content: PageContent) -> str:
    """Return the page as HTML."""
    study, results, records, verdict = content.study, content.results, content.records, content.verdict
    done, first = results.done, _first_pictures(study, content.plots)
    plots = [plot for plot in content.plots if plot not in first]
    labels = {factor.name: factor.label for factor in study.factors}
    people = Wording(study.naming, labels=labels)
    use = " ".join(uses(verdict, people))
    cards = headline(results, study, verdict.holds)
    labelled = partial(re.compile(r"`[^`]*`|\w+_\w+").sub, lambda name: people.in_text(name[0]))
    setting, limits = Setting(study, results, verdict.holds), scope(study, results)
    stages = [stage_called(result.name) for result in done]
    missing = [stage.title for stage in stages_of(study) if stage not in stages]
    profilers = (stage.showing().profiler(result, setting) for stage, result in zip(stages, done, strict=True))
    levels = results.parameters if verdict.holds and results.calibrated else None
    warnings = map(str, run_warnings(records, verdict))
    meanings = ((name, term.meaning.replace("`", "")) for term in glossary() for name in term.names[::-1])
    terms = {name.lower().replace("_", " "): meaning for name, meaning in meanings}
    shared, script, templates = Shared(), page_part("page.js"), environment()
    templates.filters["coded"] = lambda text: coded(labelled(text))
    return templates.get_template("page.html").render(
        study=study,
        title=study.title or study.name,
        kind=quantity_calibrated(study),
        question=question(study),
        warnings=[*study.warnings, *results.stale, *filter(None, map(failures_of, done)), *warnings],
        missing=missing,
        verdict=verdict,
        word=word(verdict),
        lead=lead(verdict, use),
        use=use if verdict.reasons else "",
        next=first_remedy(verdict),
        reasons=[(reason.text, reason.remedy.text if reason.remedy else "") for reason in verdict.reasons],
        first=[_picture(plot, shared) for plot in first],
        certainty=certainty(results, verdict.holds),
        headline=cards,
        cited="\n".join([*map(str, cards), *(f"{title}: {labelled(text)}" for title, text in limits)]),
        scope=limits,
        spec=study.source.read_text("utf-8-sig", errors="replace") if study.source.is_file() else "",
        setting=_part_of(setting_tables(study, levels), (), shared),
        sections=[
            _section(stage.title, result, plots, verdict, labels, shared)
            for stage, result in zip(stages, done, strict=True)
        ],
        runs=_part_of(_run_tables(study, results), _plots_of("runs", plots), shared),
        provenance=[*provenance_rows(records), *made_with(study, spec_hash(study))],
        css=(css := f"{page_part('page.css')}{shared.css}"),
        marks=shared.defs,
        terms=terms,
        script=script,
        policy=policy(css, script),
        profiler=next(filter(None, profilers), None),
    )


def coded(text: str) -> Markup:
    """Convert text to HTML: text between backticks becomes code, the name of a CSV file a link to it."""
    linked = re.sub(r"`(\w+\.csv)`", r'<a href="\1">\1</a>', str(escape(text)))
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", linked))


def _section(
    title: str, result: StageResult, plots: list[Plot], verdict: Verdict, labels: Mapping[str, str], shared: Shared
) -> dict[str, Any]:
    pictures = [plot for plot in _plots_of(result.name, plots) if verdict.holds or not plot.claims]
    notes = [str(note) for note in shown_notes(result, verdict.holds)]
    tables = tables_of(result, labels, verdict.holds)
    outcome = " ".join(outcome_sentences(result, verdict.holds, labels))
    part = _part_of(tables, pictures, shared, notes)
    return {"anchor": result.name, "title": title, "outcome": outcome, "part": part}


def _part_of(tables: Iterable[Table], plots: Iterable[Plot], shared: Shared, notes: Sequence[str] = ()) -> _Part:
    tables = list(tables)
    pictures = [(plot.detail, _picture(plot, shared)) for plot in plots]
    return _Part(
        tuple(table for table in tables if not table.detail),
        tuple(picture for detail, picture in pictures if not detail),
        tuple(table for table in tables if table.detail),
        tuple(picture for detail, picture in pictures if detail),
        tuple(notes),
    )


def _first_pictures(study: Study, plots: Sequence[Plot]) -> list[Plot]:
    compared = ["validation", *(f"validation-{response.name}" for response in study.naming.others)]
    names = (*compared, f"fracture-{short(study.targets.calibrate_at)}mm")
    return [plot for name in names for plot in plots if plot.name == name and plot.on_page]


def _run_tables(study: Study, results: Results) -> list[Table]:
    symbols = {factor.name: factor.symbol for factor in study.factors}
    tables = ((result.name, table) for result in results.done for table in design_tables(result, symbols))
    return [table.shortened(f"`{name}_runs.csv`") for name, table in tables]


def _plots_of(section: str, plots: Sequence[Plot]) -> list[Plot]:
    return [plot for plot in plots if plot.section == section and plot.on_page]


def _picture(plot: Plot, shared: Shared) -> _Picture:
    svg = inline_svg(plot.document, plot.caption, shared, plot.readings)
    return {"svg": svg, "caption": plot.caption, "wide": plot.wide}


def environment() -> Environment:
    """Return the Jinja environment with the templates of the page."""
    from jinja2 import Environment, PackageLoader

    loader = PackageLoader("stemcal.report.page", ".")
    return Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)


def page_part(name: str) -> str:
    """Return the style sheet or the script of the page, without indentation and lines that are comments."""
    return re.sub(r"(?m)^\s*(//.*\n)?", "", Path(__file__).with_name(name).read_text("utf-8"))


def policy(css: str, script: str) -> str:
    """Return the content security policy, which allows only this style, this script and embedded pictures."""
    style, script = (f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'" for text in (css, script))
    own = f"style-src {style}; script-src {script}; img-src data:"
    return f"default-src 'none'; {own}; base-uri 'none'; form-action 'none'"


def for_notebook(data: Mapping[str, Any]) -> str:
    """Return the profiler as HTML for a notebook: a page in a frame, isolated from styles and scripts around it."""
    css, script = page_part("page.css"), page_part("page.js")
    page = environment().get_template("notebook.html")
    alone = page.render(css=css, script=script, policy=policy(css, script), profiler=data)
    high = 500 + 270 * len(data["factors"])
    return (
        f'<iframe srcdoc="{escape(alone)}" title="Profiler" width="100%" height="{high}" '
        'sandbox="allow-scripts" allow="clipboard-write" style="border:0"></iframe>'
    )
