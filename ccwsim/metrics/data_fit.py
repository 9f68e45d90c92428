"""Fit of hard data to a training image, judged before any conditional simulation.

Hard data can contradict a training image although every realization honours them. Four families of
statistics of the data are compared with the same statistics of unconditional realizations at the
locations of the data: proportions, pairs of equal facies by distance and direction, the likelihood
of all pairs, and the data events of `_Events`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import combinations, product
from math import log
from typing import NamedTuple

import numpy as np
from scipy import fft

from ccwsim import CCWSIMError, Grid, HardData, Parameters, TrainingImage
from ccwsim.jobs.workers import check_stop
from ccwsim.metrics.etype import proportions
from ccwsim.metrics.stack import N_AXES, Stack
from ccwsim.model import (
    Array,
    Bytes,
    Cancel,
    Float32s,
    Floats,
    Fraction,
    Int32s,
    Ints,
    Shape,
    Study,
    Watch,
    check_int,
    largest_sides,
    per_axis,
    ratio,
    refused,
    window_at,
)
from ccwsim.run.simulation import simulate_study

MAX_NEIGHBOURS = 5  # maximum number of data in the event of a datum
MAX_EVENT_TABLE = 2**18  # maximum facies combinations of an event; limits neighbours if many facies
BACK_OFF = 100.0  # weight, in placements, of the probability that is given by one neighbour less
MAX_LABELS = 8  # maximum number of distinguished facies; the rarest facies count as one
MIN_PLACES = 3  # minimum number of data
# maximum number of compared data; if there are more, a random part is compared
MAX_COMPARED_DATA = 2000
MAX_EVENTS = 400  # maximum number of data whose events are counted in the image
# maximum distance of a pair along each axis; also at most a third of the image
MAX_PAIR_DISTANCE = 64
MAX_PAIRS = 40_000
PAIRS_PER_BIN, BINS_PER_AXIS = 20, 4
"""Minimum number of pairs in a bin of distance, and maximum number of bins along each axis."""
MIN_LOG_PROBABILITY = 1e-4  # smallest probability in a logarithm
MAX_REJECTED_P = 0.025  # largest p value of data that contradict the image
MIN_PREFERENCE = 2.5  # smallest difference of proportions of data that may prefer a facies
MIN_GAIN = 0.02  # smallest expected gain in nats per datum; below it, too few data are near
MIN_Z = 2.0  # smallest difference of two mean scores in standard errors that is reported
MIN_JUDGED_DATA = 10  # minimum number of data, or of wells in a volume, for a verdict
MIN_VARIANT_Z = 3.5  # smallest z of an image as given if a variant is said to fit better
N_EXCHANGED = 4  # number of facies, the most frequent ones, of which two are exchanged
AS_GIVEN = "as given"
MIN_RANKED = 200  # minimum number of data for naming the image that predicts them best
RANGES = (6.0, 12.0, 24.0, 48.0, 96.0)
SHRINKAGES = (0.5, 2.0, 8.0)
"""Ranges in cells, and weights of the proportions, between which `_smoothing` chooses."""
N_FOLDS = 5


@dataclass(frozen=True)
class DataFit:
    """Result of `fit_data`."""

    p: float
    """Share of the null data sets that differ from the image at least as much as the data do."""
    families: dict[str, float]
    """Largest difference in each family of statistics, in standard deviations of the null."""
    score: float
    """Mean log probability of a datum given its neighbours, from counts in the image."""
    gain: float
    """`score` minus the mean log proportion of the image, in nats per datum."""
    expected_gain: float
    """Mean gain of null data sets."""
    smoothing: float
    """Mean log probability of a datum if the other data are smoothed, without an image."""
    z_smoothing: float
    """Mean difference of log probabilities, image − smoothing, in standard errors."""
    n: int
    """Number of independent data: wells in a volume."""
    preferred: str = ""
    """Facies that the data prefer, if data thinned to the image's proportions fit the image."""

    @property
    def family(self) -> str:
        """Name of the family that differs most."""
        return max(self.families, key=lambda name: self.families[name])

    @property
    def contradicts(self) -> bool:
        """Whether the data contradict the image, not by proportions alone: p ≤ 0.025."""
        return self.n >= MIN_JUDGED_DATA and self.p <= MAX_REJECTED_P and not self.preferred

    @property
    def words(self) -> str:
        """The verdict in few words."""
        if self.contradicts:
            return f"Data contradict this training image: {self.family}"
        if self.preferred:
            return f"Wells prefer {self.preferred}, or the image lacks it; otherwise it fits"
        if self.n < MIN_JUDGED_DATA or self.expected_gain < MIN_GAIN:
            return "Too few data to judge the image"
        if self.z_smoothing < -MIN_Z:
            return "Your data alone predict better than this image"
        return "Data do not contradict this training image"


