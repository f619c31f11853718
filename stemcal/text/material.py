"""Comments of the exported material's files, and why an element size is not valid."""

from stemcal.executors.code import code_version
from stemcal.stages.refine.element_size import MOST_POSITIONS, VALID, SizedStrain, SizedStrains
from stemcal.study.model import Study


def material_lines(study: Study, found: SizedStrains, row: SizedStrain) -> list[str]:
    """Return the comments of the card's file."""
    lines = [
        f"Stem of study {study.name}, calibrated by stemcal {code_version()}.",
        "Units: mm, tonne, s, N, MPa. Each element fails by itself at the failure strain of this card.",
        f"For elements of {row.element_size:g} mm only: failure strain {row.failure_strain:.4g}. The mean force over "
        f"{row.positions} positions of the mesh is {row.force:.4g} N at {found.condition:g} mm; measured "
        f"{found.aim:.4g} N.",
    ]
    if row.interval is not None:
        low, high = row.interval
        lines.append(f"95 % interval of the failure strain by the scatter over the positions: {low:.3g} to {high:.3g}.")
    if study.material.growing():
        grown = "Parameters of this study depend on the stem's diameter: all values here are for"
        lines.append(f"{grown} {found.condition:g} mm.")
    return lines


def curve_lines(found: SizedStrains) -> list[str]:
    """Return the comments of the curve's file."""
    sizes = ", ".join(f"{row.element_size:g}" for row in found.rows if row.valid)
    return [
        f"Failure strain over element size, mm. Valid sizes: {sizes} mm.",
        f"For a maximum force of {found.aim:.4g} N on a stem of {found.condition:g} mm.",
    ]


def not_valid(found: SizedStrains, row: SizedStrain) -> str:
    """Say why an element size is not valid, and what to do."""
    where = f"--element-size: elements of {row.element_size:g} mm are not possible"
    if abs(row.force / found.aim - 1.0) > VALID:
        return (
            f"{where}: the force nearest to {found.aim:.4g} N is {row.force:.4g} N, because it jumps between failure "
            "strains. Choose larger elements."
        )
    return (
        f"{where}: the force scatters by {row.sd_percent or 0.0:.3g} % over the positions of the mesh, and "
        f"{row.positions_needed} positions would be needed (at most {MOST_POSITIONS}). Choose another element size."
    )
