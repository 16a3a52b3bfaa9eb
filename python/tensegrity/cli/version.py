"""``tensegrity version``."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version

from tensegrity.cli.console import out


def version() -> None:
    """Print the version of this package and of Python."""
    try:
        number = installed_version("tensegrity-estimation")
    except PackageNotFoundError:
        number = "(not installed)"
    out.print(f"tensegrity {number}, Python {platform.python_version()}")
