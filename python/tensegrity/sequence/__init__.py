"""Recorded data: :class:`Sequence` in memory, :func:`read` and :func:`write`."""

from tensegrity.sequence.directory import write
from tensegrity.sequence.reader import READERS, SequenceReader, read
from tensegrity.sequence.sequence import (
    CableStream,
    ContactStream,
    EndcapStream,
    ImuStream,
    PoseStream,
    Sequence,
)

__all__ = [
    "READERS",
    "CableStream",
    "ContactStream",
    "EndcapStream",
    "ImuStream",
    "PoseStream",
    "Sequence",
    "SequenceReader",
    "read",
    "write",
]
