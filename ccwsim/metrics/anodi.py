"""ANODI: distances of realizations from each other and from the image (Tan et al. 2014)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan

import numpy as np
from scipy.spatial.distance import pdist, squareform

from ccwsim import TrainingImage
from ccwsim.metrics.patterns import (
    FACTORS,
    divergences,
    pattern_size_of,
    pyramid_histograms,
    thinnest_n_layers,
)
from ccwsim.metrics.stack import Codes, Fraction, Images, Watch, as_image, as_stack
from ccwsim.model import (
    Array,
    ArrayLike,
    CCWSIMError,
    Floats,
    Ints,
    as_floats,
    check_int,
    ratio,
    refused,
    shown,
)

HISTOGRAM_SHARE = 0.5  # share of the progress bar for counting; the rest is for comparing
# number of SMACOF steps, and relative gain at which they end
MAX_SMACOF_STEPS, SMALL_STEP = 200, 1e-5
MIN_JACKKNIFE = 3  # realizations for a jackknife: two must remain when one is omitted
Means = tuple[Floats, Floats]
"""Mean divergences between realizations, and of realizations from the training image."""


@dataclass(frozen=True, eq=False)
class Scaling:
    """Coordinates of points whose distances approximate a distance matrix."""

    positions: Floats
    """Coordinates, shape (n, n_dimensions), centred on 0; the axis of largest variance is first."""
    stress: float
    """Kruskal's stress-1, √(Σ (d − b e)² / Σ d²), with distances d, distances e of the points and
    their best scale b; 0 is perfect, and above 0.2 a picture distorts the distances."""


def classical_scaling(distances: Floats, n_dimensions: int = 2) -> Scaling:
    """Return coordinates of points whose distances approximate a symmetric matrix (Torgerson 1952).

    The coordinates are the eigenvectors of −½ J D² J, with J = I − 1/n, times the square roots of
    the eigenvalues. An axis is flipped if the coordinate of largest magnitude is negative.

    Examples
    --------
    >>> line = np.abs(np.subtract.outer([0.0, 1.0, 5.0], [0.0, 1.0, 5.0]))
    >>> classical_scaling(line, 1).positions.ravel().round(6).tolist()
    [-2.0, -1.0, 3.0]
    """
    d = as_floats(distances, "distances")
    n_dimensions = check_int("n_dimensions", n_dimensions, 1, 1000)
    square = d.ndim == 2 and d.shape[0] == d.shape[1] and len(d) > 0
    if not square or not np.isfinite(d).all() or not np.allclose(d, d.T):
        raise CCWSIMError(f"distances must be a symmetric matrix, not an array of shape {d.shape}")
    squares = d**2
    means = squares.mean(axis=0)
    values, vectors = np.linalg.eigh(-0.5 * (squares - means - means[:, None] + means.mean()))
    values, vectors = np.maximum(values[::-1], 0), vectors[:, ::-1]
    positions = np.zeros((len(d), n_dimensions))
    kept = min(n_dimensions, len(d))
    positions[:, :kept] = vectors[:, :kept] * np.sqrt(values[:kept])
    return Scaling(_upright(positions), _stress(d, positions))


def metric_scaling(distances: Floats, n_dimensions: int = 2) -> Scaling:
    """Return coordinates whose distances are as near as possible to a symmetric matrix.

    SMACOF (de Leeuw 1977) lowers Σ (d − e)² from the start of `classical_scaling`, in at most 200
    steps. The axes are the principal axes of the points. Raises `CCWSIMError` as
    `classical_scaling`.

    Examples
    --------
    >>> far = 1.0 - np.eye(6)  # six points with equal distances do not fit into a plane
    >>> classical_scaling(far).stress > metric_scaling(far).stress > 0.2
    True
    """
    start = classical_scaling(distances, n_dimensions)
    d, x = as_floats(distances, "distances"), start.positions
    before = np.inf
    for _ in range(MAX_SMACOF_STEPS):
        e = _distances(x)
        now = float(((d - e) ** 2).sum())
        if before - now <= SMALL_STEP * now:
            break
        before = now
        weights = np.divide(d, e, out=np.zeros_like(d), where=e > 0)
        x = (weights.sum(axis=1)[:, None] * x - weights @ x) / len(d)  # Guttman transform
    axes = np.linalg.svd(x - x.mean(axis=0), full_matrices=False)[2]
    positions = np.zeros_like(x)
    positions[:, : len(axes)] = (x - x.mean(axis=0)) @ axes.T
    stress = _stress(d, positions)
    return Scaling(_upright(positions), stress) if stress < start.stress else start


def _upright(positions: Floats) -> Floats:
    """Flip each axis whose coordinate of largest magnitude is negative."""
    largest = positions[np.abs(positions).argmax(axis=0), np.arange(positions.shape[1])]
    return positions * np.where(largest < 0, -1.0, 1.0)


def _distances(positions: Floats) -> Floats:
    return squareform(pdist(positions)) if len(positions) > 1 else np.zeros((1, 1))


def _stress(d: Floats, positions: Floats) -> float:
    """Return Kruskal's stress-1 of positions at their best scale."""
    e = _distances(positions)
    of_distances, of_points = float((d**2).sum()), float((e**2).sum())
    if not of_distances or not of_points:
        return float(of_distances > 0)
    return float(np.sqrt(max(0.0, 1 - float((d * e).sum()) ** 2 / (of_distances * of_points))))


