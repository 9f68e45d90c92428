"""The statistics of the page Validate, and panels that show a statistic once it is computed."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
import streamlit as st

from ccwsim import CCWSIMError, Ensemble, TrainingImage, metrics
from ccwsim.figures import Bundle
from ccwsim.jobs.job import FIRST_RESULT_SECONDS
from ccwsim.jobs.statistics import Failure, StatisticsWorker, Task
from ccwsim.metrics.bands import Statistic
from ccwsim.metrics.lags import Direction, max_lag
from ccwsim.metrics.patterns import thinnest_n_layers
from ccwsim.metrics.reference_band import PATTERN_SIZES
from ccwsim.metrics.stack import Stack, as_image
from ccwsim.model import MAX_CURVES, UNKNOWN, Floats, Fraction, Int32s, Integers, Shape, Watch
from ccwsim.report.pictures import bundle_of, bundle_of_curves, layers_bundle
from ccwsim.run.simulation import simulate_study
from ccwsim.ui.results.charts import e_type_of
from ccwsim.ui.session import State, as_task, follow_tasks, queue_text, shared_values
from ccwsim.ui.widgets import button, in_row, step_note

MAX_MAP_LAG = 50
MAX_ANODI_REALIZATIONS = 200  # maximum number of realizations in the pairwise comparison of ANODI
MAX_OF_ZONES = 20  # maximum number of realizations whose zones are compared by patterns
DENSE_LAGS, STRIDE = 10, 4
"""Transiograms use every lag up to `DENSE_LAGS`, and every `STRIDE`-th lag above it."""
MIN_STOPPABLE = 3.0  # seconds of work after which the button to stop is shown
Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class LagMaps:
    """Variogram maps of the training image, and mean variogram maps of the realizations."""

    lags: Integers
    reference: Floats
    mean: Floats


@dataclass(frozen=True, eq=False)
class Compared(Generic[Value]):
    """A statistic of realizations, and the fit of realizations to crops of the training image."""

    value: Value
    fit: metrics.Fit | None


@dataclass(frozen=True, eq=False)
class GeobodiesCompared:
    """Geobodies and cell counts of realizations and image, and the fit to crops of the image."""

    each: metrics.Geobodies
    reference: metrics.Geobodies
    n_cells: int
    n_cells_reference: int
    fit: metrics.Fit | None
    joins: metrics.Fit | None


@dataclass(frozen=True, eq=False)
class PatternsCompared:
    """Pattern distances of realizations, and of crops, from the training image.

    For each realization, `unseen` is the share of patterns of size `shape` that the image does not
    contain. `unseen_at_data` is the share among patterns with hard data, or None without data.
    """

    fit: metrics.Fit | None
    shape: Shape
    unseen: Floats
    unseen_at_data: Floats | None


def facies_code(ensemble: Ensemble, facies: int) -> int:
    """Return the code of a facies by its index."""
    return int(ensemble.training_image.codes[facies])


def first(ensemble: Ensemble, n: int) -> Stack:
    """Return the first n realizations of an ensemble."""
    return Stack(ensemble.indices[:n], ensemble.training_image.codes)


@as_task
def curves(
    progress: Fraction, ensemble: Ensemble, statistic: Statistic, facies: int, direction: Direction
) -> Compared[Bundle]:
    """Return a statistic of a facies along a direction, compared with crops of the image."""
    bundle = bundle_of(ensemble, statistic, facies, direction, progress)
    fit = metrics.fit_curve(ensemble, statistic, facies_code(ensemble, facies), direction)
    return Compared(bundle, fit)


@as_task
def lag_maps(progress: Fraction, ensemble: Ensemble, facies: int) -> LagMaps:
    """Return the variogram maps of a facies."""
    sides = (*ensemble.training_image.shape, *ensemble.study.whole_shape)
    reach = max(1, min(MAX_MAP_LAG, min(sides) // 2))
    code = facies_code(ensemble, facies)
    each = metrics.variogram_map(first(ensemble, MAX_CURVES), code, reach, progress)
    reference = metrics.variogram_map(ensemble.training_image, code, reach)
    return LagMaps(each.lags, reference.gamma[0], each.gamma.mean(axis=0))


@as_task
def transitions(
    progress: Fraction, ensemble: Ensemble, direction: Direction
) -> dict[tuple[int, int], Bundle]:
    """Return the transiograms of all pairs of facies along a direction."""
    facies = range(ensemble.training_image.n_facies)
    n_lags = max_lag(direction, ensemble.training_image.shape, ensemble.study.whole_shape)
    sparse = range(DENSE_LAGS + STRIDE, n_lags + 1, STRIDE)
    lags = np.array([*range(min(n_lags, DENSE_LAGS) + 1), *sparse])
    realizations = first(ensemble, MAX_CURVES)
    each = metrics.transiograms(realizations, None, direction, lags, progress).probability
    reference = metrics.transiograms(ensemble.training_image, None, direction, lags).probability[0]
    x = lags.astype(float)
    return {
        (tail, head): bundle_of_curves(x, reference[tail, head], each[:, tail, head])
        for tail in facies
        for head in facies
    }


layers = as_task(lambda progress, ensemble, k: layers_bundle(ensemble, k), "layers")
checks = as_task(lambda progress, ensemble: metrics.check_ensemble(ensemble, progress), "checks")
variety = as_task(lambda progress, ensemble: metrics.differing_share(ensemble), "variety")
e_type = as_task(lambda progress, ensemble: e_type_of(ensemble), "e_type")
diagnosis = as_task(lambda progress, image: metrics.diagnose(image), "diagnosis")
"""Statistics that are one call: curves of layers, checks, differences, E-type and diagnosis."""


@as_task
def volume_patterns(progress: Fraction, ensemble: Ensemble) -> PatternsCompared:
    """Return pattern distances between volumes and training image, and shares of new patterns."""
    image, data = ensemble.training_image, ensemble.hard_data
    size = min(PATTERN_SIZES[-1], *image.shape[-2:], *ensemble.grid.shape[-2:])
    sizes = [side for side in PATTERN_SIZES if side <= size]
    realizations = first(ensemble, MAX_ANODI_REALIZATIONS)
    unseen = metrics.unseen_patterns(realizations, image, size, progress=progress)
    at_data = None
    if data.n:
        mask = np.zeros(ensemble.grid.shape, bool)
        mask[tuple(data.cells.T)] = True
        at_data = metrics.unseen_patterns(realizations, image, size, mask, progress=progress)
    shape = min(size, image.shape[0], ensemble.grid.shape[0]), size, size
    return PatternsCompared(metrics.fit_patterns(ensemble, sizes), shape, unseen, at_data)


@as_task
def geobodies(
    progress: Fraction, ensemble: Ensemble, facies: int, neighbours: int | None = None
) -> GeobodiesCompared:
    """Return geobodies of a facies; by default, cells that touch at corners are connected."""
    image, code = ensemble.training_image, facies_code(ensemble, facies)
    return GeobodiesCompared(
        each=metrics.geobody_statistics(ensemble, code, neighbours, progress),
        reference=metrics.geobody_statistics(image, code, neighbours),
        n_cells=ensemble.n_active,
        n_cells_reference=int((image.indices != UNKNOWN).sum()),
        fit=metrics.fit_geobodies(ensemble, code, neighbours),
        joins=metrics.fit_joins(ensemble, code),
    )


@as_task
def compute_direction_error(progress: Fraction, ensemble: Ensemble, facies: int) -> Floats:
    """Return the differences between directions of a facies and the given angles, in degrees."""
    return metrics.direction_error(ensemble, facies_code(ensemble, facies))


class ZoneFit(NamedTuple):
    """A zone compared with its own image and, by patterns, with all images."""

    number: int
    size: float  # share of the active cells
    shares: Floats  # share of each facies by realization, shape (n, n_facies)
    of_image: Floats  # share of each facies in the zone's image, shape (n_facies,)
    far: list[float]  # mean distance of patterns by image; NaN if the zone is too small


@as_task
def zones(progress: Fraction, ensemble: Ensemble) -> list[ZoneFit]:
    """Compare zones with images, by facies and by patterns that do not cross a border."""
    secondary, codes, zone_fits = ensemble.secondary, ensemble.training_image.codes, []
    assert secondary is not None
    images = ensemble.training_image, *secondary.images
    layers = thinnest_n_layers(
        *(as_image(i, codes) for i in images), Stack(ensemble.indices[:1], codes)
    )
    image_histograms = [_patterns(image, codes, layers)[0] for image in images]
    for k, zone_image in enumerate(images):
        if not (inside := ensemble.study.active_mask & (secondary.zones == k)).any():
            continue
        zone_indices = np.where(inside, ensemble.indices, np.uint8(UNKNOWN))
        far = np.full((1, len(images)), np.nan)
        if len(_patterns(Stack(zone_indices[:1], codes), codes, layers)[0].codes):
            each = _patterns(Stack(zone_indices[:MAX_OF_ZONES], codes), codes, layers)
            far = np.array(
                [
                    [
                        metrics.js_divergence(histogram, image_histogram)
                        for image_histogram in image_histograms
                    ]
                    for histogram in each
                ]
            )
        shares, (image_shares,) = (
            metrics.proportions(k, codes) for k in (Stack(zone_indices, codes), zone_image)
        )
        size = inside.sum() / ensemble.n_active
        zone_fits.append(ZoneFit(k, size, shares, image_shares, far.mean(axis=0).tolist()))
        Watch.of_share(progress).tell((k + 1) / len(images))
    return zone_fits


def _patterns(images: Any, codes: Any, layers: int) -> list[metrics.PatternHistogram]:
    """Return the patterns of each image at full resolution."""
    return [row[0] for row in metrics.pyramid_histograms(images, codes, factors=[1], layers=layers)]


@as_task
def measures(progress: Fraction, ensemble: Ensemble, facies: int) -> metrics.Measured:
    """Return all measures of a facies that are single numbers."""
    return metrics.measure(ensemble, facies_code(ensemble, facies), progress)


@as_task
def flow_fit(progress: Fraction, ensemble: Ensemble, facies: int) -> metrics.FlowFit:
    """Return the flow efficiency of a facies, compared with crops of the image."""
    return metrics.fit_flow(ensemble, facies_code(ensemble, facies), progress)


@as_task
def compare_proportions(progress: Fraction, ensemble: Ensemble) -> Compared[Floats]:
    """Return the facies proportions of each realization."""
    return Compared(ensemble.proportions, metrics.fit_proportions(ensemble))


@as_task
def patterns(progress: Fraction, ensemble: Ensemble) -> metrics.Anodi:
    """Return ANODI of the realizations against the training image."""
    return metrics.anodi(
        first(ensemble, MAX_ANODI_REALIZATIONS), ensemble.training_image, progress=progress
    )


@as_task
def reference_scores(
    progress: Fraction, ensemble: Ensemble, reference: TrainingImage
) -> tuple[metrics.ReferenceScores, metrics.Calibration]:
    """Return the scores of the probabilities in the cells without data."""
    e_type = e_type_of(ensemble)
    scored = np.ones(ensemble.grid.shape, bool)
    scored[tuple(ensemble.hard_data.cells.T)] = False
    scores = metrics.score_reference(e_type, reference, scored=scored)
    return scores, metrics.calibration(e_type, reference, scored=scored)


@as_task
def copied(progress: Fraction, ensemble: Ensemble, r: int) -> metrics.Copying:
    """Return the pieces copied in realization r; if its sources are unknown, simulate r again."""
    sources, image = sources_of(ensemble, r), ensemble.training_image
    study_sources = np.where(sources < image.indices.size, sources, -1)  # -1: from another image
    return metrics.copying(study_sources, image.shape, ensemble.active)


def sources_of(ensemble: Ensemble, r: int) -> Int32s:
    """Return the flat source index of each cell; raise an error if r was edited after the run."""
    if ensemble.sources is not None:
        return ensemble.sources[r]
    first = int(ensemble.numbers[r])
    again = simulate_study(ensemble.study, first_realization=first, keep_sources=True)
    if again.sources is None or not np.array_equal(again.indices[0], ensemble.indices[r]):
        raise CCWSIMError(
            "data were edited after this realization was simulated, so the sources of its cells "
            "are unknown; run the study again to see the sources"
        )
    return again.sources[0]


@dataclass
class Validation:
    """The state of the page."""

    azimuth: int = 45  # azimuth of the third variogram in degrees from north
    along: str = "E-W"  # direction of the transiograms
    tail: int = 0  # facies in which transiograms start, if there are many facies
    slice_axis: int = 0  # axis of the slice that maps of a volume show
    slice_at: dict[int, int] = field(default_factory=dict)  # index of the slice, by axis
    neighbours: int = 26  # number of neighbours that connect cells of geobodies in volumes
    unfolded: set[str] = field(default_factory=set)  # sections whose content is drawn
    asked: set[tuple] = field(default_factory=set)  # keys of tasks that begin only on demand
    # function that drew the latest content, by panel
    drawn: dict[str, Callable[[], Any]] = field(default_factory=dict)
    waiting: dict[str, Task] = field(default_factory=dict)  # unfinished task, by panel
    worker: StatisticsWorker = field(default_factory=lambda: StatisticsWorker(shared_values()))
    deadline: float = 0.0  # time until which this run of the page waits for statistics


def begin(state: State) -> None:
    """Set the deadline until which this run of the page or fragment waits for statistics."""
    state.page(Validation).deadline = time.monotonic() + FIRST_RESULT_SECONDS


def panel(state: State, name: str, task: Task[Value], draw: Callable[[Value], None]) -> None:
    """Draw a statistic; until it is computed, draw the earlier content of the panel dimmed."""
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
            button("Stopped: compute", key=f"go_on_{name}", on_click=worker.go_on)
        else:
            bar = '<div class="working" role="progressbar" aria-label="computing">'
            st.html(f"{bar}<i></i></div>")


def known(state: State, task: Task[Value]) -> Value | None:
    """Return the value of a task, or None if it has not been computed yet."""
    value = state.page(Validation).worker.memo.get(task.key)
    return None if isinstance(value, Failure) else value


def draw_work(state: State) -> None:
    """Follow unfinished statistics; called at the end of a page, so no element below moves."""
    page_state = state.page(Validation)
    waiting = dict(page_state.waiting)
    if waiting and not page_state.worker.stopped:
        worker = page_state.worker
        tasks = list(waiting.values())
        follow_tasks(worker, tasks, time.monotonic(), lambda n: _fill(worker, waiting, n))


def _fill(worker: StatisticsWorker, waiting: dict[str, Task], n: int) -> None:
    """Update the progress bars of all waiting panels in a single fragment."""
    bars = "".join(
        f".st-key-waiting_{name} .working i {{ width: {100 * (worker.share_of(task) or 0):.0f}% }}"
        for name, task in waiting.items()
    )
    st.html(f"<style>{bars}</style>")
    job = worker.job
    if job is not None and (job.seconds > MIN_STOPPABLE or job.position):
        with in_row("work_bar"):
            text = f"Computing {n} more {'figures' if n > 1 else 'figure'}"
            if position := job.position:
                text = queue_text(position)
            st.html(f'<div class="note">{text}</div>')
            button("Stop", key="stop_work", on_click=worker.stop)
