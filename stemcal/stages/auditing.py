"""The audit of a paper: everything printed is computed again, and what does not agree is listed.

First the cells of the printed tables and the printed claims, then what the numbers say about each other: levels
against runs, box against design, equation against solution, signs against the law.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from stemcal.errors import UsageError
from stemcal.stages.audit import audit_cells, printed_validation, table
from stemcal.study.model import Study

Stages = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Found:
    """One thing that does not agree. `kind`: sign, value, rounding, claim, design, extrapolation, law or setup."""

    place: str
    kind: str
    printed: str
    computed: str
    sentence: str


_FAR = 0.1  # coded units
Check = Callable[[Study, Stages], Iterator[Found]]


def require_printed_runs(study: Study) -> None:
    """Raise `UsageError` if there is nothing to audit."""
    if study.solver.kind != "table":
        raise UsageError("audit: recomputes from printed runs; give the spec a solver of kind table with the paper's")
    if study.published is None:
        raise UsageError("audit: the spec has no section published; say there what the paper printed")


def audit_all(study: Study, stages: Stages) -> dict[str, Any]:
    """Return the contents of ``audit.json``: what was found, how many cells agree."""
    from stemcal.stages.suspicions import SUSPICIONS

    checks: tuple[Check, ...] = (cells_differ, claims_differ, levels_differ, design_differs, *SUSPICIONS)
    found = [finding for check in checks for finding in check(study, stages)]
    tables = {
        name: count
        for stage in stages.values()
        for name, count in (stage.get("published") or {}).get("tables", {}).items()
    }
    agree, of = (sum(count[key] for count in tables.values()) for key in ("agree", "of"))
    return {
        "agree": agree,
        "of": of,
        "tables": tables,
        "findings": [{"number": number, **asdict(finding)} for number, finding in enumerate(found, 1)],
        "notes": [f"{agree} of {of} printed cells agree with what their data give; {len(found)} things do not."],
    }


def cells_differ(_study: Study, stages: Stages) -> Iterator[Found]:
    """Printed cells that their own data contradict."""
    for stage in stages.values():
        for cell in (stage.get("published") or {}).get("differences", []):
            computed = "none" if cell["value"] is None else f"{cell['value']:.6g}"
            yield Found(f"{cell['table']}: {cell['label']}", cell["kind"], cell["printed"], computed, cell["sentence"])


def claims_differ(study: Study, stages: Stages) -> Iterator[Found]:
    """Printed claims, such as a largest error, that do not hold."""
    claims = study.published.claims if study.published else {}
    computed = {**stages.get("rsm", {})}
    if study.published and study.published.validation:
        result, _ = printed_validation(study, study.published.validation)
        computed |= {name: getattr(result, name) for name in ("max_abs_error_percent", "mean_abs_error_percent")}
    cells = [(name.replace("_", " "), text, computed.get(name)) for name, text in claims.items()]
    for cell in audit_cells({"claims": cells})["differences"]:
        shown = "none" if cell["value"] is None else f"{cell['value']:.6g}"
        yield Found(f"claim: {cell['label']}", "claim", cell["printed"], shown, cell["sentence"])


def levels_differ(study: Study, stages: Stages) -> Iterator[Found]:
    """Levels as the coding table prints them against the levels that the runs had."""
    if study.published is None or study.published.levels is None or "rsm" not in stages:
        return
    header, rows = table(study.published.levels)
    factors = {entry["factor"]: entry for entry in stages["rsm"]["factors"]}
    runs = stages["rsm"]["design"]["runs"]
    for cells in rows:
        coded = float(cells[0])
        for name, text in zip(header[1:], cells[1:], strict=True):
            ran = [(run["levels"][name], run["coded"][name]) for run in runs]
            level, at = min(ran, key=lambda pair: abs(pair[1] - coded))
            printed = float(text)
            if abs(at - coded) <= 0.01 and abs(printed - level) > 1e-9 * abs(level):
                yield _level(name, coded, text, level, (printed - factors[name]["center"]) / factors[name]["half_step"])


def _level(name: str, coded: float, text: str, level: float, coded_as_printed: float) -> Found:
    from stemcal.doe.printed import agrees

    rounded = agrees(text, level)
    end = "a matter of rounding" if rounded else "which no rounding explains"
    if rounded and abs(coded_as_printed - coded) > _FAR:
        end = "a rounding that moves the level far from where the design has it"
    return Found(
        f"levels: {name} at coded {coded:g}",
        "rounding" if rounded else "value",
        text,
        f"{level:.7g}",
        f"levels: {name} at coded {coded:g} is printed {text}, the runs have {level:.7g}; as printed it would be "
        f"coded {coded_as_printed:.3f}, {end}",
    )


def design_differs(study: Study, stages: Stages) -> Iterator[Found]:
    """Levels of the printed runs against those that the analysis needs."""
    if study.published is None or study.published.design is None or "rsm" not in stages:
        return
    header, rows = table(study.published.design)
    runs = stages["rsm"]["design"]["runs"]
    for name in (heading for heading in header[:-1] if heading in stages["rsm"]["names"]):
        pairs = [(float(cells[header.index(name)]), run["levels"][name]) for cells, run in zip(rows, runs, strict=True)]
        for printed, used in sorted({pair for pair in pairs if abs(pair[0] - pair[1]) > 1e-9 * abs(pair[1])}):
            agree, of = _cells_with(study, stages["rsm"], header, rows)
            count = sum(pair == (printed, used) for pair in pairs)
            kept = (stages["rsm"].get("published") or {}).get("tables", {}).get("anova", {"agree": 0, "of": 0})
            yield Found(
                f"design: {name} in {count} runs",
                "value",
                f"{printed:g}",
                f"{used:g}",
                f"design: {name} is printed {printed:g} in {count} runs; with that {agree} of {of} cells of the "
                f"printed analysis of variance come out, with {used:g} {kept['agree']} of {kept['of']}",
            )


def _cells_with(study: Study, rsm: Mapping[str, Any], header: list[str], rows: list[list[str]]) -> tuple[int, int]:
    """Count the printed ANOVA cells that agree when the design is taken as printed."""
    from stemcal.doe.surface import fit_surface
    from stemcal.stages.audit import audit_surface
    from stemcal.stages.turning import coding_of

    coding = coding_of(rsm)
    columns = [header.index(name) for name in coding.names]
    natural = [[float(cells[column]) for column in columns] for cells in rows]
    refit = fit_surface(coding.to_coded(natural), [float(cells[-1]) for cells in rows], coding.names)
    audit = audit_surface(study, refit.as_dict())
    counts = (audit or {}).get("tables", {}).get("anova", {"agree": 0, "of": 0})
    return counts["agree"], counts["of"]
