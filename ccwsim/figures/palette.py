"""Colours of facies, which are the same in every map, contact sheet and chart."""

from __future__ import annotations

import colorsys
import re
from collections.abc import Mapping, Sequence

import plotly.colors

from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage

FACIES = ("#173F6B", "#F0AD2E", "#3A9E7E", "#A63A26", "#A78BD0", "#D5D8DC")
"""Default facies colours: deep blue, amber, green, brick, violet and grey. They are distinct for
the three common types of colour blindness and, except green and violet, in grey-scale print."""

GOLDEN_ANGLE = 0.381966
HEX = re.compile(r"#[0-9a-fA-F]{6}")


def facies_colours(
    training_image: TrainingImage, chosen: Mapping[int, str] | None = None
) -> list[str]:
    """Return the colour of each facies, in the order of the codes.

    `chosen` maps facies codes to the user's colours. Raises `CCWSIMError` for a colour that is not
    written as "#rrggbb".

    Examples
    --------
    >>> facies_colours(TrainingImage([[0, 7]]), {7: "#ff0000"})
    ['#173F6B', '#ff0000']
    """
    chosen = chosen or {}
    colours = [
        chosen.get(int(code), default_colour(k)) for k, code in enumerate(training_image.codes)
    ]
    for colour in colours:
        if not HEX.fullmatch(colour):
            raise CCWSIMError(f'colour "{colour}" must be written as #rrggbb, like #173F6B')
    return colours


def default_colour(index: int) -> str:
    """Return the default colour of facies `index`; from the seventh facies on, the hue rotates."""
    if index < len(FACIES):
        return FACIES[index]
    hue = (index * GOLDEN_ANGLE) % 1.0
    light = (0.35, 0.65, 0.5)[index % 3]
    rgb = colorsys.hls_to_rgb(hue, light, 0.55)
    return "#" + "".join(f"{round(255 * c):02X}" for c in rgb)


def bytes_of(colours: Sequence[str]) -> list[tuple[int, int, int]]:
    """Convert colours "#rrggbb" to (red, green, blue) with values from 0 to 255."""
    return [(int(c[1:3], 16), int(c[3:5], 16), int(c[5:7], 16)) for c in colours]


DIFFERENCE = ("#2C6FB0", "#F4F2ED", "#B5452C")
"""Colours of negative, zero and positive differences in the light theme."""
DIFFERENCE_ON_INK = ("#6FB1EE", "#232A33", "#FF8A6B")
"""Colours of negative, zero and positive differences in the dark theme."""

CIVIDIS = tuple(plotly.colors.sequential.Cividis)
"""Colours of the cividis ramp, used for probabilities."""

ENTROPY = ("#F3EEF8", "#C9B4DE", "#8E6BB5", "#5B3788", "#33145C")
"""Colours of the one-hue ramp for entropy; cells without uncertainty are pale."""


def with_opacity(colour: str, opacity: float) -> str:
    """Return a colour "#rrggbb" with an opacity.

    Examples
    --------
    >>> with_opacity("#0072B2", 0.2)
    'rgba(0, 114, 178, 0.2)'
    """
    red, green, blue = bytes_of([colour])[0]
    return f"rgba({red}, {green}, {blue}, {opacity:g})"


def ramp(steps: Sequence[str], n: int) -> list[str]:
    """Return `n` evenly spaced colours of the colour ramp that interpolates the colours `steps`.

    Examples
    --------
    >>> ramp(["#000000", "#FFFFFF"], 3)
    ['#000000', '#808080', '#FFFFFF']
    """
    rgb = bytes_of(steps)
    colours = []
    for k in range(n):
        at = k / max(n - 1, 1) * (len(rgb) - 1)
        low = min(int(at), len(rgb) - 2)
        share = at - low
        mixed = [round(a + share * (b - a)) for a, b in zip(rgb[low], rgb[low + 1], strict=True)]
        colours.append("#" + "".join(f"{c:02X}" for c in mixed))
    return colours
