"""Where the noises of the tightly coupled filter come from.

    python benchmarks/filter_tuning.py
    python benchmarks/filter_tuning.py --evaluations 20 --seeds 100      # a first impression

Searches the noises that no datasheet gives by CMA-ES (package `cma`) in their logarithms, on
simulated recordings of seeds that are reported nowhere else: the four manoeuvres with and without
contact flags, and the first manoeuvre of the first seed on other ground, with other endcaps and at
another speed. Prints the best noises as YAML; they are rounded into
``python/tensegrity/configs/full.yaml`` by hand.

One evaluation estimates and evaluates 28 recordings in a minute of processor time; the default of
300 evaluations takes two and a half hours on two cores. Recordings are simulated once, in some
minutes, and stay in OUT/recordings.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import cma
import numpy as np
from accuracy import Recording, Simulated, run
from accuracy_variants import NOMINAL, VARIANTS

from tensegrity.config import FilterConfig
from tensegrity.evaluation import Metrics
from tensegrity.simulation import Manoeuvre

NOISES = (
    "endcap_acceleration_rest",
    "endcap_acceleration_moving",
    "active_force",
    "active_rate",
    "creep_std",
    "slip_length",
    "slip_speed",
    "foot_rise_std",
    "foot_height_std",
    "cable_std",
)
OTHER_CONDITIONS = ("friction-0.4", "stiff-floor", "endcaps-5mm", "fast")
START = "full"
SPREAD = 0.4  # of the first generation, in natural logarithms


@dataclass(frozen=True)
class Cases:
    """The recordings a configuration is judged by; ``blind`` are those without contact flags."""

    nominal: list[Recording]
    blind: list[Recording]
    varied: list[Recording]


def cases(folder: Path, seeds: list[int]) -> Cases:
    def simulated(manoeuvre: Manoeuvre, seed: int, variant: str) -> Recording:
        # Recordings without flags differ in what is read of them alone.
        path = folder / f"{manoeuvre}-{seed}-{variant.replace('no-contacts', NOMINAL.name)}"
        return Simulated(
            group=variant, path=path, variant=VARIANTS[variant], manoeuvre=manoeuvre, seed=seed
        )

    both = [(manoeuvre, seed) for seed in seeds for manoeuvre in Manoeuvre]
    return Cases(
        nominal=[simulated(*case, NOMINAL.name) for case in both],
        blind=[simulated(*case, "no-contacts") for case in both],
        varied=[simulated(*both[0], variant) for variant in OTHER_CONDITIONS],
    )


def cost(config: FilterConfig, judged: Cases, executor: Executor) -> float:
    """Drift [% of the path], and what else a user pays for: see the terms."""
    groups = (judged.nominal, judged.blind, judged.varied)
    work = [[executor.submit(measured, one, config) for one in group] for group in groups]
    nominal, blind, varied = ([future.result() for future in group] for group in work)
    drift = [_drift(metrics) for metrics in nominal]
    return (
        float(np.mean(drift))
        + 0.2 * max(drift)
        + 0.5 * float(np.mean([_drift(metrics) for metrics in blind]))
        + 0.3 * float(np.mean([_drift(metrics) for metrics in varied]))
        + 0.02 * 1e3 * float(np.mean([metrics.endcap_rmse_m for metrics in nominal]))
        # A filter that believes most in standing feet drifts least and lies most.
        + 0.15 * abs(np.log(np.median([m.nees_position_median for m in nominal]) / 0.9))
    )


def measured(recording: Recording, config: FilterConfig) -> Metrics:
    [result] = run(recording, {"tuned": config})
    return result.metrics


def _drift(metrics: Metrics) -> float:
    return float(metrics.final_drift_percent)


def configured(noises: dict[str, float]) -> FilterConfig:
    config = FilterConfig.load(START)
    return config.model_copy(update={"noises": config.noises.model_copy(update=noises)})


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, nargs="+", default=[100, 101, 102])
    parser.add_argument("--evaluations", type=int, default=300)
    parser.add_argument("--out", type=Path, default=Path("runs/tuning"))
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    arguments = parser.parse_args()
    judged = cases(arguments.out / "recordings", arguments.seeds)
    start = FilterConfig.load(START).noises
    search = cma.CMAEvolutionStrategy(
        np.log([getattr(start, name) for name in NOISES]),
        SPREAD,
        {"maxfevals": arguments.evaluations, "seed": 1},
    )
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(arguments.jobs, mp_context=context) as executor:
        # First, since recordings with and without flags share their files.
        for made in [executor.submit(one.make) for one in judged.nominal]:
            made.result()
        while not search.stop():
            generation = search.ask()
            costs = []
            for logs in generation:
                noises = dict(zip(NOISES, np.exp(logs).tolist(), strict=True))
                costs.append(cost(configured(noises), judged, executor))
                shown = "  ".join(f"{name} {value:.4g}" for name, value in noises.items())
                print(f"{costs[-1]:.3f}  {shown}", flush=True)
            search.tell(generation, costs)
    print(f"\n# cost {search.result.fbest:.3f}\nnoises:")
    for name, log in zip(NOISES, search.result.xbest, strict=True):
        print(f"  {name}: {np.exp(log):.4g}")


if __name__ == "__main__":
    main()
