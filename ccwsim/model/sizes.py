"""Legal sizes of templates and overlaps, and wavelet levels, along z, y and x."""

from __future__ import annotations

from collections.abc import Sequence

from ccwsim.model.arrays import AXES, Shape
from ccwsim.model.bounds import MAX_LEVEL, MAX_TEMPLATE, MIN_TEMPLATE
from ccwsim.model.errors import CCWSIMError

Triple = tuple[int, int, int]
"""Lengths, levels or coordinates along z, y and x."""
PerAxis = int | Triple
"""One whole number for all axes or, in a volume, three along z, y and x."""


def triple(size: PerAxis) -> Triple:
    """Return a size along z, y and x."""
    return (size, size, size) if isinstance(size, int) else size


def per_axis(sizes: Triple, shape: Shape) -> PerAxis:
    """Return the sizes of a volume, or the size along x for a map; templates of maps are square."""
    return sizes if len(shape) == 3 else sizes[-1]


def in_layers(shape: Shape) -> Triple:
    """Return the shape of a map or volume with three axes; a map has one layer."""
    nz, ny, nx = (1, *shape)[-3:]
    return nz, ny, nx


def largest_sides(shape: Shape) -> Triple:
    """Return the sides of the largest template that fits into an image."""
    return in_layers(shape if len(shape) == 3 else (min(shape),) * 2)


def legal_sizes(level: int, smallest: int, largest: int) -> list[int]:
    """Return the template or overlap sizes that a level allows: multiples of 2^level."""
    block = 2**level
    return list(range(-(-smallest // block) * block, largest + 1, block))


def template_sizes(level: int, shape: Shape, along_z: bool = False) -> list[int]:
    """Return the template sizes that a level and a training image allow, along z if `along_z`."""
    least, side = (1, shape[0]) if along_z else (MIN_TEMPLATE, min(shape[-2:]))
    sizes = legal_sizes(level, least, min(side, MAX_TEMPLATE))
    return [size for size in sizes if overlap_sizes(level, size, along_z)]


def overlap_sizes(level: int, template: int, along_z: bool = False) -> list[int]:
    """Return the overlap sizes for a level and a template; a thin template needs no overlap."""
    return legal_sizes(level, _least_overlap(template, along_z), template // 2)


def levels(shape: Shape, along_z: bool = False) -> list[int]:
    """Return the levels at which a training image allows at least one template size."""
    return [level for level in range(MAX_LEVEL + 1) if template_sizes(level, shape, along_z)]


def nearest(sizes: Sequence[int], wanted: int) -> int:
    """Return the size nearest to `wanted`, the smaller of two; `wanted` if there are no sizes."""
    return min(sizes, key=lambda size: (abs(size - wanted), size), default=wanted)


def fitted_sizes(
    template: int, overlap: int, level: int, shape: Shape, along_z: bool, is_ccsim: bool
) -> Triple:
    """Return the nearest legal template, overlap and level along an axis; CCSIM has level 0."""
    possible, used = levels(shape, along_z), 0 if is_ccsim else level
    if possible and used not in possible:
        used = level = max(possible)
    template = nearest(template_sizes(used, shape, along_z), template)
    return template, nearest(overlap_sizes(used, template, along_z), overlap), level


def check_sizes(template: PerAxis, overlap: PerAxis, level: PerAxis) -> None:
    """Raise `CCWSIMError` for sizes that a level does not allow; sizes along z may be smaller."""
    if all(isinstance(size, int) for size in (template, overlap, level)):
        _check_axis("", triple(template)[0], triple(overlap)[0], triple(level)[0])
        return
    sides = zip(AXES[::-1], triple(template), triple(overlap), triple(level), strict=True)
    for axis, t, o, j in sides:
        _check_axis(f" along {axis}", t, o, j)


def _check_axis(where: str, template: int, overlap: int, level: int) -> None:
    """Check the sizes along one axis or all axes at once."""
    along_z = where == " along z"
    least = 1 if along_z else MIN_TEMPLATE
    _check_size("Template", where, template, level, low=least, high=MAX_TEMPLATE)
    least = _least_overlap(template, along_z)
    _check_size("Overlap", where, overlap, level, low=least, high=template // 2)


def _least_overlap(template: int, along_z: bool) -> int:
    return 0 if along_z and template < MIN_TEMPLATE else 1


def _check_size(what: str, where: str, size: int, level: int, low: int, high: int) -> None:
    """If the level does not allow a size, raise an error that names the nearest allowed sizes."""
    block = 2**level
    if size % block == 0 and low <= size <= high:
        return
    legal = legal_sizes(level, low, high)
    near = sorted(legal, key=lambda n: (abs(n - size), n))[:2]
    rule = f"a multiple of {block}"
    if size > high:
        rule = "at most half the template"
    elif size < low:
        rule = f"at least {low}"
    tail = f"try {' or '.join(map(str, sorted(near)))}" if near else "choose a lower level"
    raise CCWSIMError(f"{what} {size}{where} must be {rule} at level {level}: {tail}")
