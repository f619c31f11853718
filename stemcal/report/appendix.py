"""Tables beyond those of the stages: verdicts in words, the shape of the surface, the checks of every run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from stemcal.report.numbers import fixed, short, significant
from stemcal.report.sheets import Sheet

Stage = Mapping[str, Any]
WIDE = 3  # factors from which a table on the terminal does
MANY = 4  # factors from which a table's columns bear symbols in place of names


def page_sheets(stage: Stage) -> list[Sheet]:
    """Return a stage's tables for the page, beyond those that the terminal shows."""
    if stage["stage"] == "screen":
        return [verdict_sheet(stage)] if stage["effects"] and "verdict" in stage["effects"][0] else []
    return shape_sheets(stage)


def shape_sheets(stage: Stage) -> list[Sheet]:
    """Return the tables of a surface's shape."""
    sheets = [canonical_sheet(stage)] if stage.get("canonical") else []
    return [*sheets, *([ridge_sheet(stage)] if stage.get("ridge") else [])]


def verdict_sheet(stage: Stage) -> Sheet:
    """Return what the screening says of each factor, in words."""
    rows = tuple((e["symbol"], e["verdict"]) for e in stage["effects"])
    strong = frozenset(i for i, e in enumerate(stage["effects"]) if e["factor"] in stage["significant"])
    return Sheet("Verdict on each factor", ("", "Verdict"), rows, texts=2, strong=strong, long=True)


def canonical_sheet(stage: Stage) -> Sheet:
    """Return the surface along its own axes: curvature, and the direction in coded units."""
    canonical, names = stage["canonical"], stage["names"]
    rows = tuple(
        (str(number), significant(value), *(fixed(axis[name], 3) for name in names))
        for number, (value, axis) in enumerate(zip(canonical["eigenvalues"], canonical["axes"], strict=True), 1)
    )
    foot = (
        _stationary_point(canonical, names),
        "Negative: the force falls on both sides along that axis; the columns give its direction, coded.",
    )
    return Sheet("Canonical analysis", ("Axis", "Curva-\nture, N", *_heads(stage)), rows, foot=foot)


def _stationary_point(canonical: Mapping[str, Any], names: Sequence[str]) -> str:
    if canonical["natural"] is None:
        return "No single stationary point: the surface is a plane, or level along some direction."
    place = ", ".join(f"{name} {significant(canonical['natural'][name])}" for name in names)
    where = "inside" if canonical["inside"] else "outside"
    return (
        f"Stationary point: a {canonical['kind']} of {significant(canonical['predicted'])} N at {place}; coded radius "
        f"{fixed(canonical['coded_radius'])}, {where} the region of the runs."
    )


def ridge_sheet(stage: Stage) -> Sheet:
    """Return the way along which the surface climbs most."""
    names, coding = stage["names"], stage["coding"]
    rows = tuple(
        (
            fixed(row["radius"]),
            *(significant(coding[n]["center"] + coding[n]["half_step"] * row["coded"][n]) for n in names),
            significant(row["predicted"]),
            fixed(row["standard_error"]),
        )
        for row in stage["ridge"]
    )
    columns = ("Coded\nradius", *_heads(stage, with_units=True), "Largest\nforce, N", "Std.\nerror, N")
    return Sheet("Ridge of steepest ascent", columns, rows, texts=0)


def _heads(stage: Stage, with_units: bool = False) -> list[str]:
    """Return a column's head per factor of a surface: its name, where they are many its symbol, the unit below."""
    crowded = len(stage["names"]) > WIDE
    heads = []
    for name in stage["names"]:
        entry: Stage = next((entry for entry in stage["factors"] if entry["factor"] == name), {})
        head = entry.get("symbol") or name if crowded else name
        unit = entry.get("unit") or "1"
        heads.append(head if unit == "1" or not with_units else f"{head},\n{unit}")
    return heads


def design_sheet(title: str, stage: Stage) -> Sheet:
    """Return the runs of a design: the varied levels and the force, or why there is none."""
    runs = stage["design"]["runs"]
    varied = list(runs[0]["coded"]) if runs else []
    entries = {e["factor"]: e.get("symbol") for e in stage.get("effects") or stage.get("factors") or []}
    crowded = len(varied) > MANY
    names = [entries.get(name) or name if crowded else name for name in varied]
    rows = tuple(
        (str(run["run"]), *(short(run["levels"][name]) for name in varied), _force_or_reason(run)) for run in runs
    )
    foot = ("Symbols as in the table of factors.",) if crowded and any(entries.values()) else ()
    return Sheet(title, ("Run", *names, "Force, N"), rows, texts=0, foot=foot)


def _force_or_reason(run: Mapping[str, Any]) -> str:
    if run["force"] is not None:
        return significant(run["force"])
    return run.get("reason") or "–"


def checks_sheet(records: Mapping[str, Mapping[str, Any]]) -> Sheet | None:
    """Return the solver's checks of every distinct run, None where no solver told of them."""
    distinct: dict[str, tuple[str, Mapping[str, Any]]] = {}
    for label, record in records.items():
        distinct.setdefault(record["key"], (label, record["details"]))
    told = [(label, details) for label, details in distinct.values() if "energy_drift_percent" in details]
    if not told:
        return None
    rows = tuple(
        (
            label,
            significant(d["peak_force"]),
            fixed(d["peak_travel"], 3),
            "yes" if d["stroke_was_enough"] else "no",
            str(d["elements"]),
            str(d["deleted_elements"]),
            str(d["steps"]),
            fixed(d["energy_drift_percent"], 3),
            fixed(d["kinetic_ratio_percent"], 2),
            fixed(d["hourglass_ratio_percent"], 2),
        )
        for label, d in told
    )
    foot = (
        "Failed: elements that had failed at the peak. Drift: largest error of the energy balance. Kinetic, hourglass: "
        "largest share of the internal energy on the way to the peak; small shares mean a quasi-static test.",
    )
    columns = ("Run", "Peak,\nN", "at,\nmm", "Fell\nagain", "Elements", "Failed", "Steps", "Drift,\n%",
               "Kinetic,\n%", "Hourglass,\n%")  # fmt: skip
    return Sheet("Checks of every run", columns, rows, foot=foot)
