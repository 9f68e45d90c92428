"""Run all experiments of the paper in order, and report the results."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.numbers import seconds
from ccwsim.paper.comparison import sampled_data, stone_wall, variability
from ccwsim.paper.experiment import FULL, Experiment, ExperimentRun, Extent, Outcome
from ccwsim.paper.inputs import PaperInputs
from ccwsim.paper.methods import SETTINGS
from ccwsim.paper.realizations import (
    conditional,
    dense_data,
    limits,
    statistics,
    three_facies,
    unconditional,
)
from ccwsim.paper.times import grid_size, times_with_data
from ccwsim.paper.verdicts import NOISE, by_claim
from ccwsim.report.document import Block, Document, Facts, Judgements, Section, Text, surroundings

EXPERIMENTS = (
    Experiment(
        "Unconditional realizations",
        "Section 5.1, Fig. 6",
        "Fig. 6 shows the channel training image and three unconditional realizations; the mean "
        "CPU time is 6.52 s.",
        unconditional,
    ),
    Experiment(
        "Conditional realizations and their average",
        "Section 5.2, Fig. 7",
        "Fig. 7 shows three conditional realizations of the channel image and the average of 100; "
        "the mean CPU time is 2.42 s.",
        conditional,
    ),
    Experiment(
        "Variograms and probability of connection",
        "Section 5.3, Fig. 9",
        "Fig. 9 shows variograms (E–W and N–S) and the probability of connection (E–W) of the "
        "channel image and of 100 realizations; the values of the curves are not available.",
        statistics,
    ),
    Experiment(
        "CCWSIM against MS-CCSIM at several levels",
        "Section 5.4, Fig. 10",
        "Fig. 10 compares conditional simulations of CCWSIM and MS-CCSIM at different levels and "
        "numbers of data, which are sampled from an unconditional realization (section 5.2). The "
        "paper calls the methods comparable, with better connectivity and patterns for CCWSIM.",
        sampled_data,
    ),
    Experiment(
        "The stone wall",
        "Section 5.4, Fig. 11",
        "Fig. 11 shows conditional simulations of the stone wall image with 300 data by CCWSIM and "
        "MS-CCSIM, without numbers.",
        stone_wall,
    ),
    Experiment(
        "Variability within and between realizations",
        "Section 5.5, Table 1, Fig. 12",
        "Table 1 gives ANODI's distances “between” and “within” of CCWSIM relative to MS-CCSIM (50 "
        "realizations, three resolutions). Their ratio r is 1.19 for the stone wall and 1.01 for "
        "the channels. Fig. 12 shows realizations and training image by multidimensional scaling.",
        variability,
    ),
    Experiment(
        "CPU time against grid size",
        "Section 5.6, Fig. 13",
        "Fig. 13 shows mean CPU times of 20 conditional realizations for five grids at levels 1, 2 "
        "and 3. The largest grid, 25 million cells, takes 56, 32 and 31 s. The mean change of time "
        "is −54.8 % from level 1 to 2 and −17.4 % from level 2 to 3.",
        grid_size,
    ),
    Experiment(
        "CPU time with many data",
        "Section 5.6, Table 2",
        "Table 2 gives CPU times with 1000 and 2000 data for three images. For the channel image, "
        "MS-CCSIM takes 26.78 and 41.18 s at level 1, and 2.35 and 3.42 s at level 3. CCWSIM takes "
        "10.45 and 23.09 s at level 1, and 2.49 and 2.82 s at level 3.",
        times_with_data,
        weight=6.0,
    ),
    Experiment(
        "Dense data, beside the reference image",
        "Section 5.7, Fig. 14",
        "Fig. 14 shows a reference image and three simulations with 4000 of its cells as data; "
        "the mean CPU time is 1.06 s. Fig. 15 shows the stone wall with 8000 data; this report "
        "does not repeat it.",
        dense_data,
    ),
    Experiment(
        "Three facies on a large grid",
        "Section 5.8, Fig. 16",
        "Fig. 16 shows three facies on 1000 × 1000 cells at level 2; the CPU time is 3.50 s. The "
        "authors' files have 400 data for this case.",
        three_facies,
    ),
    Experiment(
        "Limits: nonstationary training images",
        "Section 5.9, Fig. 17",
        "Section 5.9 names nonstationary training images as a limit of the method; Fig. 17 shows "
        "the Sundarbans, an image that is not available.",
        limits,
    ),
)
"""All experiments, in the order of the paper's sections."""

