"""Whole recordings from NumPy arrays, sample by sample, and what a call from Python costs.

    python benchmarks/python/replay.py ../shared/data/prism3/right

A call whose stamp the estimator refuses does nothing but cross the boundary, for C++ refuses in a
few nanoseconds: its time is what a call from Python costs beside the work it asks for.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from timing import Case, hand_over, measure

from tensegrity import PrismEstimator
from tensegrity._core import Status
from tensegrity.config import FilterConfig
from tensegrity.sequence import Sequence, read

METHODS = ("paper", "full")


def replays(sequence: Sequence) -> list[Case]:
    """The recording at once, a call standing for one IMU sample with what is due at its stamp."""
    contacts = sequence.contacts
    arrays = (
        sequence.imu.t_ns,
        sequence.imu.gyro,
        sequence.imu.accel,
        sequence.cables.t_ns,
        sequence.cables.lengths,
        *(() if contacts is None else (contacts.t_ns, contacts.flags)),
    )
    return [
        Case(
            f"python/replay/{method}/{sequence.name}",
            "make(robot, config).replay(*arrays)",
            {
                "make": PrismEstimator,
                "robot": sequence.robot,
                "config": FilterConfig.load(method),
                "arrays": arrays,
            },
            calls=len(sequence.imu.t_ns),
        )
        for method in METHODS
    ]


def stream(estimator: PrismEstimator, samples: list[tuple], contacts: dict, cables: dict) -> None:
    """The same sample by sample."""
    for t, gyro, accel in samples:
        estimator.imu(t, gyro, accel)
        if t in contacts:
            estimator.contacts(t, contacts[t])
        if t in cables:
            estimator.cables(t, cables[t])


def streams(sequence: Sequence) -> list[Case]:
    """The recording sample by sample; contacts and cables at stamps of the IMU."""
    imu, contacts = sequence.imu, sequence.contacts
    samples = list(zip(imu.t_ns.tolist(), imu.gyro, imu.accel, strict=True))
    flags = (
        {} if contacts is None else dict(zip(contacts.t_ns.tolist(), contacts.flags, strict=True))
    )
    lengths = dict(zip(sequence.cables.t_ns.tolist(), sequence.cables.lengths, strict=True))
    return [
        Case(
            f"python/stream/{method}/{sequence.name}",
            "stream(make(robot, config), samples, flags, lengths)",
            {
                "stream": stream,
                "make": PrismEstimator,
                "robot": sequence.robot,
                "config": FilterConfig.load(method),
                "samples": samples,
                "flags": flags,
                "lengths": lengths,
            },
            calls=len(samples),
        )
        for method in METHODS
    ]


def refused() -> list[Case]:
    """Calls that are refused for their stamp."""
    estimator, t = PrismEstimator("prism3", "full"), 10**9
    calls = {
        "imu": (np.zeros(3), np.array([0.0, 0.0, 9.81])),
        "cables": (np.full(9, 0.98),),
        "contacts": (np.array([True, False, False, True, False, True]),),
    }
    cases = []
    for name, arguments in calls.items():
        call = getattr(estimator, name)
        call(t, *arguments)
        if call(t, *arguments) != Status.DUPLICATE:
            raise RuntimeError(f"{name}: a second sample of the same stamp was not refused")
        names = {"call": call, "t": t} | {f"a{k}": a for k, a in enumerate(arguments)}
        parameters = ", ".join(["t", *(f"a{k}" for k in range(len(arguments)))])
        cases.append(Case(f"python/call/{name}", f"call({parameters})", names))
    cases.append(Case("python/call/state", "estimator.state", {"estimator": estimator}))
    return cases


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recordings", nargs="+", type=Path)
    arguments = parser.parse_args()
    cases = refused()
    for path in arguments.recordings:
        sequence = read(path)
        cases += replays(sequence) + streams(sequence)
    hand_over(measure(cases))


if __name__ == "__main__":
    main()
