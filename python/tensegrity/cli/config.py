"""``tensegrity config``."""

from __future__ import annotations

from typing import Annotated

import typer

from tensegrity.cli.console import out
from tensegrity.config import FilterConfig


def config(
    source: Annotated[
        str, typer.Argument(metavar="NAME|FILE", help="Packaged profile or your YAML file.")
    ] = "full",
) -> None:
    """Print the effective filter configuration, every key with its meaning and unit."""
    out.print(FilterConfig.load(source).to_yaml(), end="", markup=False)
