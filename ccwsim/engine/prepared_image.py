"""The training image, prepared for the search in each orientation of the path (section 4.2)."""

from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from copy import copy
from dataclasses import dataclass
from functools import cached_property, partial, wraps
from math import prod
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ccwsim.engine.copies import Copies, check_pieces, make_copies
from ccwsim.engine.corrections.guidance import score_bound
from ccwsim.engine.corrections.proportions import (
    DataProportions,
    gain_factors,
    margin_weights,
    patch_shares,
    proportions_of_data,
)
from ccwsim.engine.corrections.refinement import NO_RANKS
from ccwsim.engine.corrections.residuals import Residuals, residuals_of
from ccwsim.engine.corrections.resimulation import isolated_datum_thresholds
from ccwsim.engine.corrections.seam_repair import Repair, prepare_repair
from ccwsim.engine.corrections.trend_of_data import Trend, trend_of_data, trend_of_map
from ccwsim.engine.corrections.unseen_patterns import Patterns, known_patterns, mean_thickness
from ccwsim.engine.lengths import ScaledLengths, lengths_of, templates
from ccwsim.engine.stages import similarity
from ccwsim.engine.stages.bits import to_bits, to_square_bits
from ccwsim.engine.stages.conditioning import legal_splits
from ccwsim.engine.stages.path import FROM_ABOVE, Triple, in_layers, in_three, to_path
from ccwsim.engine.stages.pyramid import Pyramid, build_pyramid, cells_of_blocks, upgrid
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.workers import check_stop
from ccwsim.model import (
    Array,
    Bytes,
    CCWSIMError,
    Floats,
    Int32s,
    Integers,
    Ints,
    Mask,
    Study,
    UInt64s,
)

MAX_PARTS_BYTES = 500_000_000
"""Maximum total size, in bytes, of the prepared parts of an image that are stored in memory."""
MAX_PREPARED, MAX_PREPARED_BYTES = 16, 128 * 2**20
"""Maximum number and total size, in bytes, of prepared images that are kept between runs."""
MAX_THIN_CELLS = 3.0  # maximum mean thickness, in cells, of a facies that is thin


class OrientedImage(NamedTuple):
    """A training image in one orientation of the path, prepared for the search."""

    pyramid: Pyramid
    splits: Ints  # shape (n_splits, 3): made by `legal_splits`
    squares: Array  # made by `running_squares`, with the type of the scores
    running: Integers  # made by `running_sums`
    places: Triple  # number of layers, rows and columns of locations
    proportions: Floats  # shape (n_facies,): expected proportions of the grid
    # shape (n_kinds, n_facies): made by `margin_weights`; 0 if not steered
    margin: Floats
    gain_factors: Floats  # shape (n_facies,): made by `gain_factors`
    illegal: Bytes  # shape of locations: 1 with unknown cells; empty if all are known
    spans: Ints  # made by `legal_spans`
    # shape (n_kinds, 2): first layer and number of layers of the locations of each kind of copies
    layers: Ints
    n_places: Ints  # shape (n_kinds,): number of locations without unknown cells
    ranks: Bytes = NO_RANKS  # shape (nz, ny, nx): ranks of a continuous variable; empty for facies
    rank_phases: Bytes = np.zeros((0,) * 6, np.uint8)  # ranks in the order of `Pyramid.phases`


