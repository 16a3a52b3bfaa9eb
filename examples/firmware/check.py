"""Run the replay in the emulator and on this machine, compare them, and table what it costs.

    python check.py BUILD

``BUILD`` holds ``recording.bin`` and the build directories: ``host``, and by the names of the
boards those of the images (target ``firmware`` of the Makefile). The exit code is 1 when one
of the limits below is missed.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Column, Table

METHODS = ("paper", "full")
BOARDS = {"mps2-an500": "Cortex-M7", "mps2-an386": "Cortex-M4F"}
KIB = 1024

FLASH_LIMIT = 192 * KIB
RAM_LIMIT = 64 * KIB
INSTRUCTION_LIMITS = {"paper": 200_000, "full": 800_000}
"""Of one IMU cycle on the Cortex-M7: 0.5 ms and 2 ms of 5 ms at 400 MHz and one per clock."""
POSITION_LIMIT = 0.01
"""Distance of the final position to the one in double precision, as a share of the path."""
COUNTER_RESOLUTION = 40
"""Instructions in one count of the board's SysTick."""


@dataclass
class Replay:
    """What one method printed: see ``replay/replay.hpp``."""

    states: list[list[float]] = field(default_factory=list)
    cycles: list[int] = field(default_factory=list)
    start: int = 0
    estimator: int = 0
    stack: int = 0

    @property
    def positions(self) -> np.ndarray:
        """Of the IMU, once a second and at the end (N, 3) [m]."""
        return np.array(self.states)[:, 1:4]

    @property
    def worst(self) -> int:
        return max(self.start, *self.cycles)


def parse(output: str) -> dict[str, Replay]:
    """The replays in the output of an image or a program, by method."""
    replays: dict[str, Replay] = defaultdict(Replay)
    for line in output.splitlines():
        what, method, *values = line.split()
        if what == "calibration":
            expected, measured = int(method), int(values[0])
            if abs(measured - expected) > COUNTER_RESOLUTION:
                raise SystemExit(f"{expected} instructions were counted as {measured}")
        elif what == "state":
            replays[method].states.append([float(v) for v in values])
        elif what == "cycle":
            replays[method].cycles.append(int(values[0]))
        else:
            setattr(replays[method], what, int(values[0]))
    for method in METHODS:
        if not replays[method].states:
            raise SystemExit(f"{method} has not started")
    return replays


def run(*command: str | Path) -> str:
    result = subprocess.run(command, capture_output=True, text=True, timeout=600)
    if result.returncode != 0:
        tail = "\n".join((result.stdout + result.stderr).splitlines()[-5:])
        raise SystemExit(f"{command[0]} ended with {result.returncode}:\n{tail}")
    return result.stdout


def emulate(board: str, image: Path) -> str:
    """Output of an image. With ``-icount shift=0`` an instruction takes 1 ns of emulated time."""
    options = (
        "-icount shift=0 -nographic -monitor none -serial none "
        "-chardev stdio,id=out -semihosting-config enable=on,target=native,chardev=out"
    )
    return run("qemu-system-arm", "-M", board, "-kernel", image, *options.split())


def memory(image: Path) -> tuple[int, int]:
    """Flash and static RAM [bytes]; the recording and the stack are not counted."""
    sections = dict(re.findall(r"^\.(\S+)\s+(\d+)", run("arm-none-eabi-size", "-A", image), re.M))
    text, data, bss = (int(sections[name]) for name in ("text", "data", "bss"))
    return text + data, data + bss


def double_routines(image: Path) -> list[str]:
    """What an image holds to emulate double precision on an FPU of single precision."""
    symbols = run("arm-none-eabi-nm", image)
    return re.findall(r"\b__aeabi_(?:d\w+|f2d|i2d|ui2d|l2d|ul2d)\b", symbols)


def difference(replay: Replay, reference: Replay) -> float:
    """Distance of the final positions over the path of the reference, whose chords of a second
    make it shorter than it is."""
    path = np.linalg.norm(np.diff(reference.positions, axis=0), axis=1).sum()
    return float(np.linalg.norm(replay.positions[-1] - reference.positions[-1]) / path)


class Limits:
    """Collects what is beyond its limit."""

    def __init__(self) -> None:
        self.missed: list[str] = []

    def check(self, what: str, value: float, limit: float) -> None:
        if not value <= limit:
            self.missed.append(f"{what}: {value:,.4g}, the limit is {limit:,.4g}")


def table(first: str, *numbers: str) -> Table:
    """A table to print, with columns of numbers."""
    return Table(first, *(Column(number, justify="right") for number in numbers))


def position(replay: Replay) -> str:
    return " ".join(f"{x:.4f}" for x in replay.positions[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=Path)
    build = parser.parse_args().build
    limits = Limits()

    recording = build / "recording.bin"
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        on_host = [
            pool.submit(run, build / "host" / f"replay_{scalar}", recording)
            for scalar in ("float", "double")
        ]
        on_board = {
            board: pool.submit(emulate, board, build / board / "image_both.elf") for board in BOARDS
        }
    single, reference = (parse(program.result()) for program in on_host)

    sizes = table("image", "flash [KiB]", "static RAM [KiB]", "stack [KiB]", "RAM [KiB]")
    costs = table("instructions per IMU cycle", "mean", "median", "worst", "start")
    ends = table("final position [m]", "x, y, z", "off double precision [% of the path]")
    for method in METHODS:
        ends.add_row(f"host in double precision, {method}", position(reference[method]))
        share = difference(single[method], reference[method])
        ends.add_row(f"host, {method}", position(single[method]), f"{100 * share:.3f}")
        limits.check(f"host, {method}: final position", share, POSITION_LIMIT)

    for board, core in BOARDS.items():
        replays = parse(on_board[board].result())
        for image, methods in (("both", METHODS), *((method, (method,)) for method in METHODS)):
            flash, static = memory(build / board / f"image_{image}.elf")
            stack = max(replays[method].stack for method in methods)
            row = (flash, static, stack, static + stack)
            sizes.add_row(f"{core}, {image}", *(f"{size / KIB:.1f}" for size in row))
            limits.check(f"{core}, {image}: flash", flash, FLASH_LIMIT)
            limits.check(f"{core}, {image}: RAM", static + stack, RAM_LIMIT)
        for method in METHODS:
            replay = replays[method]
            cycles = replay.cycles
            counts = (np.mean(cycles), np.median(cycles), replay.worst, replay.start)
            costs.add_row(f"{core}, {method}", *(f"{count:,.0f}" for count in counts))
            share = difference(replay, reference[method])
            ends.add_row(f"{core}, {method}", position(replay), f"{100 * share:.3f}")
            limits.check(f"{core}, {method}: final position", share, POSITION_LIMIT)
            if core == "Cortex-M7":
                limits.check(
                    f"{core}, {method}: instructions", replay.worst, INSTRUCTION_LIMITS[method]
                )
    routines = double_routines(build / "mps2-an386" / "image_both.elf")
    limits.check("emulated routines of double precision " + " ".join(routines), len(routines), 0)

    console = Console(width=100)
    for printed in (sizes, costs, ends):
        console.print(printed)
    for line in limits.missed:
        console.print(line, style="red")
    raise SystemExit(1 if limits.missed else 0)


if __name__ == "__main__":
    main()
