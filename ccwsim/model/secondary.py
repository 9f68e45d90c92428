"""Secondary information, which conditions a simulation besides hard data: one value per cell."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import isclose
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ccwsim.model import arrays, bounds
from ccwsim.model.arrays import Array, Floats, Mask, Shape
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.facies_match import FaciesMatch, FaciesNames, describe_codes, match_facies
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
            object.__setattr__(self, name, arrays.frozen(values))


@dataclass(frozen=True, eq=False)
class Secondary(arrays.ReadOnly):
    """Information besides hard data that conditions a simulation.

    Raises `CCWSIMError` if values have a wrong type; shapes and facies are checked when a `Study`
    is made.

    Parameters
    ----------
    active : array_like, optional
        Cells that are simulated: an array of the shape of the grid with True (or one number other
        than 0) in active cells and False (or 0) in the others, or with NaN in inactive cells; or
        the corners of a polygon in world coordinates, shape (n, 2), or a list of polygons. Values
        of other maps in inactive cells are not used, and inactive cells are in no statistic.
    probabilities : mapping, optional
        Probability of each facies, by name or code: an array of the shape of the grid, in a volume
        also a vertical curve of shape (nz,), or a number. NaN means that nothing is known. If
        facies are left out, they share 1 minus the sum of the others in proportion to the training
        image.
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
    facies : mapping or pairs, optional
        Facies of the training image, by code or name, for codes or names in `probabilities` and
        `images`. Without it, a warning names the facies that are matched by number although one of
        the images has no codes of its own.

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
    facies: FaciesNames | None = None
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
            n = f"{np.sum(self.active)} of {self.active.size} cells are" if self.is_fitted else ""
            parts.append(f"{n} active" if n else "active cells")
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
        active = None if self.active is None else arrays.frozen(_active(self.active, grid))
        inside = np.ones(grid.shape, bool) if active is None else active
        probabilities = self.probabilities
        if probabilities is not None:
            match = match_of_probabilities(probabilities, grid, image, self.facies)
            match.warn("probabilities")
            by_code = maps_by_code(match, probabilities)
            probabilities = arrays.frozen(_probabilities(by_code, grid, image, inside))
        if self.soft_weight == 0:
            probabilities = None
        fitted = replace(
            self,
            active=active,
            probabilities=probabilities,
            auxiliary=[
                replace(
                    each,
                    image=_filled("image", each.image, image.indices != UNKNOWN),
                    grid=_filled("grid", each.grid, inside),
                )
                for each in self.auxiliary
                if each.weight
            ],
            **self._fitted_copies(grid, image, inside),
            is_fitted=True,
        )
        fitted.check(grid.shape, image)
        return fitted

    def _fitted_copies(self, grid: Grid, image: TrainingImage, inside: Mask) -> dict[str, Any]:
        """Return the fields from `images` to `mirrored`, checked inside; angles are in 0 … 360."""
        n, volume = len(self.images) + 1, grid.is_volume
        if not volume and (self.dip is not None or "z" in self.mirrored):
            name = "dip" if self.dip is not None else "mirrored"
            raise CCWSIMError(f"{name}: a map has no z axis; leave it out, or simulate a volume")
        images = [recoded_image(k, image, n, self.facies) for n, k in enumerate(self.images, 1)]
        zones, weights = self.zones, self.weights
        if (zones is not None or weights is not None) and n == 1:
            raise refused("zones_without_images")
        if zones is not None:
            if weights is not None:
                raise CCWSIMError("zones and weights: give one of them")
            zones = arrays.as_floats(zones, "zones")
            _check_shape("zones", zones, grid.shape, "the grid")
            is_number = np.isin(zones, np.arange(n))
            if (wrong := zones[inside & ~is_number]).size:
                raise refused("zone_number", zone=wrong[0], last=n - 1)
            zones = arrays.frozen(np.where(is_number, zones, 0).astype(np.uint8))
        if weights is not None:
            weights = arrays.as_floats(weights, "weights")
            in_range = ((weights >= 0) & (weights <= 1e300)).all()  # so that their sum is finite
            if weights.shape != (n,) or not in_range or not weights.sum() > 0:
                raise refused("weights_of_images", weights=shown(self.weights), n=n)
            if not isclose(weights.sum(), 1, rel_tol=1e-12):  # otherwise the last digit changes
                weights = weights / weights.sum()
            weights = tuple(weights.tolist())
        field = partial(_field, grid=grid, inside=inside)
        angle = field("angle", self.angle, (-bounds.MAX_DEGREES, bounds.MAX_DEGREES), usual=0.0)
        if angle is not None and (note := note_on_radians(angle)):
            warnings.warn(note, stacklevel=4)
        angle = None if angle is None else angle % 360  # a full turn turns nothing
        dip = field("dip", self.dip, (-bounds.MAX_DIP, bounds.MAX_DIP), usual=0.0)
        scale = self.scale
        if scale is not None:
            along = scale if isinstance(scale, (tuple, list)) else (scale, scale)
            if len(along) not in (2, grid.n_dimensions):
                raise CCWSIMError("scale: give one value, or a tuple of values along each axis")
            limits = bounds.MIN_SCALE, bounds.MAX_SCALE
            along = tuple(field("scale", each, limits, usual=1.0) for each in along)
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

    def resized(self, shape: Shape, image: TrainingImage) -> Secondary:
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

    def check(self, shape: Shape, image: TrainingImage) -> None:
        """Raise `CCWSIMError` if fitted arrays do not have the shapes of grid and image."""
        for each in self.auxiliary:
            _check_shape("auxiliary variable of the image", each.image, image.shape, "the image")
            _check_shape("auxiliary variable of the grid", each.grid, shape, "the grid")
        if self.active is not None:
            _check_shape("active cells", self.active, shape, "the grid")
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


