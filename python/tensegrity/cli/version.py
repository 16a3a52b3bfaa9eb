"""``tensegrity version``."""

from __future__ import annotations

import platform

from tensegrity import __version__
from tensegrity.cli.console import out


def version() -> None:
    """Print the version of this package and of Python."""
    out.print(f"tensegrity {__version__}, Python {platform.python_version()}")
