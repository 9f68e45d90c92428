"""Numbers and times as text, for pages, reports and messages."""

import math

THREE_DIGITS = 999.5  # numbers from this number up are rounded to integers of four or more digits


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


def with_power(value: float, digits: int = 3) -> str:
    """Return a number with some significant digits, and with a power of ten if it is very small."""
    factor, _, power = f"{value:.{digits}g}".partition("e")
    raised = str(int(power or 0)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return minus(f"{factor} × 10{raised}" if power else factor)


def seconds(value: float) -> str:
    """Return a time with its unit."""
    in_ms = value < THREE_DIGITS / 1000
    return f"{three_digits(1000 * value)} ms" if in_ms else f"{three_digits(value)} s"