def _check_shape(what: str, array: Array, shape: Shape, of: str) -> None:
    if array.shape != shape:
        raise CCWSIMError(
            f"{what}: {arrays.describe_shape(array.shape)} cells, but {of} has "
            f"{arrays.describe_shape(shape)}; give one value for each cell of {of}"
        )


def note_on_radians(angles: Floats) -> str:
    """Return a sentence about a map whose angles are within a turn in radians, and not whole."""
    if not angles.ndim or (np.abs(angles) > 2 * np.pi).any() or not (angles % 1).any():
        return ""
    ends = f"{angles.min():.3g} to {angles.max():.3g}"
    return f"angles from {ends} look like radians; convert them to degrees"


def _filled(name: str, values: Floats, used: Mask) -> Floats:
    """Return an auxiliary variable with values in gaps of cells that are not used."""
    if values.shape != used.shape:
        return values  # a later check names both shapes
    if not np.isfinite(values[used]).all():
        raise refused("auxiliary_gaps", name=name)
    return np.where(np.isfinite(values), values, values[used].min())


def _field(
    name: str,
    field_or_number: Any,
    limits: tuple[float, float],
    *,
    grid: Grid,
    inside: Mask,
    usual: float,
) -> Floats | None:
    """Return a number, shape (), or a map of the grid; NaN and wrong values outside are `usual`."""
    if field_or_number is None:
        return None
    values = arrays.as_floats(field_or_number, name)
    if values.ndim:
        _check_shape(name, values, grid.shape, "the grid")
    values = np.where(np.isnan(values), usual, values)
    wrong = (values < limits[0]) | (values > limits[1])
    if values.ndim:
        values, wrong = np.where(wrong & ~inside, usual, values), wrong & inside
    if wrong.any():
        raise CCWSIMError(
            f"{name} = {values[wrong].flat[0]:g} is not between {limits[0]:g} and {limits[1]:g}"
            + ("; mark cells without a value with NaN" if values.ndim else "")
        )
    return arrays.frozen(values)


def _part_of(values: Array | None, part: tuple[slice, ...]) -> Array | None:
    return arrays.frozen(values[part]) if values is not None and values.ndim else values


def match_of_probabilities(
    by_facies: Mapping[Any, ArrayLike],
    grid: Grid,
    image: TrainingImage,
    facies: FaciesNames | None,
) -> FaciesMatch:
    """Return the facies of a training image for the facies of probabilities."""
    maps = [_map_of(key, values, grid, False) for key, values in by_facies.items()]
    shares = [float(np.nansum(p) / max(np.isfinite(p).sum(), 1)) for p in maps]
    return match_facies(by_facies, image, facies=facies, shares=shares)


def maps_by_code(match: FaciesMatch, maps: Mapping[Any, ArrayLike]) -> dict[Any, ArrayLike]:
    """Return maps, in the order of the labels of `match`, by the code of their facies."""
    by_code = dict(zip(match.codes.values(), maps.values(), strict=False))
    if len(by_code) < len(maps):
        raise refused("two_maps_of_facies", maps=describe_codes(match.codes, match.image))
    return by_code


def match_of_image(
    other: TrainingImage, image: TrainingImage, facies: FaciesNames | None
) -> FaciesMatch:
    """Return the match of the names or, unless all names match, of the codes of another image."""
    names, stated = [*other.codes_by_name], {str(k).casefold() for k in dict(facies or {})}
    is_named = len(names) == other.n_facies and names != [*map(str, other.codes)]
    is_named = is_named and {*names} <= image.codes_by_name.keys() | stated
    return match_facies(
        names if is_named else other.codes.tolist(),
        image,
        numbering=other.numbering,
        facies=facies,
        shares=other.proportions.tolist(),
    )


