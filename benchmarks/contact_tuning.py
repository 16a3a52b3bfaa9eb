"""Find the contact detector's parameters by maximum likelihood, and measure how good they are.

    python benchmarks/contact_tuning.py

Simulates recordings, perturbs the true endcaps as an estimator does, and minimises the mean
negative log likelihood of the true contact flags (normal force > 1 N) under the probabilities that
the C++ detector gives while it runs over the recordings. Prints the parameters as they stand in
cpp/include/tensegrity/contact/detector.hpp, then precision and recall on seeds that had no part in
the fit, and on recordings of another simulator if they are there.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.signal import lfilter

import tensegrity.sequence
from tensegrity import simulation
from tensegrity._core import ContactDetector, ContactDetectorParameters, Prism

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

PROBABILITY_FLOOR = 1e-6  # the detector never goes below


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


def parameters(x: FloatArray) -> ContactDetectorParameters:
    """From the vector that the optimiser sees; rates and times are logarithms there."""
    x = x * SCALE
    p = ContactDetectorParameters()
    p.intercept = list(x[:3])
    p.height_weight, p.share_weight = x[3:5]
    p.touch_down_rate, p.lift_off_rate, p.evidence_time = np.exp(x[5:])
    return p


def vector(p: ContactDetectorParameters) -> FloatArray:
    """Inverse of :func:`parameters`."""
    logs = np.log([p.touch_down_rate, p.lift_off_rate, p.evidence_time])
    return np.concatenate([p.intercept, [p.height_weight, p.share_weight], logs]) / SCALE


def probabilities(p: ContactDetectorParameters, r: Recording) -> FloatArray:
    """(N, 6) from a detector that starts afresh."""
    return ContactDetector(Prism(), p).probabilities(r.endcaps, r.dt)


def negative_log_likelihood(x: FloatArray, recordings: Sequence[Recording]) -> float:
    """Mean over all samples and endcaps."""
    p = parameters(x)
    terms = []
    for r in recordings:
        loaded = probabilities(p, r)
        terms.append(-np.log(np.where(r.loaded, loaded, 1 - loaded).clip(min=PROBABILITY_FLOOR)))
    return float(np.concatenate(terms).mean())


def fit(recordings: Sequence[Recording]) -> tuple[ContactDetectorParameters, float]:
    """Parameters of the greatest likelihood, and the mean negative log likelihood."""
    start = vector(ContactDetectorParameters())
    result = minimize(negative_log_likelihood, start, args=(recordings,), method="L-BFGS-B")
    return parameters(result.x), float(result.fun)


def precision_recall(p: ContactDetectorParameters, recordings: Iterable[Recording]) -> str:
    """One line of a table."""
    counts = np.zeros(3)
    for r in recordings:
        flags = probabilities(p, r) > 0.5
        counts += [np.sum(flags & r.loaded), np.sum(flags), np.sum(r.loaded)]
    return f"precision {counts[0] / counts[1]:.3f}  recall {counts[0] / counts[2]:.3f}"


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    cli.add_argument("--evaluate", action="store_true", help="measure the defaults, fit nothing")
    arguments = cli.parse_args()

    def simulated(seeds: Iterable[int]) -> list[Recording]:
        return [
            recording(simulation.simulate(name, simulation.SimulationOptions(seed=seed)))
            for seed in seeds
            for name in MANOEUVRES
        ]

    p = ContactDetectorParameters()
    if not arguments.evaluate:
        random = np.random.default_rng(1)
        p, loss = fit([perturbed(r, random) for r in simulated(FIT_SEEDS)])
        print(f"mean negative log likelihood {loss:.5f}")
        print("intercept      ", ", ".join(f"{value:.2f}" for value in p.intercept))
        for name in ("height_weight", "share_weight"):
            print(f"{name:<15}", f"{getattr(p, name):.2f}")
        for name in ("touch_down_rate", "lift_off_rate", "evidence_time"):
            print(f"{name:<15}", f"{getattr(p, name):.3f}")

    sets = {"held-out seeds": simulated(HELD_OUT_SEEDS)}
    for path in sorted(RECORDINGS.glob("*/endcaps.csv")):
        name = path.parent.name
        sets[f"other simulator, {name}"] = [recording(tensegrity.sequence.read(path.parent))]
    for name, recordings in sets.items():
        for scale in (0.0, 1.0, 2.0):
            random = np.random.default_rng(2)
            estimated = [perturbed(r, random, scale) for r in recordings]
            print(f"{name:<25} errors x {scale:.0f}   {precision_recall(p, estimated)}")


if __name__ == "__main__":
    main()
