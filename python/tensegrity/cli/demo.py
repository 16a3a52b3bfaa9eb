"""``tensegrity demo``: everything once, from simulation to figures."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures import wait as wait_for
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, Queue
from typing import Annotated

import typer
from rich.progress import Progress

from tensegrity import estimation, robots
from tensegrity.cli.console import out, progress_bars
from tensegrity.cli.evaluate import METRICS
from tensegrity.cli.recording import SIMULATION, describe, record
from tensegrity.cli.tables import demo_table
from tensegrity.config import FilterConfig
from tensegrity.evaluation import TABLE_II, Metrics, compare, measure
from tensegrity.plotting import save_figures
from tensegrity.run import write_run
from tensegrity.sequence import read
from tensegrity.simulation import Manoeuvre, SimulationOptions

METHODS = ("paper", "full")
RECORDINGS, RUNS, FIGURES = "recordings", "runs", "figures"
QUICK_PATH_M = 3.0


def demo(
    directory: Annotated[
        Path, typer.Option("--out", help="Directory for recordings, runs and figures.")
    ] = Path("demo"),
    quick: Annotated[
        bool,
        typer.Option("--quick", help=f"Roll {QUICK_PATH_M:g} m instead of the published paths."),
    ] = False,
    seed: Annotated[int, typer.Option(help="Seed of the simulations.", min=0)] = 0,
) -> None:
    """Simulate four manoeuvres, estimate by both methods, evaluate and draw figures.

    Recordings that are already there with the same options are used again.
    """
    started = time.monotonic()
    path_length = QUICK_PATH_M if quick else None
    results = _in_parallel([Task(name, seed, path_length, directory) for name in Manoeuvre])
    out.print(demo_table(results, TABLE_II), soft_wrap=False)
    out.print(
        "T: Tong et al. 2024, on recordings of their own simulation.\n"
        f"recordings: {directory / RECORDINGS}\nruns: {directory / RUNS}\n"
        f"figures: {directory / FIGURES}\ndone in {time.monotonic() - started:.0f} s",
        markup=False,
    )


@dataclass(frozen=True)
class Task:
    """One manoeuvre of the demo; ``path_length`` [m] in place of the published one."""

    manoeuvre: Manoeuvre
    seed: int
    path_length: float | None
    directory: Path

    def run(self, progress: Callable[[float], None]) -> dict[str, Metrics]:
        """Simulate, estimate, evaluate, draw; returns the metrics by method."""
        robot = robots.load()
        options = SimulationOptions(seed=self.seed, path_length=self.path_length)
        recording = self.directory / RECORDINGS / self.manoeuvre
        made = recording / SIMULATION
        wanted = describe(self.manoeuvre, options, robot)
        if not (made.is_file() and made.read_text(encoding="utf-8") == wanted):
            record(self.manoeuvre, options, robot, recording, progress)
        progress(1.0)

        sequence = read(recording)
        metrics, comparisons = {}, {}
        for method in METHODS:
            config = FilterConfig.load(method)
            trajectory = estimation.estimate(sequence, config=config)
            run = self.directory / RUNS / f"{self.manoeuvre}-{method}"
            write_run(
                trajectory,
                run,
                sequence=recording.resolve(),
                robot=sequence.robot,
                config=config,
                overwrite=True,
            )
            comparisons[method] = compare(trajectory, sequence)
            metrics[method] = measure(comparisons[method], trajectory.runtime_s)
            metrics[method].save(run / METRICS)
        save_figures(comparisons, self.directory / FIGURES / self.manoeuvre)
        return metrics


def _in_parallel(tasks: list[Task]) -> dict[str, dict[str, Metrics]]:
    """Run the tasks in as many processes as there are cores; results by manoeuvre."""
    # Started afresh ("spawn"): a fork would copy the threads that draw the progress bars.
    context = multiprocessing.get_context("spawn")
    with (
        context.Manager() as manager,
        ProcessPoolExecutor(
            max_workers=min(len(tasks), os.cpu_count() or 1),
            mp_context=context,
            initializer=signal.signal,
            initargs=(signal.SIGINT, signal.SIG_DFL),  # Ctrl-C ends the workers without a word
        ) as executor,
        progress_bars() as progress,
    ):
        news: Queue[tuple[str, float]] = manager.Queue()
        futures = {task.manoeuvre: executor.submit(_work, task, news) for task in tasks}
        try:
            _follow(list(futures.values()), news, progress, [task.manoeuvre for task in tasks])
        finally:
            executor.shutdown(wait=False, cancel_futures=True)
        return {manoeuvre: future.result() for manoeuvre, future in futures.items()}


def _work(task: Task, news: Queue[tuple[str, float]]) -> dict[str, Metrics]:
    """A task in a worker process; tells every new percent of the simulation."""
    told = -1

    def progress(fraction: float) -> None:
        nonlocal told
        percent = int(100 * fraction)
        if percent > told:
            told = percent
            news.put((task.manoeuvre, fraction))

    return task.run(progress)


def _follow(
    futures: list[Future[dict[str, Metrics]]],
    news: Queue[tuple[str, float]],
    progress: Progress,
    names: list[str],
) -> None:
    """Draw the news until all are done, or raise the first error."""
    bars = {name: progress.add_task(f"simulating {name}", total=1.0) for name in names}
    pending = set(futures)
    while pending:
        done, pending = wait_for(pending, timeout=0.1)
        for future in done:
            future.result()
        while True:
            try:
                name, fraction = news.get_nowait()
            except Empty:
                break
            progress.update(bars[name], completed=fraction)
            if fraction >= 1.0:
                progress.update(bars[name], description=f"estimating {name}")
