"""The training image, prepared for the search in each orientation of the path (section 4.2)."""

from collections.abc import Callable
from functools import cached_property
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.corrections.guidance import score_bound
from ccwsim.engine.corrections.proportions import (
    DataProportions,
    gain_factors,
    margin_weights,
    patch_shares,
    proportions_of_data,
)
from ccwsim.engine.corrections.resimulation import isolated_datum_thresholds
from ccwsim.engine.corrections.seam_repair import Repair, prepare_repair
from ccwsim.engine.corrections.trend_of_data import Trend, trend_of_data, trend_of_map
from ccwsim.engine.corrections.unseen_patterns import Patterns, known_patterns, mean_thickness
from ccwsim.engine.lengths import ScaledLengths, lengths_of
from ccwsim.engine.stages.bits import to_bits, to_square_bits
from ccwsim.engine.stages.conditioning import legal_splits
from ccwsim.engine.stages.path import Triple, in_layers, in_three, to_path
from ccwsim.engine.stages.pyramid import Pyramid, build_pyramid, upgrid
from ccwsim.engine.stages.similarity import running_squares, running_sums, score_type, summed_up
from ccwsim.jobs.workers import check_stop
from ccwsim.model.study import Study
from ccwsim.system.lru_cache import LruCache

KEPT_BYTES = 500_000_000
"""Maximum total size, in bytes, of the prepared parts of an image that are stored in memory."""
THIN = 3.0  # maximum mean thickness, in cells, of a facies that is thin


class OrientedImage(NamedTuple):
    """A training image in one orientation of the path, prepared for the search."""

    pyramid: Pyramid
    splits: NDArray[np.int64]  # shape (n_splits, 3): made by `legal_splits`
    squares: NDArray[np.number[Any]]  # made by `running_squares`, with the type of the scores
    running: NDArray[np.unsignedinteger[Any]]  # made by `running_sums`
    places: Triple  # number of layers, rows and columns of locations
    proportions: NDArray[np.float64]  # shape (n_facies,): proportions of the training image
    margin: NDArray[np.float64]  # shape (n_facies,): made by `margin_weights`; 0 if not steered
    gain_factors: NDArray[np.float64]  # shape (n_facies,): made by `gain_factors`
    illegal: NDArray[np.uint8]  # shape of locations: 1 with unknown cells; empty if all are known

    @property
    def n_places(self) -> int:
        """Number of possible locations of a patch in the image."""
        return prod(self.places)


def orient_image(
    study: Study,
    image: NDArray[np.uint8],
    known: NDArray[np.bool_] | None,
    lengths: ScaledLengths,
    may_split: bool,
) -> OrientedImage:
    """Return the prepared `image`, which is in path coordinates at the coarsest scale.

    `known` are the known cells of the image at the finest scale, or None if all are known.
    `lengths` are along the axes of the path; `may_split` is true if tiles may be split.
    """
    p = study.parameters
    template, overlap, level = lengths.template, lengths.overlap, lengths.level
    correlation = p.similarity == "correlation"
    check_stop()  # each of the following steps takes a second for an image of many million cells
    pyramid = build_pyramid(image, level, n_planes(study))
    if max(level) and not p.exact_data:
        blocks = np.broadcast_to(upgrid(pyramid.image, lengths.block), pyramid.phases.shape)
        pyramid = pyramid._replace(phases=np.ascontiguousarray(blocks))
    guided = score_bound(study, lengths, len(pyramid.sums))
    kind = score_type(level, template, overlap, correlation, guided, known is not None)
    splits = legal_splits(template, overlap, lengths.volume) if may_split else [(1, 1, 1)]
    check_stop()
    squares = running_squares(pyramid.sums, kind)
    if correlation:
        squares[:] = 0
    running = running_sums(pyramid.sums, level, template)
    size = tuple(t >> n for t, n in zip(template, level, strict=True))
    places = tuple(n - t + 1 for n, t in zip(pyramid.sums.shape[1:], size, strict=True))
    proportions = np.array(study.training_image.proportions)  # kernels need a writable array
    margin, factors = np.zeros(len(proportions)), np.ones(len(proportions))
    if steers(study):
        shares = patch_shares(pyramid.sums, size, prod(template))  # type: ignore[arg-type]
        margin, factors = margin_weights(shares, proportions), gain_factors(shares, proportions)
    sums = squares, running, places
    illegal = np.zeros((0, 0, 0), np.uint8)
    if known is not None:
        illegal = illegal_places(known, lengths, places)  # type: ignore[arg-type]
    steering = proportions, margin, factors
    return OrientedImage(pyramid, np.array(splits), *sums, *steering, illegal)  # type: ignore[arg-type]


def illegal_places(
    known: NDArray[np.bool_], lengths: ScaledLengths, places: Triple
) -> NDArray[np.uint8]:
    """Return 1 for each location whose patch, also if shifted by refinement, has unknown cells.

    `known` has the shape of the image at the finest scale; `places` is the shape of the result.
    """
    table, ends = summed_up((~known).astype(np.int64)), []
    sizes = lengths.template, lengths.block, lengths.cell_size
    for n, m, t, b, s in zip(known.shape, places, *sizes, strict=True):
        first = np.arange(m) * b * s
        ends.append((np.maximum(first - b * s + 1, 0), np.minimum(first + (t + b) * s - 1, n)))
    for axis, (low, high) in enumerate(ends):
        table = np.take(table, high, axis) - np.take(table, low, axis)
    return (table > 0).astype(np.uint8)


def n_planes(study: Study) -> int:
    """Return the number of planes of block sums: one per facies, or one for two facies."""
    n_facies = study.training_image.n_facies
    return 1 if study.parameters.similarity == "ssd" and n_facies <= 2 else n_facies


