"""Where a ranging robot was: simulate SUPERball, calibrate its ranges, track it.

    python 05_ranging.py

Real recordings work alike: ``read_sequence("recording/")`` instead of the simulation.
"""

from tensegrity.ranging.calibration import calibrate_ranges
from tensegrity.simulation.superball import SuperballOptions, simulate_superball
from tensegrity.tracking import track, track_errors

sequence = simulate_superball("rolling", SuperballOptions(seed=1, duration=12.0))

# Raw ranges are metres too long: offsets from the moving robot, anchors surveyed.
calibration = calibrate_ranges(sequence.ranges, sequence.anchors)
print(f"offsets: {calibration.offsets.offset_m.mean():.3f} m on average; {calibration.verdict}")

result = track(sequence, offsets=calibration.offsets)
print(f"{len(result)} states; standing on {result.faces[-1]}")

errors = track_errors(result, sequence.endcaps)
print(f"centre of mass within {errors.centre_of_mass_rmse:.2f} m")
print(f"ends of the rods within {errors.node_rmse:.2f} m")