def recoded_image(
    other: TrainingImage, image: TrainingImage, number: int, facies: FaciesNames | None
) -> TrainingImage:
    """Return another image with the codes of the training image, matched by name or code."""
    what = f"further image {number}"
    if other.n_dimensions != image.n_dimensions:
        kinds = {2: "a map", 3: "a volume"}
        raise CCWSIMError(
            f"{what} is {kinds[other.n_dimensions]}, but the training image is "
            f"{kinds[image.n_dimensions]}; give images of one kind"
        )
    match = match_of_image(other, image, facies)
    match.warn(what)
    try:
        codes = image.codes[[image.index_of(code) for code in match.codes.values()]]
    except CCWSIMError as error:
        raise refused("facies_of_images", what=what, error=error) from None
    if np.array_equal(codes, other.codes):
        return other
    cells = np.where(
        other.indices == UNKNOWN, np.nan, codes[np.minimum(other.indices, len(codes) - 1)]
    )
    return TrainingImage(cells, name=other.name, numbering=image.numbering_of_data)


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
        _check_shape("active cells", first, grid.shape, "the grid")
        if first.dtype.kind not in "buif":
            raise CCWSIMError(f"active cells: {shown(source)} is not an array of True and False")
        active = active_codes(first)
        outside = "no cell of the grid is active; give a number other than 0 in active cells"
    if not active.any():
        raise CCWSIMError(f"active cells: {outside}")
    return active


def active_codes(values: Array) -> Mask:
    """Return the active cells of an array of numbers: 0 is inactive beside one other code.

    It is also inactive beside −1 and 1 if cells of −1 are connected with cells of 1, as the fixed
    heads of IBOUND. A negative code is inactive beside a positive one. Other codes do not say which
    of them is inactive, unless some cells have no value.
    """
    has_value = known_values(values)
    codes = np.unique(values[has_value]).tolist()
    is_ibound = codes == [-1, 0, 1]
    if is_ibound:
        from scipy.ndimage import label  # slow to import

        parts = np.asarray(label(has_value & (values != 0))[0])  # type: ignore[index]
        is_decided = np.isin(parts[values == -1], parts[values == 1]).all()
    else:
        is_decided = len(codes) < 3 and (0 in codes or min(codes, default=0) < 0 < max(codes))
    if is_decided:
        return has_value & (values != (0 if 0 in codes else codes[0]))
    if is_ibound or (len(codes) > 1 and has_value.all()):
        raise refused("codes_of_active", codes=", ".join(f"{code:g}" for code in codes[:9]))
    return has_value


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


def _probabilities(
    by_facies: Mapping[Any, ArrayLike], grid: Grid, image: TrainingImage, inside: Mask
) -> Floats:
    """Return the probability of each facies in each cell, shape (n_facies, *shape of the grid)."""
    maps = {image.index_of(key): _map_of(key, p, grid, inside) for key, p in by_facies.items()}
    missing = [k for k in range(image.n_facies) if k not in maps]
    if not maps:
        raise CCWSIMError("probabilities: there is no map; give the map of at least one facies")
    soft = np.stack([maps.get(k, np.zeros(grid.shape)) for k in range(image.n_facies)])
    total = soft.sum(axis=0)
    has_all = ~np.isnan(total)
    if missing:  # the rest is shared as in the training image
        shares = image.proportions[missing]
        soft[missing] = np.multiply.outer(shares / shares.sum(), 1 - total)
        total = np.where(has_all & (total <= 1 + SUM_TOLERANCE), 1.0, total)
    wrong = has_all & inside & (np.abs(total - 1) > SUM_TOLERANCE)
    if wrong.any():
        cell = tuple(np.argwhere(wrong)[0])
        where = describe_cell(cell)
        raise refused("sum_of_probabilities", total=total[cell], n=wrong.sum(), at=where)
    if not has_all.any():
        raise CCWSIMError("probabilities: no cell has a value for all facies; leave them out")
    soft = np.clip(soft, 0.0, 1.0)
    return soft / np.where(has_all, soft.sum(axis=0), np.nan)


def _map_of(key: Any, values: ArrayLike, grid: Grid, inside: Mask | bool) -> Floats:
    """Return the map of a facies, NaN where nothing is known; the values `inside` are checked."""
    what = f"probability of {shown(key)}"
    values = arrays.as_floats(values, what)
    values = np.where(known_values(values), values, np.nan)
    if values.ndim == 1 and grid.nz is not None and len(values) == grid.nz:
        values = values[:, None, None]
    if values.ndim == 0 or values.shape[1:] == (1, 1):
        values = np.broadcast_to(values, grid.shape)
    _check_shape(what, values, grid.shape, "the grid")
    wrong = (values < 0) | (values > 1)
    if (wrong & inside).any():
        cell = tuple(np.argwhere(wrong & inside)[0])
        cure = "divide percent by 100" if values[cell] > 1 else "mark unknown cells with NaN"
        at = describe_cell(cell)
        raise refused("probability", what=what, value=values[cell], at=at, cure=cure)
    return np.where(wrong, np.nan, values)
