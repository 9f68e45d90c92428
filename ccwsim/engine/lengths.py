"""Template, overlap and level along z, y and x, at each scale and along the path."""

from __future__ import annotations

from typing import NamedTuple

from ccwsim.engine.stages.conditioning import MAX_DATA
from ccwsim.engine.stages.path import Triple, along_path, overlap_cells
from ccwsim.model.bounds import MAX_TEMPLATE, MIN_TEMPLATE
from ccwsim.model.parameters import Parameters, legal_sizes

USUAL_OVERLAP = 448
"""Cells of the overlap for which the weights of data were chosen: T 32, OR 8."""


class ScaledLengths(NamedTuple):
    """Lengths along z, y and x; a map has a template of one layer, and no overlap or level along z.

    `scales` is how often each axis is up-gridded, `level` what is left of the wavelet level.
    `weight_of_data` multiplies the weights of data, as they compete with the overlap, and slack.
    """

    template: Triple
    overlap: Triple
    level: Triple
    scales: Triple = (0, 0, 0)
    volume: bool = False
    weight_of_data: float = 1.0

    @property
    def block(self) -> Triple:
        """Cells of a coefficient along each axis."""
        z, y, x = self.level
        return 2**z, 2**y, 2**x

    @property
    def unit(self) -> Triple:
        """Cells of the grid that a cell of this scale stands for, along each axis."""
        z, y, x = self.scales
        return 2**z, 2**y, 2**x

    @property
    def step(self) -> Triple:
        """From one patch to the next along each axis."""
        (tz, ty, tx), (oz, oy, ox) = self.template, self.overlap
        return tz - oz, ty - oy, tx - ox

    def along(self, orientation: int) -> ScaledLengths:
        """Return the lengths along the axes of a path."""
        own = (along_path(each, orientation) for each in self[:4])
        return ScaledLengths(*own, volume=self.volume, weight_of_data=self.weight_of_data)

    def at_scale(self, scale: int) -> ScaledLengths:
        """Return the lengths of images that are up-gridded `scale` times, in their own cells.

        Axes with a lower level are up-gridded less often, so that no axis is coarser than it.
        """
        z, y, x = (min(scale, level) for level in self.level)
        unit = (z, y, x)

        def coarse(lengths: Triple) -> Triple:
            a, b, c = (length >> n for length, n in zip(lengths, unit, strict=True))
            return a, b, c

        left = (level - n for level, n in zip(self.level, unit, strict=True))
        (a, b, c), template, overlap = left, coarse(self.template), coarse(self.overlap)
        return ScaledLengths(template, overlap, (a, b, c), unit, self.volume, self.weight_of_data)

    @property
    def max_data(self) -> float:
        """How many data a patch may have before its tile is split.

        In a volume a larger overlap does not make more of them fit at once.
        """
        return MAX_DATA * (1.0 if self.volume else self.weight_of_data)


def lengths_of(
    p: Parameters, shape: tuple[int, ...], template: Triple | None = None
) -> ScaledLengths:
    """Return the lengths of a study whose grid has `shape`, with the template that was drawn.

    Examples
    --------
    >>> lengths_of(Parameters(32, 8, 2), (60, 100))[:3]
    ((1, 32, 32), (0, 8, 8), (0, 2, 2))
    """
    usual, overlap, level = p.along(shape)
    own, volume = usual if template is None else template, len(shape) == 3
    weight = overlap_cells(own, overlap) / USUAL_OVERLAP
    if not volume:
        weight = 1.0 if p.published_draw else max(weight, 1.0)
    return ScaledLengths(own, overlap, level, (0, 0, 0), volume, weight)


def templates(p: Parameters, shape: tuple[int, ...]) -> list[Triple]:
    """Return all templates that realizations may have for an image of `shape`.

    Those of a volume change along all axes by about the same share; a template of less than
    MIN_TEMPLATE layers stays.

    Examples
    --------
    >>> templates(Parameters(32, 8, 2, template_variation=0.1), (60, 100))
    [(1, 32, 32)]
    >>> templates(Parameters((8, 32, 16), (2, 8, 4), 1, template_variation=0.2), (20, 99, 99))
    [(6, 28, 14), (8, 32, 16), (8, 36, 18)]
    """
    usual, overlap, level = p.along(shape)
    room = shape if len(shape) == 3 else (1, min(shape), min(shape))  # of a map it is square
    legal = []
    for t, o, j, most in zip(usual, overlap, level, room, strict=True):
        low = max(round(t * (1 - p.template_variation)), 2 * o, MIN_TEMPLATE)
        high = min(round(t * (1 + p.template_variation)), most, MAX_TEMPLATE)
        legal.append(legal_sizes(j, low, high) if t >= MIN_TEMPLATE else [t])
    found = []
    for size in legal[2]:
        wanted = [size * t / usual[2] for t in usual]
        z, y = (min(legal[a], key=lambda n, a=a: abs(n - wanted[a])) for a in (0, 1))
        found.append((z, y, size))
    return found
