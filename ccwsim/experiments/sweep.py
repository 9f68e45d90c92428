"""Parameter sweeps: many settings of one study, judged and compared."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.metrics import Quality, judge
from ccwsim.metrics.diagnosis import MIN_ACROSS, templates_that_fit
from ccwsim.model.arrays import check_int
from ccwsim.model.errors import Cancelled, CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate
from ccwsim.system.workers import Progress

RANGED = {
    "method": "",
    "template_size": "T",
    "overlap_size": "OR",
    "wavelet_level": "level",
    "n_candidates": "K",
    "search_fraction": "search",
}
"""The parameters that may have a range, and their signs in a label."""
CELL, LOCATION, PRODUCT, DATUM = 2e-8, 1.2e-9, 1.2e-11, 1.8e-12
"""Seconds on one core of 2024: to cut and paste a cell, to visit a location of the training image,
to multiply two coefficients, and to compare a window's cell with one of the training image."""
JUDGING = 6e-8
"""Seconds a cell to judge a realization."""
ERRORS = {
    "patterns": lambda quality: quality.pattern_distance,
    "connection": lambda quality: quality.tau_error,
    "mended": lambda quality: quality.n_resimulated + quality.n_forced,
}
"""Errors of a setting, as numbers of its `Quality`; less is better."""
PATTERN_TOLERANCE = 0.1
"""Pattern distances within this share of the smallest count as equally good."""
TAU_TOLERANCE = 0.03
"""Errors of τ(h) within this of the smallest count as equally good."""


@dataclass(frozen=True)
class Settings:
    """The settings that a sweep tries."""

    fitting: tuple[Parameters, ...]  # the combinations that fit together, each once
    # the others: the values of each, and why they do not fit
    left_out: tuple[tuple[dict[str, Any], str], ...] = ()
    # how many were left out as they simulate the same as another: "ccsim" has no level
    n_equal: int = 0

    def __len__(self) -> int:
        return len(self.fitting)

    def __iter__(self) -> Iterator[Parameters]:
        return iter(self.fitting)


def settings(
    base: Parameters,
    ranges: Mapping[str, Sequence[Any]],
    image_shape: tuple[int, int] | None = None,
) -> Settings:
    """Return all combinations of ranges that fit together.

    Parameters
    ----------
    base : Parameters
        What is not in the ranges.
    ranges : mapping of str to sequence
        Values by the name of a parameter of `RANGED`.
    image_shape : pair of int, optional
        Of the training image; templates larger than it are left out.

    Returns
    -------
    Settings

    Raises
    ------
    CCWSIMError
        For the name of another parameter, or a range without a value.

    Examples
    --------
    >>> found = settings(Parameters(), {"wavelet_level": [1, 3], "overlap_size": [8, 12]})
    >>> [(p.wavelet_level, p.overlap_size) for p in found], found.left_out[0][1]
    ([(1, 8), (3, 8), (1, 12)], 'Overlap 12 must be a multiple of 8 at level 3: try 8 or 16')
    """
    for name, values in ranges.items():
        if name not in RANGED:
            raise CCWSIMError(f"{shown(name)} has no range: choose from {', '.join(RANGED)}")
        if not len(values):
            raise CCWSIMError(f"{name} has no value to try: give at least one")
    names = [name for name in RANGED if name in ranges]
    fitting: dict[Parameters, Parameters] = {}
    left_out: list[tuple[dict[str, Any], str]] = []
    n_equal = 0
    for values in product(*(dict.fromkeys(ranges[name]) for name in names)):
        changes = dict(zip(names, values, strict=True))
        try:
            parameters = replace(base, **changes)
            _check_fits(parameters, image_shape)
        except CCWSIMError as error:
            left_out.append((changes, str(error)))
            continue
        n_equal += _canonical(parameters) in fitting
        fitting.setdefault(_canonical(parameters), parameters)
    return Settings(tuple(fitting.values()), tuple(left_out), n_equal)


def varied(parameters: Iterable[Parameters]) -> list[str]:
    """Return which of the ranged parameters are not the same in all settings.

    Examples
    --------
    >>> varied([Parameters(), Parameters(template_size=48)])
    ['template_size']
    """
    found = list(parameters)
    return [name for name in RANGED if len({_value(p, name) for p in found}) > 1]


def label(parameters: Parameters, names: Iterable[str]) -> str:
    """Return a setting in one short line.

    Examples
    --------
    >>> label(Parameters(), ["template_size", "wavelet_level"])
    'T 32 · level 2'
    """
    parts = []
    for name in names:
        value = _value(parameters, name)
        if name == "wavelet_level" and parameters.method == "ccsim":
            continue
        text = f"{value:g}" if isinstance(value, float) else str(value)
        parts.append(f"{RANGED[name]} {text}".strip())
    return " · ".join(parts)


def _canonical(p: Parameters) -> Parameters:
    """Return equal parameters for all settings that simulate the same."""
    return replace(p, wavelet_level=0) if p.method == "ccsim" else p


