"""`stemcal export deck`: the shear test as an LS-DYNA deck."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from stemcal.cli.console import note, say_json, waiting, warn
from stemcal.cli.options import AsJson, Quiet, Spec
from stemcal.cli.session import read_study
from stemcal.cli.simulate import Diameter, Settings, chosen_levels, require_material
from stemcal.errors import UsageError
from stemcal.outputs import write_output

if TYPE_CHECKING:
    from stemcal.solvers.deck import Deck

DeckFile = Annotated[Path, typer.Argument(metavar="OUT.k", help="The deck to write.", show_default=False)]
Card = Annotated[
    Literal["mat024", "mat003"] | None,
    typer.Option(help="The stem's material card.", show_default="mat024; mat003 for LS-DYNA as the solver"),
]
Long = Annotated[
    bool, typer.Option("--long", help="Twenty columns (+) where ten round a value; OpenRadioss does not read them.")
]
Program = Annotated[
    Literal["lsdyna", "openradioss"] | None,
    typer.Option(
        "--for",
        help="Carry the study's lengths by this program's own cards (nonlocal failure, a nose); for OpenRadioss with "
        "starter and engine files beside the deck.",
        show_default="cards that both read, without lengths",
    ),
]
NoForce = Annotated[bool, typer.Option("--no-force", help="Do not compute which force the deck is to give.")]


def export_deck(
    spec: Spec,
    out: DeckFile,
    diameter: Diameter = None,
    settings: Settings = None,
    material: Card = None,
    long: Long = False,
    program: Program = None,
    no_force: NoForce = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write the shear test as an LS-DYNA keyword deck: stem, blade and supports meshed, contact, motion, output.

    Units are mm, tonne, s, N and MPa. Factors stand at mid-level unless set. LS-DYNA and OpenRadioss read it. The force
    that this deck is to give is computed and told beside the study's: what no card says may change it greatly.

    Example: [bold]stemcal export deck configs/wild-chrysanthemum.yaml --set yield_stress=17.96 run.k[/bold]
    """
    from stemcal.study.reading.checked import typed_size
    from stemcal.text.decks import forces_told

    study = read_study(spec)
    levels = chosen_levels(study, study.midlevels(), settings or [])
    chosen = study.specimen.outer_diameter if diameter is None else typed_size(diameter, "--diameter")
    require_material(study, levels, chosen)
    if not out.absolute().parent.is_dir():
        raise UsageError(f"{out}: the folder {out.parent} does not exist")

    from dataclasses import replace

    from stemcal.solvers.deck import Deck, deck_text
    from stemcal.study.model import DeckSolver, EmbeddedSolver

    solver = study.solver
    size = solver.element_size.at(chosen) if isinstance(solver, EmbeddedSolver | DeckSolver) else 0.0
    if chosen < 2 * size:
        raise UsageError(f"--diameter {chosen:g}: the stem is thinner than two elements of {size:g} mm")

    deck = Deck.of(study, levels, chosen)
    form = replace(deck.form, material=material or deck.form.material, long=long or deck.form.long)
    deck = replace(deck, form=replace(form, lengths=program or form.lengths))
    forces = None if no_force or (quiet and not as_json) else _forces(deck, quiet)
    text = deck_text(deck if forces is None else replace(deck, force_to_give=forces[0]))
    write_output(out, text)
    beside = _write_beside(deck, out)
    if as_json:
        of_deck, of_study = forces or (None, None)
        files = [str(path) for path in (out, *beside)]
        say_json({"files": files, "force": of_deck, "force_of_study": of_study, "otherwise": deck.notes})
    if not quiet:
        for sentence in deck.notes:
            warn(sentence)
        for path in beside:
            note(f"wrote {path}")
        note(f"wrote {out} ({text.count(chr(10))} lines)")
        if forces is not None:
            for sentence in forces_told(*forces):
                warn(sentence)


def _write_beside(deck: Deck, out: Path) -> list[Path]:
    """Write the starter and engine files that OpenRadioss needs beside a deck with a nonlocal length; return them."""
    if deck.form.lengths != "openradioss" or deck.nonlocal_length == 0.0:
        return []
    from stemcal.solvers.openradioss.files import engine_text, starter_text

    texts = {
        out.with_name(f"{out.stem}_0000.rad"): starter_text(deck, out.name),
        out.with_name(f"{out.stem}_0001.rad"): engine_text(deck, out.stem),
    }
    for path, text in texts.items():
        write_output(path, text)
    return list(texts)


def _forces(deck: Deck, quiet: bool) -> tuple[float, float | None] | None:
    """Return the force that the deck is to give, and the study's where its own solver is the embedded one; N.

    None where they would take more than this machine's memory or days, which is warned of.
    """
    from stemcal.overview.foresight import demand_of_one
    from stemcal.solvers.deck.as_embedded import as_embedded
    from stemcal.solvers.embedded import simulate
    from stemcal.study.model import EmbeddedSolver
    from stemcal.text.decks import not_foretold
    from stemcal.text.plan import objections

    of_deck, own = as_embedded(deck), isinstance(deck.study.solver, EmbeddedSolver)
    for study in (of_deck, deck.study) if own else (of_deck,):
        if too_much := objections(demand_of_one(study, [deck.diameter]), 1)[0]:
            warn(not_foretold(too_much))
            return None
    with waiting("the force that this deck is to give", quiet):
        force = simulate(of_deck, {}, deck.diameter).peak_force
        return force, simulate(deck.study, deck.levels, deck.diameter).peak_force if own else None
