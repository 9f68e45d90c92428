"""What tells settings apart in charts: a colour, a dash and a symbol each, red left to the TI."""

from __future__ import annotations

from ccwsim.figures.palette import bytes_of
from ccwsim.figures.style import DARK, Theme

ON_PAPER = ("#1B1F24", "#0072B2", "#00805C", "#9A5CB4")
ON_INK = ("#ECE9E2", "#56B4E9", "#2FC39B", "#D39BE6")
DASHES = ("solid", "dash", "dot", "dashdot")
SYMBOLS = ("circle", "square", "triangle-up", "cross")


def setting_colours(theme: Theme) -> tuple[str, ...]:
    """Return one "#rrggbb" for each of four settings.

    Examples
    --------
    >>> setting_colours(DARK)[1]
    '#56B4E9'
    """
    return ON_INK if theme == DARK else ON_PAPER


def thinned(colour: str, opacity: float) -> str:
    """Return a colour "#rrggbb" that lets what is below show.

    Examples
    --------
    >>> thinned("#0072B2", 0.2)
    'rgba(0, 114, 178, 0.2)'
    """
    red, green, blue = bytes_of([colour])[0]
    return f"rgba({red}, {green}, {blue}, {opacity:g})"
