"""How well the `full` method knows which endcaps carry load, in the loop.

    python benchmarks/contact_loads.py [--seeds 0-1] [--force 20]

Precision and recall over endcaps and samples, with and without contact flags: an endcap is called
loaded when the share of the weight that the estimate gives it exceeds the force; the truth is the
simulator's normal force.
"""

from __future__ import annotations

import argparse
import dataclasses

import numpy as np
from accuracy import seeds
from numpy.typing import NDArray

import tensegrity
from tensegrity.simulation import Manoeuvre, SimulationOptions, simulate_with_forces

GRAVITY = 9.81  # [m/s^2]


def counts(
    called: NDArray[np.bool_], loaded: NDArray[np.bool_]
) -> tuple[np.intp, np.intp, np.intp]:
    """True positives, false positives, false negatives."""
    return (called & loaded).sum(), (called & ~loaded).sum(), (~called & loaded).sum()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=seeds, default=seeds("0-1"))
    parser.add_argument("--force", type=float, default=20.0, help="[N]")
    args = parser.parse_args()
    totals = {"flags": np.zeros(3), "no flags": np.zeros(3)}
    for manoeuvre in Manoeuvre:
        for seed in args.seeds:
            sequence, forces = simulate_with_forces(manoeuvre, SimulationOptions(seed=seed))
            robot = sequence.robot
            weight = len(robot.rods) * robot.rod_mass * GRAVITY
            for name, contacts in (("flags", sequence.contacts), ("no flags", None)):
                trajectory = tensegrity.estimate(dataclasses.replace(sequence, contacts=contacts))
                rows = np.searchsorted(sequence.imu.t_ns, trajectory.t_ns)
                called = np.nan_to_num(trajectory.load_shares) * weight > args.force
                totals[name] += counts(called, forces[rows] > args.force)
    print("| | precision | recall |\n|---|--:|--:|")
    for name, (hits, false_alarms, misses) in totals.items():
        precision, recall = hits / (hits + false_alarms), hits / (hits + misses)
        print(f"| {name} | {100 * precision:.1f} % | {100 * recall:.1f} % |")


if __name__ == "__main__":
    main()
