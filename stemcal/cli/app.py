"""The `stemcal` command and its subcommands.

The modules of the commands import large libraries only when a command runs, so that `stemcal --help` is fast.
"""

import re
from inspect import cleandoc
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from stemcal.cli import doctor, explain, export, measure, run, simulate, spec, status
from stemcal.cli.exit_codes import exit_codes, flush_all, prepare_process
from stemcal.stages.stage import STAGES
from stemcal.version import __version__


class _Commands(TyperGroup):
    """The subcommands of stemcal, including stages of other packages; errors become messages and exit codes."""

    def invoke(self, ctx: Any) -> Any:
        with exit_codes():
            return super().invoke(ctx)

    def list_commands(self, ctx: Any) -> list[str]:
        return [*super().list_commands(ctx), *(stage.name for stage in STAGES.external)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if (own := super().get_command(ctx, cmd_name)) or (stage := STAGES.named(cmd_name)) is None:
            return own
        further = typer.Typer(rich_markup_mode="rich")
        further.command(stage.name, rich_help_panel=_STAGE_PANEL)(run.command_of(stage, "my-study.yaml"))
        return typer.main.get_command(further)


app = typer.Typer(
    name="stemcal",
    cls=_Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

_STAGE_PANEL = "Stages of a study (an interrupted stage resumes where it stopped)"
_STUDY_PANEL = "Prepare, monitor and publish a study"
COMMANDS: dict[str, tuple[Any, ...]] = {
    _STAGE_PANEL: (run.run, *(run.command_of(stage) for stage in STAGES.built_in), run.enter, run.report),
    _STUDY_PANEL: (spec.init, spec.check, simulate.simulate, status.status),
    "Help": (doctor.doctor, explain.explain),
}
"""The commands in each panel of the help."""
for _panel, _commands in COMMANDS.items():
    for _command in _commands:
        app.command(rich_help_panel=_panel)(_command)
for _typer in (app, measure.app, export.app):
    for _info in _typer.registered_commands:  # without line breaks within paragraphs, which rich would keep
        _info.help = re.sub(r"(?<!\n)\n(?!\n)", " ", cleandoc(_info.callback.__doc__ or ""))
app.add_typer(measure.app, name="measure", rich_help_panel=_STUDY_PANEL)
app.add_typer(export.app, name="export", rich_help_panel=_STUDY_PANEL)


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
    """Calibrate finite element models of plant stems against measured forces.

    A study is defined by one YAML file, called the spec.
    `stemcal init` writes a template for the spec, and `stemcal run` runs all stages of the study.
    """


def main() -> None:
    """Entry point of the console script."""
    prepare_process()
    try:
        app()
    finally:
        flush_all()


if __name__ == "__main__":
    main()
