"""`stemcal export-deck`: the shear test as an LS-DYNA deck."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from stemcal.cli.options import Quiet, Spec
from stemcal.cli.simulate import Diameter, Settings, chosen_levels, require_material

DeckFile = Annotated[Path, typer.Argument(metavar="OUT.k", help="The deck to write.", show_default=False)]
Card = Annotated[
    Literal["mat024", "mat003"] | None,
    typer.Option(help="The stem's material card.", show_default="mat024; mat003 for LS-DYNA as the solver"),
]
Long = Annotated[
    bool, typer.Option("--long", help="Twenty columns (+) where ten round a value; OpenRadioss does not read them.")
]


def export_deck(
    spec: Spec,
    out: DeckFile,
    diameter: Diameter = None,
    settings: Settings = None,
    material: Card = None,
    long: Long = False,
    quiet: Quiet = False,
) -> None:
    """Write the shear test as an LS-DYNA keyword deck: stem, blade and supports meshed, contact, motion, output.

    Units are mm, tonne, s, N and MPa. Factors stand at mid-level unless set. LS-DYNA and OpenRadioss read it.

    Example: [bold]stemcal export-deck configs/wild-chrysanthemum.yaml --set yield_stress=17.96 run.k[/bold]
    """
    from stemcal.cli.console import note, warn
    from stemcal.cli.session import read_study
    from stemcal.errors import UsageError
    from stemcal.study.reading.checked import typed_size

    study = read_study(spec)
    levels = chosen_levels(study, study.midlevels(), settings or [])
    chosen = study.specimen.outer_diameter if diameter is None else typed_size(diameter, "--diameter")
    require_material(study, levels, chosen)
    if not out.absolute().parent.is_dir():
        raise UsageError(f"{out}: the folder {out.parent} does not exist")

    from dataclasses import replace

    from stemcal.outputs import write_output
    from stemcal.solvers.deck import Deck, deck_text
    from stemcal.study.model import EmbeddedSolver

    size = study.solver.element_size.at(chosen) if isinstance(study.solver, EmbeddedSolver) else 0.0
    if chosen < 2 * size:
        raise UsageError(f"--diameter {chosen:g}: the stem is thinner than two elements of {size:g} mm")

    deck = Deck.of(study, levels, chosen)
    form = replace(deck.form, material=material or deck.form.material, long=long or deck.form.long)
    deck = replace(deck, form=form)
    text = deck_text(deck)
    write_output(out, text)
    if not quiet:
        for sentence in deck.notes:
            warn(sentence)
        note(f"wrote {out} ({text.count(chr(10))} lines)")
