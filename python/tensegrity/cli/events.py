"""What the estimator had to cope with, in words."""

from __future__ import annotations

from tensegrity.cli.console import err
from tensegrity.trajectory import Trajectory

_EVENTS = {
    "imu_dropped": "IMU samples not usable: not finite, impossible, or out of order",
    "imu_gaps": "gaps in the IMU bridged",
    "cables_dropped": "cable samples not usable: out of order or too late",
    "contacts_dropped": "contact samples not usable: out of order or too late",
    "shape_failures": "cable samples that no shape of this robot fits",
    "contacts_rejected": "corrections by contacts refused, the feet stand anew",
    "cables_rejected": "single cable lengths refused: check that sensor",
    "spin_resets": "times the spin of the shape could not be true and was widened",
    "velocity_resets": "times the velocity could not be true and was widened",
    "terrain_mismatches": "the ground was declared flat but slopes: set 'settings.terrain: slope'",
}


def report_events(trajectory: Trajectory) -> None:
    """Print the counters of the estimator's health that are not zero, one line each."""
    for name, counts in trajectory.health.items():
        if len(counts) and counts[-1] > 0:
            err.print(f"{name}: {counts[-1]} ({_EVENTS[name]})", markup=False)
