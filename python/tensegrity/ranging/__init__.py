"""Ultra-wideband ranging: recordings of raw ranges, and the calibration that they allow."""

from tensegrity.ranging.recording import (
    Anchors,
    FloorTruth,
    InternalRanges,
    Offsets,
    RangeRecording,
    read_anchors,
    read_floor_truth,
    read_internal_ranges,
    read_offsets,
    read_ranges,
    write_anchors,
    write_floor_truth,
    write_internal_ranges,
    write_offsets,
    write_ranges,
)

__all__ = [
    "Anchors",
    "FloorTruth",
    "InternalRanges",
    "Offsets",
    "RangeRecording",
    "read_anchors",
    "read_floor_truth",
    "read_internal_ranges",
    "read_offsets",
    "read_ranges",
    "write_anchors",
    "write_floor_truth",
    "write_internal_ranges",
    "write_offsets",
    "write_ranges",
]
