"""Names and values of an address, put there and read with words for what cannot be taken."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ccwsim.io.data_file import printable

MAX_LETTERS = 40
"""Of a facies' name, and of a bad value that is said again."""


class Words:
    """Names and values, in the order in which they are put."""

    def __init__(self) -> None:
        self.found: dict[str, list[str]] = {}

    def put(self, name: str, value: object, unusual: bool = True) -> None:
        """Put a value, unless it is as usual."""
        if unusual:
            self.found[name] = [str(value)]

    def put_all(self, name: str, values: Sequence[str]) -> None:
        """Put one name with several values."""
        if values:
            self.found[name] = list(values)


class Reading:
    """Reads values by their names; what is wrong is noted, and the usual value taken.

    Parameters
    ----------
    query : mapping
        The values of each name.

    Attributes
    ----------
    notes : list of str
        What could not be taken, in sentences.
    """

    def __init__(self, query: Mapping[str, Sequence[str]]) -> None:
        self._query = query
        self.notes: list[str] = []

    def text(self, name: str) -> str | None:
        """Return the last value of a name."""
        values = self._query.get(name)
        return values[-1] if values else None

    def all(self, name: str) -> Sequence[str]:
        """Return all values of a name."""
        return self._query.get(name, ())

    def refuse(self, name: str, reason: str, taken: str) -> None:
        """Note a value that cannot be taken."""
        value = printable(self.text(name) or "", MAX_LETTERS)
        self.notes.append(f"{name} = {value} {reason}: {taken}.")

    def whole(self, name: str, usual: int, low: int, high: int) -> int:
        """Return a whole number."""
        text = self.text(name)
        if text is None:
            return usual
        if re.fullmatch(r"-?\d{1,18}", text, re.ASCII) and low <= int(text) <= high:
            return int(text)
        reason = f"is no whole number from {low} to {high}"
        self.refuse(name, reason, f"the usual {usual} is taken")
        return usual

    def one_of(self, name: str, usual: str, words: Mapping[str, str]) -> str:
        """Return what a word stands for."""
        text = self.text(name)
        if text is None or text in words:
            return words[text] if text else usual
        self.refuse(name, f"is none of {', '.join(words)}", f"the usual {usual} is taken")
        return usual

    def pair(
        self, name: str, usual: tuple[float, float], figure: str, low: float, high: float
    ) -> tuple[float, float]:
        """Return two numbers with an x between them."""
        text = self.text(name)
        match = re.fullmatch(f"({figure})[xX×]({figure})", text or "", re.ASCII)
        if text is None:
            return usual
        if match:
            pair = float(match[1]), float(match[2])
            if low <= min(pair) and max(pair) <= high:
                return pair
        said = "x".join(f"{value:g}" for value in usual)
        self.refuse(name, "is no pair such as 640x480 that can be", f"the usual {said} is taken")
        return usual