def fit_data(
    image: TrainingImage,
    data: HardData,
    shape: Grid | tuple[int, ...],
    n_null: int = 40,
    seed: int = 0,
    parameters: Parameters | None = None,
    progress: Fraction | None = None,
    cancel: Cancel | None = None,
) -> DataFit:
    """Judge whether hard data contradict a training image.

    `shape` is the grid of the data. `n_null` is the number of unconditional realizations, which are
    compared at the locations of the data. By default, their template has 32 cells, if it fits.

    Raises `CCWSIMError` for data outside the grid or of an unknown facies, for fewer than 3 data,
    and for n_null < 10.

    Examples
    --------
    >>> stripes = TrainingImage(np.tile([[0], [0], [0], [1], [1], [1]], (16, 96)))
    >>> cells = np.argwhere(np.random.default_rng(0).random((60, 60)) < 0.03)
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> like = HardData(cells, cells[:, 0] // 3 % 2)
    >>> unlike = HardData(cells, cells[:, 1] // 3 % 2)
    >>> fits = [fit_data(stripes, data, (60, 60), parameters=p) for data in (like, unlike)]
    >>> [fit.contradicts for fit in fits]
    [False, True]
    """
    check_int("n_null", n_null, 10, 10_000)
    rng = np.random.default_rng(seed)
    study = Study(image, Grid.of(shape), parameters or _fitting(image), data, seed)
    if data.n > MAX_COMPARED_DATA:
        chosen = rng.permutation(data.n)[:MAX_COMPARED_DATA]
        data = data.part(chosen)
        study = replace(study, hard_data=data)
    if data.n < MIN_PLACES:
        raise refused("too_few_data_to_judge", n=data.n, least=MIN_PLACES)
    unconditional = replace(study, hard_data=HardData())
    null = simulate_study(unconditional, n_null, keep_sources=True, cancel=cancel)
    watch = Watch.of_share(progress)
    watch.tell(0.5)
    at_data = (slice(None), *data.cells.T)
    rank = np.argsort(np.argsort(-image.proportions, kind="stable"), kind="stable")
    labels = np.minimum(rank, MAX_LABELS - 1).astype(np.uint8)  # the rarest facies share a label
    n_labels = int(labels.max()) + 1
    indices = np.append(labels, np.uint8(n_labels))[np.minimum(image.indices, image.n_facies)]
    sets = labels[np.vstack([study.facies_of_data[None], null.indices[at_data]])].astype(np.int64)
    assert null.sources is not None
    sources = null.sources[at_data]
    halves, logs, differences = _compare(indices, n_labels, data.cells, sets, sources, rng)
    watch.tell(0.8)
    p, preferred = _p_value(differences), ""
    excess = differences["proportions"][0]
    if p <= MAX_REJECTED_P and excess > MIN_PREFERENCE and data.n_dimensions < N_AXES:
        shares = np.bincount(sets[0], minlength=n_labels) / data.n
        preference = shares / _shares(indices, n_labels)
        thinned = rng.random(data.n) * preference[sets[0]] < preference[shares > 0].min()
        *_, others = _compare(
            indices, n_labels, data.cells[thinned], sets[:, thinned], sources[:, thinned], rng
        )
        del others["proportions"]
        if thinned.sum() >= MIN_JUDGED_DATA and _p_value(others) > MAX_REJECTED_P:
            preferred = image.facies_names[int(np.argmax(labels == preference.argmax()))]
    watch.tell(0.9)
    gains = logs.mean(axis=1) - np.log(_shares(indices, n_labels))[sets[:, halves.targets]].mean(1)
    of_image = halves.log_probabilities_of(sets[0])
    smoothed = smooth_data(data.cells, sets[0], n_labels)[halves.targets, sets[0, halves.targets]]
    of_data = np.log(np.maximum(smoothed, MIN_LOG_PROBABILITY))
    return DataFit(
        p=p,
        families={name: float(each[0]) for name, each in differences.items()},
        score=float(of_image.mean()),
        gain=float(gains[0]),
        expected_gain=float(gains[1:].mean()),
        smoothing=float(of_data.mean()),
        z_smoothing=paired_z(of_image - of_data),
        n=int(well_numbers(data.cells).max()) + 1,
        preferred=preferred,
    )


