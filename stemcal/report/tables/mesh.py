"""Sheets of the mesh: the force at the solution on other meshes, and what every interval is made of."""

from __future__ import annotations

from stemcal.report.numbers import fixed, interval, short, significant
from stemcal.report.tables.sheet import Sheet, response_or_reason
from stemcal.stages.mesh.result import MeshResult


def mesh_sheet(stage: MeshResult) -> Sheet:
    """Return the force on every mesh against that on the study's own."""
    own = {row.condition: row.outcome.response for row in stage.rows if row.mesh == "own"}
    rows = []
    for row in stage.rows:
        response, against, each = row.outcome.response, own[row.condition], row.outcome.phase_responses or ()
        apart = fixed(100.0 * (response / against - 1.0)) if response and against and row.mesh != "own" else ""
        ends = f"{significant(min(each))} to {significant(max(each))}" if len(each) > 1 else ""
        name = {"own": "the study's own", "phases": f"mean of {len(each)} places"}.get(
            row.mesh, f"elements of {row.mesh}"
        )
        rows.append((short(row.condition), name, response_or_reason(response, row.outcome.reason), apart, ends))
    scatter = stage.scatter
    shared = f" ({fixed(100.0 * scatter.common**0.5)} % shared by all diameters)" if scatter.conditions > 1 else ""
    foot = (f"Standard deviation over {scatter.placements} places {fixed(scatter.sd_percent)} %{shared}.",)
    columns = ("Diameter,\nmm", "Mesh", "Force, N", "Against\nown, %", "From to, N")
    return Sheet("The solution on other meshes", columns, tuple(rows), texts=2, foot=foot)


def budget_sheet(stage: MeshResult) -> Sheet:
    """Return what the error of the force is made of at every diameter."""
    rows = tuple(
        (
            short(row.condition),
            row.source,
            fixed(row.sd),
            fixed(row.share_percent, 0),
            "known" if row.df is None else fixed(row.df, 1),
        )
        for row in stage.budget
    )
    taken = stage.certainty.taken
    foot = (
        "Laboratory: of the measured mean. Surface: of one more simulation. Mesh: of its place along the stem.",
        *([f"Laboratory: {taken}."] if taken else []),
    )
    if stage.prediction_interval is not None:
        claim = (
            "At the solution of the surface a simulation with the mesh at any place gives "
            f"{interval(stage.prediction_interval)} N (95 %)."
        )
        foot = (*foot, claim)
    columns = ("Diameter,\nmm", "Source", "Sd, N", "Share of\nvariance, %", "df")
    claiming = foot[-1:] if stage.prediction_interval is not None else ()
    return Sheet("What the error of the force is made of", columns, rows, texts=2, foot=foot, claiming=claiming)
