"""The core is the one compiled for this processor, and what it computes does not depend on that."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tensegrity import _core

# What the psABI asks of x86-64-v3, as Linux names it.
V3 = {"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"}
WITHOUT_AVX2 = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2"}
# The undeformed robot is on the fold, where lengths fix the shape to the root of their precision:
# the paper's, which has only them, differs by as much as the solver's last step.
TOLERANCE = {"paper": 1e-3, "full": 1e-8}

ESTIMATE = """
import json
from dataclasses import replace

import numpy as np
from helpers.sequences import make_sequence
from tensegrity import _core
from tensegrity.estimation import estimate

sequence = make_sequence(5.0)
random = np.random.default_rng(0)
noisy = lambda x, std: x + std * random.standard_normal(x.shape)
imu = replace(
    sequence.imu, gyro=noisy(sequence.imu.gyro, 0.002), accel=noisy(sequence.imu.accel, 0.02)
)
cables = replace(sequence.cables, lengths=noisy(sequence.cables.lengths, 0.002))
sequence = replace(sequence, imu=imu, cables=cables)
fields = ("position", "quaternion", "velocity", "gyro_bias", "endcaps_world", "position_covariance")
estimates = {}
for method in ("paper", "full"):
    trajectory = estimate(sequence, config=method)
    estimates[method] = {name: getattr(trajectory, name).tolist() for name in fields}
print(json.dumps({"instruction_set": _core.instruction_set(), "estimates": estimates}))
"""


def estimate(**environment: str) -> dict:
    """Of a noisy recording, in a process of its own."""
    tests = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", ESTIMATE],
        env={**os.environ, **environment},
        cwd=tests,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module", autouse=True)
def _two_cores() -> None:
    folder = Path(_core.__file__).parent / "lib" / "glibc-hwcaps" / "x86-64-v3"
    if not folder.is_dir():
        pytest.skip("the module is built for one instruction set only")
    if platform.libc_ver()[0] != "glibc" or platform.libc_ver()[1] < "2.33":
        pytest.skip("the system's loader does not choose libraries by processor")


def test_the_processors_own_is_loaded() -> None:
    flags = set()
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("flags"):
            flags = set(line.split(":")[1].split())
            break
    expected = "x86-64-v3" if flags >= V3 else "baseline"
    assert _core.instruction_set() == expected


def test_without_avx2_it_is_the_other_which_computes_the_same() -> None:
    here, other = estimate(), estimate(**WITHOUT_AVX2)
    assert here["instruction_set"] == _core.instruction_set()
    assert other["instruction_set"] == "baseline"
    for method, estimates in here["estimates"].items():
        for name, values in estimates.items():
            np.testing.assert_allclose(
                np.array(other["estimates"][method][name]),
                np.array(values),
                rtol=0,
                atol=TOLERANCE[method],
                err_msg=f"{method}: {name}",
            )