@dataclass(frozen=True)
class ImageRank:
    """Place of a training image in the result of `rank_images`."""

    image: TrainingImage
    score: float
    """Mean log probability of a datum given its neighbours, from counts in the image."""
    z: float
    """Standard errors between the best image's score and this score; up to 2 is no difference."""
    n: int
    """Number of data in the mean."""

    @property
    def name(self) -> str:
        """Name of the training image, or of its variant in the result of `rank_variants`."""
        return self.image.name


def rank_images(
    images: Sequence[TrainingImage], data: HardData, progress: Fraction | None = None
) -> tuple[ImageRank, ...]:
    """Rank training images by how well they predict each hard datum from its neighbours.

    The result is from the best to the worst; images without a facies of the data come last, with
    the score −∞. Nothing is simulated. Raises `CCWSIMError` for no image, images of other
    dimensions than the data, or fewer than 3 data.

    Examples
    --------
    >>> stripes = np.tile([[0], [0], [0], [1], [1], [1]], (16, 96))
    >>> images = [TrainingImage(stripes.T, name="N-S"), TrainingImage(stripes, name="E-W")]
    >>> cells = np.argwhere(np.random.default_rng(0).random((60, 60)) < 0.03)
    >>> best, other = rank_images(images, HardData(cells, cells[:, 0] // 3 % 2))
    >>> best.image.name, other.z > 2
    ('E-W', True)
    """
    if not images or data.n < MIN_PLACES:
        raise refused("too_few_to_rank", images=len(images), n=data.n, least=MIN_PLACES)
    reach = np.min([_reach(image.shape) for image in images], axis=0)
    most = max(image.n_facies + (image.known is not None) for image in images)
    targets = np.random.default_rng(0).permutation(data.n)[:MAX_EVENTS]
    logs, watch = [], Watch.of_share(progress)
    for number, image in enumerate(images):
        if image.n_dimensions != data.n_dimensions:
            raise CCWSIMError(
                f"{image.name or 'a training image'} has {image.n_dimensions} axes, but the hard "
                f"data have {data.n_dimensions}: rank maps by data of a map, volumes by data of a "
                "volume"
            )
        places = np.searchsorted(image.codes, data.facies).clip(max=image.n_facies - 1)
        if (image.codes[places] == data.facies).all():
            events = _Events(
                image.indices, image.n_facies, data.cells, targets, reach=reach, most_facies=most
            )
            logs.append(events.log_probabilities_of(places))
        else:
            logs.append(np.full(len(targets), -np.inf))
        watch.tell((number + 1) / len(images))
    order = np.argsort([-each.mean() for each in logs], kind="stable")
    best = logs[order[0]]
    return tuple(
        ImageRank(
            image=images[k],
            score=float(logs[k].mean()),
            z=0.0 if k == order[0] else paired_z(best - logs[k]),
            n=len(targets),
        )
        for k in order
    )


def rank_variants(
    image: TrainingImage, data: HardData, progress: Fraction | None = None
) -> tuple[ImageRank, ...]:
    """Rank a training image "as given" and its variants by how well they predict hard data.

    The variants are turned by 90°, 180° and 270°, mirrored, scaled by ½ and 2, and with two of the
    four most frequent facies exchanged (not classes of values); see `rank_images` for the rows and
    errors. Volumes are turned about the z axis.

    Examples
    --------
    >>> stripes = np.tile([[0], [0], [0], [1], [1], [1]], (16, 96))
    >>> cells = np.argwhere(np.random.default_rng(0).random((60, 60)) < 0.03)
    >>> data = HardData(cells, cells[:, 1] // 3 % 2)
    >>> z = {row.name: row.z for row in rank_variants(TrainingImage(stripes), data)}
    >>> z["as given"] > 4 > z["turned by 90°"]
    True
    """
    return rank_images(_variants(image), data, progress)


