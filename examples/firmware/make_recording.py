"""Write the recording that the replay is linked with: a simulated prism that rolls 2 m.

    python make_recording.py recording.bin

The layout is that of ``replay/recording.hpp``: a header with the counts, then the IMU samples, the
cable samples and the contact flags, little-endian. Values are single precision, as an onboard
driver delivers them: what the replay computes in double precision differs from single precision
by arithmetic alone, not by input.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from tensegrity.sequence import Sequence
from tensegrity.simulation import SimulationOptions, simulate

MAGIC = b"prism\0\0\1"
HEADER = np.dtype(
    [("magic", "S8"), ("imu", "<u4"), ("cables", "<u4"), ("contacts", "<u4"), ("zero", "<u4")]
)
IMU = np.dtype([("t", "<i8"), ("gyro", "<f4", 3), ("accel", "<f4", 3)])
CABLES = np.dtype([("t", "<i8"), ("lengths", "<f4", 9), ("zero", "<u4")])
CONTACTS = np.dtype([("t", "<i8"), ("flags", "u1", 6), ("zero", "u1", 2)])


def table(dtype: np.dtype, **columns: np.ndarray) -> bytes:
    """Rows of ``dtype``; what is not given is zero."""
    rows = np.zeros(len(columns["t"]), dtype)
    for name, values in columns.items():
        rows[name] = values
    return rows.tobytes()


def encode(sequence: Sequence) -> bytes:
    """The recording as the replay reads it: IMU of the base rod, cables and contact flags."""
    imu, cables, contacts = sequence.imu, sequence.cables, sequence.contacts
    assert contacts is not None  # simulated robots feel their contacts
    header = np.zeros(1, HEADER)
    header["magic"] = MAGIC
    header["imu"], header["cables"] = len(imu.t_ns), len(cables.t_ns)
    header["contacts"] = len(contacts.t_ns)
    return (
        header.tobytes()
        + table(IMU, t=imu.t_ns, gyro=imu.gyro, accel=imu.accel)
        + table(CABLES, t=cables.t_ns, lengths=cables.lengths)
        + table(CONTACTS, t=contacts.t_ns, flags=contacts.flags)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    # The estimator starts after two still seconds.
    sequence = simulate(
        "forward", SimulationOptions(path_length=2.0, still_start=2.5, still_end=1.0)
    )
    data = encode(sequence)
    out.parent.mkdir(parents=True, exist_ok=True)
    # An unchanged recording keeps its time stamp, and nothing is linked anew.
    if not out.exists() or out.read_bytes() != data:
        out.write_bytes(data)
    print(f"{out}: {sequence.duration_s:.1f} s, {len(data) / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
