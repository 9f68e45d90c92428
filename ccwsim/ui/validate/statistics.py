"""The statistics that the page works out, and panels that show each as soon as it is known."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.figures import Bundle
from ccwsim.jobs.job import PATIENCE
from ccwsim.jobs.statistics import Failure, Fraction, StatisticsWorker, Task
from ccwsim.metrics import (
    Anodi,
    Calibration,
    Copying,
    Diagnosis,
    EType,
    Fit,
    Geobodies,
    Measured,
    ReferenceScores,
    anodi,
    calibration,
    copying,
    diagnose,
    differing_share,
    fit_curve,
    fit_geobodies,
    fit_patterns,
    fit_proportions,
    fit_vertical_proportions,
    geobody_statistics,
    measure,
    score_reference,
    transiograms,
    unseen_patterns,
    variogram_map,
)
from ccwsim.metrics.bands import Statistic, curves_of
from ccwsim.metrics.fits import PATTERN_SIZES
from ccwsim.metrics.lags import Direction, distinct_lags, max_lag
from ccwsim.metrics.stack import Stack
from ccwsim.model.bounds import MAX_CURVES
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage
from ccwsim.report.pictures import bundle_of_curves, layers_bundle
from ccwsim.run.simulation import simulate
from ccwsim.system.lru_cache import LruCache
from ccwsim.ui.results.curves import e_type_of
from ccwsim.ui.session.fragments import follow_tasks
from ccwsim.ui.session.progress import queue_text
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.text import step_note

MAX_MAP_LAG = 50
MAX_COMPARED = 200
"""Realizations that ANODI compares, each with each."""
DENSE_LAGS, STRIDE = 10, 4
"""Transiograms take every lag up to here, and every fourth beyond."""
MAX_KEPT, MAX_KEPT_BYTES = 96, 256 * 10**6
MIN_KEPT = 24
"""Values that are kept however large they are: more than a page shows."""
MIN_STOPPABLE = 3.0
"""Seconds of work after which it can be stopped."""
Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class LagMaps:
    """Variogram maps: of the training image and the mean over realizations."""

    lags: NDArray[np.integer]
    reference: NDArray[np.float64]
    mean: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CurvesCompared:
    """Curves of the realizations and of the training image, and how crops of that compare."""

    bundle: Bundle
    fit: Fit | None


@dataclass(frozen=True, eq=False)
class GeobodiesCompared:
    """Geobodies of the realizations, of the training image, cells of both, and how they fit."""

    each: Geobodies
    reference: Geobodies
    n_cells: int
    n_cells_reference: int
    fit: Fit | None


@dataclass(frozen=True, eq=False)
class ProportionsCompared:
    """Facies proportions of each realization, and how their mean fits crops."""

    each: NDArray[np.float64]
    fit: Fit | None


@dataclass(frozen=True, eq=False)
class PatternsCompared:
    """Distances of patterns from the training image's beside those of its crops.

    By realization, `unseen` is the share of the patterns of a `shape` that the image never has,
    `unseen_at_data` that of those with hard data, None if there are none.
    """

    fit: Fit | None
    shape: tuple[int, ...]
    unseen: NDArray[np.float64]
    unseen_at_data: NDArray[np.float64] | None


def task_of(
    name: str, ensemble: Ensemble, work: Callable[[Fraction], Value], *more: Any
) -> Task[Value]:
    """Return a task on an ensemble; `more` is what else its value depends on."""
    study = ensemble.digest, ensemble.training_image.digest, ensemble.grid.shape
    return Task((name, *study, *more), work)


def code_of(ensemble: Ensemble, facies: int) -> int:
    """Return the code of a facies by its index."""
    return int(ensemble.training_image.codes[facies])


def first(ensemble: Ensemble, n: int) -> Stack:
    """Return the first n realizations."""
    return Stack(ensemble.indices[:n], ensemble.training_image.codes)


def curves(
    ensemble: Ensemble, statistic: Statistic, facies: int, direction: Direction
) -> Task[CurvesCompared]:
    """Return a statistic of a facies along a direction, and whether crops give the same."""
    image, code = ensemble.training_image, code_of(ensemble, facies)
    longest = max_lag(direction, image.shape, ensemble.grid.shape)
    lags, distances = distinct_lags(direction, longest)

    def work(progress: Fraction) -> CurvesCompared:
        some = first(ensemble, MAX_CURVES)
        each = curves_of(statistic, some, code, direction, lags, progress)
        reference = curves_of(statistic, image, code, direction, lags)[0]
        fit = fit_curve(ensemble, statistic, code, direction)
        return CurvesCompared(bundle_of_curves(distances, reference, each), fit)

    return task_of(statistic, ensemble, work, facies, direction)


def lag_maps(ensemble: Ensemble, facies: int) -> Task[LagMaps]:
    """Return variogram maps of a facies."""
    sides = (*ensemble.training_image.shape, *ensemble.grid.shape)
    reach = max(1, min(MAX_MAP_LAG, min(sides) // 2))
    code = code_of(ensemble, facies)

    def work(progress: Fraction) -> LagMaps:
        each = variogram_map(first(ensemble, MAX_CURVES), code, reach, progress)
        reference = variogram_map(ensemble.training_image, code, reach)
        return LagMaps(each.lags, reference.gamma[0], each.gamma.mean(axis=0))

    return task_of("lag maps", ensemble, work, facies)


def transitions(ensemble: Ensemble, direction: Direction) -> Task[dict[tuple[int, int], Bundle]]:
    """Return the transiograms of all pairs of facies along a direction."""
    n = ensemble.training_image.n_facies
    n_lags = max_lag(direction, ensemble.training_image.shape, ensemble.grid.shape)
    sparse = range(DENSE_LAGS + STRIDE, n_lags + 1, STRIDE)
    lags = np.array([*range(min(n_lags, DENSE_LAGS) + 1), *sparse])

    def work(progress: Fraction) -> dict[tuple[int, int], Bundle]:
        some = first(ensemble, MAX_CURVES)
        each = transiograms(some, None, direction, lags, progress).probability
        image = transiograms(ensemble.training_image, None, direction, lags).probability[0]
        x = lags.astype(float)
        return {
            (tail, head): bundle_of_curves(x, image[tail, head], each[:, tail, head])
            for tail in range(n)
            for head in range(n)
        }

    return task_of("transitions", ensemble, work, direction)


def layers(ensemble: Ensemble, facies: int) -> Task[CurvesCompared]:
    """Return the vertical proportion curves of a facies of volumes."""

    def work(progress: Fraction) -> CurvesCompared:
        fit = fit_vertical_proportions(ensemble, code_of(ensemble, facies))
        return CurvesCompared(layers_bundle(ensemble, facies), fit)

    return task_of("layers", ensemble, work, ensemble.grid, facies)


def volume_patterns(ensemble: Ensemble) -> Task[PatternsCompared]:
    """Return how near the patterns of volumes are to the training image's, and which are new."""
    image, data = ensemble.training_image, ensemble.hard_data
    size = min(PATTERN_SIZES[-1], *image.shape[-2:], *ensemble.grid.shape[-2:])
    sizes = [side for side in PATTERN_SIZES if side <= size]

    def work(progress: Fraction) -> PatternsCompared:
        some = first(ensemble, MAX_COMPARED)
        unseen = unseen_patterns(some, image, size, progress=progress)
        at_data = None
        if data.n:
            mask = np.zeros(ensemble.grid.shape, bool)
            mask[tuple(data.cells.T)] = True
            at_data = unseen_patterns(some, image, size, mask, progress=progress)
        shape = min(size, image.shape[0], ensemble.grid.shape[0]), size, size
        return PatternsCompared(fit_patterns(ensemble, sizes), shape, unseen, at_data)

    return task_of("volume patterns", ensemble, work, data.digest)