def orient_image(
    study: Study,
    image: Bytes,
    known_mask: Mask | None,
    copies: Copies | None,
    lengths: ScaledLengths,
    may_split: bool,
    other: OrientedImage | None = None,
) -> OrientedImage:
    """Return the prepared `image`, which is in path coordinates at the coarsest scale.

    `known_mask` marks the known cells of the image at the finest scale; None if all are known.
    `lengths` are along the axes of the path; `may_split` is true if tiles may be split. The layers
    of `copies` must be in the order of the path. Margins and gain factors are copied from `other`,
    the image in another orientation, if given. Raises `CCWSIMError` if no patch fits into the
    image, or into the copies of a kind.
    """
    p = study.parameters
    template, overlap, level = lengths.template, lengths.overlap, lengths.level
    correlation = p.similarity == "correlation"
    check_stop()  # each of the following steps takes a second for an image of many million cells
    pyramid = build_pyramid(image, level, n_planes(study), study.training_image.n_facies)
    if max(level) and not p.exact_data:
        blocks = np.broadcast_to(upgrid(pyramid.image, lengths.block), pyramid.phases.shape)
        pyramid = pyramid._replace(phases=np.ascontiguousarray(blocks))
    size = tuple(t >> n for t, n in zip(template, level, strict=True))
    places = tuple(max(n - t + 1, 0) for n, t in zip(pyramid.sums.shape[1:], size, strict=True))
    if p.variant == "code" and p.method == "ms-ccsim":  # it leaves out the last T rows and columns
        places = places[0], max(places[1] - size[1], 1), max(places[2] - size[2], 1)
    proportions = np.array(study.training_image.proportions)  # kernels need a writable array
    kinds, layers = proportions[None], np.array([[0, places[0]]])
    if copies is not None:
        proportions, kinds = copies.expected, copies.proportions
        layers = copies.layers // (lengths.block[0] * lengths.cell_size[0])
        layers[:, 1] = np.maximum(layers[:, 1] + 1 - size[0], 0)
    illegal = np.zeros((0, 0, 0), np.uint8)
    if known_mask is not None:
        illegal = illegal_places(known_mask, lengths, places)  # type: ignore[arg-type]
    n_illegal = [np.count_nonzero(illegal[first : first + n]) for first, n in layers.tolist()]
    n_places = layers[:, 1] * places[1] * places[2] - n_illegal
    check_pieces(copies, n_places, template)
    guided = score_bound(study, lengths, len(pyramid.sums))
    largest = largest_code(study)
    kind = similarity.score_type(
        level,
        template,
        overlap,
        correlation,
        guided,
        excludes=known_mask is not None,
        largest_code=largest,
    )
    splits = legal_splits(template, overlap, lengths.volume) if may_split else [(1, 1, 1)]
    check_stop()
    squares = similarity.running_squares(pyramid.sums, kind)
    planes = pyramid.sums
    if p.variant != "ours":
        of_codes, planes = planes_of_codes(pyramid.sums, study.training_image.codes)
        squares = similarity.running_squares(of_codes[None], kind)
    if correlation:
        squares[:] = 0
    running = similarity.running_sums(planes, level, template, largest)
    margin, factors = np.zeros(kinds.shape), np.ones(len(proportions))
    if other is not None:
        margin, factors = other.margin, other.gain_factors
    elif steers(study):
        shares = [
            patch_shares(
                pyramid.sums[:, first : first + n + size[0] - 1],
                size,  # type: ignore[arg-type]
                n_cells=prod(template),
                illegal=illegal[first : first + n],
            )
            for first, n in layers.tolist()
        ]
        margin = np.stack(
            [margin_weights(share, kind) for share, kind in zip(shares, kinds, strict=True)]
        )
        factors = gain_factors(np.concatenate(shares), proportions)
    return OrientedImage(
        pyramid=pyramid,
        splits=np.array(splits),
        squares=squares,
        running=running,
        places=places,  # type: ignore[arg-type]
        proportions=proportions,
        margin=margin,
        gain_factors=factors,
        illegal=illegal,
        spans=similarity.legal_spans(illegal),
        layers=layers,
        n_places=n_places,
    )


def planes_of_codes(sums: Integers, codes: Ints) -> tuple[Ints, Ints]:
    """Return the block sums A of facies codes, and for each plane of `sums` its code times A.

    B, the block sums of codes in the overlap, are sums over the facies of code times number of
    cells. With these planes, the terms of all facies therefore add up to A·B.
    """
    weights = np.asarray(codes[-len(sums) :], np.int64)[:, None, None, None]
    of_codes = (weights * sums).sum(axis=0)
    return of_codes, weights * of_codes