def _variants(image: TrainingImage) -> list[TrainingImage]:
    """Return the image as given and its variants, with names."""
    given, plane = image.array, (-1, -2)  # y is upwards, so a turn from y to x is clockwise
    arrays = {AS_GIVEN: given}
    for flipped, quarter in product((False, True), range(4)):
        turned = np.rot90(np.flip(given, -1) if flipped else given, -quarter, plane)
        parts = ["mirrored"] * flipped + [f"turned by {90 * quarter}°"] * (quarter > 0)
        arrays[" and ".join(parts) or AS_GIVEN] = turned
    arrays["scaled by ½"] = given[..., ::2, ::2]
    arrays["scaled by 2"] = given.repeat(2, axis=-2).repeat(2, axis=-1)
    names = image.names_by_code
    frequent = np.argsort(-image.proportions)[: 0 if image.values else N_EXCHANGED]
    for one, other in combinations(image.codes[np.sort(frequent)].tolist(), 2):
        exchanged = np.where(given == one, other, np.where(given == other, one, given))
        arrays[f"{names[one]} and {names[other]} exchanged"] = exchanged
    return [
        TrainingImage(array, name=name, facies_names=[names[code] for code in _codes(array)])
        for name, array in arrays.items()
    ]


def _codes(array: Array) -> list[int]:
    """Return the sorted codes of an array with NaN in unknown cells."""
    return np.unique(array[~np.isnan(array.astype(float))]).astype(int).tolist()


def winner(ranks: Sequence[ImageRank]) -> TrainingImage | None:
    """Return the image that predicts the data best, or None if the data do not tell it apart."""
    best, *lower = ranks
    is_clear = best.n >= MIN_RANKED and all(other.z > MIN_Z for other in lower)
    return best.image if is_clear else None


def better_variant(ranks: Sequence[ImageRank]) -> tuple[str, float]:
    """Return the best variant of `rank_variants` and z of the image as given.

    The variant is the image as given, unless another variant is clearly better.
    """
    best, z = ranks[0], next(rank.z for rank in ranks if rank.name == AS_GIVEN)
    return (best.name if best.n >= MIN_RANKED and z > MIN_VARIANT_Z else AS_GIVEN), z