def geobodies(
    ensemble: Ensemble, facies: int, neighbours: int | None = None
) -> Task[GeobodiesCompared]:
    """Return the geobodies of a facies; cells at corners touch unless `neighbours` says other."""
    image, code = ensemble.training_image, code_of(ensemble, facies)

    def work(progress: Fraction) -> GeobodiesCompared:
        return GeobodiesCompared(
            geobody_statistics(ensemble, code, neighbours, progress),
            geobody_statistics(image, code, neighbours),
            ensemble.grid.n_cells,
            image.indices.size,
            fit_geobodies(ensemble, code, neighbours),
        )

    return task_of("geobodies", ensemble, work, facies, neighbours)


def measures(ensemble: Ensemble, facies: int) -> Task[Measured]:
    """Return the measures of a facies that are one number each."""
    code = code_of(ensemble, facies)
    return task_of("measures", ensemble, lambda report: measure(ensemble, code, report), facies)


def proportions(ensemble: Ensemble) -> Task[ProportionsCompared]:
    """Return the facies proportions of each realization."""

    def work(progress: Fraction) -> ProportionsCompared:
        return ProportionsCompared(ensemble.proportions, fit_proportions(ensemble))

    return task_of("proportions", ensemble, work)


def variety(ensemble: Ensemble) -> Task[float]:
    """Return the share of cells in which two realizations differ."""
    return task_of("variety", ensemble, lambda progress: differing_share(ensemble))


