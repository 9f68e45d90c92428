"""The parameters of a simulation, with their names, symbols, ranges and meanings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from ccwsim.model.arrays import (
    WORLD_AXES,
    Shape,
    check_choice,
    check_int,
    check_number,
    digest,
    listing,
)
from ccwsim.model.assets import read_toml
from ccwsim.model.bounds import PARAMETER_BOUNDS
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.published import VARIANT_SETTINGS, VARIANTS, Variant
from ccwsim.model.sizes import PerAxis, Triple, check_sizes, fitted_sizes, per_axis, triple

Method = Literal["ccwsim", "ccsim", "ms-ccsim"]
Similarity = Literal["ssd", "correlation"]
METHODS: tuple[Method, ...] = get_args(Method)
SIMILARITIES: tuple[Similarity, ...] = get_args(Similarity)
Weight = float | tuple[float, float, float]
"""One number for all axes or, in a volume, three along z, y and x."""
PARAMETER_CHOICES = {"method": METHODS, "similarity": SIMILARITIES, "variant": VARIANTS}
PER_AXIS = ("template_size", "overlap_size", "wavelet_level")
"""Parameters with one integer for all axes or, in a volume, three integers along z, y and x.
`location_weight`, which is not an integer, can also have three numbers."""
_ABOUT = read_toml("assets/parameters.toml")
"""Symbol in the paper, name in the authors' code, range and meaning of each parameter."""


class Lengths(NamedTuple):
    """Template, overlap and wavelet level along z, y and x; in maps 1, 0 and 0 along z."""

    template: Triple
    overlap: Triple
    level: Triple


def describe_weight(weight: Weight) -> str:
    """Return a location weight as text, such as "2 along z"."""
    if not isinstance(weight, tuple):
        return f"{weight:g}"
    along = [f"{w:g} along {axis}" for axis, w in zip("zyx", weight, strict=True) if w]
    return listing(along or ["0"])


