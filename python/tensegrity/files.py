"""Reading text with located errors, writing files and directories all at once or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tensegrity.errors import InputError


def read_text(path: Path) -> str:
    """The content of a UTF-8 file (a byte order mark is dropped).

    Raises :class:`InputError` with the file, and with the line of the first undecodable byte.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError("no such file", file=path, hint="check the path") from None
    except IsADirectoryError:
        raise InputError("is a directory, a file is expected", file=path) from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"not text: byte 0x{content[error.start]:02x} is not UTF-8",
            file=path,
            line=content.count(b"\n", 0, error.start) + 1,
            hint="is this a binary file?",
        ) from None
    nul = text.find("\0")
    if nul >= 0:
        raise InputError(
            "not text: it contains a NUL character",
            file=path,
            line=text.count("\n", 0, nul) + 1,
            hint="is this a binary file?",
        )
    return text


def check_directory(path: Path, *, marker: str, overwrite: bool = False) -> None:
    """Refuse a directory that must not be written, before work is spent on what goes there.

    An empty or missing directory is free. A non-empty one is replaced only with ``overwrite``, and
    only when it holds the file ``marker``, so that a mistyped path never costs anybody their home
    directory.
    """
    if path.is_file():
        raise InputError("is a file, a directory is expected", file=path)
    if not path.is_dir() or not any(path.iterdir()):
        return
    if not (path / marker).is_file():
        raise InputError(
            f"is not empty and holds no {marker}: it will not be overwritten",
            file=path,
            hint="choose another directory",
        )
    if not overwrite:
        raise InputError(
            "exists and is not empty",
            file=path,
            hint="add --overwrite (in Python overwrite=True), or choose another directory",
        )


def check_file(path: Path, *, overwrite: bool = False) -> None:
    """Refuse a file that cannot or must not be written, before work is spent on its content."""
    if path.is_dir():
        raise InputError("is a directory, a file is needed", file=path)
    if not path.parent.is_dir():
        raise InputError("its directory does not exist", file=path, hint="create it first")
    if path.exists() and not overwrite:
        raise InputError(
            "exists already",
            file=path,
            hint="add --overwrite (in Python overwrite=True), or choose another file",
        )


def write_file(path: Path, content: str, *, overwrite: bool = False) -> None:
    """A text file that appears at ``path`` complete or not at all (:func:`check_file`)."""
    check_file(path, overwrite=overwrite)
    with tempfile.TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as staging:
        new = Path(staging) / "new"
        new.write_text(content, encoding="utf-8")
        new.replace(path)


@contextmanager
def new_directory(path: Path, *, marker: str, overwrite: bool = False) -> Iterator[Path]:
    """A directory that appears at ``path`` complete or not at all.

    Yields an empty temporary directory next to ``path`` to write into. When the block ends it takes
    the place of ``path``; when the block raises it is removed and ``path`` stays as it was.

    What is there already is treated as :func:`check_directory` says.
    """
    check_directory(path, marker=marker, overwrite=overwrite)
    target = path.resolve()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    except OSError as error:
        raise InputError(f"cannot be created: {error.strerror}", file=path) from None
    try:
        content = staging / "new"
        content.mkdir()
        yield content
        old = staging / "old"
        try:
            if target.exists():
                target.rename(old)
            content.rename(target)
        except BaseException:
            if old.exists() and not target.exists():
                old.rename(target)
            raise
    finally:
        shutil.rmtree(staging)