@dataclass(frozen=True, eq=False)
class Anodi:
    """Pattern distances within ensembles, and between ensembles and their training image."""

    names: tuple[str, ...]
    factors: tuple[int, ...]
    """Coarsening factors: resolution g is 1 / factors[g] of the full resolution."""
    weights: Floats
    """Weights of the resolutions; their sum is 1."""
    pattern_size: int
    """Side of the patterns in cells."""
    divergence: Floats
    """Jensen–Shannon divergence (log₂) of each pair of images, shape (n_factors, 1 + n_all,
    1 + n_all); the training image is first, followed by all realizations."""
    owner: Ints
    """Index of the ensemble of each image, shape (1 + n_all,); −1 for the training image."""
    between: Floats
    """Mean divergence between realizations, shape (n_ensembles, n_factors); NaN if n = 1."""
    within: Floats
    """Mean divergence of realizations from the training image, shape (n_ensembles, n_factors)."""

    @property
    def ratio(self) -> Floats:
        """Ratio `between` / `within`, shape (n_ensembles, n_factors); larger is better."""
        return ratio(self.between, self.within)

    @property
    def mean_ratio(self) -> Floats:
        """Weighted mean of `ratio` over the resolutions, shape (n_ensembles,)."""
        return self.ratio @ self.weights

    def relative(self, name: str, other: str) -> tuple[float, float, float]:
        """Return the ratios `name` / `other` of `between`, of `within` and of between / within.

        Each ratio is a weighted mean over resolutions. A third ratio above 1 means that the
        ensemble `name` is better: its realizations vary more relative to their distance from the
        image (Tan et al. 2014). Raises `CCWSIMError` for an unknown name.
        """
        between, within, both = self._relative(self._means_of(name), self._means_of(other))
        return float(between), float(within), float(both)

    def relative_errors(self, name: str, other: str) -> tuple[float, float, float]:
        """Return jackknife standard errors of the logarithms of the results of `relative`.

        Each realization of the two ensembles is omitted in turn. Errors are NaN if an ensemble has
        fewer than three realizations. Raises `CCWSIMError` for an unknown name.
        """
        means, other_means = self._means_of(name), self._means_of(other)
        if name == other:
            return 0.0, 0.0, 0.0
        if min(np.count_nonzero(self.owner == self._row(n)) for n in (name, other)) < MIN_JACKKNIFE:
            return nan, nan, nan
        variance = np.zeros(3)
        with np.errstate(divide="ignore", invalid="ignore"):
            for relative in (
                self._relative(self._without_each(name), other_means),
                self._relative(means, self._without_each(other)),
            ):
                logs = np.log(relative)
                variance += (logs.shape[1] - 1) * logs.var(axis=1)
        between, within, both = np.sqrt(variance).tolist()
        return between, within, both

    def _relative(self, one: Means, other: Means) -> Floats:
        """Return the weighted ratios of `between`, `within` and between / within, shape (3, …)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            between, within = one[0] / other[0], one[1] / other[1]
            return np.array([each @ self.weights for each in (between, within, between / within)])

    def _means_of(self, name: str) -> Means:
        """Return `between` and `within` of an ensemble, shape (factors,)."""
        return self.between[self._row(name)], self.within[self._row(name)]

    def _without_each(self, name: str) -> Means:
        """Return `between` and `within`, shape (n, factors); row k omits realization k."""
        members = np.flatnonzero(self.owner == self._row(name))
        n = len(members)
        rows = self.divergence[:, members[:, None], members].sum(axis=2)
        pairs = rows.sum(axis=1, keepdims=True) - 2 * rows
        to_image = self.divergence[:, 0, members]
        sums = to_image.sum(axis=1, keepdims=True) - to_image
        return (pairs / ((n - 1) * (n - 2))).T, (sums / (n - 1)).T

    def scaling(self, n_dimensions: int = 2) -> Scaling:
        """Return points for the training image (first) and for all realizations.

        Distances between points approximate √(Σ w · divergence) with resolution weights w.
        """
        mixed = np.tensordot(self.weights, self.divergence, axes=1)
        return metric_scaling(np.sqrt(mixed), n_dimensions)

    def _row(self, name: str) -> int:
        if name not in self.names:
            raise CCWSIMError(f"ensemble {shown(name)} is not one of {', '.join(self.names)}")
        return self.names.index(name)


def anodi(
    ensembles: Images | Mapping[str, Images],
    training_image: TrainingImage | ArrayLike,
    codes: Codes | None = None,
    size: int | None = None,
    factors: Sequence[int] = FACTORS,
    weights: Sequence[float] | None = None,
    progress: Fraction | None = None,
) -> Anodi:
    """Compare ensembles with their training image and with each other (Tan et al. 2014).

    Patterns are counted exactly at each resolution of a pyramid (see `coarsened`). Section 5.5 of
    the paper uses 8 × 8 windows. Here the default is 4 × 4, as in the public code of ANODI, because
    nearly every exact 8 × 8 pattern occurs only once. Several ensembles have names. `weights` of
    the resolutions are scaled to sum to 1; by default 2^−g for resolution g. Resolutions at which
    an image has no whole pattern of active cells do not count.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> analysis = anodi(rng.integers(0, 2, (3, 30, 30)), np.eye(30, dtype=int))
    >>> analysis.between.shape, analysis.scaling().positions.shape
    ((1, 3), (4, 2))
    """
    named = ensembles if isinstance(ensembles, Mapping) else {"realizations": ensembles}
    scaled = _scaled_weights(weights, len(factors))
    image = as_image(training_image, codes)
    stacks = {str(name): as_stack(images, image.codes) for name, images in named.items()}
    if not stacks:
        raise CCWSIMError("ANODI needs at least one ensemble")
    side, layers = pattern_size_of(image, size), thinnest_n_layers(image, *stacks.values())
    rows = pyramid_histograms(image, size=side, factors=factors, layers=layers)
    watch = Watch.of_share(progress)
    step = HISTOGRAM_SHARE / sum(len(stack) for stack in stacks.values())
    for stack in stacks.values():
        done = len(rows) - 1
        part = watch.part(done * step, (done + len(stack)) * step)
        rows += pyramid_histograms(
            stack, size=side, factors=factors, progress=part.tell, layers=layers
        )
    owner = np.concatenate([[-1], np.repeat(range(len(stacks)), [len(s) for s in stacks.values()])])
    divergence = divergences(rows, watch.part(HISTOGRAM_SHARE, 1.0).tell)
    # resolutions at which all images have whole patterns of active cells
    judged = [k for k, each in enumerate(divergence) if np.isfinite(each).all()]
    if not judged:
        judged, divergence = [0], np.nan_to_num(divergence)
    divergence = divergence[judged]
    scaled = _scaled_weights(scaled[judged].tolist(), len(judged))
    between, within = _mean_divergences(divergence, owner, len(stacks))
    return Anodi(
        names=tuple(stacks),
        factors=tuple(factors[k] for k in judged),
        weights=scaled,
        pattern_size=side,
        divergence=divergence,
        owner=owner,
        between=between,
        within=within,
    )


def _mean_divergences(divergence: Array, owner: Array, n_ensembles: int) -> tuple[Array, Array]:
    between, within = np.full((2, n_ensembles, len(divergence)), np.nan)
    for k in range(n_ensembles):
        members = np.flatnonzero(owner == k)
        within[k] = divergence[:, 0, members].mean(axis=1)
        if len(members) > 1:
            pairs = divergence[:, members[:, None], members].sum(axis=(1, 2))
            between[k] = pairs / (len(members) * (len(members) - 1))
    return between, within


def _scaled_weights(weights: Sequence[float] | None, n: int) -> Floats:
    """Return the weights of n resolutions, scaled to sum to 1; by default proportional to 2^−g."""
    values = 0.5 ** np.arange(1, n + 1) if weights is None else as_floats(weights, "weights")
    fits = values.shape == (n,) and n > 0 and np.isfinite(values).all()
    if not fits or values.min() < 0 or not values.sum() > 0:
        raise refused("factor_weights", given=shown(weights), n=n)
    return values / values.sum()
