"""`stemcal import-deck`: an LS-DYNA deck of a stem as a study with the embedded solver."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from stemcal.cli.console import note, say_json, say_whole, warn
from stemcal.cli.init import write_new
from stemcal.cli.options import AsJson, Quiet
from stemcal.errors import UsageError

DeckFile = Annotated[Path, typer.Argument(metavar="RUN.k", help="The deck to read.", show_default=False)]
SpecFile = Annotated[
    Path | None, typer.Argument(metavar="SPEC.yaml", help="The spec to write.", show_default="RUN.yaml")
]
Units = Annotated[
    Literal["mm-t-s", "mm-kg-ms", "m-kg-s"], typer.Option(help="The deck's units of length, mass and time.")
]


def import_deck(
    deck: DeckFile,
    spec: SpecFile = None,
    units: Units = "mm-t-s",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Read an LS-DYNA deck of a stem's shear test and write it as a study with the embedded solver.

    Mesh, material, contact and motion become the spec's. What does not fit is listed here and at the top of the spec;
    an existing file is left alone.

    Example: [bold]stemcal import-deck run.k my-stem.yaml[/bold]
    """
    from stemcal.solvers.deck_import.importing import imported, read_deck
    from stemcal.solvers.deck_import.spec_text import spec_text
    from stemcal.study.reading.template import study_name

    out = deck.with_suffix(".yaml") if spec is None else spec
    name = study_name(out.stem)
    try:
        found = imported(read_deck(deck), units)
        text = spec_text(found, name, deck.name)
    except UsageError as error:
        raise UsageError(f"{deck}: {error}") from None
    write_new(out, text)
    if as_json:
        say_json({"spec": str(out), "fits": found.fits, "leaves": found.leaves})
    else:
        say_whole(str(out))
    if not quiet:
        note(f"read: {', '.join(found.fits)}")
        for sentence in found.leaves:
            warn(f"not in the study: {sentence}")
        note("ranges of the factors and the measured force are not in a deck: write yours")