def _fitting(image: TrainingImage) -> Parameters:
    """Return parameters with a template of at most half of the image along each axis."""
    sides = largest_sides(image.shape)
    z, y, x = (next((t for t in (32, 16, 8) if t <= n // 2), 4) for n in sides)
    return Parameters(
        template_size=per_axis((z, y, x), image.shape),
        overlap_size=per_axis((z // 4, y // 4, x // 4), image.shape),
        wavelet_level=per_axis((min(z // 8, 2), min(y // 8, 2), min(x // 8, 2)), image.shape),
    )


def well_numbers(cells: Ints) -> Ints:
    """Return the number of the vertical well of each datum; in a map, each datum is a well."""
    wells = cells[:, 1:] if cells.shape[1] == N_AXES else cells
    return np.unique(wells, axis=0, return_inverse=True)[1].reshape(-1)


def _shares(indices: Bytes, n_facies: int) -> Floats:
    return np.fmax(proportions(Stack(indices[None], np.arange(n_facies)))[0], MIN_LOG_PROBABILITY)


def paired_z(differences: Floats) -> float:
    """Return the mean of differences in standard errors."""
    mean = float(differences.mean())
    if not np.isfinite(mean):
        return mean
    return mean / max(float(differences.std(ddof=1)) / len(differences) ** 0.5, 1e-12)


def _compare(
    indices: Bytes,
    n_facies: int,
    cells: Ints,
    sets: Ints,
    sources: Int32s,
    rng: np.random.Generator,
) -> tuple["_Events", Floats, dict[str, Floats]]:
    """Return the data events, their log probabilities, and largest differences by family."""
    halves = _Events(indices, n_facies, cells, rng.permutation(len(cells))[:MAX_EVENTS])
    logs, expected = halves.log_probabilities(sets, sources)
    families = {
        "proportions": _proportions(indices, n_facies, sets),
        "data events": _Family((logs - expected).mean(axis=1)[:, None]),
        **_pair_families(indices, n_facies, cells, sets, rng),
    }
    return halves, logs, {name: family.largest_difference() for name, family in families.items()}


def _p_value(differences: dict[str, Floats]) -> float:
    """Return the share of data sets whose largest difference is at least that of the data."""
    scaled = [(d - d.mean()) / max(d.std(), 1e-12) for d in differences.values()]
    combined = np.max(scaled, axis=0)
    return float((combined >= combined[0]).mean())


class _Family(NamedTuple):
    """Statistics of the data (row 0) and of the null data sets (other rows)."""

    sets: Floats  # shape (1 + n_null, statistics)
    halves: Floats | None = None  # expected in the western, eastern, southern and northern half

    def largest_difference(self) -> Floats:
        """Return each row's largest |z| against all other rows, shape (1 + n_null,)."""
        n = len(self.sets) - 1
        centred = self.sets - self.sets.mean(axis=0)
        mean = -centred / n
        squares = (centred**2).sum(axis=0) - centred**2 - n * mean**2
        variance = squares / (n - 1) + 1e-18
        z = np.abs(centred - mean) / np.sqrt(variance)
        if self.halves is not None:  # realizations share the image's chance features, data do not
            west, east, south, north = self.halves
            of_image = ((west - east) ** 2 + (south - north) ** 2) / 8  # NaN: unknown half
            z[0] /= np.sqrt(1 + np.nansum(of_image) / variance[0].sum())
        return z.max(axis=1)


def _halves(indices: Bytes) -> list[Bytes]:
    return [part for axis in (-1, -2) for part in np.array_split(indices, 2, axis)]


def _proportions(indices: Bytes, n_facies: int, sets: Ints) -> _Family:
    codes = np.arange(n_facies)
    of_halves = [proportions(Stack(half[None], codes))[0] for half in _halves(indices)]
    return _Family(np.stack([(sets == k).mean(1) for k in codes], -1), np.array(of_halves))


def _reach(shape: Shape) -> Ints:
    """Return the largest distance along each axis that is compared with an image."""
    return np.array([max(min(n // 3, MAX_PAIR_DISTANCE), 1) for n in shape])


def _pair_families(
    indices: Bytes, n_facies: int, cells: Ints, sets: Ints, rng: np.random.Generator
) -> dict[str, _Family]:
    """Return the likelihood of all pairs, and shares of equal pairs by axis and distance."""
    reach = _reach(indices.shape)
    first, second = np.triu_indices(len(cells), 1)
    if len(first) > 10 * MAX_PAIRS:
        chosen = rng.choice(len(first), 10 * MAX_PAIRS, replace=False)
        first, second = first[chosen], second[chosen]
    lags = cells[second] - cells[first]
    near = np.flatnonzero((np.abs(lags) <= reach).all(axis=1))
    near = rng.permutation(near)[:MAX_PAIRS]
    if len(near) < PAIRS_PER_BIN:
        return {}
    first, second, lags = first[near], second[near], lags[near]
    whole, *halves = (
        _pair_shares(part, n_facies, reach)[(slice(None), slice(None), *(lags + reach).T)]
        for part in (indices, *_halves(indices))
    )
    pair_shares, shares = np.fmax(whole, MIN_LOG_PROBABILITY), _shares(indices, n_facies)
    gain = np.log(
        pair_shares / pair_shares.sum(axis=(0, 1)) / np.multiply.outer(shares, shares)[..., None]
    )
    of_first, of_second = sets[:, first], sets[:, second]
    likelihood = gain[of_first, of_second, np.arange(len(lags))].mean(axis=1)[:, None]
    expected = [(half * gain).sum(axis=(0, 1)).mean(keepdims=True) for half in halves]
    bins = _bins(lags)
    columns, by_half = [], []
    for in_bin, k in product((bins == b for b in np.unique(bins[bins >= 0])), range(n_facies)):
        columns.append(((of_first[:, in_bin] == k) & (of_second[:, in_bin] == k)).mean(axis=1))
        by_half.append([half[k, k, in_bin].mean() for half in halves])
    families = {"pairs": _Family(likelihood, np.array(expected))}
    if columns:
        families["pairs by distance"] = _Family(np.stack(columns, -1), np.array(by_half).T)
    return families


def _bins(lags: Ints) -> Ints:
    """Return the bin of each pair, by axis of its largest component and by length; −1 for none."""
    lengths, axis = np.sqrt((lags**2).sum(axis=1)), np.abs(lags).argmax(axis=1)
    bins, n_bins = np.full(len(lags), -1), 0
    for a in range(lags.shape[1]):
        along = np.flatnonzero(axis == a)
        n = min(BINS_PER_AXIS, len(along) // PAIRS_PER_BIN)
        if n:
            edges = np.quantile(lengths[along], np.linspace(0, 1, n + 1)[1:-1])
            bins[along] = n_bins + np.searchsorted(edges, lengths[along])
            n_bins += n
    return bins


def _pair_shares(indices: Bytes, n_facies: int, reach: Ints) -> Float32s:
    """Return the share of pairs (x, x + h) with facies (k, l), shape (K, K, 2 · reach + 1 …).

    Only pairs of known cells count; the share is NaN at lags without such pairs.
    """
    shape = [
        fft.next_fast_len(n + int(r), real=True) for n, r in zip(indices.shape, reach, strict=True)
    ]
    spectra = [np.asarray(fft.rfftn(np.float32(indices == k), shape)) for k in range(n_facies)]
    lags = [np.arange(-r, r + 1) for r in reach]
    taken = np.ix_(*[lag % n for lag, n in zip(lags, shape, strict=True)])
    along = [n - np.abs(lag) for lag, n in zip(lags, indices.shape, strict=True)]
    n_pairs = reduce(np.multiply.outer, along)
    if indices.max() >= n_facies:
        spectrum = np.asarray(fft.rfftn((indices < n_facies).astype(float), shape))
        n_pairs = np.rint(np.asarray(fft.irfftn(np.abs(spectrum) ** 2, shape))[taken])
    shares = [
        ratio(np.maximum(np.asarray(fft.irfftn(a.conj() * b, shape))[taken], 0), n_pairs)
        for a, b in product(spectra, spectra)
    ]
    return np.array(shares, np.float32).reshape((n_facies, n_facies, *n_pairs.shape))


class _Events:
    """Probabilities of data given their nearest neighbours, from all placements in an image.

    P_j = (N(z, e_j) + a · P_{j−1}) / (N(e_j) + a) for the j nearest neighbours e_j, where N counts
    the placements of the event. P_0 is the proportion of facies z, and a = 100. A datum that a
    realization copied from one half of the image is scored by counts in the other half, because
    its event certainly occurs where it was copied.
    """

    def __init__(
        self,
        indices: Bytes,
        n_facies: int,
        cells: Ints,
        targets: Ints,
        reach: Ints | None = None,
        most_facies: int = 1,
    ) -> None:
        self.targets, self._cells = targets, cells
        self._n_facies, self._shape = n_facies, indices.shape
        indices = np.minimum(indices, n_facies)  # unknown is one more digit
        self._n_digits = max(n_facies, int(indices.max()) + 1)
        self._axis = indices.ndim - (2 if indices.shape[-2] > indices.shape[-1] else 1)
        across = tuple(np.delete(range(indices.ndim), self._axis))
        # known cells up to each place along the axis
        n_before = np.cumsum((indices < n_facies).sum(axis=across))
        self._middle = max(int(np.searchsorted(n_before, n_before[-1] / 2, side="right")), 1)
        self._halves = np.split(indices, [self._middle], axis=self._axis)
        self._whole = [indices]
        reach = np.min([_reach(h.shape) for h in self._halves], axis=0) if reach is None else reach
        most = int(log(MAX_EVENT_TABLE) / log(max(self._n_digits, most_facies, 2))) - 1
        groups = well_numbers(cells)
        self._neighbours: list[Ints] = []
        for target in targets:
            lags = np.abs(cells - cells[target])
            distance = (lags.astype(float) ** 2).sum(axis=1)
            distance[(groups == groups[target]) | (lags > reach).any(axis=1)] = np.inf
            nearest = np.argsort(distance, kind="stable")[: max(min(MAX_NEIGHBOURS, most), 1)]
            self._neighbours.append(nearest[np.isfinite(distance[nearest])])

    def log_probabilities(self, sets: Ints, sources: Int32s) -> tuple[Floats, Floats]:
        """Return log P at the targets and its expectation; each half counts for unknown sources."""
        along = np.unravel_index(np.maximum(sources, 0), self._shape)[self._axis]
        half_of = np.vstack([0 * sets[:1] - 1, np.where(sources < 0, -1, along >= self._middle)])
        results = np.empty((2, len(sets), len(self.targets)))
        for row, (target, near) in enumerate(zip(self.targets, self._neighbours, strict=True)):
            check_stop()
            neighbours = tuple(sets[:, k] for k in near[::-1])
            sums = np.zeros((2, len(sets)))
            for number, counts in enumerate(self._counts(near, target, self._halves)):
                p = np.maximum(_probabilities(counts)[neighbours], MIN_LOG_PROBABILITY)
                logs = np.broadcast_to(np.log(p), (len(sets), self._n_facies))
                of_target = np.take_along_axis(logs, sets[:, [target]], axis=1)[:, 0]
                half = half_of[:, target]
                weight = np.where(half < 0, 0.5, half != number)
                sums += weight * np.stack([of_target, (p * logs).sum(axis=1)])
            results[:, :, row] = sums
        return results[0], results[1]

    def log_probabilities_of(self, facies: Ints) -> Floats:
        """Return log P of the facies at the targets by counts in the whole image, (targets,)."""
        probabilities = []
        for target, near in zip(self.targets, self._neighbours, strict=True):
            check_stop()
            p = _probabilities(self._counts(near, target, self._whole)[0])
            probabilities.append(p[(*facies[near[::-1]], facies[target])])
        return np.log(np.maximum(probabilities, MIN_LOG_PROBABILITY))

    def _counts(self, near: Ints, target: int, parts: list[Bytes]) -> list[Floats]:
        """Count events in each part by the facies of the farthest, …, nearest datum and target."""
        placed = self._cells[[target, *near]] - self._cells[target]
        low, high = placed.min(axis=0), placed.max(axis=0)
        n_digits, known_facies = self._n_digits, (slice(self._n_facies),) * len(placed)
        counts = []
        for part in parts:
            codes = np.zeros(part.shape + low - high, np.uint32)
            for power, offset in enumerate(placed - low):
                codes += part[window_at(offset, codes.shape)] * np.uint32(n_digits**power)
            n_events = np.bincount(codes.ravel(), minlength=n_digits ** len(placed))
            counts.append(n_events.reshape((n_digits,) * len(placed))[known_facies].astype(float))
        return counts


def _probabilities(counts: Floats) -> Floats:
    """Return P of the last axis given all others, backing off from the first axis."""
    nearer = [counts]
    while nearer[-1].ndim > 1:
        nearer.append(nearer[-1].sum(axis=0))
    p = (nearer[-1] + 1) / (nearer[-1].sum() + len(nearer[-1]))
    for n in nearer[-2::-1]:
        p = (n + BACK_OFF * p) / (n.sum(axis=-1, keepdims=True) + BACK_OFF)
    return p


def smooth_data(cells: Ints, facies: Ints, n_facies: int) -> Floats:
    """Return the probabilities at each datum, by the best smoothing of the data of other wells."""
    groups = well_numbers(cells)
    is_facies = np.eye(n_facies)[facies]
    squares = (cells[:, None] - cells[None]).astype(np.float32) ** 2
    other_wells = groups[:, None] != groups[None]
    left_out = other_wells @ is_facies / np.maximum(other_wells.sum(axis=1), 1)[:, None]
    models = [left_out]
    for along_y, along_x in product(RANGES, RANGES):
        exponent = squares[..., -2] / along_y**2 + squares[..., -1] / along_x**2
        if cells.shape[1] == N_AXES:
            exponent += squares[..., 0] / RANGES[0] ** 2
        weights = np.where(other_wells, np.exp(-exponent / 2), 0)
        sums, total = weights @ is_facies, weights.sum(axis=1)[:, None]
        models += [(sums + s * left_out) / (total + s) for s in SHRINKAGES]
    at_datum = slice(None), np.arange(len(cells)), facies
    logs = np.log(np.maximum(np.array(models)[at_datum], MIN_LOG_PROBABILITY))
    wells = np.random.default_rng(1).permutation(groups.max() + 1)
    fold = wells[groups] % N_FOLDS
    chosen = np.empty_like(is_facies)
    for k in range(N_FOLDS):
        chosen[fold == k] = models[logs[:, fold != k].mean(axis=1).argmax()][fold == k]
    return chosen
