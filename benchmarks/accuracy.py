"""How accurate the estimator is: simulated manoeuvres by seed, or your own recordings.

    python benchmarks/accuracy.py                              # what the README shows
    python benchmarks/accuracy.py --methods full mine.yaml --seeds 10-19 --manoeuvres forward
    python benchmarks/accuracy.py --ablation
    python benchmarks/accuracy.py recordings/monday recordings/tuesday

Prints a table and writes it to OUT/accuracy.md, and every single run's metrics to
OUT/accuracy.json. Simulated recordings stay in OUT/recordings and are used again.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import multiprocessing
import os
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import tensegrity
from tensegrity import robots
from tensegrity.cli.recording import SIMULATION, describe, record
from tensegrity.config import FilterConfig
from tensegrity.errors import InputError
from tensegrity.evaluation import Metrics, evaluate, published_result
from tensegrity.simulation import Manoeuvre, SimulationOptions

Methods = dict[str, FilterConfig]
"""Configurations by the label they have in the table."""

# What separates the profile `full` from `paper`, and the numbers that only this setting reads.
_SWITCHES: dict[str, tuple[tuple[str, str], ...]] = {
    "shape": (("noises", "shape_std_rest"), ("noises", "shape_std_moving")),
    "spin": (("priors", "spin_std"), ("noises", "spin_std")),
    "contact_point": (),
    "contact_noise": (("noises", "contact_position_std"),),
}


@dataclass(frozen=True)
class Recording:
    """A directory on disk; ``group`` is what its results are averaged with."""

    group: str
    path: Path


@dataclass(frozen=True)
class Simulated(Recording):
    """A recording that is made when it is not there yet."""

    seed: int

    def make(self) -> None:
        """Simulate, unless the same simulation is already on disk."""
        manoeuvre, robot = Manoeuvre.named(self.group), robots.load()
        options = SimulationOptions(seed=self.seed)
        made = self.path / SIMULATION
        if made.is_file() and made.read_text(encoding="utf-8") == describe(
            manoeuvre, options, robot
        ):
            return
        record(manoeuvre, options, robot, self.path, progress=lambda fraction: None)


@dataclass(frozen=True)
class Result:
    """One recording by one method."""

    group: str
    method: str
    recording: str
    metrics: Metrics


def run(recording: Recording, methods: Methods) -> list[Result]:
    """Estimate and evaluate one recording by every method."""
    if isinstance(recording, Simulated):
        recording.make()
    sequence = tensegrity.sequence.read(recording.path)
    return [
        Result(
            recording.group,
            label,
            recording.path.name,
            evaluate(tensegrity.estimate(sequence, config=config), sequence),
        )
        for label, config in methods.items()
    ]


def run_all(recordings: Sequence[Recording], methods: Methods, jobs: int) -> list[Result]:
    """All recordings in ``jobs`` processes; results in the order of ``recordings``."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(jobs, len(recordings)), mp_context=context) as executor:
        futures = {executor.submit(run, one, methods): one for one in recordings}
        try:
            for done, future in enumerate(as_completed(futures), start=1):
                future.result()
                name = futures[future].path.name
                print(f"{done}/{len(futures)} {name}", file=sys.stderr)
        except BaseException:
            executor.shutdown(cancel_futures=True)
            raise
        return [result for future in futures for result in future.result()]


# --- methods ------------------------------------------------------------------------------------


def ablation() -> Methods:
    """``paper`` and ``full``, and each of them with one setting of the other at a time."""
    profiles = {name: FilterConfig.load(name) for name in ("paper", "full")}
    methods: Methods = {}
    for name, other in (("paper", "full"), ("full", "paper")):
        methods[name] = profiles[name]
        for setting in _SWITCHES:
            switched = _switched(profiles[name], profiles[other], setting)
            if switched == profiles[name]:
                continue  # contact noise from the shape means nothing without a tracked shape
            methods[f"{name}, {setting}: {getattr(switched.settings, setting)}"] = switched
    return methods


def _switched(config: FilterConfig, other: FilterConfig, setting: str) -> FilterConfig:
    values: dict[str, dict[str, Any]] = config.model_dump()
    for section, key in (("settings", setting), *_SWITCHES[setting]):
        values[section][key] = getattr(getattr(other, section), key)
    if values["settings"]["shape"] == "least_squares":
        values["settings"]["contact_noise"] = "constant"
    return FilterConfig.model_validate(values)


# --- tables -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Summary:
    """What the table shows of several runs; ``None`` where no recording allows the figure."""

    runs: int
    drift_percent_mean: float | None
    drift_percent_worst: float | None
    rpe_trans_m_per_m: float | None
    rpe_rot_deg_per_m: float | None
    z_drift_m: float | None
    endcap_rmse_m: float | None
    nees_position_median: float | None