def _value(p: Parameters, name: str) -> Any:
    return p.level if name == "wavelet_level" else getattr(p, name)


def _check_fits(p: Parameters, image_shape: tuple[int, int] | None) -> None:
    if image_shape is not None and p.template_size > min(image_shape):
        ny, nx = image_shape
        raise CCWSIMError(
            f"Template {p.template_size} is larger than the training image of {nx} × {ny}"
        )


def expected_seconds(
    parameters: Parameters,
    image_shape: tuple[int, int],
    grid_shape: tuple[int, int],
    n_facies: int = 2,
    n_data: int = 0,
) -> float:
    """Return the expected seconds of one realization, its judgement included.

    Right within a factor of about three; the relation between settings is what matters.
    """
    p, shrunk = parameters, 2**parameters.level
    size, overlap = p.template_size, p.overlap_size
    cells, image_cells = grid_shape[0] * grid_shape[1], image_shape[0] * image_shape[1]
    n_tiles = cells / p.step**2
    locations = 1.0
    for side in image_shape:
        locations *= max(side - size, 0) / shrunk + 1
    planes = 1 if n_facies <= 2 else n_facies
    products = planes * (2 * size - overlap) * overlap / shrunk**2
    raster = n_tiles * (size**2 * CELL + locations * (LOCATION + products * PRODUCT))
    return raster + n_data * size**2 * image_cells * DATUM + cells * JUDGING


@dataclass(frozen=True, eq=False)
class Row:
    """One setting of a sweep, and its result.

    Attributes
    ----------
    parameters : Parameters
    quality : Quality
    realizations : ndarray of uint8, shape (n_kept, ny, nx)
        The first few, as facies indices.
    """

    parameters: Parameters
    quality: Quality
    realizations: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Sweep:
    """The result of a sweep.

    Attributes
    ----------
    rows : tuple of Row
        The settings that were finished, in the order they were asked for.
    failed : tuple of (Parameters, str)
        Settings that could not be simulated, and why.
    n_asked : int
        How many settings were asked for.
    image_shape : pair of int
        Of the training image.
    """

    rows: tuple[Row, ...]
    failed: tuple[tuple[Parameters, str], ...]
    n_asked: int
    image_shape: tuple[int, int]

    @property
    def stopped(self) -> bool:
        """Whether it was cancelled before all settings were finished."""
        return len(self.rows) + len(self.failed) < self.n_asked

    @property
    def times(self) -> NDArray[np.float64]:
        """CPU seconds of a realization, by setting."""
        return np.array([row.quality.cpu_seconds for row in self.rows])

    def errors(self, kind: str = "patterns") -> NDArray[np.float64]:
        """Return one of `ERRORS`, by setting."""
        return np.array([ERRORS[kind](row.quality) for row in self.rows], dtype=float)


def sweep(
    training_image: TrainingImage,
    grid_shape: tuple[int, int] | Grid,
    settings: Sequence[Parameters],
    hard_data: HardData | None = None,
    n_realizations: int = 4,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Callable[[], bool] | None = None,
    found: Callable[[Row], None] | None = None,
    n_kept: int = 2,
    facies: int | None = None,
) -> Sweep:
    """Simulate each setting from the same seed, on one thread for fair times, and judge it.

    Parameters
    ----------
    training_image, grid_shape, hard_data, seed
        As in `simulate`.
    settings : sequence of Parameters
        As `settings` gives them.
    n_realizations : int
        Of each setting.
    progress : callable, optional
        Called as progress(fraction, n_done), n_done settings of all; the fraction is of the
        expected time.
    cancel : callable, optional
        Returns True to stop; what is finished by then is returned.
    found : callable, optional
        Called with each `Row` as it comes.
    n_kept : int
        How many realizations of each setting are kept.
    facies : int, optional
        Index into the codes of the facies whose connectivity is judged.

    Returns
    -------
    Sweep

    Raises
    ------
    CCWSIMError
        Where there is no setting.

    Examples
    --------
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> tried = [Parameters(8, 2, 1), Parameters(16, 4, 1)]
    >>> sweep(stripes, (40, 50), tried, n_realizations=2).errors().shape
    (2,)
    """
    if not len(settings):
        raise CCWSIMError("there is no setting to try: give ranges that fit together")
    n, grid = check_int("n_realizations", n_realizations, 1), Grid.of(grid_shape)
    data = HardData() if hard_data is None else hard_data
    sizes = training_image.shape, grid.shape, training_image.n_facies, data.n
    ahead = np.cumsum([0.0, *(expected_seconds(p, *sizes) for p in settings)])
    rows: list[Row] = []
    failed: list[tuple[Parameters, str]] = []
    for k, parameters in enumerate(settings):
        if cancel and cancel():
            break

        def report(share: float, _: int, k: int = k) -> None:
            if progress:
                progress((ahead[k] + share * (ahead[k + 1] - ahead[k])) / ahead[-1], k)

        try:
            study = training_image, grid, parameters, data, n, seed
            ensemble = simulate(*study, n_workers=1, progress=report, cancel=cancel)
            row = Row(parameters, judge(ensemble, facies), _first(ensemble.indices, n_kept))
        except Cancelled:
            break
        except CCWSIMError as error:
            failed.append((parameters, str(error)))
            continue
        rows.append(row)
        if found:
            found(row)
        report(1.0, n, k)
    if progress and len(rows) + len(failed) == len(settings):
        progress(1.0, len(settings))
    return Sweep(tuple(rows), tuple(failed), len(settings), training_image.shape)


