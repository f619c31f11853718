"""`stemcal export-deck`: the shear test as an LS-DYNA deck."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stemcal.cli.options import Quiet, Spec
from stemcal.cli.simulate import Diameter, Settings, chosen_levels, require_material

DeckFile = Annotated[Path, typer.Argument(metavar="OUT.k", help="The deck to write.", show_default=False)]


def export_deck(
    spec: Spec,
    out: DeckFile,
    diameter: Diameter = None,
    settings: Settings = None,
    quiet: Quiet = False,
) -> None:
    """Write the shear test as an LS-DYNA keyword deck: stem, blade and supports meshed, contact, motion, output.

    Units are mm, tonne, s, N and MPa. Factors stand at mid-level unless set.

    Example: [bold]stemcal export-deck configs/wild-chrysanthemum.yaml --set yield_stress=17.96 run.k[/bold]
    """
    from stemcal.cli.console import note, warn
    from stemcal.cli.session import read_study
    from stemcal.errors import UsageError

    study = read_study(spec)
    levels = chosen_levels(study.midlevels(), settings or [])
    require_material(study, levels)
    chosen = study.specimen.outer_diameter if diameter is None else diameter
    if not out.absolute().parent.is_dir():
        raise UsageError(f"{out}: the folder {out.parent} does not exist")

    from stemcal.outputs import write_output
    from stemcal.solvers.deck import deck_text
    from stemcal.study.model import EmbeddedSolver

    size = study.solver.element_size.at(chosen) if isinstance(study.solver, EmbeddedSolver) else 0.0
    if chosen < 2 * size:
        raise UsageError(f"--diameter {chosen:g}: the stem is thinner than two elements of {size:g} mm")

    text = deck_text(study, levels, chosen)
    write_output(out, text)
    if isinstance(study.solver, EmbeddedSolver) and study.solver.rate_law == "paper":
        warn("LS-DYNA scales the yield stress by 1 + (rate/C)^(1/P), not by 1 + (rate/C)^P as this study does")
    if not quiet:
        note(f"wrote {out} ({text.count(chr(10))} lines)")