def summary(runs: Sequence[Metrics]) -> Summary:
    """Means over ``runs`` and the worst drift; the vertical drift counts without its sign."""

    def values(name: str) -> list[float]:
        return [abs(x) for x in (getattr(m, name) for m in runs) if x is not None]

    def mean(name: str) -> float | None:
        return fmean(values(name)) if values(name) else None

    return Summary(
        runs=len(runs),
        drift_percent_mean=mean("final_drift_percent"),
        drift_percent_worst=max(values("final_drift_percent"), default=None),
        rpe_trans_m_per_m=mean("rpe_trans_rmse_m_per_m"),
        rpe_rot_deg_per_m=mean("rpe_rot_rmse_deg_per_m"),
        z_drift_m=mean("z_drift_m"),
        endcap_rmse_m=mean("endcap_rmse_m"),
        nees_position_median=mean("nees_position_median"),
    )


# Header, field of Summary, format, and what a metre becomes.
_COLUMNS = (
    ("drift, mean [%]", "drift_percent_mean", ".1f", 1),
    ("worst [%]", "drift_percent_worst", ".1f", 1),
    ("RPE [m/m]", "rpe_trans_m_per_m", ".3f", 1),
    ("RPE [°/m]", "rpe_rot_deg_per_m", ".2f", 1),
    ("z drift [cm]", "z_drift_m", ".1f", 100),
    ("endcaps [mm]", "endcap_rmse_m", ".0f", 1000),
    ("NEES", "nees_position_median", ".1f", 1),
)


def table(results: Sequence[Result]) -> str:
    """Markdown: a row per group and method, and one per method over all groups."""
    groups = list(dict.fromkeys(result.group for result in results))
    methods = list(dict.fromkeys(result.method for result in results))
    lines = [
        "| | method | runs | " + " | ".join(header for header, *_ in _COLUMNS) + " |",
        "|---|---|--:|" + "--:|" * len(_COLUMNS),
    ]
    for group in groups:
        for method in methods:
            of = [r.metrics for r in results if (r.group, r.method) == (group, method)]
            lines.append(_row(group, method, summary(of)))
        lines.extend(_published_row(group))
    if len(groups) > 1:
        for method in methods:
            of = [r.metrics for r in results if r.method == method]
            lines.append(_row("**all**", method, summary(of)))
    return "\n".join(lines) + "\n"


def _row(group: str, method: str, figures: Summary) -> str:
    cells = [group, method, str(figures.runs)]
    for _, name, form, scale in _COLUMNS:
        value = getattr(figures, name)
        cells.append("–" if value is None else format(scale * value, form))
    return "| " + " | ".join(cells) + " |"


def _published_row(group: str) -> Iterable[str]:
    found = published_result(group)
    if found is not None:
        figures = found[1]
        published = Summary(
            runs=1,
            drift_percent_mean=figures.final_drift_percent,
            drift_percent_worst=None,
            rpe_trans_m_per_m=figures.rpe_trans_rmse_m_per_m,
            rpe_rot_deg_per_m=figures.rpe_rot_rmse_deg_per_m,
            z_drift_m=None,
            endcap_rmse_m=None,
            nees_position_median=None,
        )
        yield _row(group, "T, Table II", published)


# --- command line -------------------------------------------------------------------------------


def seeds(text: str) -> list[int]:
    """``0-4,7`` as ``[0, 1, 2, 3, 4, 7]``."""
    found: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        found.extend(range(int(first), int(last or first) + 1))
    return found


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recordings", nargs="*", type=Path, help="instead of simulations")
    parser.add_argument("--seeds", type=seeds, default=seeds("0-4"), help="such as 0-4,7")
    parser.add_argument("--manoeuvres", nargs="+", choices=list(Manoeuvre), default=list(Manoeuvre))
    parser.add_argument(
        "--methods", nargs="+", default=["paper", "full"], help="packaged profiles or YAML files"
    )
    parser.add_argument(
        "--ablation",
        action="store_true",
        help="instead of --methods: paper and full with one setting of the other at a time",
    )
    parser.add_argument("--out", type=Path, default=Path("runs/accuracy"))
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    return parser.parse_args()


def main() -> None:
    args = arguments()
    if args.ablation:
        methods = ablation()
    else:
        methods = {name: FilterConfig.load(name) for name in args.methods}
    recordings: list[Recording] = [Recording(path.resolve().name, path) for path in args.recordings]
    if not recordings:
        recordings = [
            Simulated(manoeuvre, args.out / "recordings" / f"{manoeuvre}-{seed}", seed)
            for manoeuvre in args.manoeuvres
            for seed in args.seeds
        ]
    results = run_all(recordings, methods, args.jobs)

    args.out.mkdir(parents=True, exist_ok=True)
    text = table(results)
    (args.out / "accuracy.md").write_text(text, encoding="utf-8")
    content = {
        "methods": {label: config.model_dump() for label, config in methods.items()},
        "runs": [dataclasses.asdict(result) for result in results],
    }
    (args.out / "accuracy.json").write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        raise SystemExit(f"error: {error}") from None
