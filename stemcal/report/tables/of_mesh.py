"""Tables of the mesh: the force at the solution on other meshes, and what every interval is made of."""

from __future__ import annotations

from stemcal.files.rows import Column, Table
from stemcal.report.tables.columns import condition, response, to_decimals
from stemcal.stages.mesh.result import MeshResult, MeshRun
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.numbers import fixed, interval
from stemcal.text.tables import line


def mesh_tables(stage: MeshResult, names: Names) -> list[Table]:
    """Return the response on every mesh, and the error budget."""
    return [mesh_table(stage, names), budget_table(stage, names)]


def mesh_table(stage: MeshResult, names: Names) -> Table:
    """Return the response on every mesh against that on the study's own."""
    own = {row.condition: row.outcome.response for row in stage.rows if row.mesh == "own"}

    def apart(row: MeshRun) -> float | str:
        found, against = row.outcome.response, own[row.condition]
        return 100.0 * (found / against - 1.0) if found and against and row.mesh != "own" else ""

    def ends(row: MeshRun) -> tuple[float, float] | str:
        each = row.outcome.phase_responses or ()
        return (min(each), max(each)) if len(each) > 1 else ""

    columns = [
        *condition(names.naming),
        Column("mesh", "Mesh", of=_mesh_name),
        response(names.response),
        Column("apart", "Against own", "%", fixed, apart),
        Column("ends", "From to", names.response.written, interval, ends),
    ]
    scatter = stage.scatter
    fields = {"places": scatter.placements, "sd": scatter.sd_percent, "common": 100.0 * scatter.common**0.5}
    foot = line("shared scatter" if scatter.conditions > 1 else "scatter", **fields)
    return Table.of(columns, stage.rows, line("meshes"), [foot])


def _mesh_name(row: MeshRun) -> str:
    """Return what a mesh is called."""
    name = row.mesh if row.mesh in ("own", "phases") else "size"
    return line(name, size=row.mesh, count=len(row.outcome.phase_responses or ()))


def budget_table(stage: MeshResult, names: Names) -> Table:
    """Return what the error of the response is made of at every condition."""
    columns = [
        *condition(names.naming),
        Column("source", "Source"),
        Column("sd", "SD", names.response.written, fixed),
        Column("share_percent", "Share of variance", "%", to_decimals(0)),
        Column("df", "df", "", to_decimals(1), lambda row: say("known") if row.df is None else row.df),
    ]
    taken, one = stage.certainty.taken, stage.prediction_interval
    foot = line("sources"), *([f"Laboratory: {taken}."] if taken else [])
    claimed = (line("at any place", names, one=one),) if one is not None else ()
    return Table.of(columns, stage.budget, line("budget", names), foot, claimed=claimed)
