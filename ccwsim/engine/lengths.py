"""Template T, overlap OR and level J along z, y and x, at each scale and along the path."""

from __future__ import annotations

from typing import NamedTuple

from ccwsim.engine.stages.conditioning import MAX_PATCH_DATA
from ccwsim.engine.stages.path import Triple, along_path, overlap_cells
from ccwsim.model import MAX_TEMPLATE, MIN_TEMPLATE, Parameters, Shape, largest_sides, legal_sizes

USUAL_OVERLAP = 448
"""Overlap cells of a patch with T = 32 and OR = 8, for which the weights of data were chosen."""


class ScaledLengths(NamedTuple):
    """Lengths along z, y and x, in cells of a scale. Along z of a map, T is 1; OR and J are 0."""

    template: Triple
    overlap: Triple
    level: Triple  # the wavelet level minus `scales`
    scales: Triple = (0, 0, 0)  # number of times that each axis is up-gridded
    volume: bool = False
    weight_of_data: float = 1.0  # factor of weights of data and of slack

    @property
    def block(self) -> Triple:
        """Number of cells in the block of a coefficient, along each axis."""
        z, y, x = self.level
        return 2**z, 2**y, 2**x

    @property
    def cell_size(self) -> Triple:
        """Number of grid cells in a cell of this scale, along each axis."""
        z, y, x = self.scales
        return 2**z, 2**y, 2**x

    @property
    def step(self) -> Triple:
        """Number of cells from a patch to the next patch along each axis, T − OR."""
        (tz, ty, tx), (oz, oy, ox) = self.template, self.overlap
        return tz - oz, ty - oy, tx - ox

    @property
    def max_data(self) -> float:
        """Maximum number of data per patch; a tile with more data is split.

        In maps, but not in volumes, the limit increases with the overlap.
        """
        return MAX_PATCH_DATA * (1.0 if self.volume else self.weight_of_data)

    def along(self, orientation: int) -> ScaledLengths:
        """Return the lengths along the axes of a path."""
        t, o, j, scales = (along_path(lengths, orientation) for lengths in self[:4])
        return self._replace(template=t, overlap=o, level=j, scales=scales)

    def cells_of(self, coarser: ScaledLengths) -> Triple:
        """Return the number of cells, along each axis, in a cell of a coarser scale."""
        z, y, x = (b - a for a, b in zip(self.scales, coarser.scales, strict=True))
        return 2**z, 2**y, 2**x


def lengths_of(
    p: Parameters, shape: Shape, template: Triple | None = None, orientation: int = 0
) -> tuple[ScaledLengths, ...]:
    """Return the lengths along a path at each scale, the finest first.

    Only "ms-ccsim" has more than one scale. `shape` is the shape of the grid; `template` is the
    template of a realization along the axes of the grid. The wavelet level of an axis limits the
    number of times that the axis is up-gridded.
    """
    usual, overlap, level = p.along(shape)
    template, volume = template or usual, len(shape) == 3
    weight = overlap_cells(template, overlap) / USUAL_OVERLAP
    if not volume:
        weight = 1.0 if p.published_draw else max(weight, 1.0)

    def at_scale(scale: int) -> ScaledLengths:
        scales = [min(scale, n) for n in level]
        sizes = [
            tuple(n >> k for n, k in zip(lengths, scales, strict=True))
            for lengths in (template, overlap)
        ]
        return ScaledLengths(
            template=sizes[0],  # type: ignore[arg-type]
            overlap=sizes[1],  # type: ignore[arg-type]
            level=tuple(n - k for n, k in zip(level, scales, strict=True)),  # type: ignore[arg-type]
            scales=tuple(scales),  # type: ignore[arg-type]
            volume=volume,
            weight_of_data=weight,
        )

    return tuple(at_scale(scale).along(orientation) for scale in range(p.scale + 1))


def templates(p: Parameters, shape: Shape) -> list[Triple]:
    """Return all templates that realizations can have for an image of `shape`.

    In a volume, all sides of the template change by about the same factor. A side with fewer than
    MIN_TEMPLATE layers does not change.
    """
    usual, overlap, level = p.along(shape)
    legal = []
    for t, o, j, most in zip(usual, overlap, level, largest_sides(shape), strict=True):
        low = max(round(t * (1 - p.template_variation)), 2 * o, MIN_TEMPLATE)
        high = min(round(t * (1 + p.template_variation)), most, MAX_TEMPLATE)
        legal.append(legal_sizes(j, low, high) if t >= MIN_TEMPLATE else [t])
    sizes = []
    for size in legal[2]:
        exact = [size * t / usual[2] for t in usual]
        z, y = (min(legal[a], key=lambda n, a=a: abs(n - exact[a])) for a in (0, 1))
        sizes.append((z, y, size))
    return sizes
