"""Where a command may write."""

from __future__ import annotations

from pathlib import Path

from tensegrity.errors import InputError


def check_output(directory: Path, *, marker: str, overwrite: bool) -> None:
    """Refuse a directory that must not be written before work is spent on what goes there.

    An empty or missing directory is free. One that holds the file ``marker`` is replaced with
    ``overwrite``; any other is nobody's to replace.
    """
    if directory.exists() and not directory.is_dir():
        raise InputError("is a file, a directory is needed", file=directory)
    if not directory.is_dir() or not any(directory.iterdir()):
        return
    if not (directory / marker).is_file():
        raise InputError(
            f"is not empty and holds no {marker}: it will not be overwritten",
            file=directory,
            hint="name another directory with --out",
        )
    if not overwrite:
        raise InputError(
            "exists already",
            file=directory,
            hint="add --overwrite, or name another directory with --out",
        )
