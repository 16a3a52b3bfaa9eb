"""`docs/benchmarks.md` from `results.json`.

python benchmarks/report.py            # writes the page
python benchmarks/report.py --check    # fails where the page is not what the results give
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median

from results import Results, Timing

TEMPLATE = Path(__file__).with_name("page.md.in")
PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks.md"

# T §VI, on an i5-11400H: mean times [ns].
T_PROPAGATION, T_CORRECTION, T_SHAPE = 11.33e3, 17.46e3, 4.1e6
METHODS = ("paper", "full")
RODS = (3, 6, 12, 24, 48)
REPLAY_S, REPLAY_HZ = 90, 200


def duration(ns: float) -> str:
    """With three digits and a readable unit."""
    for unit, scale in (("s", 1e9), ("ms", 1e6), ("µs", 1e3)):
        if ns >= scale:
            return f"{three_digits(ns / scale)} {unit}"
    return f"{three_digits(ns)} ns"


def three_digits(value: float) -> str:
    """1.23, 12.3, 123, 1230"""
    return f"{value:.{max(0, 2 - len(str(int(value))) + 1)}f}" if value < 1000 else f"{value:.0f}"


def spread(timing: Timing) -> str:
    """Median and, in brackets, least and greatest; with a star where the core never was its own."""
    low, high = duration(timing.min_ns), duration(timing.max_ns)
    if low.split()[1] == high.split()[1]:
        low = low.split()[0]
    star = "" if timing.alone else " \\*"
    return f"{duration(timing.median_ns)} ({low} – {high}){star}"


def thousands(count: float) -> str:
    """12 345"""
    return f"{count:,.0f}".replace(",", " ")


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Markdown; the first column to the left, figures to the right."""
    lines = [header, ["---", *["--:"] * (len(header) - 1)], *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


class Page:
    """The figures of a run as cells; a case that was not measured is a dash."""

    def __init__(self, results: Results) -> None:
        self._results = results

    def time(self, case: str) -> str:
        timing = self._results.times.get(case)
        return "–" if timing is None else spread(timing)

    def least(self, case: str) -> str:
        timing = self._results.times.get(case)
        return "–" if timing is None else duration(timing.median_ns)

    def instructions(self, case: str) -> str:
        count = self._results.instructions.get(case)
        return "–" if count is None else thousands(count)

    def ratio(self, case: str, to: str) -> str:
        """How many times as long ``case`` takes."""
        times = self._results.times
        if case not in times or to not in times:
            return "–"
        return f"{three_digits(times[case].median_ns / times[to].median_ns)} ×"

    def cycles(self) -> str:
        rows = []
        for method in METHODS:
            for recording in self._results.recordings:
                case = f"cycle/{method}/{recording}"
                single = self._results.cycles[case]
                rows.append(
                    [
                        f"{method}, {recording}",
                        self.time(case),
                        duration(single["median_ns"]),
                        duration(single["worst_ns"]),
                    ]
                )
        return table(["", "mean", "median cycle", "worst cycle"], rows)

    def worst(self) -> str:
        rows = []
        for method in METHODS:
            kinds: dict[str, float] = {}
            for case, calls in self._results.worst_instructions.items():
                if case.startswith(f"cycle/{method}/"):
                    for kind, count in calls.items():
                        kinds[kind] = max(kinds.get(kind, 0.0), count)
            rows.append(
                [
                    method,
                    *(
                        thousands(kinds[k]) if k in kinds else "–"
                        for k in ("imu", "cables", "contacts", "cycle")
                    ),
                ]
            )
        return table(["worst call", "`imu`", "`cables`", "`contacts`", "whole cycle"], rows)

    def filter(self) -> str:
        rows = []
        for contacts in range(7):
            row = [str(contacts)]
            for step in ("propagate", "correct"):
                case = f"filter/{step}/{contacts}"
                row += [
                    self.time(f"{case}/double"),
                    self.instructions(f"{case}/double"),
                    self.least(f"{case}/float"),
                ]
            row.insert(4, self.least(f"filter/roll/{contacts}/double"))
            rows.append(row)
        rows.append(["T", duration(T_PROPAGATION), "", "", "", duration(T_CORRECTION), "", ""])
        header = [
            "contacts",
            "propagate",
            "instructions",
            "`float`",
            "rolling",
            "correct",
            "instructions",
            "`float`",
        ]
        return table(header, rows)

    def tight(self) -> str:
        names = {
            "propagate": f"propagate (T: {duration(T_PROPAGATION)})",
            "cables": "nine cables",
            "rods": "lengths of two rods",
            "feet": f"three feet (T: {duration(T_CORRECTION)})",
        }
        return table(
            ["", "time", "instructions", "`float`"],
            [
                [
                    name,
                    self.time(f"tight/{part}/double"),
                    self.instructions(f"tight/{part}/double"),
                    self.least(f"tight/{part}/float"),
                ]
                for part, name in names.items()
            ],
        )

    def shape(self) -> str:
        names = {
            "step": "solver, one step",
            "warm": "solver, from the last solution",
            "cold": "solver, from nothing",
            "tracker": "tracker, predict and correct",
            "ipopt_warm": "Ipopt, from the last solution",
            "ipopt_cold": "Ipopt, from the undeformed robot",
        }
        rows = [
            [f"{name}, {recording}", self.time(case), self.instructions(case)]
            for part, name in names.items()
            for recording in self._results.recordings
            for case in [f"shape/{part}/{recording}"]
        ]
        return table(["", "time", "instructions"], rows)

    def contact(self) -> str:
        cases = {
            "contact/spin_start/flags": "spin of a robot at rest, contacts known",
            "contact/spin_start/search": "spin of a robot at rest, contacts searched",
        } | {
            f"contact/detector/{recording}": f"contact detector, {recording}"
            for recording in self._results.recordings
        }
        rows = [[name, self.time(case), self.instructions(case)] for case, name in cases.items()]
        return table(["", "time", "instructions"], rows)

    def superball(self) -> str:
        rows = [
            [name, self.time(f"ukf/superball/{case}"), self.instructions(f"ukf/superball/{case}")]
            for case, name in (
                ("mixed", "filter in `double`, dynamics in `float`"),
                ("double", "all in `double`"),
                ("float", "all in `float`"),
            )
        ]
        rows += [
            [f"calibration of {case.removeprefix('calibration/')}", spread(timing), "–"]
            for case, timing in self._results.times.items()
            if case.startswith("calibration/")
        ]
        return table(["", "time", "instructions"], rows)

    def scaling(self) -> str:
        rows = []
        for rods in RODS:
            filter_ = f"ukf/algebra/covariance/{rods}/double"
            heap = self._results.times[filter_].bytes
            rows.append(
                [
                    f"{rods}",
                    f"{12 * rods}",
                    self.least(f"dynamics/prism/{rods}/double"),
                    self.least(f"dynamics/prism/{rods}/float"),
                    self.least(filter_),
                    self.least(f"ukf/algebra/covariance/{rods}/float"),
                    self.least(f"ukf/algebra/square_root/{rods}/double"),
                    f"{heap / 1e6:.2g} MB",
                ]
            )
        header = [
            "rods",
            "states",
            "dynamics",
            "`float`",
            "filter",
            "`float`",
            "square-root filter",
            "memory",
        ]
        return table(header, rows)

    def python(self) -> str:
        rows = []
        for method in METHODS:
            for recording in self._results.recordings:
                replay = self._results.times[f"python/replay/{method}/{recording}"]
                cycle = self._results.times[f"cycle/{method}/{recording}"]
                whole = replay.median_ns * REPLAY_S * REPLAY_HZ
                rows.append(
                    [
                        f"{method}, {recording}",
                        spread(replay),
                        duration(whole),
                        self.time(f"python/stream/{method}/{recording}"),
                        duration(cycle.median_ns),
                    ]
                )
        header = ["", "replay", f"{REPLAY_S} s at {REPLAY_HZ} Hz", "sample by sample", "C++"]
        return table(header, rows)

    def calls(self) -> str:
        names = {
            "imu": "`imu(t, gyro, accel)`",
            "cables": "`cables(t, lengths)`",
            "contacts": "`contacts(t, flags)`",
            "state": "`state`",
        }
        rows = [[name, self.time(f"python/call/{call}")] for call, name in names.items()]
        return table(["", "time"], rows)

    def peers(self) -> str:
        cases = [
            *(
                (
                    f"{name}, {contacts} contact{'s' * (contacts > 1)}",
                    f"peers/{step}/{contacts}",
                    "gtsam",
                )
                for step, name in (("propagate", "propagate"), ("correct", "correct"))
                for contacts in (1, 3, 6)
            ),
            *(
                ("shape from nine lengths", case, peer)
                for recording in self._results.recordings
                if f"{(case := f'peers/shape/{recording}')}/tensegrity" in self._results.times
                for peer in ("scipy", "casadi", "tensegrity_ipopt")
            ),
            ("unscented filter, process in NumPy", "peers/unscented", "filterpy"),
            ("orientation from an IMU sample", "peers/orientation", "ahrs"),
        ]
        versions = self._results.versions
        labels = {
            "gtsam": f"GTSAM {versions['gtsam']}",
            "scipy": f"SciPy {versions['scipy']}",
            "casadi": f"CasADi {versions['casadi']}, Ipopt {versions['Ipopt of casadi']}",
            "tensegrity_ipopt": f"`IpoptShapeSolver`, Ipopt {versions['Ipopt']}",
            "filterpy": f"FilterPy {versions['filterpy']}",
            "ahrs": f"ahrs {versions['ahrs']}",
        }
        rows = [
            [
                name,
                self.time(f"{case}/tensegrity"),
                labels[peer],
                self.time(f"{case}/{peer}"),
                self.ratio(f"{case}/{peer}", f"{case}/tensegrity"),
            ]
            for name, case, peer in cases
        ]
        return table(["", "tensegrity", "peer", "peer's time", "ratio"], rows)

    def company(self) -> dict[str, str]:
        """How often repetitions had their core for themselves, and what it cost to share it."""
        timings = self._results.times.values()
        alone = sum(timing.alone for timing in timings)
        whole = sum(timing.repetitions for timing in timings)
        shared = [
            timing.disturbed_ns / timing.median_ns
            for timing in timings
            if timing.alone and timing.disturbed_ns is not None
        ]
        said = {"repetitions with a core of their own": f"{alone} of {whole}"}
        if shared:
            said["the others took"] = f"{three_digits(median(shared))} × as long"
        return said

    def conditions(self) -> str:
        machine = self._results.machine | self.company()
        versions = self._results.versions
        lines = [f"- {name}: {value}\n" for name, value in (machine | versions).items()]
        return "".join(lines) + "\n```\n" + "\n".join(self._results.commands) + "\n```\n"


def page(results: Results) -> str:
    """All of it as Markdown."""
    p = Page(results)
    recordings = ", ".join(
        f"{name} ({recording['duration_s']:.0f} s, {recording['samples']:.0f} IMU samples)"
        for name, recording in results.recordings.items()
    )
    return TEMPLATE.read_text(encoding="utf-8").format(
        recordings=recordings,
        t_shape=duration(T_SHAPE),
        cycles=p.cycles(),
        worst=p.worst(),
        filter=p.filter(),
        tight=p.tight(),
        shape=p.shape(),
        contact=p.contact(),
        superball=p.superball(),
        scaling=p.scaling(),
        python=p.python(),
        instruction_set=results.versions["Python module"],
        calls=p.calls(),
        peers=p.peers(),
        conditions=p.conditions().rstrip("\n"),
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    arguments = parser.parse_args()
    expected = page(Results.read())
    if not arguments.check:
        PAGE.write_text(expected, encoding="utf-8")
    elif PAGE.read_text(encoding="utf-8") != expected:
        raise SystemExit(
            "error: docs/benchmarks.md is not what benchmarks/results.json gives: "
            "run `python benchmarks/report.py`"
        )


if __name__ == "__main__":
    main()
