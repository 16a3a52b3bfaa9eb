"""From a recording to figures: read, estimate by both methods, evaluate, draw.

    python 02_recording.py [RECORDING]

Without a recording, one metre of rolling is simulated and written to `rolling/` first.
"""

import sys
from pathlib import Path

import tensegrity
from tensegrity.evaluation import compare, measure
from tensegrity.plotting import save_figures
from tensegrity.simulation import SimulationOptions, simulate

if len(sys.argv) > 1:
    recording = Path(sys.argv[1])
else:
    recording = Path("rolling")
    simulated = simulate("forward", SimulationOptions(seed=1, path_length=1.0))
    tensegrity.sequence.write(simulated, recording, overwrite=True)

sequence = tensegrity.sequence.read(recording)
print(f"{sequence.name}: {sequence.duration_s:.1f} s, {len(sequence.imu.t_ns)} IMU samples")

comparisons = {}
for method in ("paper", "full"):
    trajectory = tensegrity.estimate(sequence, config=method)
    comparisons[method] = compare(trajectory, sequence)  # aligned at the still start, same stamps
    metrics = measure(comparisons[method], trajectory.runtime_s)
    print(
        f"{method}: drift {metrics.final_drift_m:.3f} m after {metrics.path_length_m:.2f} m, "
        f"{metrics.real_time_factor:.0f} times real time"
    )

for figure in save_figures(comparisons, "figures"):
    print(figure)
