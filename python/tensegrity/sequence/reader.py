"""Choice of the reader for a recording: the one place that knows all formats."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from tensegrity.errors import InputError
from tensegrity.robots import Robot
from tensegrity.sequence.directory import DirectoryReader
from tensegrity.sequence.sequence import Sequence


class SequenceReader(Protocol):
    """Reads recordings of one format."""

    def accepts(self, path: Path) -> bool:
        """Whether the existing ``path`` is a recording of this format."""

    def read(self, path: Path, robot: Robot | None) -> Sequence:
        """The recording; ``robot`` takes the place of the robot it names.

        Raises :class:`InputError`.
        """


READERS: tuple[SequenceReader, ...] = (DirectoryReader(),)


def read(path: str | Path, *, robot: Robot | None = None) -> Sequence:
    """Read a recording. ``robot`` takes the place of the robot that the recording names.

    Raises :class:`InputError` with file, line and field for whatever is wrong with it.
    """
    path = Path(path)
    if not path.exists():
        raise InputError("no such sequence", file=path, hint="check the path")
    for reader in READERS:
        if reader.accepts(path):
            return reader.read(path, robot)
    raise InputError(
        "is not a sequence", file=path, hint="a sequence is a directory with imu.csv and cables.csv"
    )
