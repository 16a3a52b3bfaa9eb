"""How accurate the estimator is: simulated manoeuvres by seed, or your own recordings.

    python benchmarks/accuracy.py                              # what the README shows
    python benchmarks/accuracy.py --methods full mine.yaml --seeds 10-19 --manoeuvres forward
    python benchmarks/accuracy.py --ablation                   # part by part: accuracy_ablation.py
    python benchmarks/accuracy.py --variants                   # other ground, robot, sensors
    python benchmarks/accuracy.py --variants nominal imu-gaps --seeds 0 --manoeuvres forward
    python benchmarks/accuracy.py recordings/monday recordings/tuesday

Prints a table and writes it to OUT/accuracy.md, and every single run's metrics to
OUT/accuracy.json (with --variants: variants.md and variants.json). Simulated recordings stay in
OUT/recordings and are used again.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import multiprocessing
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from accuracy_ablation import Methods, ablation
from accuracy_table import Result, table
from accuracy_variants import NOMINAL, VARIANTS, Variant

import tensegrity
from tensegrity import robots
from tensegrity.cli.recording import SIMULATION, describe, record
from tensegrity.config import FilterConfig
from tensegrity.errors import InputError
from tensegrity.evaluation import evaluate
from tensegrity.simulation import Manoeuvre


@dataclass(frozen=True, kw_only=True)
class Recording:
    """A directory on disk; ``group`` is what its results are averaged with."""

    group: str
    path: Path
    variant: Variant = NOMINAL

    def make(self) -> None:
        """Nothing to do: a recording of the user's."""


@dataclass(frozen=True, kw_only=True)
class Simulated(Recording):
    """A recording that is made when it is not there yet."""

    manoeuvre: Manoeuvre
    seed: int

    def make(self) -> None:
        """Simulate, unless the same simulation is already on disk."""
        robot, options = robots.load(), self.variant.simulation(self.seed)
        made = self.path / SIMULATION
        if made.is_file() and made.read_text(encoding="utf-8") == describe(
            self.manoeuvre, options, robot
        ):
            return
        record(self.manoeuvre, options, robot, self.path, progress=lambda fraction: None)


def run(recording: Recording, methods: Methods) -> list[Result]:
    """Estimate and evaluate one recording by every method."""
    recording.make()
    variant = recording.variant
    sequence = variant.sensed(tensegrity.sequence.read(recording.path))
    return [
        Result(
            recording.group,
            label,
            recording.path.name,
            evaluate(tensegrity.estimate(sequence, config=variant.declared(config)), sequence),
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
                # The name first: when this recording fails, it is the last one named.
                print(f"{done}/{len(futures)} {futures[future].path.name}", file=sys.stderr)
                future.result()
        except BaseException:
            executor.shutdown(cancel_futures=True)
            raise
        return [result for future in futures for result in future.result()]


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
    parser.add_argument(
        "--manoeuvres",
        nargs="+",
        type=Manoeuvre,
        choices=list(Manoeuvre),
        help="all; with --variants forward and left-turn",
    )
    parser.add_argument(
        "--variants",
        nargs="*",
        metavar="NAME",
        choices=list(VARIANTS),
        help=f"group by variant instead of manoeuvre; all, or some of {', '.join(VARIANTS)}",
    )
    parser.add_argument(
        "--methods", nargs="+", default=["paper", "full"], help="packaged profiles or YAML files"
    )
    parser.add_argument(
        "--ablation",
        action="store_true",
        help="instead of --methods: full with one part at a time switched off, and paper",
    )
    parser.add_argument("--out", type=Path, default=Path("runs/accuracy"))
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    args = parser.parse_args()
    if args.recordings and args.variants is not None:
        parser.error("--variants are simulated, not read from recordings")
    return args


def simulations(args: argparse.Namespace) -> list[Recording]:
    """All seeds of each manoeuvre, or of each variant."""
    folder = args.out / "recordings"
    if args.variants is None:
        return [
            Simulated(
                group=manoeuvre, path=folder / f"{manoeuvre}-{seed}", manoeuvre=manoeuvre, seed=seed
            )
            for manoeuvre in args.manoeuvres or Manoeuvre
            for seed in args.seeds
        ]
    return [
        Simulated(
            group=name,
            path=folder / f"{manoeuvre}-{seed}-{name}",
            variant=VARIANTS[name],
            manoeuvre=manoeuvre,
            seed=seed,
        )
        for name in args.variants or VARIANTS
        for manoeuvre in args.manoeuvres or (Manoeuvre.FORWARD, Manoeuvre.LEFT_TURN)
        for seed in args.seeds
    ]


def main() -> None:
    args = arguments()
    if args.ablation:
        methods = ablation()
    else:
        methods = {name: FilterConfig.load(name) for name in args.methods}
    recordings = [Recording(group=path.resolve().name, path=path) for path in args.recordings]
    results = run_all(recordings or simulations(args), methods, args.jobs)

    args.out.mkdir(parents=True, exist_ok=True)
    name = "accuracy" if args.variants is None else "variants"
    text = table(results)
    (args.out / f"{name}.md").write_text(text, encoding="utf-8")
    content = {
        "methods": {label: config.model_dump() for label, config in methods.items()},
        "runs": [dataclasses.asdict(result) for result in results],
    }
    (args.out / f"{name}.json").write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        raise SystemExit(f"error: {error}") from None