def illegal_places(known_mask: Mask, lengths: ScaledLengths, places: Triple) -> Bytes:
    """Return 1 for each location whose patch has unknown cells, before or after refinement.

    `known_mask` has the shape of the image at the finest scale; the result has the shape `places`.
    """
    unknown_mask = ~known_mask
    for axis in (2, 1, 0):  # layers last, because blocks of a map do not reduce their number
        n, m, t = known_mask.shape[axis], places[axis], lengths.template[axis]
        b, s = lengths.block[axis], lengths.cell_size[axis]
        first = np.arange(m) * b * s
        low, high = np.maximum(first - b * s, -1), np.minimum(first + (t + b) * s, n + 1) - 2
        counts = np.cumsum(unknown_mask, axis, dtype=np.int32)
        before = np.take(counts, np.maximum(low, 0), axis)
        np.moveaxis(before, axis, 0)[low < 0] = 0
        unknown_mask = np.take(counts, high, axis) > before
    return unknown_mask.astype(np.uint8)


def n_planes(study: Study) -> int:
    """Return the number of planes of block sums: one per facies, or one for two facies."""
    codes, p = study.training_image.codes, study.parameters
    one_is_enough = p.similarity == "ssd" if p.variant == "ours" else codes[0] == 0
    return 1 if one_is_enough and len(codes) <= 2 else len(codes)


def largest_code(study: Study) -> int:
    """Return the largest code from which scores are computed; 1 for scores of numbers of cells."""
    if study.parameters.variant == "ours":
        return 1
    return max(int(study.training_image.codes[-1]), 1)


def steers(study: Study) -> bool:
    """Return whether realizations are steered towards random target proportions.

    An auxiliary variable or a location weight along y or x switches steering off, because the
    location of patches in the image then determines proportions.
    """
    p, several = study.parameters, study.training_image.n_facies > 1
    placed = max(p.location_weights[1:]) > 0 or study.secondary_or_empty.auxiliary
    return several and not placed and not p.published_draw and not p.match_proportions


Method = TypeVar("Method", bound=Callable[..., Any])


def _part(method: Method) -> Method:
    """Make a method of `PreparedImage` return a part, which is computed once for its arguments."""
    defaults = method.__defaults__ or ()  # of all arguments or of none

    @wraps(method)
    def stored(image: Any, *key: Any) -> Any:
        key += defaults[len(key) :]
        return image.part((method.__name__, *key), partial(method, image, *key))

    return stored  # type: ignore[return-value]