TITLE = "CCWSIM: the paper's experiments, run again"
PAPER = (
    "Bavandsavadkoohi, M., Gloaguen, E., Tokhmechi, B., Arab-Amiri, A. and Giroux, B. (2024): "
    "CCWSIM, sections 5.1 to 5.9, Figs. 6 to 17, Tables 1 and 2"
)
KNOWN = (
    "The paper states Tables 1 and 2, the CPU times of Figs. 6 to 8, 13, 14 and 16, and the "
    "changes between levels of Fig. 13. The paper's curves, maps and images of Ganges and "
    "Sundarbans are not available; the report states which numbers are unknown. The paper's "
    "seconds were measured with MATLAB on another machine (Core i7 at 2.6 GHz). Therefore only "
    "ratios within one run can be compared."
)
QUICK_RUN = (
    "This was a quick run on small grids with few realizations, which only checks that the program "
    "works. For valid verdicts, do the full run."
)
WORDS = (
    "“agrees”, “differs”: the paper's statement holds or does not hold in this run. “better”, "
    "“behind”: our number is better or worse than the other. “in part”: the statement holds for "
    "one of two measures, for some lags or for some of the listed cases. “surrounded”: the image's "
    "curve is among the realizations' curves. “less time”: our run is faster, but the paper's "
    "machine differs. “not comparable”: our grid differs from the paper's grid, or realizations "
    "are too few. Two ratios have the “same order” if both "
    f"are below 1, above 1 or within {100 * NOISE - 100:.0f} % of 1. Ratios agree if they "
    "differ by less than two standard errors: jackknife errors of ANODI ratios, and "
    f"{100 * NOISE - 100:.0f} % for CPU times."
)


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
    """Run experiments of the paper, by default all experiments on the bundled images.

    `progress` is called as progress(fraction, number of finished experiments), and `on_finished`
    with each finished experiment. If `cancel` returns True, the run stops, and the result contains
    the finished experiments.

    Examples
    --------
    >>> reproduce(experiments=()).stopped
    False
    """
    start, finished, stopped = time.perf_counter(), [], False
    cancelled = cancel or (lambda: False)
    ends = list(accumulate((e.weight for e in experiments), initial=0.0))
    for k, experiment in enumerate(experiments):

        def share(done: float, k: int = k) -> None:
            if progress:
                progress((ends[k] + done * experiments[k].weight) / ends[-1], k)

        run = ExperimentRun(inputs or PaperInputs(), extent, seed, share, cancelled)
        try:
            if cancelled():
                raise Cancelled("stopped")
            finished.append(_tried(experiment, run))
        except Cancelled:
            stopped = True
            break
        if on_finished:
            on_finished(finished[-1])
        if progress:
            progress(ends[k + 1] / ends[-1], k + 1)
    seconds = time.perf_counter() - start
    return Reproduction(inputs or PaperInputs(), extent, seed, tuple(finished), stopped, seconds)


def with_largest_grid(extent: Extent, side: int | None) -> Extent:
    """Return a copy of an extent whose largest timed grid has `side` × `side` cells.

    Raises `CCWSIMError` for a side that is too small or too large.

    Examples
    --------
    >>> with_largest_grid(FULL, 5000).timed_sides
    (1000, 2000, 3000, 4000, 5000)
    """
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
    return Document(
        TITLE,
        tuple(map(_section, reproduction.finished)),
        subtitle=PAPER,
        opening=_opening(reproduction),
        colophon=Facts((*surroundings(), *_run_facts(reproduction))),
    )


def _opening(r: Reproduction) -> tuple[Block, ...]:
    blocks: list[Block] = [Text(summary(r)), Text(KNOWN)]
    if r.extent.name != "full":
        blocks.append(Text(QUICK_RUN))
    if r.stopped:
        blocks.append(Text("The run was stopped before the missing experiments."))
    blocks.append(Text(WORDS, quiet=True))
    return tuple(blocks)


def summary(r: Reproduction) -> str:
    """Summarize the experiments in one sentence.

    Examples
    --------
    >>> summary(reproduce(experiments=()))
    '0 experiments were run. Verdicts: none.'
    """
    failed = sum(f.outcome is None for f in r.finished)
    tail = f", {failed} of them failed" if failed else ""
    counted = ", ".join(f"{n} × {word}" for word, n in r.words.most_common()) or "none"
    return f"{len(r.finished)} experiments were run{tail}. Verdicts: {counted}."


def verdict_of(finished: Finished) -> str:
    """Return as text the verdicts of an experiment, or the problem that stopped the experiment.

    Examples
    --------
    >>> verdict_of(Finished(EXPERIMENTS[0], None, "no memory", 1.0))
    'failed: no memory'
    """
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
    x = r.extent
    extent = (
        f"{x.name}: {x.n_many} realizations instead of the paper's 100, {x.n_few} for comparing "
        f"methods, {x.n_anodi} for distances, {x.n_timed} for times"
    )
    took = ", ".join(f"{f.experiment.title} {seconds(f.seconds)}" for f in r.finished)
    return (
        ("Inputs", folder),
        ("Extent", extent),
        ("Seed", str(r.seed)),
        ("Parameters", f"{SETTINGS}, unless a section states other values"),
        ("Time", f"{seconds(r.seconds)} in all; {took}"),
    )
