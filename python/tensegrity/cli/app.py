"""The program ``tensegrity``."""

from __future__ import annotations

from typing import Annotated

import typer

from tensegrity.cli.group import CommandGroup

app = typer.Typer(
    name="tensegrity",
    cls=CommandGroup,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich's boxes cut long option names off
    epilog="Example: tensegrity demo",
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback(invoke_without_command=True)
def _global_options(
    context: typer.Context,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of errors.")] = False,
) -> None:
    """State estimation for tensegrity robots: simulate, estimate, evaluate, compare."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main() -> None:
    """Entry point of the ``tensegrity`` command."""
    app()
