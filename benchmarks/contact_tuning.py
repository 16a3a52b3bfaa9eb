"""Find the contact detector's parameters by maximum likelihood, and measure how good they are.

    python benchmarks/contact_tuning.py

Simulates recordings, perturbs the true endcaps as an estimator does, and minimises the mean
negative log likelihood of the true contact flags (normal force > 1 N) under the probabilities that
the C++ detector gives while it runs over the recordings. Prints the parameters as they stand in
cpp/include/tensegrity/contact/detector.hpp, then precision and recall on seeds that had no part in
the fit, and on recordings of another simulator if they are there. The same for two detectors that
lack an idea, each fitted as well: one without the load share, one without memory.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.signal import lfilter

import tensegrity.sequence
from tensegrity import _core, simulation

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MANOEUVRES = ("forward", "backward", "left-turn", "right-turn")
FIT_SEEDS = range(100, 105)
HELD_OUT_SEEDS = range(105, 108)  # seeds from 0 are for reported results and are never used here
RECORDINGS = Path(__file__).parents[2] / "shared" / "data" / "prism3"

# What an estimator does to the endcaps: per coordinate, a first-order Gauss-Markov error.
SHAPE_STD = 0.025 / np.sqrt(3)  # [m], 25 mm in space
SHAPE_TIME = 0.3  # [s]
TILT_STD = np.deg2rad(1.0)
TILT_TIME = 3.0  # [s]

# Every sample decides for itself: the process forgets between samples, evidence is new at once.
NO_MEMORY = {"touch_down_rate": 1e6, "lift_off_rate": 1e6, "evidence_time": 1e-6}


@dataclass(frozen=True)
class Recording:
    """Endcap centres (N, 6, 3) in the world [m], the endcaps that are loaded (N, 6), and the time
    between samples [s]."""

    endcaps: FloatArray
    loaded: BoolArray
    dt: float


def recording(sequence: tensegrity.sequence.Sequence) -> Recording:
    """The truth of a sequence at the stamps of its cables, where the estimator asks."""
    if sequence.endcaps is None or sequence.contacts is None:
        raise SystemExit(f"{sequence.name}: tuning needs true endcaps and contacts")
    t = sequence.cables.t_ns
    at = np.searchsorted(sequence.endcaps.t_ns, t).clip(max=len(sequence.endcaps.t_ns) - 1)
    flags = np.searchsorted(sequence.contacts.t_ns, t).clip(max=len(sequence.contacts.t_ns) - 1)
    return Recording(
        endcaps=sequence.endcaps.position[at],
        loaded=sequence.contacts.flags[flags],
        dt=float(np.median(np.diff(t))) * 1e-9,
    )


def gauss_markov(
    shape: tuple[int, ...], std: float, time: float, dt: float, random: np.random.Generator
) -> FloatArray:
    """First-order Gauss-Markov noise along the first axis."""
    keep = np.exp(-dt / time)
    white = random.normal(0.0, std * np.sqrt(1 - keep**2), shape)
    white[0] /= np.sqrt(1 - keep**2)
    return lfilter([1.0], [1.0, -keep], white, axis=0)


def perturbed(truth: Recording, random: np.random.Generator, scale: float = 1.0) -> Recording:
    """The endcaps as an estimator has them; ``scale`` multiplies its errors."""
    samples = len(truth.endcaps)
    q = truth.endcaps - truth.endcaps.mean(axis=1, keepdims=True)
    tilt = np.zeros((samples, 1, 3))
    tilt[:, 0, :2] = gauss_markov((samples, 2), scale * TILT_STD, TILT_TIME, truth.dt, random)
    q = q + np.cross(tilt, q)
    q += gauss_markov(q.shape, scale * SHAPE_STD, SHAPE_TIME, truth.dt, random)
    return Recording(q, truth.loaded, truth.dt)


# Brings the optimiser's variables to one size, which its line search needs.
SCALE = np.array([1.0, 1.0, 1.0, 100.0, 10.0, 1.0, 1.0, 1.0])


def parameters(x: FloatArray) -> _core.ContactDetectorParameters:
    """From the vector that the optimiser sees; rates and times are logarithms there."""
    x = x * SCALE
    p = _core.ContactDetectorParameters()
    p.intercept = list(x[:3])
    p.height_weight, p.share_weight = x[3:5]
    p.touch_down_rate, p.lift_off_rate, p.evidence_time = np.exp(x[5:])
    return p


def vector(p: _core.ContactDetectorParameters) -> FloatArray:
    """Inverse of :func:`parameters`."""
    logs = np.log([p.touch_down_rate, p.lift_off_rate, p.evidence_time])
    return np.concatenate([p.intercept, [p.height_weight, p.share_weight], logs]) / SCALE


def probabilities(p: _core.ContactDetectorParameters, r: Recording) -> FloatArray:
    """(N, 6) from a detector that starts afresh."""
    return _core.ContactDetector(_core.Prism(), p).probabilities(r.endcaps, r.dt)


def negative_log_likelihood(x: FloatArray, recordings: Sequence[Recording]) -> float:
    """Mean over all samples and endcaps."""
    p = parameters(x)
    terms = []
    for r in recordings:
        loaded = probabilities(p, r)
        terms.append(-np.log(np.where(r.loaded, loaded, 1 - loaded)))
    return float(np.concatenate(terms).mean())


def fit(
    recordings: Sequence[Recording], fixed: Mapping[str, float] | None = None
) -> _core.ContactDetectorParameters:
    """Parameters of the greatest likelihood, some of them held at ``fixed`` values."""
    p = _core.ContactDetectorParameters()
    defaults = vector(p)
    for name, value in (fixed or {}).items():
        setattr(p, name, value)
    start = vector(p)
    free = defaults == start

    def complete(x: FloatArray) -> FloatArray:
        full = start.copy()
        full[free] = x
        return full

    result = minimize(
        lambda x: negative_log_likelihood(complete(x), recordings), start[free], method="L-BFGS-B"
    )
    return parameters(complete(result.x))


def precision_recall(p: _core.ContactDetectorParameters, recordings: Iterable[Recording]) -> str:
    """``precision / recall`` over all endcaps of all recordings."""
    true_positives = positives = loaded = 0
    for r in recordings:
        flags = probabilities(p, r) > 0.5
        true_positives += np.sum(flags & r.loaded)
        positives += np.sum(flags)
        loaded += np.sum(r.loaded)
    return f"{true_positives / positives:.3f} / {true_positives / loaded:.3f}"


def simulated(seeds: Iterable[int]) -> list[Recording]:
    """All manoeuvres with each of the seeds."""
    return [
        recording(simulation.simulate(name, simulation.SimulationOptions(seed=seed)))
        for seed in seeds
        for name in MANOEUVRES
    ]


def print_parameters(p: _core.ContactDetectorParameters) -> None:
    print("intercept        ", ", ".join(f"{value:.2f}" for value in p.intercept))
    for name in ("height_weight", "share_weight"):
        print(f"{name:<17} {getattr(p, name):.1f}")
    for name in ("touch_down_rate", "lift_off_rate", "evidence_time"):
        print(f"{name:<17} {getattr(p, name):.3f}")


def main() -> None:
    cli = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    cli.add_argument("--evaluate", action="store_true", help="measure the defaults, fit nothing")
    arguments = cli.parse_args()

    detectors = {"defaults": _core.ContactDetectorParameters()}
    if not arguments.evaluate:
        random = np.random.default_rng(1)
        recordings = [perturbed(r, random) for r in simulated(FIT_SEEDS)]
        detectors["fitted"] = fit(recordings)
        print_parameters(detectors["fitted"])
        detectors["no load share"] = fit(recordings, {"share_weight": 0.0})
        detectors["no memory"] = fit(recordings, NO_MEMORY)

    sets = {"held-out seeds": simulated(HELD_OUT_SEEDS)}
    for path in sorted(RECORDINGS.glob("*/endcaps.csv")):
        sets[f"second, {path.parent.name}"] = [recording(tensegrity.sequence.read(path.parent))]
    print("\nprecision / recall of", ", ".join(detectors))
    for name, truths in sets.items():
        for scale in (0.0, 1.0, 2.0):
            random = np.random.default_rng(2)
            estimated = [perturbed(r, random, scale) for r in truths]
            row = "   ".join(precision_recall(p, estimated) for p in detectors.values())
            print(f"{name:<16} errors x {scale:.0f}   {row}")


if __name__ == "__main__":
    main()
