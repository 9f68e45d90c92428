"""Measures of one facies: one number for each realization and each crop of the training image."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Literal

import numpy as np

from ccwsim import Ensemble, TrainingImage
from ccwsim.metrics.connectivity import Geobodies, geobody_statistics
from ccwsim.metrics.pattern_codes import count_patterns
from ccwsim.metrics.patterns import thinnest_n_layers, unseen_patterns
from ccwsim.metrics.reference_band import Fit, fit_values
from ccwsim.metrics.stack import Fraction, Stack, as_stack, map_parallel
from ccwsim.model import Floats, Ints, Mask, minus, ratio

MAX_MEASURED = 200  # maximum number of measured realizations; later realizations are not measured
PER_CELLS, PER_CELLS_VOLUME = 10_000, 1_000_000
"""Number of cells to which geobody counts are scaled, because images differ in size."""
PATTERN_SIDE = 3


@dataclass(frozen=True, eq=False)
class OfFacies:
    """A stack of images, and the code of the measured facies."""

    images: Stack
    code: int
    training_image: TrainingImage
    are_crops: bool = False  # whether the images are crops of the training image

    @cached_property
    def inside(self) -> Mask:
        """Mask of the facies, shape (n, nz, ny, nx); maps have one layer."""
        mask = self.images.indices == self.images.index_of(self.code)
        return mask if self.images.is_volumes else mask[:, None]

    @cached_property
    def geobodies(self) -> Geobodies:
        """Geobody statistics of the facies; cells that touch at corners are joined."""
        return geobody_statistics(self.images, self.code)

    @cached_property
    def known(self) -> Mask:
        """Mask of the cells whose facies is known, shape of `inside`."""
        return (self.images.indices < self.images.n_facies).reshape(self.inside.shape)

    @property
    def n_cells(self) -> Ints:
        """Number of known cells of each image, shape (n,)."""
        return self.known.sum(axis=(1, 2, 3))


@dataclass(frozen=True)
class Measure:
    """One entry of `MEASURES`."""

    title: str
    """Name of the measure, with the unit."""
    definition: str
    values: Callable[[OfFacies], Floats]
    """Function of an `OfFacies` that returns a value (or NaN) for each image, shape (n,)."""
    least: float
    """Smallest reported difference, in units of the value."""
    words: tuple[str, str] = ("too low", "too high")
    """Words for a value below the crops (empty if such values are good) and above the crops."""
    factor: float = 1.0
    """Factor applied to values on screen, such as 100 for percent."""
    digits: int = 2
    """Number of decimals on screen."""
    volumes: bool | None = None
    """True for measures of volumes, False for measures of maps, None for measures of both."""
    errors: tuple[float, float] = (3.3, 3.0)
    """Allowed differences from crops in standard errors, for maps and for volumes."""
    spread: float = 0.0
    """Smallest standard deviation between crops, in units of the value."""
    checked: Literal["facies", "image", "elsewhere"] = "facies"
    """Whether `check_ensemble` compares it for each facies, for the image, or by another check."""

    @property
    def name(self) -> str:
        """The title without the unit, as in a sentence: "chord E–W", "Euler number"."""
        name = self.title.partition(",")[0].partition(" per ")[0]
        return name if name.startswith("Euler") or len(name) == 1 else name[0].lower() + name[1:]

    def text(self, value: float) -> str:
        """Return a value as text.

        Examples
        --------
        >>> MEASURES[0].text(0.2731), MEASURES[0].text(float("nan"))
        ('27.3', '–')
        """
        if not np.isfinite(value):
            return "–"
        return minus(f"{self.factor * value:.{self.digits}f}")


def _boundary(of: OfFacies) -> Floats:
    """Return the share of adjacent cell pairs with only one cell in the facies, or NaN."""
    unequal, n_pairs = np.zeros((2, len(of.inside)))
    for axis in (1, 2, 3):
        cell, neighbour = (np.delete(of.inside, end, axis) for end in (-1, 0))
        pairs = np.delete(of.known, -1, axis) & np.delete(of.known, 0, axis)
        unequal += ((cell != neighbour) & pairs).sum(axis=(1, 2, 3))
        n_pairs += pairs.sum(axis=(1, 2, 3))
    return ratio(unequal, n_pairs)


def _chord(axis: int) -> Callable[[OfFacies], Floats]:
    """Return a function that computes mean chord lengths along an axis of (n, nz, ny, nx)."""

    def values(of: OfFacies) -> Floats:
        lines = np.moveaxis(of.inside, axis, -1)
        begins = lines[..., 0].sum(axis=(1, 2))
        begins = begins + (lines[..., 1:] & ~lines[..., :-1]).sum(axis=(1, 2, 3))
        return ratio(of.inside.sum(axis=(1, 2, 3)), begins)

    return values


def _largest(of: OfFacies) -> Floats:
    shares = (s[0] / s.sum() if len(s) else np.nan for s in of.geobodies.sizes)
    return np.array([*shares], float)


def _unseen(of: OfFacies) -> Floats:
    sides = *of.images.shape[-2:], *of.training_image.shape[-2:]
    size, crops, image = min(PATTERN_SIDE, min(sides)), of.images, as_stack(of.training_image)
    if not of.are_crops:
        return unseen_patterns(crops, image, size)
    height = min(size, thinnest_n_layers(image, crops))
    codes, counts = count_patterns(image.volume(0), image.n_facies, height, size)

    def by_the_rest(k: int) -> float:  # a pattern is unseen if all its locations are in the crop
        codes_of_crop, n = count_patterns(crops.volume(k), image.n_facies, height, size)
        return float(ratio(n[counts[np.searchsorted(codes, codes_of_crop)] == n].sum(), n.sum()))

    return np.array(map_parallel(by_the_rest, len(crops)))


def _counted(
    title: str, definition: str, count: Callable[[OfFacies], Ints], words: tuple[str, str]
) -> Iterator[Measure]:
    """Yield a measure that counts geobodies per 10,000 cells in maps, or 1,000,000 in volumes."""
    for per, least, volumes in ((PER_CELLS, 0.5, False), (PER_CELLS_VOLUME, 5.0, True)):

        def values(of: OfFacies, per: int = per) -> Floats:
            return ratio(per * count(of), of.n_cells)

        whole = f"{title} per {per:,} cells"
        yield Measure(whole, definition, values, least, words, digits=1, volumes=volumes)


MEASURES = (
    Measure(
        "Proportion, %",
        "Share of the cells that have this facies.",
        lambda of: ratio(of.inside.sum(axis=(1, 2, 3)), of.n_cells), 0.01,
        ("too little", "too much"), factor=100, digits=1, checked="elsewhere",
    ),
    Measure(
        "Boundary, %",
        "Share of adjacent cell pairs with only one cell in the facies: the boundary roughness.",
        _boundary, 0.003, ("too smooth", "too rough"), factor=100,
    ),
    Measure(
        "Chord E–W, cells",
        "Mean length of the facies along east–west lines, which end at the border.",
        _chord(3), 0.5, ("too short", "too long"), digits=1,
    ),
    Measure(
        "Chord N–S, cells",
        "Mean length of the facies along north–south lines, which end at the border.",
        _chord(2), 0.5, ("too short", "too long"), digits=1,
    ),
    Measure(
        "Chord vertical, layers",
        "Mean thickness of the facies along vertical columns, which end at top and bottom.",
        _chord(1), 0.25, ("too thin", "too thick"), digits=1, volumes=True,
    ),
    *_counted(
        "Geobodies",
        "Number of geobodies; cells that touch at sides or corners belong to one geobody.",
        lambda of: of.geobodies.n_geobodies, ("too few", "too many"),
    ),
    Measure(
        "Largest geobody, %",
        "Share of the facies in the largest geobody.",
        _largest, 0.1, ("too small", "too large"),
        factor=100, digits=0, spread=0.1, checked="elsewhere",
    ),
    Measure(
        "Γ",
        "Probability that two cells of the facies are in one geobody (Renard and Allard 2013).",
        lambda of: of.geobodies.gamma, 0.1, ("too little connected", "too much connected"),
        spread=0.1, checked="elsewhere",
    ),
    *_counted(
        "Euler number",
        "Geobodies minus holes; in volumes geobodies minus tunnels plus cavities.",
        lambda of: of.geobodies.euler_number, ("too many holes", "too many pieces"),
    ),
    Measure(
        "Unseen patterns, %",
        f"Share of the patterns (all facies, {PATTERN_SIDE} cells along a side) that do not occur "
        "in the training image.",
        _unseen, 0.0005, ("", "too many"), factor=100, errors=(2.0, 3.0), checked="image",
    ),
)  # fmt: skip
"""All measures, in the order on screen."""


@dataclass(frozen=True, eq=False)
class Measured:
    """Values of the measures of a facies, in maps or in volumes."""

    measures: tuple[Measure, ...]
    each: Floats
    """Value of each measure in each realization, shape (n, m)."""
    reference: Floats
    """Value of each measure in the training image, shape (m,)."""
    fit: Fit | None
    """Comparison of pieces of the realizations with crops of the training image, by measure."""


def measure(ensemble: Ensemble, facies: int | str, progress: Fraction | None = None) -> Measured:
    """Measure a facies in at most 200 realizations, and compare the values with crops of the image.

    Examples
    --------
    >>> from ccwsim import datasets, simulate
    >>> measured = measure(simulate(datasets.load("channels"), (128, 128)), facies=1)
    >>> measured.measures[0].title, round(measured.reference[0], 2)
    ('Proportion, %', np.float64(0.27))
    """
    image, chosen = ensemble.training_image, measures_of(ensemble.training_image)
    fit = fit_measures(ensemble, facies, chosen)

    def one(r: int) -> Floats:
        return _values(chosen, image, facies, Stack(ensemble.indices[r : r + 1], image.codes))

    each = map_parallel(one, min(ensemble.n, MAX_MEASURED), progress)
    reference = _values(chosen, image, facies, as_stack(image))[0]
    return Measured(chosen, np.concatenate(each), reference, fit)


def measures_of(image: TrainingImage) -> tuple[Measure, ...]:
    """Return the measures of maps or of volumes."""
    return tuple(m for m in MEASURES if m.volumes in (None, image.n_dimensions > 2))


def fit_measures(ensemble: Ensemble, facies: int | str, chosen: Sequence[Measure]) -> Fit | None:
    """Compare measures of pieces with those of crops; `Fit.at` has their indices in `MEASURES`."""
    image = ensemble.training_image
    name = "measures", image.index_of(facies), *(m.title for m in chosen)
    positions = np.array([MEASURES.index(m) for m in chosen], float)
    which = image.n_dimensions - 2
    least, spread, errors = np.array([(m.least, m.spread, m.errors[which]) for m in chosen]).T
    values = partial(_values, chosen, image, facies)
    return fit_values(
        ensemble,
        name,
        positions,
        values,
        of_crops=partial(values, are_crops=True),
        min_gap=least,
        min_spread=spread,
        n_errors=errors,
        one_sided=np.array([not m.words[0] for m in chosen]),
    )


def _values(
    chosen: Sequence[Measure],
    image: TrainingImage,
    facies: int | str,
    images: Stack,
    are_crops: bool = False,
) -> Floats:
    """Return the measures of a facies in images, shape (n_images, n_measures)."""
    of = OfFacies(images, image.code_of(facies), image, are_crops)
    return np.column_stack([np.asarray(m.values(of), float) for m in chosen])