@dataclass(frozen=True)
class Parameters:
    # In volumes, the first three parameters and location_weight may be triples.
    template_size: PerAxis = 32
    overlap_size: PerAxis = 8
    wavelet_level: PerAxis = 2
    n_candidates: int = 20
    method: Method = "ccwsim"
    similarity: Similarity = "ssd"
    search_fraction: float = 0.1
    co_template: int = 2
    random_path: bool = True
    template_variation: float = 0.0
    match_proportions: bool = False
    published_draw: bool = False
    repair_seams: bool = True
    location_weight: Weight = 0.0
    refine: bool = True
    exact_data: bool = True
    variant: Variant = "ours"

    def __post_init__(self) -> None:
        for f in fields(self):
            value = _checked(f.name, getattr(self, f.name), f.default)
            object.__setattr__(self, f.name, value)
        check_sizes(self.template_size, self.overlap_size, self.level)
        for name, needed in VARIANT_SETTINGS[self.variant].items():
            if (value := getattr(self, name)) != needed:
                variant = self.variant
                raise refused(
                    "not_in_variant", name=name, value=value, needed=needed, variant=variant
                )

    @classmethod
    def published(cls, variant: Variant, **others: Any) -> Parameters:
        """Return the parameters of the paper's method ("paper") or of its authors' code ("code").

        `others` are any other parameters, such as `template_size` or `n_candidates`. Both variants
        are for maps without secondary information other than inactive cells. With the method
        "ms-ccsim", the coarsest images are searched by these rules, without splitting. At finer
        scales, a patch with data is searched within T cells of its location; a patch without data
        stays there, as in the code of MS-CCSIM. A level L of that code is `wavelet_level` = L − 1.

        **"paper"** is Algorithm 1 and sections 4.1 to 4.4 as written: plain cross-correlation of
        the approximation coefficients of the facies codes (one value a cell), the K best locations
        with ties in the order of the locations, a uniform draw, the inverse DWT, the minimum cut.
        Near data, a location qualifies if its patch honours every datum in the template. Among the
        best `search_fraction` of the locations, it must also honour the data in the co-template, as
        long as such a location exists. One of the first K locations that qualify is drawn. If none
        qualifies, the template is split in four, down to 4 cells or 2^level; at this size, the
        first location with the fewest misses is used. The paper leaves a few points open. Here, a
        quarter overlaps earlier cells by at most OR, and its locations are those of the whole
        template. The first patch has no scores and is drawn from all locations that qualify. Tiles
        may end beyond the grid.

        **"code"** is the authors' MATLAB code: the sum of squared differences of the codes; data
        moved to blocks of 2^level cells, in which the largest code wins; codes read back from
        rounded coefficients, whose half-way value is no code; the authors' cut, which leaves the
        cheapest path; patches that overwrite data. Near data, the first location that honours all
        data is used instead of one of K, or else the last one with the fewest misses, both among
        the best `search_fraction`. Some differences remain. The path is random (theirs takes the
        eight paths in turn). Tiles may end beyond the grid (their last tile is moved back). Ties
        are broken by the order of the rows (theirs by rounding errors). The first patch with data
        is drawn from all locations (theirs from a random `search_fraction`). In MS-CCSIM, a search
        at a finer scale uses the best location (theirs the last one searched).

        Examples
        --------
        >>> Parameters.published("paper", wavelet_level=1).similarity
        'correlation'
        """
        check_choice("variant", variant, VARIANTS)
        return cls(**{"variant": variant, **VARIANT_SETTINGS[variant], **others})

    def as_in(self, variant: Variant) -> Parameters:
        """Return these parameters as in the paper, as in its authors' code, or as in our method.

        The parameters that a published variant fixes have their defaults in our method.
        """
        if check_choice("variant", variant, VARIANTS) == self.variant:
            return self
        usual = {f.name: f.default for f in fields(self) if f.name in VARIANT_SETTINGS["paper"]}
        return replace(self, **{**usual, **VARIANT_SETTINGS[variant], "variant": variant})

    @property
    def level(self) -> PerAxis:
        """Wavelet level of the search: 0 for "ccsim", which compares cells."""
        return 0 if self.method == "ccsim" else self.wavelet_level

    @property
    def scale(self) -> int:
        """Number of times that "ms-ccsim" coarsens images (largest level); 0 for other methods."""
        return max(triple(self.level)) if self.method == "ms-ccsim" else 0

    @property
    def location_weights(self) -> tuple[float, float, float]:
        """The location weight along z, y and x."""
        weight = self.location_weight
        return weight if isinstance(weight, tuple) else (weight, weight, weight)

    @property
    def step(self) -> PerAxis:
        """Distance from one patch to the next in cells, T − OR."""
        if isinstance(self.template_size, int) and isinstance(self.overlap_size, int):
            return self.template_size - self.overlap_size
        (tz, ty, tx), (oz, oy, ox) = triple(self.template_size), triple(self.overlap_size)
        return tz - oz, ty - oy, tx - ox

    def along(self, shape: Sequence[int]) -> Lengths:
        """Return template, overlap and level along z, y and x for the shape of an image or grid.

        Raises `CCWSIMError` if `shape` belongs to a map and any parameter is a triple.

        Examples
        --------
        >>> Parameters().along((512, 512))
        Lengths(template=(1, 32, 32), overlap=(0, 8, 8), level=(0, 2, 2))
        >>> Parameters((16, 32, 32), (4, 8, 8), (1, 2, 2)).along((50, 100, 100)).level
        (1, 2, 2)
        """
        template, overlap, level = (
            triple(size) for size in (self.template_size, self.overlap_size, self.level)
        )
        if len(shape) == 3:
            return Lengths(template, overlap, level)
        for name in (*PER_AXIS, "location_weight"):
            value = getattr(self, name)
            if isinstance(value, tuple):
                raise refused("three_numbers_of_map", name=name, value=value, one=max(value))
        return Lengths((1, *template[1:]), (0, *overlap[1:]), (0, *level[1:]))

    @property
    def digest(self) -> str:
        """Short text that is equal for equal parameters."""
        return digest(*((f.name, getattr(self, f.name)) for f in fields(self)))


def parameter_table() -> list[dict[str, str]]:
    """Return one row for each parameter: name, symbol, matlab, allowed, default and meaning."""
    return [
        {"name": f.name, "symbol": "", "matlab": "", "default": str(f.default)} | _ABOUT[f.name]
        for f in fields(Parameters)
    ]