@dataclass(eq=False)
class PreparedImage:
    """The prepared training image, which all realizations of a study share.

    Each part is computed once, when it is first needed. The most recently used parts, up to
    MAX_PARTS_BYTES in total, remain in memory. No part depends on the seed.
    """

    study: Study

    def __post_init__(self) -> None:
        study = self.study
        self.lengths = lengths_of(study.parameters, study.grid.shape)
        """Lengths at each scale, along the axes of the grid, for the default template."""
        self._parts: Memo[Any] = Memo(max_bytes=MAX_PARTS_BYTES)

    @cached_property
    def key(self) -> tuple[Hashable, ...]:
        """Everything that determines the parts: equal for studies that differ in the seed."""
        return self.study.key("seed")

    @_part
    def oriented(self, orientation: int, template: Triple) -> OrientedImage:
        """Return the prepared image in one orientation, at the coarsest scale.

        `template` has the lengths along the axes of the grid.
        """
        p, study, copies = self.study.parameters, self.study, self.copies
        lengths = lengths_of(p, study.grid.shape, template, orientation)[-1]
        may_split = p.exact_data and study.hard_data.n > self.lengths[0].max_data
        mask = self._known_mask
        if copies and orientation & FROM_ABOVE:
            first, n = copies.layers.T
            layers = np.column_stack([len(copies.indices) - first - n, n])
            copies = copies._replace(layers=layers)
        oriented = orient_image(
            study,
            self.scaled(orientation, p.scale),
            known_mask=None if mask is None else to_path(mask, orientation),
            copies=copies,
            lengths=lengths,
            may_split=may_split,
            other=self.oriented(0, template) if copies and orientation else None,
        )
        image = study.training_image
        if not image.values:
            return oriented
        ranks = image.ranks_of(image.values[image.variable])
        ranks = ranks.ravel()[copies.origins] if copies else ranks[None]
        ranks = np.ascontiguousarray(to_path(ranks, orientation))
        return oriented._replace(ranks=ranks, rank_phases=cells_of_blocks(ranks, lengths.block))

    def fitting(self, orientation: int, template: Triple) -> tuple[Triple, OrientedImage]:
        """Return a template, and the image prepared for it, or the next smaller one that fits.

        Only `template_variation` allows smaller templates. Raises `CCWSIMError` if none fits.
        """
        study = self.study
        allowed = templates(study.parameters, study.training_image.shape)
        for smaller in [t for t in reversed(allowed) if t[2] < template[2]]:
            try:
                return template, self.oriented(orientation, template)
            except CCWSIMError:
                template = smaller
        return template, self.oriented(orientation, template)

    @cached_property
    def copies(self) -> Copies | None:
        """The copies in which patches are searched; None if only the training image is searched."""
        return make_copies(self.study)

    @cached_property
    def base(self) -> Bytes:
        """The training image, shape (nz, ny, nx); unknown cells count as one facies more."""
        indices, n_facies = self.study.training_image.indices, self.study.training_image.n_facies
        return np.minimum(indices.reshape(in_layers(indices.shape)), n_facies)

    @property
    def shape(self) -> Triple:
        """Shape of the image, or of the stack of its copies, along z, y and x."""
        nz, ny, nx = (self.copies.indices if self.copies else self.base).shape
        return nz, ny, nx

    @property
    def _known_mask(self) -> Mask | None:
        """The known cells of the image or of the stack of copies, three axes."""
        if self.copies:
            return self.copies.known_mask
        mask = self.study.training_image.known
        return None if mask is None else mask.reshape(in_layers(mask.shape))

    @_part
    def scaled(self, orientation: int = 0, scale: int = 0) -> Bytes:
        """Return the image, or the stack of its copies, in one orientation, shape (nz, ny, nx).

        The image is up-gridded `scale` times.
        """
        if scale == 0:
            image = self.copies.indices if self.copies else self.base
            return np.array(to_path(image, orientation), order="C")  # kernels need it writable
        if self.study.parameters.variant == "code":  # the cell nearest to the middle of a block
            fine = self.scaled(orientation)
            _, sy, sx = self.lengths[scale].along(orientation).cell_size
            ny, nx = fine.shape[1] // sy * sy, fine.shape[2] // sx * sx
            return np.ascontiguousarray(fine[:, sy // 2 : ny : sy, sx // 2 : nx : sx])
        finer, coarser = (self.lengths[s].along(orientation) for s in (scale - 1, scale))
        return upgrid(self.scaled(orientation, scale - 1), finer.cells_of(coarser))

    @_part
    def unknown(self, orientation: int = 0) -> Int32s:
        """Return the running numbers of unknown cells of the image; empty if all are known."""
        if self._known_mask is None:
            return np.zeros((0, 0, 0), np.int32)
        return similarity.summed_up(~to_path(self._known_mask, orientation), np.int32)

    @_part
    def bits(self) -> UInt64s:
        """Return the bits of the image, row by row, as computed by `to_bits`."""
        return to_bits(self.scaled())

    @_part
    def square_bits(self, orientation: int = 0, scale: int = 0) -> UInt64s:
        """Return the bits of the `scaled` image in squares, as computed by `to_square_bits`."""
        return to_square_bits(self.scaled(orientation, scale), self.study.training_image.n_facies)

    @_part
    def repair(self, template: Triple) -> Repair:
        """Return the inputs of seam repair, in the orientation of the grid."""
        shape, n_facies = in_layers(self.study.grid.shape), self.study.training_image.n_facies
        room = np.minimum(self.shape, shape).tolist()
        if self.copies:
            room[0] = min(room[0], int(self.copies.layers[:, 1].min()))
        return prepare_repair(
            self.scaled(),
            template,
            room=tuple(room),
            n_facies=n_facies,
            volume=len(self.base) > 1,
            unknown=self.unknown(),
        )

    @_part
    def residuals(self) -> Residuals:
        """Return the inputs to correct values at the hard data of the study."""
        return residuals_of(self.study)

    @_part
    def proportions_of_data(self) -> DataProportions:
        """Return the proportions of the hard data of the study."""
        study = self.study
        cells, facies = in_three(study.hard_data.cells), study.facies_of_data
        proportions = np.array(study.training_image.proportions)
        proportions = self.copies.expected if self.copies else proportions
        shape = in_layers(study.grid.shape)
        return proportions_of_data(cells, facies, self.base, proportions, shape)

    @_part
    def trend(self, orientation: int) -> Trend | None:
        """Return the proportions that probabilities or hard data suggest for each place.

        Return None if neither suggests any. The trend is in an orientation of the path.
        """
        secondary, shape = self.study.secondary_or_empty, self.study.grid.shape
        of_image = self.study.training_image.proportions
        if self.copies and secondary.zones is not None:
            of_image = self.copies.proportions[self.copies.kinds.reshape(shape)]
        soft = secondary.probabilities
        if orientation == 0 and (soft is not None or of_image.ndim > 1):
            unknown = np.full((of_image.shape[-1], *shape), np.nan)
            return trend_of_map(unknown if soft is None else soft, of_image)
        if orientation == 0:
            shape, (_, ty, tx) = in_layers(self.study.grid.shape), self.lengths[0].template
            return trend_of_data(self.proportions_of_data(), shape, min(ty, tx) / 2)
        trend = self.trend(0)
        if trend is None:
            return None
        facies = np.moveaxis(trend.proportions, -1, 0)
        planes = [to_path(plane[None], orientation)[0] for plane in facies]
        return trend._replace(proportions=np.stack(planes, axis=-1))

    @_part
    def patterns(self, orientation: int) -> Patterns:
        """Return the patterns of the image in an orientation of the path."""
        image, unknown = self.scaled(orientation), self.unknown(orientation)
        return known_patterns(image, None, len(self.base) > 1, unknown)

    def part(self, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Return a prepared part by its key; call `make` if the part is not in memory."""
        return self._parts.value(key, make)

    @cached_property
    def has_thin_facies(self) -> bool:
        """Whether a facies consists of bodies that are only a few cells thick."""
        usual = int(np.argmax(self.study.training_image.proportions))
        thicknesses = np.delete(mean_thickness(self.base), usual)
        return bool((thicknesses < MAX_THIN_CELLS).any())

    @cached_property
    def isolated_datum_thresholds(self) -> Floats:
        """Thresholds, by facies index, below which a datum is isolated (see `resimulation`)."""
        return isolated_datum_thresholds(self.base)


_images: Memo[PreparedImage] = Memo(MAX_PREPARED, MAX_PREPARED_BYTES, min_values=0)
_keeps: ContextVar[bool] = ContextVar("keeps", default=True)
keeps_images = _keeps.get
"""Return whether this thread uses and keeps prepared images of other runs."""


@contextmanager
def fresh_images() -> Iterator[None]:
    """Prepare all images of a thread anew, so that measured times include their preparation."""
    token = _keeps.set(False)
    try:
        yield
    finally:
        _keeps.reset(token)


def divide_images(n: int) -> None:
    """Divide the memory for prepared images among `n` processes."""
    _images.max_bytes = MAX_PREPARED_BYTES / n


def prepared_image(study: Study) -> PreparedImage:
    """Return the prepared image of a study; parts may be those of a study with another seed."""
    image = PreparedImage(study)
    if _keeps.get():  # with the parts of a kept image, but the seed of this study
        image = copy(_images.value(image.key, lambda: image))
        image.study = study
    return image


def keep(prepared: PreparedImage) -> None:
    """Keep an image for later runs, as far as all images fit; called when its parts are made."""
    if _keeps.get():
        _images.put(prepared.key, prepared)