def _first(indices: NDArray[np.uint8], n: int) -> NDArray[np.uint8]:
    """Return a read-only copy of the first n, so that the others can be given back."""
    kept = indices[: max(n, 1)].copy()
    kept.setflags(write=False)
    return kept


@dataclass(frozen=True)
class Recommendation:
    """A setting to take."""

    index: int  # which row of the sweep
    reason: str  # why, in words


def pareto_front(times: ArrayLike, errors: ArrayLike) -> NDArray[np.int64]:
    """Return the Pareto front: no other point is as good in both and better in one.

    Raises
    ------
    CCWSIMError
        Where there are not as many times as errors.

    Examples
    --------
    >>> pareto_front([1.0, 2.0, 3.0], [5.0, 6.0, 4.0])
    array([0, 2])
    """
    t, e = np.asarray(times, dtype=float), np.asarray(errors, dtype=float)
    if t.shape != e.shape or t.ndim != 1:
        raise CCWSIMError(f"{t.size} times and {e.size} errors: one of each a setting is needed")
    front: list[int] = []
    best = np.inf
    for k in np.lexsort((e, t)):
        if np.isnan(t[k]) or np.isnan(e[k]):
            continue
        twin = bool(front) and t[front[-1]] == t[k] and e[front[-1]] == e[k]
        if e[k] < best or twin:
            front.append(int(k))
            best = e[k]
    return np.array(front, np.int64)


def recommended(sweep: Sweep) -> Recommendation:
    """Return the fastest of the settings that are as good as the best.

    The settings are narrowed down in steps: those that miss the fewest data; those whose template
    fits the training image often enough not to repeat it; those whose pattern distance lies within
    a tenth of the smallest, or within its standard error; those whose error of τ(h) lies within
    0.03 of the smallest. The fastest of the rest is recommended.

    Raises
    ------
    CCWSIMError
        Where no setting is finished.
    """
    if not sweep.rows:
        raise CCWSIMError("no setting is finished yet: let the sweep go on")
    wrong = np.array([row.quality.n_mismatched for row in sweep.rows])
    among = np.flatnonzero(wrong == wrong.min())
    sizes = [row.parameters.template_size for row in sweep.rows]
    fitting = [templates_that_fit(sweep.image_shape, size) for size in sizes]
    varied_enough = [k for k in among.tolist() if fitting[k] >= MIN_ACROSS**2]
    too_large = len(among) - len(varied_enough) if varied_enough else 0
    among = np.array(varied_enough or among)
    patterns, tau = sweep.errors("patterns"), sweep.errors("connection")
    best = among[np.argmin(patterns[among])]
    quality = sweep.rows[best].quality
    doubt = np.nan_to_num(quality.pattern_spread) / quality.n**0.5
    limit = patterns[best] + max(PATTERN_TOLERANCE * patterns[best], doubt)
    good = near = among[patterns[among] <= limit]
    known = near[~np.isnan(tau[near])]
    if len(known):
        good = known[tau[known] <= tau[known].min() + TAU_TOLERANCE]
    index = int(good[np.argmin(sweep.times[good])])
    return Recommendation(index, _reason(sweep, index, int(best), near.tolist(), too_large))


def _reason(sweep: Sweep, index: int, best: int, near: list[int], too_large: int) -> str:
    patterns, tau, times = sweep.errors("patterns"), sweep.errors("connection"), 1000 * sweep.times
    faster = [k for k in near if times[k] < times[index]]
    against = f"{patterns[index]:.3g} against {patterns[best]:.3g} bits"
    if len(sweep.rows) == 1:
        reason = "The only setting that is finished."
    elif index == best:
        reason = f"Its patterns are the closest to the training image's, {patterns[best]:.3g} bits"
        rest = f", and no setting as close is faster than its {times[index]:.3g} ms."
        reason += "." if faster else rest
    else:
        reason = f"Its patterns are as close to the training image's as the best ({against})"
        quicker = times[index] < times[best]
        reason += f", in {times[index]:.3g} instead of {times[best]:.3g} ms." if quicker else "."
    if faster:
        reason += (
            f" Of the settings as close it is the fastest with the right connectivity: the error "
            f"of τ(h) is {tau[index]:.2g}, that of faster ones {tau[faster].min():.2g} or more."
        )
    if sweep.rows[index].quality.n_mismatched:
        reason += " It does not honour all data; no setting does."
    if too_large:
        many = "setting has a template" if too_large == 1 else "settings have templates"
        reason += (
            f" {too_large} other {many} so large that fewer than {MIN_ACROSS**2} fit the training "
            "image: realizations would repeat pieces of it."
        )
    return reason
