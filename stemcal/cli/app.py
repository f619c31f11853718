"""The `stemcal` command: its subcommands, and the one place where errors end.

Modules of commands import nothing heavy until a command runs, so `stemcal --help` answers at once.
"""

import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from stemcal.cli import (
    augment,
    by_hand,
    check,
    demo,
    doctor,
    explain,
    export,
    export_deck,
    export_material,
    import_deck,
    init,
    measure,
    plan,
    plot,
    report,
    retry,
    run,
    runs,
    schema,
    simulate,
    stages,
    status,
    verify,
    verify_transfer,
)
from stemcal.cli.console import fail
from stemcal.cli.guard import exit_codes
from stemcal.cli.streams import lost_data, stand_in
from stemcal.stages.base import STAGES
from stemcal.version import __version__


class Commands(TyperGroup):
    """The subcommands; errors of any of them become messages and exit codes."""

    def invoke(self, ctx: Any) -> Any:
        """Run the chosen command under the guard."""
        with exit_codes():
            return super().invoke(ctx)


app = typer.Typer(
    name="stemcal",
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

PANEL = "Stages of a study (each goes on where it stopped)"
RESULTS = "Results to publish"
FOLDER = "The study folder"
AROUND = "Around a study"
FIRST = "First steps and help"

app.command(rich_help_panel=PANEL)(run.run)
for _stage in STAGES:
    if _stage.name != "audit":
        app.command(rich_help_panel=PANEL)(stages.command_of(_stage))
app.command(rich_help_panel=PANEL)(augment.augment)
app.command(rich_help_panel=PANEL)(by_hand.enter_command())
app.command(rich_help_panel=PANEL)(by_hand.ask)
app.command(rich_help_panel=PANEL)(by_hand.tell_command())
app.command(rich_help_panel=PANEL)(report.report)
app.command(rich_help_panel=RESULTS)(export.export)
app.command(rich_help_panel=RESULTS)(plot.plot)
app.command(rich_help_panel=RESULTS)(stages.audit_command())
app.add_typer(measure.app, name="measure", rich_help_panel=AROUND)
app.command(rich_help_panel=AROUND)(init.init)
app.command(rich_help_panel=AROUND)(check.check)
app.command(rich_help_panel=AROUND)(plan.plan)
app.command(rich_help_panel=AROUND)(simulate.simulate)
app.command("export-deck", rich_help_panel=AROUND)(export_deck.export_deck)
app.command("export-material", rich_help_panel=AROUND)(export_material.export_material)
app.command("verify-transfer", rich_help_panel=AROUND)(verify_transfer.verify_transfer)
app.command("import-deck", rich_help_panel=AROUND)(import_deck.import_deck)
app.command(rich_help_panel=FOLDER)(status.status)
app.command(rich_help_panel=FOLDER)(runs.runs)
app.command(rich_help_panel=FOLDER)(retry.retry)
app.command(rich_help_panel=FOLDER)(verify.verify)
app.command(rich_help_panel=FIRST)(demo.demo)
app.command(rich_help_panel=FIRST)(doctor.doctor)
app.command(rich_help_panel=FIRST)(schema.schema)
app.command(rich_help_panel=FIRST)(explain.explain)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"stemcal {__version__}")
        raise typer.Exit


@app.callback()
def stemcal(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Calibrate finite element models of plant stems against measured cutting force.

    A study is one YAML file: [bold]stemcal init[/bold] writes one to start from,
    [bold]stemcal run[/bold] takes it through screening, response surface, inversion and validation.
    """


def main() -> None:
    """Entry point of the console script."""
    stand_in()
    try:
        app()
    except SystemExit as ending:
        if (why := lost_data()) and not ending.code:
            fail(f"standard output: {why}; what was to be printed is lost, files are written")
            sys.exit(1)
        raise


if __name__ == "__main__":
    main()
