"""What ranging among many modules costs, pairwise and with broadcasts, and what its ranges err by.

python benchmarks/ranging_schedules.py
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging.schedules import Air, Schedule, broadcast, cost, pairwise, simulate_round
from tensegrity.ranging.two_way import Clocks

MODULES = (2, 4, 8, 12, 20, 22, 30, 40)
ERRORS_AMONG = 20
ROUNDS = 40
START_S = 3.0
NOISE_S = 0.16e-9
HALL_M = 6.0  # half its width

# Drift [1], aging [1/s], noise of receive stamps [s], speed of modules [m/s].
CONDITIONS: dict[str, tuple[float, float, float, float]] = {
    "equal clocks": (0.0, 0.0, 0.0, 0.0),
    "drift up to 20 ppm": (20e-6, 0.0, 0.0, 0.0),
    "drift up to 40 ppm": (40e-6, 0.0, 0.0, 0.0),
    "20 ppm, aging 0.1 ppm/s": (20e-6, 1e-7, 0.0, 0.0),
    "20 ppm, aging 1 ppm/s": (20e-6, 1e-6, 0.0, 0.0),
    "20 ppm, modules at 1 m/s": (20e-6, 0.0, 0.0, 1.0),
    "20 ppm, modules at 5 m/s": (20e-6, 0.0, 0.0, 5.0),
    "20 ppm, stamps 0.16 ns": (20e-6, 0.0, NOISE_S, 0.0),
    "all: 0.1 ppm/s, 1 m/s, 0.16 ns": (20e-6, 1e-7, NOISE_S, 1.0),
}


def main() -> None:
    print("| modules | pairs | | packets | ranges | round [ms] | rounds [1/s] | exchange [ms] |")
    print("|--:|--:|---|--:|--:|--:|--:|--:|")
    for modules in MODULES:
        for schedule in (pairwise(modules), broadcast(modules)):
            this = cost(schedule)
            print(
                f"| {modules} | {modules * (modules - 1) // 2} | {this.kind} | {this.packets} | "
                f"{this.ranges} | {1e3 * this.duration_s:.0f} | {this.rate_hz:.1f} | "
                f"{1e3 * this.longest_exchange_s:.0f} |"
            )
    print(f"\nErrors among {ERRORS_AMONG} modules, rms / largest [mm]:\n")
    print("| | pairwise | broadcast |\n|---|--:|--:|")
    for name, condition in CONDITIONS.items():
        cells = []
        for schedule in (pairwise(ERRORS_AMONG), broadcast(ERRORS_AMONG)):
            error = 1e3 * errors(schedule, *condition)
            cells.append(f"{np.sqrt(np.mean(error**2)):.1f} / {np.abs(error).max():.0f}")
        print(f"| {name} | {cells[0]} | {cells[1]} |")


def errors(
    schedule: Schedule, drift: float, aging: float, noise_s: float, speed: float
) -> NDArray[np.float64]:
    """Of the ranges of many rounds against the distance at the response [m]."""
    rng = np.random.default_rng(0)
    count = schedule.modules
    air = Air(np.zeros((count, count)), noise_s)
    collected = []
    for _ in range(ROUNDS):
        positions = rng.uniform(-HALL_M, HALL_M, (count, 3))
        velocities = speed * rng.normal(0, 1, (count, 3))
        clocks = Clocks.draw(count, rng, drift, aging)
        done = simulate_round(schedule, clocks, positions, velocities, air, rng, START_S)
        line = positions[schedule.starter] - positions[schedule.responder]
        relative = velocities[schedule.starter] - velocities[schedule.responder]
        line += relative * (done.response_s - START_S)[:, None]
        collected.append(done.ranges().range_m - np.linalg.norm(line, axis=1))
    return np.concatenate(collected)


if __name__ == "__main__":
    main()
