"""Numbers, times and sizes as text, for pages, reports and messages."""

import math

THREE_DIGITS = 999.5  # numbers from this number up are rounded to integers of four or more digits
TIME_UNITS = (
    ("years", 365.25 * 86400.0, 1000 * 86400.0),
    ("d", 86400.0, 86400.0),
    ("h", 3600.0, 5400.0),
    ("min", 60.0, 90.0),
    ("s", 1.0, THREE_DIGITS / 1000),
    ("ms", 0.001, 0.0),
)
"""Units of time: name, length in seconds, and the shortest duration that is given in the unit."""


def plural(n: int, noun: str) -> str:
    """Return a count and its noun, singular or plural."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def minus(number: str) -> str:
    """Return a number with a true minus sign."""
    return number.replace("-", "−")


def three_digits(value: float) -> str:
    """Return a number with three significant digits, without powers of ten; "–" for NaN."""
    if math.isnan(value):
        return "–"
    if value == 0:
        return "0"
    return f"{value:.3g}" if 1e-4 <= abs(value) < THREE_DIGITS else f"{value:.0f}"


def coordinate(value: float) -> str:
    """Return a coordinate or length with all of its digits, such as "6522175"."""
    return f"{value:.12g}"


def with_power(value: float, digits: int = 3) -> str:
    """Return a number with some significant digits, and with a power of ten if it is very small."""
    factor, _, power = f"{value:.{digits}g}".partition("e")
    raised = str(int(power or 0)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return minus(f"{factor} × 10{raised}" if power else factor)


def duration(seconds: float, rough: bool = False) -> str:
    """Return a time in the unit that suits it, from milliseconds to years; "never" if infinite.

    A `rough` time, such as the time that is left, is at least 1 s, and has no decimals up to an
    hour.

    Examples
    --------
    >>> duration(0.25), duration(75.3), duration(0.25, rough=True), duration(9000.0, rough=True)
    ('250 ms', '75.3 s', '1 s', '2.5 h')
    """
    if math.isinf(seconds):
        return "never"
    seconds = max(seconds, 1.0) if rough else seconds
    unit, length = next(
        ((u, size) for u, size, least in TIME_UNITS if seconds >= least), ("s", 1.0)
    )
    number = seconds / length
    if not rough:
        return f"{three_digits(number)} {unit}"
    return f"{number:.0f} {unit}" if unit in ("s", "min") else f"{number:.1f} {unit}"


def format_bytes(number: float) -> str:
    """Return a number of bytes as text."""
    return f"{number / 1e9:.1f} GB" if number >= 1e9 else f"{number / 1e6:.0f} MB"