def patterns(ensemble: Ensemble) -> Task[Anodi]:
    """Return ANODI of the realizations against the training image."""

    def work(progress: Fraction) -> Anodi:
        return anodi(first(ensemble, MAX_COMPARED), ensemble.training_image, progress=progress)

    return task_of("patterns", ensemble, work)


def e_type(ensemble: Ensemble) -> Task[EType]:
    """Return probability, most likely facies and entropy of each cell."""
    return task_of("e-type", ensemble, lambda progress: e_type_of(ensemble))


def reference_scores(
    ensemble: Ensemble, reference: TrainingImage
) -> Task[tuple[ReferenceScores, Calibration]]:
    """Return the scores of the probabilities in the cells without data."""

    def work(progress: Fraction) -> tuple[ReferenceScores, Calibration]:
        found = e_type_of(ensemble)
        scored = np.ones(ensemble.grid.shape, bool)
        scored[tuple(ensemble.hard_data.cells.T)] = False
        scores = score_reference(found, reference, scored=scored)
        return scores, calibration(found, reference, scored=scored)

    return task_of("reference", ensemble, work, ensemble.hard_data.digest, reference.digest)


def diagnosis(image: TrainingImage) -> Task[Diagnosis]:
    """Return what a training image is like; it calls facies by the names of this user."""
    return Task(("diagnosis", image.digest, image.facies_names), lambda progress: diagnose(image))


def copied(ensemble: Ensemble, r: int) -> Task[Copying]:
    """Return what realization r copied, simulated again where its sources were not kept."""

    def work(progress: Fraction) -> Copying:
        return copying(sources_of(ensemble, r), ensemble.training_image.shape)

    run = ensemble.parameters.digest, ensemble.hard_data.digest, ensemble.seed
    more = *run, int(ensemble.numbers[r]), ensemble.sources is None
    return task_of("copying", ensemble, work, *more)


def sources_of(ensemble: Ensemble, r: int) -> NDArray[np.int32]:
    """Return the flat index in the training image of each cell of realization r.

    Raises `CCWSIMError` for a realization that was edited since its run.
    """
    if ensemble.sources is not None:
        return ensemble.sources[r]
    study = (ensemble.training_image, ensemble.grid, ensemble.parameters, ensemble.hard_data)
    number = int(ensemble.numbers[r])
    again = simulate(*study, 1, ensemble.seed, first_realization=number, keep_sources=True)
    if again.sources is None or not np.array_equal(again.indices[0], ensemble.indices[r]):
        raise CCWSIMError(
            "data were edited since this realization was simulated, and cells around them "
            "simulated again, so its sources are not known; run the study again to see them"
        )
    return again.sources[0]


