"""Secondary information, which conditions a simulation besides hard data: one value per cell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isclose
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.model import arrays, bounds
from ccwsim.model.arrays import Floats, Mask
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.grid import Grid, describe_cell
from ccwsim.model.missing import UNKNOWN, known_values
from ccwsim.model.numbers import plural
from ccwsim.model.training_image import TrainingImage

SUM_TOLERANCE = 0.01
"""Maximum difference between 1 and the sum of the probabilities in a cell; rounded files differ."""


@dataclass(frozen=True, eq=False)
class Auxiliary(arrays.ReadOnly):
    """A variable that is known in the training image and in the grid, such as a depth.

    Patches are preferred whose values in the image equal the values in the grid.

    Parameters
    ----------
    image : array_like, shape of the training image
        Values of the variable in the cells of the training image.
    grid : array_like, shape of the grid
        Values of the variable in the cells of the grid, in the same unit.
    weight : float
        With weight 1, a difference as large as the range of the values in the image counts as much
        as a mismatch in every cell of the overlap; 0 … 10.

    Examples
    --------
    >>> depth = np.linspace(0, 1, 40)[:, None].repeat(40, axis=1)
    >>> Auxiliary(depth, depth[::-1]).weight
    1.0
    """

    image: Floats
    grid: Floats
    weight: float = 1.0

    def __post_init__(self) -> None:
        weight = arrays.check_number("weight", self.weight, 0.0, bounds.MAX_AUXILIARY_WEIGHT)
        object.__setattr__(self, "weight", weight)
        for name in ("image", "grid"):
            values = arrays.as_floats(getattr(self, name), f"auxiliary variable of the {name}")
            if not np.isfinite(values).all():
                raise refused("auxiliary_gaps", name=name)
            object.__setattr__(self, name, arrays.frozen(values))


@dataclass(frozen=True, eq=False)
class Secondary(arrays.ReadOnly):
    """Information besides hard data that conditions a simulation.

    Raises `CCWSIMError` if values have a wrong type; shapes and facies are checked when a `Study`
    is made.

    Parameters
    ----------
    active : array_like, optional
        Cells that are simulated: an array of the shape of the grid with True (or a number other
        than 0) in active cells, or with NaN in inactive cells; or the corners of a polygon in world
        coordinates, shape (n, 2), or a list of polygons. Inactive cells are in no statistic.
    probabilities : mapping, optional
        Probability of each facies, by name or code: an array of the shape of the grid, in a volume
        also a vertical curve of shape (nz,), or a number. NaN means that nothing is known. One
        facies may be left out; its probability is 1 minus the sum of the others.
    auxiliary : sequence of Auxiliary, optional
    soft_weight : float
        Strength of the probabilities, 0 … 5. With 1, facies occur about as often as the
        probabilities say, as far as the training image allows.
    images : sequence of TrainingImage or array_like, optional
        Further training images, whose facies all occur in the training image, by name or, without
        names, by code.
    zones : array_like of int, shape of the grid, optional
        Image of each cell: 0 for the training image, 1 for the first of `images`, and so on.
    weights : sequence of float, optional
        Relative numbers of patches from the training image and from each of `images`, without
        `zones`. By default all images are searched for each patch.
    angle : float or array_like, shape of the grid, optional
        Azimuth, in degrees clockwise from north, to which the north of the images is turned. NaN
        means 0.
    scale : float, array_like, or a tuple of these along x, y (and z), optional
        Factor by which images are enlarged before they are turned; 0.2 … 5. NaN means 1.
    dip : float or array_like, shape of the grid, optional
        In volumes, inclination of the layers of the images, in degrees below the horizontal, in the
        direction of `angle`; −80 … 80. NaN means 0.
    mirrored : str or sequence of str
        Axes, of "x", "y" and "z", along which images are also searched mirrored.
    angle_tolerance : float
        Maximum difference of an angle from the map in degrees, if at most 16 turned or scaled
        copies of each image suffice; 0.5 … 45.

    Examples
    --------
    >>> west = np.arange(60) < 30
    >>> Secondary(active=np.tile(west, (50, 1))).active.sum()
    np.int64(1500)
    """

    active: Any = None
    probabilities: Any = None
    auxiliary: Sequence[Auxiliary] = ()
    soft_weight: float = 1.0
    images: Sequence[Any] = ()
    zones: Any = None
    weights: Any = None
    angle: Any = None
    scale: Any = None
    dip: Any = None
    mirrored: Sequence[str] = ()
    angle_tolerance: float = 2.0
    is_fitted: bool = field(default=False, repr=False)

    def __post_init__(self) -> None:
        weight = arrays.check_number("soft_weight", self.soft_weight, 0.0, bounds.MAX_SOFT_WEIGHT)
        auxiliary = (self.auxiliary,) if isinstance(self.auxiliary, Auxiliary) else self.auxiliary
        auxiliary = _as_tuple("auxiliary", auxiliary, "ccwsim.Auxiliary(image, grid)")
        if not all(isinstance(variable, Auxiliary) for variable in auxiliary):
            raise CCWSIMError("auxiliary: a list of ccwsim.Auxiliary(image, grid) is needed")
        soft = self.probabilities
        if soft is not None and not self.is_fitted and not isinstance(soft, Mapping):
            raise refused("probabilities_not_a_mapping", given=shown(soft))
        images = _as_tuple("images", self.images, "training images")
        if len(images) >= bounds.MAX_IMAGES:
            raise refused("too_many_images", n=len(images), most=bounds.MAX_IMAGES - 1)
        axes = _as_tuple("mirrored", self.mirrored, "axes")
        if not all(isinstance(axis, str) and axis in ("x", "y", "z") for axis in axes):
            raise CCWSIMError(f'mirrored = {shown(self.mirrored)}: give "x", "y", "z" or several')
        tolerance = arrays.check_number("angle_tolerance", self.angle_tolerance, 0.5, 45.0)
        images = tuple(map(TrainingImage.of, images))
        vars(self).update(soft_weight=weight, auxiliary=auxiliary, images=images)
        vars(self).update(mirrored=axes, angle_tolerance=tolerance)

    @property
    def guides(self) -> bool:
        """Whether probabilities or auxiliary variables guide the search."""
        return self.probabilities is not None or bool(self.auxiliary)

    @property
    def has_copies(self) -> bool:
        """Whether patches come from other images than the unchanged training image."""
        return bool(self.mirrored) or self.is_of_other_images

    @property
    def is_of_other_images(self) -> bool:
        """Whether patches come from other images, or from turned or scaled ones."""
        return bool(self.images) or any(k is not None for k in (self.angle, self.scale, self.dip))

    @property
    def is_empty(self) -> bool:
        """Whether nothing is given."""
        return self.active is None and not self.guides and not self.has_copies

    @property
    def digest(self) -> str:
        """Hash of the content of fitted secondary information."""
        parts = [array for a in self.auxiliary for array in (a.image, a.grid, a.weight)]
        if self.has_copies:
            turned = self.angle, self.dip, *(self.scale or ()), self.angle_tolerance
            images = [image.digest for image in self.images]
            parts += [self.zones, self.weights, *turned, *images, "".join(self.mirrored)]
        return arrays.digest(self.active, self.probabilities, self.soft_weight, *parts)

    def describe(self) -> str:
        """Return the kinds of information as text.

        Examples
        --------
        >>> Secondary(probabilities={1: 0.3}, soft_weight=0.5).describe()
        'probabilities with weight 0.5'
        """
        parts = []
        if self.probabilities is not None:
            parts.append(f"probabilities with weight {self.soft_weight:g}")
        parts += [f"auxiliary variable with weight {each.weight:g}" for each in self.auxiliary]
        if self.active is not None:
            parts.append("active cells")
        if self.images:
            choices = {"by zone": self.zones, "with weights": self.weights}
            choice = (text for text, values in choices.items() if values is not None)
            parts.append(" ".join([plural(len(self.images) + 1, "training image"), *choice]))
        parts += [name for name in ("angle", "scale", "dip") if getattr(self, name) is not None]
        if self.mirrored:
            parts.append(f"mirrored along {' and '.join(self.mirrored)}")
        return ", ".join(parts)

    def fitted(self, grid: Grid, image: TrainingImage) -> Secondary:
        """Return the same information as checked arrays for a grid and a training image.

        `active` is then None or of bool and the shape of the grid; `probabilities` are None or of
        float64 and shape (n_facies, *shape of the grid), in the order of the codes of the image.

        Raises
        ------
        CCWSIMError
            If a shape or a facies does not fit, if probabilities are not between 0 and 1 or do not
            sum to 1, or if nothing is known or active. The message names the value and the fix.
        """
        if self.is_fitted:
            self.check(grid.shape, image)
            return self
        probabilities = self.probabilities
        if probabilities is not None:
            probabilities = arrays.frozen(_probabilities(probabilities, grid, image))
        if self.soft_weight == 0:
            probabilities = None
        fitted = replace(
            self,
            active=None if self.active is None else arrays.frozen(_active(self.active, grid)),
            probabilities=probabilities,
            auxiliary=[each for each in self.auxiliary if each.weight],
            **self._fitted_copies(grid, image),
            is_fitted=True,
        )
        fitted.check(grid.shape, image)
        return fitted

    def _fitted_copies(self, grid: Grid, image: TrainingImage) -> dict[str, Any]:
        """Return the checked fields from `images` to `mirrored`; angles are in 0 … 360."""
        n, volume = len(self.images) + 1, grid.nz is not None
        if not volume and (self.dip is not None or "z" in self.mirrored):
            name = "dip" if self.dip is not None else "mirrored"
            raise CCWSIMError(f"{name}: a map has no z axis; leave it out, or simulate a volume")
        images = [_recoded(further, image, k) for k, further in enumerate(self.images, 1)]
        zones, weights = self.zones, self.weights
        if (zones is not None or weights is not None) and n == 1:
            raise CCWSIMError("zones or weights: give the further training images as `images`")
        if zones is not None:
            if weights is not None:
                raise CCWSIMError("zones and weights: give one of them")
            zones = arrays.as_integers(arrays.as_array(zones, "zones"), "zones")
            _check_shape("zones", zones, grid.shape, "the grid")
            if zones.min() < 0 or zones.max() >= n:
                wrong = zones.min() if zones.min() < 0 else zones.max()
                raise refused("zone_number", zone=wrong, last=n - 1)
            zones = arrays.frozen(zones.astype(np.uint8))
        if weights is not None:
            weights = arrays.as_floats(weights, "weights")
            in_range = ((weights >= 0) & (weights <= 1e300)).all()  # so that their sum is finite
            if weights.shape != (n,) or not in_range or not weights.sum() > 0:
                raise refused("weights_of_images", weights=shown(self.weights), n=n)
            if not isclose(weights.sum(), 1, rel_tol=1e-12):  # otherwise the last digit changes
                weights = weights / weights.sum()
            weights = tuple(weights.tolist())
        angle = _field("angle", self.angle, grid, (-bounds.MAX_DEGREES, bounds.MAX_DEGREES), 0.0)
        angle = None if angle is None else angle % 360  # a full turn turns nothing
        dip = _field("dip", self.dip, grid, (-bounds.MAX_DIP, bounds.MAX_DIP), 0.0)
        scale = self.scale
        if scale is not None:
            along = scale if isinstance(scale, (tuple, list)) else (scale, scale)
            if len(along) not in (2, grid.n_dimensions):
                raise CCWSIMError("scale: give one value, or a tuple of values along each axis")
            limits = bounds.MIN_SCALE, bounds.MAX_SCALE
            along = tuple(_field("scale", each, grid, limits, 1.0) for each in along)
            scale = None if all(np.all(each == 1) for each in along) else along
        return {
            **{"images": images, "zones": zones, "weights": weights, "scale": scale},
            "angle": None if angle is None or not angle.any() else arrays.frozen(angle),
            "dip": None if dip is None or not dip.any() else dip,
        }

    def compartments(self, grid: Grid) -> list[Secondary]:
        """Return the same information for each connected part of the active cells.

        A thin inactive strip does not make its two sides independent, because a patch covers both
        sides. Parts that are simulated one by one, with different seeds, are independent.

        Examples
        --------
        >>> strip = np.ones((50, 60), bool)
        >>> strip[:, 28:32] = False
        >>> [part.active.sum().item() for part in Secondary(strip).compartments(Grid(50, 60))]
        [1400, 1400]
        """
        from scipy import ndimage

        active = np.ones(grid.shape, bool) if self.active is None else _active(self.active, grid)
        parts, n = ndimage.label(active)  # type: ignore[misc]
        return [replace(self, active=arrays.frozen(parts == k)) for k in range(1, n + 1)]

    def resized(self, shape: tuple[int, ...], image: TrainingImage) -> Secondary:
        """Return information of the same kinds for a small grid and image, to compile kernels."""
        soft = None if self.probabilities is None else np.zeros((image.n_facies, *shape))
        of_image, of_grid = np.zeros(image.shape), np.zeros(shape)
        return replace(
            self,
            active=None if self.active is None else np.ones(shape, bool),
            probabilities=None if soft is None else soft + 1 / image.n_facies,
            auxiliary=[Auxiliary(of_image, of_grid, weight=each.weight) for each in self.auxiliary],
            **dict.fromkeys(("zones", "weights", "angle", "scale", "dip")),
            **{"images": (), "mirrored": ()},
        )

    def cropped(self, part: tuple[slice, ...]) -> Secondary:
        """Return fitted information for a part of the grid; no `active` if all are active there."""
        soft, active = self.probabilities, _part_of(self.active, part)
        return replace(
            self,
            active=None if active is None or active.all() else active,
            probabilities=None if soft is None else arrays.frozen(soft[(slice(None), *part)]),
            auxiliary=[replace(each, grid=each.grid[part]) for each in self.auxiliary],
            **{name: _part_of(getattr(self, name), part) for name in ("zones", "angle", "dip")},
            scale=self.scale and tuple(_part_of(each, part) for each in self.scale),
        )

    def check(self, shape: tuple[int, ...], image: TrainingImage) -> None:
        """Raise `CCWSIMError` if fitted arrays do not have the shapes of grid and image."""
        for each in self.auxiliary:
            _check_shape("auxiliary variable of the image", each.image, image.shape, "the image")
            _check_shape("auxiliary variable of the grid", each.grid, shape, "the grid")
        if self.active is not None:
            _check_shape("active", self.active, shape, "the grid")
        if self.probabilities is not None:
            _check_shape("probabilities", self.probabilities[0], shape, "the grid")
        for name in ("zones", "angle", "dip"):
            if (array := getattr(self, name)) is not None and array.ndim:
                _check_shape(name, array, shape, "the grid")
        if self.auxiliary and self.images:
            raise refused("auxiliary_with_images")


def _as_tuple(name: str, values: Any, what: str) -> tuple[Any, ...]:
    """Return a sequence, or the letters of a text of axes, as a tuple."""
    if not isinstance(values, (list, tuple, str)):
        raise CCWSIMError(f"{name} = {shown(values)}: a list of {what} is needed")
    return tuple(values)


def _check_shape(what: str, array: NDArray, shape: tuple[int, ...], of: str) -> None:
    if array.shape != shape:
        raise CCWSIMError(
            f"{what}: {arrays.describe_shape(array.shape)} cells, but {of} has "
            f"{arrays.describe_shape(shape)}; give one value for each cell of {of}"
        )


def _field(
    name: str, field_or_number: Any, grid: Grid, limits: tuple[float, float], usual: float
) -> Floats | None:
    """Return a number, shape (), or a map of the shape of the grid; NaN becomes `usual`."""
    if field_or_number is None:
        return None
    values = arrays.as_floats(field_or_number, name)
    if values.ndim:
        _check_shape(name, values, grid.shape, "the grid")
    values = np.where(np.isnan(values), usual, values)
    wrong = (values < limits[0]) | (values > limits[1])
    if wrong.any():
        raise CCWSIMError(
            f"{name} = {values[wrong].flat[0]:g} is not between {limits[0]:g} and {limits[1]:g}"
        )
    return arrays.frozen(values)


def _part_of(values: NDArray | None, part: tuple[slice, ...]) -> NDArray | None:
    return arrays.frozen(values[part]) if values is not None and values.ndim else values


def _recoded(other: TrainingImage, image: TrainingImage, number: int) -> TrainingImage:
    """Return another image with the codes of the training image, matched by name or code."""
    named = any(n != str(c) for n, c in zip(other.facies_names, other.codes, strict=True))
    what = f"images: image {number}"
    if other.n_dimensions != image.n_dimensions:
        kinds = {2: "a map", 3: "a volume"}
        raise CCWSIMError(
            f"{what} is {kinds[other.n_dimensions]}, but the training image is "
            f"{kinds[image.n_dimensions]}; give images of one kind"
        )
    names = [name.casefold() for name in image.facies_names]
    by_name = named and all(name.casefold() in names for name in other.facies_names)
    try:
        keys = other.facies_names if by_name else other.codes.tolist()
        codes = image.codes[[image.index_of(key) for key in keys]]
    except CCWSIMError as error:
        raise refused("facies_of_images", what=what, error=error) from None
    if np.array_equal(codes, other.codes):
        return other
    cells = np.where(
        other.indices == UNKNOWN, np.nan, codes[np.minimum(other.indices, len(codes) - 1)]
    )
    return TrainingImage(cells, name=other.name)


def _active(source: ArrayLike, grid: Grid) -> Mask:
    """Return the active cells of a grid, from an array or polygons."""
    several = isinstance(source, (list, tuple)) and source and np.ndim(source[0]) == 2
    polygons = list(source) if several else [source]  # type: ignore[arg-type]
    values = [arrays.as_array(each, "active") for each in polygons]
    first = values[0]
    if first.shape != grid.shape and first.ndim == 2 and first.shape[1] == 2 and len(first) > 2:
        inside = [cells_in_polygon(arrays.as_floats(each, "polygon"), grid) for each in values]
        active = np.logical_or.reduce(inside)
        outside = "the polygon contains no centre of a cell of the grid: check its coordinates"
    else:
        _check_shape("active", first, grid.shape, "the grid")
        if first.dtype.kind not in "buif":
            raise CCWSIMError(f"active: {shown(source)} is not an array of True and False")
        has_value = known_values(first)
        is_binary = np.isin(first[has_value], (0, 1)).all()  # then 0 means inactive
        active = has_value & (first != 0) if is_binary else has_value
        outside = "no cell of the grid is active"
    if not active.any():
        raise CCWSIMError(f"active: {outside}")
    return active


@np.errstate(over="ignore", invalid="ignore")  # corners may be far from all cells
def cells_in_polygon(corners: Floats, grid: Grid) -> Mask:
    """Return the cells of a grid whose centre is in a polygon, in all layers of a volume."""
    x, y = grid.axes[0], grid.axes[1]
    inside = np.zeros((len(y), len(x)), bool)
    ends = np.hstack([corners, np.roll(corners, -1, axis=0)])
    first, last = np.searchsorted(y, [corners[:, 1].min(), corners[:, 1].max()])
    for row in range(first, last):
        crossed = (ends[:, 1] <= y[row]) != (ends[:, 3] <= y[row])
        x0, y0, x1, y1 = ends[crossed].T
        crossings = np.sort(x0 + (y[row] - y0) * (x1 - x0) / (y1 - y0))
        inside[row] = (len(crossings) - np.searchsorted(crossings, x, side="right")) % 2
    return np.broadcast_to(inside, grid.shape).copy()


def _probabilities(by_facies: Mapping[Any, ArrayLike], grid: Grid, image: TrainingImage) -> Floats:
    """Return the probability of each facies in each cell, shape (n_facies, *shape of the grid)."""
    maps = {image.index_of(key): _map_of(key, values, grid) for key, values in by_facies.items()}
    names = image.facies_names
    missing = [k for k in range(image.n_facies) if k not in maps]
    if len(missing) > 1 or not maps:
        raise refused("probabilities_missing", facies=arrays.listing(names[k] for k in missing))
    soft = np.stack([maps.get(k, np.zeros(grid.shape)) for k in range(image.n_facies)])
    total = soft.sum(axis=0)
    has_all = ~np.isnan(total)
    if missing:
        soft[missing[0]] = 1 - total
        total = np.where(has_all & (total <= 1 + SUM_TOLERANCE), 1.0, total)
    wrong = has_all & (np.abs(total - 1) > SUM_TOLERANCE)
    if wrong.any():
        cell = tuple(np.argwhere(wrong)[0])
        where = describe_cell(cell)
        raise refused("sum_of_probabilities", total=total[cell], n=wrong.sum(), at=where)
    if not has_all.any():
        raise CCWSIMError("probabilities: no cell has a value for all facies; leave them out")
    soft = np.clip(soft, 0.0, 1.0)
    return soft / np.where(has_all, soft.sum(axis=0), np.nan)


def _map_of(key: Any, values: ArrayLike, grid: Grid) -> Floats:
    """Return the map of a facies, of the shape of the grid, NaN where nothing is known."""
    what = f"probability of {shown(key)}"
    values = arrays.as_floats(values, what)
    values = np.where(known_values(values), values, np.nan)
    if values.ndim == 1 and grid.nz is not None and len(values) == grid.nz:
        values = values[:, None, None]
    if values.ndim == 0 or values.shape[1:] == (1, 1):
        values = np.broadcast_to(values, grid.shape)
    _check_shape(what, values, grid.shape, "the grid")
    wrong = (values < 0) | (values > 1)
    if wrong.any():
        cell = tuple(np.argwhere(wrong)[0])
        raise refused("probability", what=what, value=values[cell], at=describe_cell(cell))
    return values
