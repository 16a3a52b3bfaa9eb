"""The subcommands together, and what becomes of their errors."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from tensegrity.cli import compare, config, demo, estimate, evaluate, simulate, version
from tensegrity.cli.console import err
from tensegrity.errors import InputError

EXIT_INTERNAL = 1
EXIT_BAD_INPUT = 2


class _Group(TyperGroup):
    """Turns every error into one line on stderr and an exit code."""

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


app = typer.Typer(
    name="tensegrity",
    cls=_Group,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich's boxes cut long option names off
    help="State estimation for tensegrity robots: simulate, estimate, evaluate, compare.",
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


for function, summary, example in (
    (demo.demo, "Simulate, estimate, evaluate and draw, all at once.", "demo --out demo"),
    (
        simulate.simulate,
        "Record a simulated robot.",
        "simulate right-turn --out recordings/right --seed 3",
    ),
    (
        estimate.estimate,
        "Estimate shape and pose from a recording.",
        "estimate recordings/right --method full --out runs/right",
    ),
    (evaluate.evaluate, "Compare a run with the truth.", "evaluate runs/right"),
    (
        compare.compare,
        "Print runs side by side.",
        "compare runs/right-paper runs/right-full --figures figures",
    ),
    (config.config, "Print a filter configuration.", "config paper > my.yaml"),
    (version.version, "Print the version.", "version"),
):
    app.command(short_help=summary, epilog=f"Example: tensegrity {example}")(function)


def main() -> None:
    """Entry point of the ``tensegrity`` command."""
    app()
