"""A group of commands that are imported when they are called, and what becomes of their errors."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

from tensegrity.cli.commands import COMMANDS
from tensegrity.cli.console import err
from tensegrity.errors import InputError, did_you_mean

EXIT_INTERNAL = 1
EXIT_BAD_INPUT = 2


class CommandGroup(TyperGroup):
    """Imports a command only when it is called: some need libraries that take long to load.

    Every error becomes one line on stderr and an exit code; ``--debug`` shows the traceback.
    """

    def list_commands(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        return list(COMMANDS)

    def get_command(self, ctx: typer.Context, cmd_name: str) -> Any:  # type: ignore[override]
        summary = COMMANDS.get(cmd_name)
        if summary is None:
            ctx.fail(f"no command '{cmd_name}', {did_you_mean(cmd_name, COMMANDS)}")
        name = cmd_name.replace("-", "_")
        function = getattr(import_module(f"tensegrity.cli.{name}"), name)
        single = typer.Typer(add_completion=False, rich_markup_mode=None)
        single.command(cmd_name, epilog=f"Example: tensegrity {summary.example}")(function)
        return typer.main.get_command(single)

    def format_commands(self, ctx: typer.Context, formatter: Any) -> None:  # type: ignore[override]
        with formatter.section("Commands"):
            formatter.write_dl([(name, summary.text) for name, summary in COMMANDS.items()])

    def main(self, *args: Any, **extra: Any) -> Any:
        try:
            status = super().main(*args, **{**extra, "standalone_mode": False})
        except Exception as error:
            # Usage errors: typer's type for them depends on its version, its interface does not.
            message, context = getattr(error, "format_message", None), getattr(error, "ctx", None)
            if message is None:
                raise
            command = self.name if context is None else context.command_path
            _fail(f"{message().rstrip('.')} (see '{command} --help')", EXIT_BAD_INPUT)
        sys.exit(status if isinstance(status, int) else 0)

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        try:
            return super().invoke(ctx)
        except InputError as error:
            if ctx.params["debug"]:
                raise
            _fail(str(error), EXIT_BAD_INPUT)
        except BrokenPipeError:
            raise  # whoever read the output has gone, typer ends quietly
        except Exception as error:
            if ctx.params["debug"] or hasattr(error, "exit_code") or isinstance(error, typer.Abort):
                raise
            _fail(
                f"internal failure, {type(error).__name__}: {error} "
                "('tensegrity --debug COMMAND ...' shows where)",
                EXIT_INTERNAL,
            )


def _fail(message: str, code: int) -> None:
    err.print(f"error: {' '.join(message.split())}", style="red", markup=False)
    sys.exit(code)
