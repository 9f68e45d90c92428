"""Properties of a training image, and advice on template size, overlap and wavelet level."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import prod
from typing import Any, cast

import numpy as np

from ccwsim import Grid, Parameters, TrainingImage
from ccwsim.engine.stages.conditioning import MAX_PATCH_DATA
from ccwsim.metrics.etype import proportions
from ccwsim.metrics.lags import VERTICAL, Direction, lags_that_fit
from ccwsim.metrics.stack import N_AXES, Codes, Images, Stack, as_image
from ccwsim.metrics.stationarity import IMAGE_PARTS, QUARTERS, Stationarity, stationarity
from ccwsim.metrics.variograms import variogram
from ccwsim.model import (
    MAX_TEMPLATE,
    MIN_TEMPLATE,
    PER_AXIS,
    ArrayLike,
    Floats,
    Ints,
    Mask,
    Shape,
    check_int,
    fitted,
    plural,
    read_toml,
)

_TEXTS = read_toml("assets/advice.toml")
SILL_SHARE = 0.95
PROMINENCE = 0.1  # minimum prominence of a peak of the correlation; lower peaks are noise
THICK_SHARE = 0.95  # share of a facies covered by squares whose side is its thickness


@dataclass(frozen=True, eq=False)
class Spacing:
    """Range and spacing of features along a direction."""

    lags: Ints
    correlation: Floats
    """Correlation 1 − Σ γ / Σ sill, with sums over facies, shape (n_lags,)."""
    range: int | None
    """First lag at which γ reaches 95 % of the sill; None if γ stays below this value."""
    spacing: int | None
    """Distance between features: the lag of the first peak of the correlation, or None."""
    strength: float
    """Prominence of the first peak, from 0 (no repetition) to about 2 (strict period)."""


def feature_spacing(
    image: Images, codes: Codes | None = None, direction: Direction = "E-W"
) -> Spacing:
    """Return range and spacing of the features; lags are at most half of the smaller side.

    In a volume, this is the smaller side of a layer or, for "vertical", the number of layers.

    Examples
    --------
    >>> stripes = feature_spacing(np.tile(np.arange(60) // 5 % 2, (60, 1)))
    >>> stripes.range, stripes.spacing, round(stripes.strength, 3)
    (3, 10, 2.0)
    """
    stack = as_image(image, codes)
    side = stack.shape[0] if str(direction) == VERTICAL else min(stack.shape[-2:])
    lags = lags_that_fit(stack.shape, direction, np.arange(max(side // 2, 1)))
    parts = [variogram(stack, int(code), direction, lags) for code in stack.codes]
    sill = sum(float(part.sill[0]) for part in parts)
    if not sill:
        return Spacing(lags, np.ones(len(lags)), None, None, 0.0)
    correlation = 1 - np.sum([part.gamma[0] for part in parts], axis=0) / sill
    reached = np.flatnonzero(correlation <= 1 - SILL_SHARE)
    from scipy.signal import find_peaks  # imported here because loading takes time

    peaks, properties = find_peaks(correlation, prominence=PROMINENCE)
    reach = int(reached[0]) if len(reached) else None
    if not len(peaks):
        return Spacing(lags, correlation, reach, None, 0.0)
    return Spacing(lags, correlation, reach, int(peaks[0]), float(properties["prominences"][0]))


@dataclass(frozen=True, eq=False)
class Granulometry:
    """Share of a facies that remains when parts thinner than a size are removed."""

    sizes: Ints
    """Sides of squares: 1, 2, … cells."""
    kept: Floats
    """Share of the facies' cells covered by squares of each size that are inside the facies."""

    def thickness(self, share: float = THICK_SHARE) -> int:
        """Return the largest size that keeps at least `share` of the facies; 0 if absent."""
        return int(np.count_nonzero(self.kept >= share))


def granulometry(
    image: Images,
    facies: int | str,
    max_size: int = 64,
    down_to: float = 0.0,
    extend: bool = False,
    vertical: bool = False,
) -> Granulometry:
    """Compute morphological openings of a facies with growing squares (Matheron 1975).

    Squares have sides of up to `max_size` cells, inside the image and, in volumes, within layers;
    `vertical` takes vertical columns of 1, 2, … layers instead. `down_to` stops after the first
    size at which less than this share of the facies remains. A geobody cut by the edge has the
    thickness of the visible part, unless `extend` repeats the edge cells of the image.

    Examples
    --------
    >>> river = np.zeros((9, 9), int)
    >>> river[3:6] = 1
    >>> granulometry(river, 1).thickness()
    3
    """
    max_size = check_int("max_size", max_size, 1, 2**31)
    stack = as_image(image)
    inside = stack.volume(0) == stack.index_of(facies)
    axes = (0,) if vertical else (1, 2)
    total, largest = int(inside.sum()), min(max_size, min(inside.shape[axis] for axis in axes))
    kept: list[float] = []
    for size in range(1, largest + 1):
        edges = [(size - 1 if axis in axes else 0,) * 2 for axis in range(N_AXES)]
        whole = np.pad(inside, edges, mode="edge") if extend else inside
        for axis in axes:
            whole = _combined(np.logical_and, whole, size, axis)
        if not whole.any():
            break
        reached = np.pad(whole, edges)
        for axis in axes:
            reached = _combined(np.logical_or, reached, size, axis)
        if extend:
            inner = (slice(a, n - b) for (a, b), n in zip(edges, reached.shape, strict=True))
            reached = reached[tuple(inner)]
        kept.append(np.count_nonzero(reached) / total)
        if kept[-1] < down_to:
            break
    return Granulometry(np.arange(1, len(kept) + 1), np.array(kept))


def _combined(operation: np.ufunc, mask: Mask, size: int, axis: int) -> Mask:
    """Combine runs of `size` cells along an axis; the result is in the first cell of each run."""
    length = 1
    mask = np.moveaxis(mask, axis, 0)
    while length < size:
        step = min(length, size - length)
        mask = operation(mask[:-step], mask[step:])
        length += step
    return np.moveaxis(mask, 0, axis)


MIN_ACROSS = 6  # minimum number of templates along an image's smaller side, to avoid copies
SMALL_TEMPLATE = 24  # largest template for which MIN_ACROSS_SMALL templates suffice
MIN_BLOCKS = 8  # minimum blocks along a template; with fewer, patterns of small images deteriorate
SMALL_SIDES = range(8, 160)  # smaller sides of maps in which fewer than 5 default templates fit
MIN_ACROSS_SMALL = 4  # minimum number of small templates, or of templates of a periodic image
MAX_ADVISED_LEVEL = 3
MANY_TEMPLATES = 16  # number of templates in an image for which steering compensates for its edges
FEW_AT_EDGES = 0.75  # a facies is at the edges if its proportion in patches / in the image is less
COARSE_LEVEL = 3  # level at which dense data break shapes (measured in `docs/quality.md`)
MIN_HALVED_LAYERS = 16  # minimum layers of a volume whose templates have half the layers, not all
MIN_LAYERS = 8  # minimum height of a template in layers, if the image has enough layers
TREND_WEIGHT = 0.5  # location weight for a trend; larger weights add little
PERIODIC = 0.5  # minimum `Spacing.strength` at which an image is considered periodic


@dataclass(frozen=True)
class Advice:
    """An advised parameter value with its reason; a volume has three values (z, y, x)."""

    parameter: str
    value: Any
    reason: str


def templates_that_fit(shape: Shape, template_size: int | tuple[int, int, int]) -> int:
    """Return the number of templates that fit into an image without overlap.

    `template_size` is the side of the template in cells, or its layers, rows and columns.

    Examples
    --------
    >>> templates_that_fit((256, 256), 32)
    64
    """
    lengths = Grid.of(shape).shape
    alike = not isinstance(template_size, tuple) or len(template_size) != len(lengths)
    sides = (template_size,) * len(lengths) if alike else template_size
    each = [check_int("template_size", side, 1, 2**31) for side in cast(tuple[int, ...], sides)]
    return prod(n // side for n, side in zip(lengths, each, strict=True))


def feature_size(ew: Spacing, ns: Spacing, side: int) -> tuple[int, str]:
    """Return the side in cells of a template that contains a feature, and the reason as text."""
    largest = largest_template(side)
    spacings = [
        s.spacing
        for s in (ew, ns)
        if s.spacing is not None
        and (s.spacing <= largest + 2 or (s.strength >= PERIODIC and 3 * s.spacing < side))
    ]
    if spacings:
        return max(spacings), f"Features repeat about every {max(spacings)} cells"
    if ew.range is not None and ns.range is not None:
        lengths = f"{plural(ew.range, 'cell')} east–west and {ns.range} north–south"
        why = f"The variogram reaches its sill after {lengths}"
        return round(2 * (ew.range * ns.range) ** 0.5), why
    if ew.range is not None or ns.range is not None:
        return largest, "Features reach across the image along one axis"
    return largest, "The variogram reaches no sill"


def largest_template(side: int) -> int:
    """Return the largest advised template for an image whose smaller side has `side` cells."""
    small = min(side // MIN_ACROSS_SMALL, SMALL_TEMPLATE)
    return min(max(side // MIN_ACROSS, small, MIN_TEMPLATE), MAX_TEMPLATE)


def _resolving_level(thinnest: int) -> int:
    """Return the coarsest level whose blocks are at most as large as the thinnest facies."""
    return max(thinnest, 1).bit_length() - 1


@lru_cache(maxsize=8)  # pages ask again whenever they are drawn
def resolving_levels(training_image: TrainingImage) -> tuple[int, int, int]:
    """Return the coarsest levels, along z, y and x, whose blocks resolve the thinnest facies.

    At coarser levels, the search hardly sees this facies. In maps, the level along z is 0.

    Examples
    --------
    >>> resolving_levels(TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64))))
    (0, 1, 1)
    """
    image = as_image(training_image)
    along_z = _thickness(image, vertical=True) if image.is_volumes else (1,)
    z, level = _resolving_level(min(along_z)), _resolving_level(min(_thickness(image)))
    return z, level, level


def _advise_level(thinnest: int, side: int) -> Advice:
    """Advise a wavelet level with blocks that are at most as large as the thinnest facies."""
    by_side = max(largest_template(side) // MIN_BLOCKS, 1).bit_length() - 1
    level = min(_resolving_level(thinnest), by_side, MAX_ADVISED_LEVEL)
    compared = "single cells must be compared"
    if level:
        compared = f"blocks with sides of {2**level} cells still resolve this facies"
    reason = f"The thinnest facies is {plural(thinnest, 'cell')} thick: {compared}."
    return Advice("wavelet_level", level, reason)


def _advise_template(wanted: int, why: str, side: int, level: int, is_period: bool) -> Advice:
    """Advise the smallest template that contains a feature, if enough fit; fewer if periodic."""
    largest, block_size = largest_template(side), 2**level
    size = -(-max(wanted, 16) // block_size) * block_size
    if is_period and largest < wanted and MIN_ACROSS_SMALL * size <= side:
        why += f", though only {side // size} templates fit along {side} cells"
    elif max(wanted, 16) > largest:
        why += f", but {side // largest} templates should fit along {side} cells"
        size = max(largest // block_size * block_size, 4, block_size)
    held = "hold a feature" if size >= wanted else "are the maximum"
    return Advice("template_size", size, f"{why}: {size} cells {held}.")


def _advise_overlap(template: int, thinnest: int, level: int) -> Advice:
    """Advise an overlap: a quarter of the template, at least the smallest facies thickness."""
    block_size = 2**level
    largest = max(template // 2 // block_size, 1)
    n_blocks = min(max(round(template / 4 / block_size), -(-thinnest // block_size), 1), largest)
    reason = _TEXTS["overlap"].format(thickness=plural(thinnest, "cell"))
    return Advice("overlap_size", n_blocks * block_size, reason)


def warn_of_level(parameters: Parameters, grid_shape: Shape, n_data: int) -> str:
    """Return a one-sentence warning if the level is too coarse for the hard data; otherwise "".

    The level is too coarse if a template has more than `MAX_PATCH_DATA` data on average.

    Examples
    --------
    >>> warn_of_level(Parameters(32, 8, 2), (512, 512), 4000)
    ''
    >>> warn_of_level(Parameters(32, 8, 3), (512, 512), 4000)[:44]
    'A template has 16 data on average: at level '
    """
    grid = Grid.of(grid_shape)
    lengths = parameters.along(grid.shape)
    level, a_template = max(lengths.level), n_data * prod(lengths.template) / grid.n_cells
    if level < COARSE_LEVEL or a_template <= MAX_PATCH_DATA:
        return ""
    return _TEXTS["level"].format(n=a_template, level=level)


def facies_at_edges(parameters: Parameters, training_image: TrainingImage) -> int | None:
    """Return the index of a facies whose proportion in patches is far below that in the image.

    Realizations have too little of this facies. The result is None if there is no such facies, if
    the image has unknown cells, or if many templates fit into it.
    """
    image, shape = training_image, training_image.shape
    template = parameters.along(shape).template[-len(shape) :]
    if image.known is not None or templates_that_fit(shape, template) >= MANY_TEMPLATES:  # type: ignore[arg-type]
        return None
    n_patches = np.ones(())  # number of patches that contain each cell
    for n, side in zip(shape, template, strict=True):
        most = min(side, max(n - side, 0) + 1)
        along = np.minimum(np.arange(1, n + 1), np.arange(n, 0, -1)).clip(max=most)
        n_patches = np.multiply.outer(n_patches, along)
    counts = np.bincount(image.indices.ravel(), n_patches.ravel(), image.n_facies)
    ratios = counts / counts.sum() / image.proportions
    return int(ratios.argmin()) if ratios.min() < FEW_AT_EDGES else None


def warn_of_edges(parameters: Parameters, training_image: TrainingImage) -> str:
    """Return a warning if a facies is mostly at the edges of the image; otherwise "".

    Examples
    --------
    >>> cells = np.zeros((64, 64), int)
    >>> cells[:, :9] = cells[:, -9:] = 1
    >>> warn_of_edges(Parameters(32, 8, 2), TrainingImage(cells))[:60]
    'facies 1 (28 % of the training image) is mostly at the edges'
    >>> warn_of_edges(Parameters(8, 2, 0), TrainingImage(cells))
    ''
    """
    facies = facies_at_edges(parameters, training_image)
    if facies is None:
        return ""
    share = 100 * training_image.proportions[facies]
    return _TEXTS["edges"].format(facies=training_image.facies_names[facies], share=share)


def advise_along_z(
    level: int, thinnest: int, spacing: Spacing, n_layers: int
) -> tuple[tuple[int, int, int], str]:
    """Return level, template and overlap along z of a (thin) volume, and the reason as text."""
    largest = n_layers if n_layers < MIN_HALVED_LAYERS else min(n_layers // 2, MAX_TEMPLATE)
    by_side = max(largest // 4, 1).bit_length() - 1
    z_level = max(min(level - 1, _resolving_level(thinnest), by_side), 0)
    wanted, why = n_layers, "features reach across the layers"
    if spacing.spacing is not None:
        wanted, why = spacing.spacing, f"features repeat about every {spacing.spacing} layers"
    elif spacing.range is not None:
        wanted = 2 * spacing.range
        why = f"the variogram reaches its sill after {plural(spacing.range, 'layer')}"
    block_size = 2**z_level
    template = min(-(-max(wanted, MIN_LAYERS) // block_size), largest // block_size) * block_size
    if template < wanted < n_layers:
        why += f", but only {template} layers fit into half of the image"
    n_blocks = max(round(template / 4 / block_size), -(-thinnest // block_size), 1)
    return (z_level, template, min(n_blocks, template // 2 // block_size) * block_size), why


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Properties of a training image, and advised parameters."""

    stationarity: Stationarity
    thickness: tuple[int, ...]
    """Thickness of each facies in cells: side of the largest squares that cover 95 % of the facies.
    Geobodies at the border are extended beyond the border."""
    spacing_ew: Spacing
    spacing_ns: Spacing
    feature_size: int
    """Side in cells of a template that contains a feature."""
    n_templates: int
    """Number of templates of the advised size that fit into the image without overlap."""
    advice: tuple[Advice, ...]
    """Consistent level, template and overlap; with a trend, also a location_weight."""
    warnings: tuple[str, ...]
    """Warnings about possible problems of the image."""
    vertical_thickness: tuple[int, ...] = ()
    """Vertical thickness of each facies of a volume, in layers; empty for a map."""
    vertical_spacing: Spacing | None = None

    def advised(self, parameter: str) -> Any:
        """Return the advised value of a parameter, in volumes as (layers, rows, columns)."""
        return next(a.value for a in self.advice if a.parameter == parameter)


def diagnose(training_image: TrainingImage | ArrayLike) -> Diagnosis:
    """Analyse a training image and advise template size, overlap and wavelet level.

    Values of a continuous variable are analysed as two facies, below and above the median. Raises
    `CCWSIMError` for an image of fewer than 8 rows or columns.

    Examples
    --------
    >>> import numpy as np
    >>> rivers = TrainingImage(np.tile(np.arange(192)[:, None] % 24 < 6, (1, 192)).astype(int))
    >>> [(a.parameter, a.value) for a in diagnose(rivers).advice]
    [('wavelet_level', 2), ('template_size', 24), ('overlap_size', 8)]
    """
    training_image = TrainingImage.of(training_image).two_facies
    image, names = as_image(training_image), training_image.facies_names
    quarters = stationarity(image)
    thickness = _thickness(image)
    ew, ns = (feature_spacing(image, direction=d) for d in ("E-W", "N-S"))
    side = min(image.shape[-2:])
    wanted, why = feature_size(ew, ns, side)
    level = _advise_level(min(thickness), side)
    is_period = wanted in (ew.spacing, ns.spacing)
    template = _advise_template(wanted, why, side, level.value, is_period)
    advice = level, template, _advise_overlap(template.value, min(thickness), level.value)
    spacings, upright, vertical = (ew, ns), (), None
    if image.is_volumes:
        upright = _thickness(image, vertical=True)
        vertical = feature_spacing(image, direction=VERTICAL)
        spacings = ew, ns, vertical
        along_z, why = advise_along_z(level.value, min(upright), vertical, image.shape[0])
        advice = tuple(
            Advice(a.parameter, (z, a.value, a.value), f"{a.reason} Along z {why}.")
            for a, z in zip(advice, along_z, strict=True)
        )
        if quarters.vertical_trend.any() and along_z[1] < image.shape[0]:
            weight = TREND_WEIGHT, 0.0, 0.0
            advice = *advice, Advice("location_weight", weight, _TEXTS["location"])
    elif quarters.drifting.any():
        advice = *advice, Advice("location_weight", TREND_WEIGHT, _TEXTS["places"])
    boxes = wanted if vertical is None else (advice[1].value[0], wanted, wanted)
    return Diagnosis(
        stationarity=quarters,
        thickness=thickness,
        spacing_ew=ew,
        spacing_ns=ns,
        feature_size=wanted,
        n_templates=templates_that_fit(image.shape, advice[1].value),
        advice=advice,
        warnings=tuple(_warnings(image, names, quarters, spacings, boxes)),
        vertical_thickness=upright,
        vertical_spacing=vertical,
    )


def recommended_parameters(
    training_image: TrainingImage, parameters: Parameters | None = None
) -> tuple[Parameters, str]:
    """Return parameters with the values that `diagnose` advises, and the reasons as text.

    Other values are those of `parameters`. Raises `CCWSIMError` for an image of fewer than 8 rows
    or columns.

    Examples
    --------
    >>> rivers = TrainingImage(np.tile(np.arange(192)[:, None] % 24 < 6, (1, 192)).astype(int))
    >>> advised, reason = recommended_parameters(rivers)
    >>> advised.template_size, reason[:37]
    (24, 'The thinnest facies is 6 cells thick:')
    """
    advice, base = diagnose(training_image).advice, parameters or Parameters()
    values = {each.parameter: each.value for each in advice}
    return fitted(base, training_image.shape, **values), " ".join(each.reason for each in advice)


def default_parameters(training_image: TrainingImage) -> Parameters:
    """Return the default parameters; for a small map, the sizes of `recommended_parameters`.

    Examples
    --------
    >>> [default_parameters(TrainingImage(np.eye(n, dtype=int))).template_size for n in (72, 256)]
    [16, 32]
    """
    shape = training_image.shape
    if len(shape) == N_AXES or min(shape) not in SMALL_SIDES:
        return Parameters()
    advised, _ = recommended_parameters(training_image)
    return Parameters(**{name: getattr(advised, name) for name in PER_AXIS})


def _thickness(image: Stack, vertical: bool = False) -> tuple[int, ...]:
    """Return the thickness of each facies within layers, or vertically."""
    return tuple(
        granulometry(image, code, down_to=THICK_SHARE, extend=True, vertical=vertical).thickness()
        for code in image.codes.tolist()
    )


def _warnings(
    image: Stack,
    names: tuple[str, ...],
    quarters: Stationarity,
    spacings: tuple[Spacing, ...],
    wanted: int | tuple[int, int, int],
) -> Iterator[str]:
    n_fit = templates_that_fit(image.shape, wanted)
    sides = wanted if isinstance(wanted, tuple) else (wanted,)
    if n_fit < MIN_ACROSS**2:
        yield _TEXTS["few"].format(n=n_fit, sides=" × ".join(map(str, sides)))
    if quarters.drifting.any():
        yield _drift(image, names, quarters)
    elif quarters.changing.any():
        shift = np.where(quarters.changing, quarters.variogram_shift, 0)
        yield _TEXTS["changing"].format(quarter=QUARTERS[int(shift.max(axis=(1, 2)).argmax())])
    if quarters.vertical_trend.any():
        yield _trend(image, names, quarters)
    for name, spacing in zip(("east–west", "north–south", "vertically"), spacings, strict=False):
        if spacing.spacing is not None and spacing.strength >= PERIODIC:
            yield _TEXTS["periodic"].format(n=spacing.spacing, way=name)


def _trend(image: Stack, names: tuple[str, ...], quarters: Stationarity) -> str:
    """Describe the facies whose proportion differs most between the upper and the lower half."""
    assert quarters.vertical_differences is not None
    sizes = np.where(quarters.vertical_trend, np.abs(quarters.vertical_differences), 0)
    facies = int(sizes.argmax())
    share, difference = proportions(image)[0, facies], quarters.vertical_differences[facies]
    shares = {"upper": share + difference, "lower": share - difference}
    return _TEXTS["trend"].format(facies=names[facies], **shares)


def _drift(image: Stack, names: tuple[str, ...], quarters: Stationarity) -> str:
    """Describe the part of the image whose facies proportion differs most from the whole image."""
    p = quarters.proportions.mean(axis=0)
    sizes = np.abs(quarters.differences) / np.sqrt(np.maximum(p * (1 - p), 1e-12))
    part, facies = divmod(int(np.where(quarters.drifting, sizes, 0).argmax()), image.n_facies)
    shares = {
        "share": p[facies] + quarters.differences[part, facies],
        "whole": proportions(image)[0, facies],
        "chance": 2 * quarters.errors[part, facies],
    }
    return _TEXTS["drift"].format(part=IMAGE_PARTS[part], facies=names[facies], **shares)