def fitted(parameters: Parameters, shape: Shape, **changes: Any) -> Parameters:
    """Return parameters with `changes`; sizes become the nearest ones that an image allows.

    For a volume, numbers become triples; along z, the size is halved, and the level is lower by
    one. For a map, a triple is replaced by the number along x. A published variant is for maps; it
    sets the parameters that it needs.
    """
    volume = len(shape) == 3
    variant = "ours" if volume else changes.get("variant", parameters.variant)
    values = vars(parameters.as_in(variant)) | changes
    is_ccsim = values["method"] == "ccsim"
    templates, overlaps, levels = (_along_axes(name, values[name]) for name in PER_AXIS)
    z, y, x = (
        fitted_sizes(t, o, j, shape, along_z=volume and axis == "z", is_ccsim=is_ccsim)
        for axis, t, o, j in zip(WORLD_AXES[::-1], templates, overlaps, levels, strict=True)
    )
    for name, *sizes in zip(PER_AXIS, z, y, x, strict=True):
        values[name] = per_axis((sizes[0], sizes[1], sizes[2]), shape)
    if not volume and isinstance(weight := values["location_weight"], tuple):
        values["location_weight"] = max(weight[1:])  # a map has no weight along z
    if volume or any(values[name] != needed for name, needed in VARIANT_SETTINGS[variant].items()):
        values["variant"] = "ours"  # the published variants have no additions
    return Parameters(**values)


def _along_axes(name: str, size: PerAxis) -> Triple:
    """Return a size or level along z, y and x; a single number is reduced along z."""
    if isinstance(size, tuple):
        return size
    along_z = max(size - 1, 0) if name == "wavelet_level" else max(size // 2, 1)
    return along_z, size, size


def _checked(name: str, value: Any, default: Any) -> Any:
    """Return a parameter's value or three values, or raise an error that names the parameter."""
    if name in PARAMETER_CHOICES:
        return check_choice(name, value, PARAMETER_CHOICES[name])
    if isinstance(default, bool):
        if not isinstance(value, (bool, np.bool_)):
            raise CCWSIMError(f"{name} = {shown(value)} must be True or False")
        return bool(value)
    if isinstance(value, np.ndarray) and value.ndim:
        value = value.tolist()
    low, high = PARAMETER_BOUNDS[name]
    along_axes = isinstance(value, (tuple, list)) and len(value) == 3
    if not along_axes or name not in (*PER_AXIS, "location_weight"):
        return _checked_number(name, value, low, high)
    lows = {"template_size": 1, "overlap_size": 0}.get(name, low), low, low  # thin volumes
    sides = zip(WORLD_AXES[::-1], value, lows, strict=True)
    return tuple(_checked_number(f"{name} along {axis}", v, low, high) for axis, v, low in sides)


def _checked_number(name: str, value: Any, low: float, high: float) -> Any:
    """Return a value between two limits: an int if both limits are ints, otherwise a float."""
    if isinstance(low, int) and isinstance(high, int):
        return check_int(name, value, low, high)
    return check_number(name, value, low, high, open_below=name == "search_fraction")


def _documented() -> str:
    lines = []
    for row in parameter_table():
        names = [f"{row['symbol']} in the paper"] if row["symbol"] else []
        names += [f"`{row['matlab']}` in the authors' code"] if row["matlab"] else []
        lines.append(f"{row['name']} : {row['allowed']}; default {row['default']}")
        lines.append(f"    {row['meaning']}" + (f" ({', '.join(names)})" if names else ""))
    return _DOCUMENTATION.format("\n".join(lines))


_DOCUMENTATION = """All parameters of a simulation, checked when the object is made.

For a volume template_size, overlap_size and wavelet_level may each be three
numbers, along z, y and x; one number applies to all axes. Volumes are often thin, so a
template along z may have only 1 cell (overlap 0), or 2 or 3 cells (overlap 0 or 1).
Raises `CCWSIMError` for a value that is not allowed; the message suggests other values.

Parameters
----------
{}

Examples
--------
>>> Parameters((16, 48, 48), (4, 8, 8), wavelet_level=(1, 2, 2)).step
(12, 40, 40)"""
Parameters.__doc__ = _documented()
