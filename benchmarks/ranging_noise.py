"""Process noise of the ranging estimator: errors and consistency over simulated recordings.

    python benchmarks/ranging_noise.py [SEED ...]

Prints, for every pair of accelerations tried, the errors of the centre of mass and of the ends of
the rods, and the median NEES of the centre of mass (per degree of freedom; 0.79 for an exact
covariance). The packaged values come from the seeds 100 and 101, which nothing else reports on.
"""

from __future__ import annotations

import sys

import numpy as np

from tensegrity.ranging.calibration import calibrate_ranges
from tensegrity.ranging.calibration_model import CalibrationModel
from tensegrity.simulation.superball import SuperballOptions, simulate_superball
from tensegrity.tracking import FilterSettings, TrackSettings, track, track_errors

ACCELERATIONS = ((3.0, 1.5), (1.0, 1.5), (1.0, 0.5), (0.5, 0.5), (0.5, 0.25), (0.25, 0.25))
SETTLED_S = 5.0


def main() -> None:
    for seed in [int(text) for text in sys.argv[1:]] or [100, 101]:
        options = SuperballOptions(seed=seed)
        recordings = [simulate_superball(kind, options) for kind in ("rolling", "local")]
        calibration = calibrate_ranges(
            recordings[0].ranges, recordings[0].anchors, CalibrationModel(offsets="pair")
        )
        offset_std = float(np.median(calibration.offset_std))
        for recording in recordings:
            for body, node in ACCELERATIONS:
                chosen = FilterSettings()
                chosen.body_acceleration, chosen.node_acceleration = body, node
                result = track(
                    recording,
                    offsets=calibration.offsets,
                    settings=TrackSettings(filter=chosen, offset_std=offset_std),
                )
                assert recording.endcaps is not None  # a simulation knows the truth
                errors = track_errors(result, recording.endcaps)
                late = (errors.t_ns - recording.ranges.t_ns[0]) * 1e-9 >= SETTLED_S
                print(
                    f"{recording.name}: body {body:g}, node {node:g}: centre of mass "
                    f"{np.sqrt(np.mean(errors.centre_of_mass[late] ** 2)):.3f} m, ends "
                    f"{np.sqrt(np.mean(errors.nodes[late] ** 2)):.3f} m, "
                    f"NEES {np.median(errors.nees[late]) / 3:.2f}"
                )


if __name__ == "__main__":
    main()
