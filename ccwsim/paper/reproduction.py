"""Run all experiments of the paper in order, and report the results."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from ccwsim import Cancelled, CCWSIMError
from ccwsim.experiments.trials import Trial, run_trials
from ccwsim.model import Watch, duration
from ccwsim.paper.comparison import compare_methods, variability
from ccwsim.paper.experiment import (
    FULL,
    PAPER_TEXTS,
    Experiment,
    ExperimentRun,
    Extent,
    Outcome,
    PaperInputs,
    said,
)
from ccwsim.paper.methods import AUTHORS_SETTINGS, paper_parameters
from ccwsim.paper.realizations import MapFigure, show_figure
from ccwsim.paper.times import grid_size, times_with_data
from ccwsim.paper.verdicts import NOISE, by_claim
from ccwsim.report.document import Document, Facts, Judgements, Section, Text, surroundings

RUNS: dict[str, Callable[[ExperimentRun], Outcome]] = {
    **{
        name: partial(
            show_figure, MapFigure(where=about["place"].rsplit(", ")[-1], **about["figure"])
        )
        for name, about in PAPER_TEXTS["experiments"].items()
        if "figure" in about
    },
    "levels_and_data": partial(compare_methods, "channel", (100, 300, 400, 1000)),
    "stone_wall": partial(compare_methods, "stone wall", (300,)),
    "variability": variability,
    "grid_size": grid_size,
    "times_with_data": times_with_data,
}
"""Functions that run the experiments, by their names in the texts."""
EXPERIMENTS = tuple(
    Experiment(
        title=about["title"],
        place=about["place"],
        shows=about["shows"],
        run=RUNS[name],
        weight=about["weight"],
    )
    for name, about in PAPER_TEXTS["experiments"].items()
)
"""All experiments, in the order of the paper's sections; weights are seconds (`PROBE_SECONDS`)."""
PROBE_SHAPE, PROBE_SECONDS = (512, 512), 0.013
"""Grid of a timed realization, and its CPU seconds where the weights were measured."""
QUICK_SECONDS = 15.0  # duration of a quick run there


