"""``tensegrity version``."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version

from tensegrity.cli.console import out


def version() -> None:
    """Print the version of this package and of Python."""
    out.print(f"tensegrity {package_version()}, Python {platform.python_version()}")


def package_version() -> str:
    """The version of this package."""
    try:
        return installed_version("tensegrity-estimation")
    except PackageNotFoundError:
        return "not installed"  # used from a source tree
