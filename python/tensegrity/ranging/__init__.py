"""Ultra-wideband ranging: recordings of raw ranges, and the calibration that they allow."""

from tensegrity.ranging.calibration import RangeCalibration, calibrate_ranges
from tensegrity.ranging.calibration_files import (
    Calibration,
    read_calibration,
    write_calibration,
)
from tensegrity.ranging.calibration_model import CalibrationModel
from tensegrity.ranging.prediction import prediction_errors
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
    "Calibration",
    "CalibrationModel",
    "FloorTruth",
    "InternalRanges",
    "Offsets",
    "RangeCalibration",
    "RangeRecording",
    "calibrate_ranges",
    "prediction_errors",
    "read_anchors",
    "read_calibration",
    "read_floor_truth",
    "read_internal_ranges",
    "read_offsets",
    "read_ranges",
    "write_anchors",
    "write_calibration",
    "write_floor_truth",
    "write_internal_ranges",
    "write_offsets",
    "write_ranges",
]