@dataclass(frozen=True, eq=False)
class Finished:
    """A finished experiment with its outcome, or with the problem that stopped the experiment."""

    experiment: Experiment
    outcome: Outcome | None
    problem: str
    seconds: float


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Result of a run: the finished experiments, in the order of the paper."""

    inputs: PaperInputs
    extent: Extent
    seed: int
    finished: tuple[Finished, ...]
    stopped: bool
    seconds: float

    @property
    def words(self) -> Counter[str]:
        """Number of claims for each verdict, such as "agrees"; a claim counts once."""
        outcomes = [f.outcome for f in self.finished if f.outcome is not None]
        every = by_claim(j for outcome in outcomes for j in outcome.judgements)
        return Counter(judgement.word for judgement in every)


def reproduce(
    inputs: PaperInputs | None = None,
    extent: Extent = FULL,
    seed: int = 0,
    progress: Callable[[float, int], None] | None = None,
    cancel: Callable[[], bool] | None = None,
    experiments: Sequence[Experiment] = EXPERIMENTS,
    on_finished: Callable[[Finished], None] | None = None,
) -> Reproduction:
    """Run experiments of the paper; a stopped run returns the finished experiments."""
    start, finished, stopped = time.perf_counter(), [], False

    def tried(experiment: Experiment, watch: Watch) -> Finished:
        return _tried(experiment, ExperimentRun(inputs or PaperInputs(), extent, seed, watch))

    weights = [experiment.weight for experiment in experiments]
    try:
        for result in run_trials(experiments, tried, weights, Watch(progress, cancel)):
            finished.append(result)
            if on_finished:
                on_finished(result)
    except Cancelled:
        stopped = True
    return Reproduction(
        inputs=inputs or PaperInputs(),
        extent=extent,
        seed=seed,
        finished=tuple(finished),
        stopped=stopped,
        seconds=time.perf_counter() - start,
    )


def expected_duration(inputs: PaperInputs, extent: Extent) -> float:
    """Return about the seconds that all experiments take here, from a simulation timed now."""
    p, image = paper_parameters("ccwsim", 1, "ours"), inputs.image("channel")
    probe = Trial.of(image, PROBE_SHAPE, p)
    seconds = min(float(probe.simulate(1, n_workers=1).cpu_seconds[0]) for _ in range(3))
    return usual_seconds(extent) * seconds / PROBE_SECONDS


def usual_seconds(extent: Extent) -> float:
    """Return about the seconds that all experiments take on an ordinary machine with two cores."""
    if not extent.is_full:
        return QUICK_SECONDS
    larger = max(extent.timed_sides) ** 2 / max(FULL.timed_sides) ** 2 - 1
    return (
        sum(e.weight for e in EXPERIMENTS)
        + larger * PAPER_TEXTS["experiments"]["grid_size"]["weight"]
    )


def with_largest_grid(extent: Extent, side: int | None) -> Extent:
    """Return a copy of an extent whose largest timed grid has `side` × `side` cells."""
    if side is None:
        return extent
    if not 64 <= side <= 10_000:
        raise CCWSIMError(f"the largest grid's side {side} must be from 64 to 10000 cells")
    return replace(extent, timed_sides=tuple(round(side * k / 5) for k in range(1, 6)))


def _tried(experiment: Experiment, run: ExperimentRun) -> Finished:
    """Run one experiment; an error is reported and does not stop the other experiments."""
    start = time.perf_counter()
    outcome, problem = None, ""
    try:
        outcome = experiment.run(run)
        outcome = replace(outcome, judgements=by_claim(outcome.judgements))
    except Cancelled:
        raise
    except CCWSIMError as error:
        problem = str(error)
    except MemoryError:
        problem = "the experiment does not fit into memory"
    except Exception as error:
        problem = f"{type(error).__name__}: {error}"
    return Finished(experiment, outcome, problem, time.perf_counter() - start)


def document_of(reproduction: Reproduction) -> Document:
    """Return the report: all verdicts, then a section for each experiment."""
    opening = [Text(reproduction_summary(reproduction)), Text(PAPER_TEXTS["known"])]
    if reproduction.extent.name != "full":
        opening.append(Text(PAPER_TEXTS["quick_run"]))
    if reproduction.stopped:
        opening.append(Text("The run was stopped before the missing experiments."))
    opening.append(Text(PAPER_TEXTS["words"].format(noise=round(100 * NOISE - 100)), quiet=True))
    return Document(
        PAPER_TEXTS["title"],
        tuple(map(_section, reproduction.finished)),
        subtitle=PAPER_TEXTS["paper"],
        opening=tuple(opening),
        colophon=Facts((*surroundings(), *_run_facts(reproduction))),
    )


def reproduction_summary(r: Reproduction) -> str:
    """Summarize the experiments in one sentence."""
    failed = sum(f.outcome is None for f in r.finished)
    tail = f", {failed} of them failed" if failed else ""
    counted = ", ".join(f"{n} × {word}" for word, n in r.words.most_common()) or "none"
    return f"{len(r.finished)} experiments were run{tail}. Verdicts: {counted}."


def verdict_of(finished: Finished) -> str:
    """Return as text the verdicts of an experiment, or the problem that stopped it."""
    if finished.outcome is None:
        return f"failed: {finished.problem}"
    counts = Counter(judgement.word for judgement in finished.outcome.judgements)
    return ", ".join(word if n == 1 else f"{n} × {word}" for word, n in counts.items())


def _section(finished: Finished) -> Section:
    e = finished.experiment
    first = Text(e.shows)
    if finished.outcome is None:
        words = Text(f"This experiment failed: {finished.problem}")
        return Section(e.title, (first, words), e.place, verdict_of(finished))
    judged = Judgements(finished.outcome.judgements, "The paper says", "Found here")
    return Section(
        e.title, (first, judged, *finished.outcome.blocks), e.place, verdict_of(finished)
    )


def _run_facts(r: Reproduction) -> tuple[tuple[str, str], ...]:
    folder = "the bundled training images and data"
    if r.inputs.folder is not None:
        folder = f"training images and data of the folder “{r.inputs.folder.name}”"
    took = ", ".join(f"{f.experiment.title} {duration(f.seconds)}" for f in r.finished)
    return (
        ("Inputs", folder),
        ("Extent", said("extent", x=r.extent)),
        ("Seed", str(r.seed)),
        ("Parameters", f"{AUTHORS_SETTINGS}, unless a section states other values"),
        ("Time", f"{duration(r.seconds)} in all; {took}"),
    )