def steers(study: Study) -> bool:
    """Return whether realizations are steered towards random target proportions.

    A location weight or an auxiliary variable switches steering off, because the location of
    patches in the image then determines proportions.
    """
    p, several = study.parameters, study.training_image.n_facies > 1
    several = several and not (study.secondary and study.secondary.auxiliary)
    return several and not p.draws_as_published and not p.match_proportions


class PreparedImage:
    """The prepared training image, which all realizations of a study share.

    Each part is computed when it is first needed; two threads may compute the same part. The most
    recently used parts, up to KEPT_BYTES in total, remain in memory.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.lengths = lengths_of(study.parameters, study.grid.shape)
        """Lengths at each scale, along the axes of the grid, for the default template."""
        self._parts: LruCache[Any] = LruCache(max_bytes=KEPT_BYTES)

    def oriented(self, orientation: int, template: Triple) -> OrientedImage:
        """Return the prepared image in one orientation, at the coarsest scale.

        `template` has the lengths along the axes of the grid.
        """

        def make() -> OrientedImage:
            p, study = self.study.parameters, self.study
            lengths = lengths_of(p, study.grid.shape, template, orientation)[-1]
            may_split = p.exact_data and study.hard_data.n > self.lengths[0].max_data
            known = study.training_image.known
            if known is not None:
                known = to_path(known.reshape(in_layers(known.shape)), orientation)
            image = self.scaled(orientation, p.scale)
            return orient_image(study, image, known, lengths, may_split)

        return self.part(("oriented", orientation, template), make)

    def scaled(self, orientation: int = 0, scale: int = 0) -> NDArray[np.uint8]:
        """Return the image in one orientation, up-gridded `scale` times, shape (nz, ny, nx)."""

        def make() -> NDArray[np.uint8]:
            if scale == 0:
                indices = self.study.training_image.indices
                oriented = to_path(indices.reshape(in_layers(indices.shape)), orientation)
                # kernels need a writable array; unknown cells count as one facies more
                return np.minimum(oriented, self.study.training_image.n_facies, order="C")
            finer, coarser = (self.lengths[s].along(orientation) for s in (scale - 1, scale))
            return upgrid(self.scaled(orientation, scale - 1), finer.cells_of(coarser))

        return self.part(("scaled", orientation, scale), make)

    def unknown(self) -> NDArray[np.int64]:
        """Return the running numbers of unknown cells of the image; empty if all are known."""
        known = self.study.training_image.known
        if known is None:
            return np.zeros((0, 0, 0), np.int64)
        cells = (~known.reshape(in_layers(known.shape))).astype(np.int64)
        return self.part(("unknown",), lambda: summed_up(cells))

    def bits(self) -> NDArray[np.uint64]:
        """Return the bits of the image, row by row, as computed by `to_bits`."""
        return self.part(("bits",), lambda: to_bits(self.scaled()))

    def square_bits(self, orientation: int = 0, scale: int = 0) -> NDArray[np.uint64]:
        """Return the bits of the `scaled` image in squares, as computed by `to_square_bits`."""
        key = "square_bits", orientation, scale
        return self.part(key, lambda: to_square_bits(self.scaled(orientation, scale)))

    def repair(self, template: Triple) -> Repair:
        """Return the inputs of seam repair, in the orientation of the grid."""
        shape, n_facies = in_layers(self.study.grid.shape), self.study.training_image.n_facies
        return self.part(
            ("repair", template), lambda: prepare_repair(self.scaled(), template, shape, n_facies)
        )

    def proportions_of_data(self) -> DataProportions:
        """Return the proportions of the hard data of the study."""
        study = self.study

        def make() -> DataProportions:
            cells, facies = in_three(study.hard_data.cells), study.facies_of_data
            proportions = np.array(study.training_image.proportions)
            shape = in_layers(study.grid.shape)
            return proportions_of_data(cells, facies, self.scaled(), proportions, shape)

        return self.part(("proportions of data",), make)

    def trend(self, orientation: int) -> Trend | None:
        """Return the proportions that probabilities or hard data suggest for each place.

        Return None if neither suggests any. The trend is in an orientation of the path.
        """

        def make() -> Trend | None:
            secondary = self.study.secondary
            if orientation == 0 and secondary and secondary.probabilities is not None:
                return trend_of_map(secondary.probabilities, self.study.training_image.proportions)
            if orientation == 0:
                shape, (_, ty, tx) = in_layers(self.study.grid.shape), self.lengths[0].template
                return trend_of_data(self.proportions_of_data(), shape, min(ty, tx) / 2)
            trend = self.trend(0)
            if trend is None:
                return None
            facies = np.moveaxis(trend.proportions, -1, 0)
            planes = [to_path(plane[None], orientation)[0] for plane in facies]
            return trend._replace(proportions=np.stack(planes, axis=-1))

        return self.part(("trend", orientation), make)

    def patterns(self, orientation: int) -> Patterns:
        """Return the patterns of the image in an orientation of the path."""
        return self.part(
            ("patterns", orientation), lambda: known_patterns(self.scaled(orientation))
        )

    def part(self, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Return a prepared part by its key; call `make` if the part is not in memory."""
        return self._parts.get_or_make(key, make)

    @cached_property
    def has_thin_facies(self) -> bool:
        """Whether a facies consists of bodies that are only a few cells thick."""
        usual = int(np.argmax(self.study.training_image.proportions))
        thicknesses = np.delete(mean_thickness(self.scaled()), usual)
        return bool((thicknesses < THIN).any())

    @cached_property
    def isolated_datum_thresholds(self) -> NDArray[np.float64]:
        """Thresholds, by facies index, below which a datum is isolated (see `resimulation`)."""
        return isolated_datum_thresholds(self.scaled())