@st.cache_resource(show_spinner=False)
def shared_values() -> LruCache:
    """Return the values that all sessions share; their keys are digests of contents."""
    return LruCache(MAX_KEPT, MAX_KEPT_BYTES, MIN_KEPT)


@dataclass
class Validation:
    """What the page remembers.

    `azimuth` is the direction of the third variogram, in degrees from north, `along` that of the
    transiograms, `tail` the facies they start in if there are many. Maps of volumes show a
    slice along `slice_axis`, by axis at `slice_at`; cells of their geobodies have `neighbours`.
    `seen` are the sections that came into view; others are not computed. `drawn` and `waiting` are
    what each panel drew last and the task it waits for; this run of the page waits until `deadline`
    for quick statistics.
    """

    azimuth: int = 45
    along: str = "E-W"
    tail: int = 0
    slice_axis: int = 0
    slice_at: dict[int, int] = field(default_factory=dict)
    neighbours: int = 26
    seen: set[str] = field(default_factory=set)
    drawn: dict[str, Callable[[], Any]] = field(default_factory=dict)
    waiting: dict[str, Task] = field(default_factory=dict)
    worker: StatisticsWorker = field(default_factory=lambda: StatisticsWorker(shared_values()))
    deadline: float = 0.0


def begin(state: State) -> None:
    """Let this run of the page, or of a part of it, wait for quick statistics."""
    state.page(Validation).deadline = time.monotonic() + PATIENCE


def panel(state: State, name: str, task: Task[Value], draw: Callable[[Value], None]) -> None:
    """Draw a statistic, or what this panel showed before, dimmed, while it is worked out."""
    page_state = state.page(Validation)
    worker = page_state.worker
    worker.ask(task)
    value = worker.wait_for(task, max(0.0, page_state.deadline - time.monotonic()))
    if isinstance(value, Failure):
        step_note(f"{value.reason[:1].upper()}{value.reason[1:]}.")
        return
    if value is not None:
        page_state.drawn[name] = lambda: draw(value)
        draw(value)
        return
    page_state.waiting[name] = task
    with st.container(key=f"waiting_{name}"):
        if name in page_state.drawn:
            with st.container(key=f"dim_{name}"):
                page_state.drawn[name]()
        if worker.stopped:
            button("Stopped: work it out", key=f"go_on_{name}", on_click=worker.go_on)
        else:
            bar = '<div class="working" role="progressbar" aria-label="working it out">'
            st.html(f"{bar}<i></i></div>")


def known(state: State, task: Task[Value]) -> Value | None:
    """Return a value only if it was computed already."""
    value = state.page(Validation).worker.cache.get(task.key)
    return None if isinstance(value, Failure) else value


def draw_work(state: State) -> None:
    """Follow what is still worked out; called last on the page, where its position is fixed."""
    page_state = state.page(Validation)
    waiting = dict(page_state.waiting)
    if waiting and not page_state.worker.stopped:
        worker = page_state.worker
        tasks = list(waiting.values())
        follow_tasks(worker, tasks, time.monotonic(), lambda n: _fill(worker, waiting, n))


def _fill(worker: StatisticsWorker, waiting: dict[str, Task], n: int) -> None:
    """Fill the bars of the panels that wait.

    One fragment does it for all: the browser gives up on a fragment in a panel that is replaced
    while it draws.
    """
    bars = "".join(
        f".st-key-waiting_{name} .working i {{ width: {100 * (worker.share_of(task) or 0):.0f}% }}"
        for name, task in waiting.items()
    )
    st.html(f"<style>{bars}</style>")
    if worker.seconds > MIN_STOPPABLE or worker.position:
        with st.container(horizontal=True, vertical_alignment="center", key="work_bar"):
            text = f"Working out {n} more {'figures' if n > 1 else 'figure'}"
            if position := worker.position:
                text = queue_text(position)
            st.html(f'<div class="note">{text}</div>')
            button("Stop", key="stop_work", on_click=worker.stop)
