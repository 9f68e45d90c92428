"""Guides and placed hard data as words of a link, such as along_90_0~facies_2."""

from collections.abc import Iterable
from dataclasses import dataclass, fields, is_dataclass
from itertools import accumulate, chain, pairwise
from math import inf
from typing import Any

import numpy as np

from ccwsim import CCWSIMError, HardData, datasets
from ccwsim.model import bounds
from ccwsim.model.bounds import MAX_LINK_DATA
from ccwsim.model.errors import refused
from ccwsim.sharing.choices import (
    Directions,
    Gradient,
    GuideChoice,
    ImageChoice,
    Stroke,
    ZoneLayers,
)

Bounds = tuple[float, float]
"""Minimum and maximum of a number, both of type int if the number must be an integer."""
BASE = 36  # base of the integers in packed hard data


@dataclass(frozen=True)
class GuideSpec:
    """One row of the table of guides: a word of a link, and the value that follows it.

    The value of a field is of the type `kind`, or a tuple of such items if there can be several.
    An item consists of some numbers and then any number of points, or of further numbers.
    """

    word: str
    field: str  # name in `GuideChoice`
    kind: type
    numbers: tuple[Bounds, ...] = ()
    points: int = 0  # minimum number of points (x, y) after the numbers
    more: Bounds | None = None  # bounds of further numbers, if there are no points
    names: tuple[str, ...] = ()  # allowed texts, if an item is a text
    several: bool = False

    def holds(self, value: Any) -> bool:
        """Return whether a value of the field is of the kind of this row."""
        kinds = (int, float) if self.kind is float else self.kind
        return all(isinstance(item, kinds) for item in self._items(value))

    def write(self, value: Any) -> str:
        """Return a value as a text that `read` converts back, after the word."""
        items = ("_".join(map(str, _numbers_in(item))) for item in self._items(value))
        return f"{self.word}_{'__'.join(items)}"

    def read(self, text: str) -> Any:
        """Convert the text after the word to a value; raise `ValueError` for another text."""
        if not self.several:
            return self._read_item(text)
        return tuple(map(self._read_item, text.split("__"))) if text else ()

    def _items(self, value: Any) -> tuple[Any, ...]:
        return value if self.several and isinstance(value, tuple) else (value,)

    def _read_item(self, text: str) -> Any:
        if self.names:
            if text not in self.names:
                raise ValueError(text)
            return self.kind(text)
        words, n = text.split("_"), len(self.numbers)
        limited = zip(words[:n], self.numbers, strict=True)
        values: list[Any] = [_number(word, limits) for word, limits in limited]
        more = [_number(word, self.more or _ANY_NUMBER) for word in words[n:]]
        if self.points:
            points = tuple(zip(more[::2], more[1::2], strict=True))
            if not self.points <= len(points) <= MAX_LINK_DATA:
                raise ValueError(text)
            values.append(points)
        elif self.more:
            values.append(tuple(more))
        elif more:
            raise ValueError(text)
        return self.kind(*values)


def _numbers_in(value: Any) -> Iterable[Any]:
    """Return the numbers of an item one after another, or its name."""
    if isinstance(value, ImageChoice):
        return (value.bundled,)
    if is_dataclass(value):
        value = tuple(getattr(value, field.name) for field in fields(value))
    return chain.from_iterable(map(_numbers_in, value)) if isinstance(value, tuple) else (value,)


def _number(word: str, limits: Bounds) -> float:
    low, high = limits
    value = int(word) if isinstance(low, int) else float(word)
    if not (low <= value <= high and abs(value) < inf):
        raise ValueError(word)
    return value


_ANY_NUMBER, _SHARE = (-bounds.MAX_FLOAT, bounds.MAX_FLOAT), (0.0, 1.0)
_DEGREES = -bounds.MAX_DEGREES, bounds.MAX_DEGREES
_FACIES, _LAYERS = (0, bounds.MAX_FACIES - 1), (0, bounds.MAX_GRID_SIDE_OFFERED - 1)
_SOFT, _AUXILIARY = (0.0, bounds.MAX_SOFT_WEIGHT), (0.0, bounds.MAX_AUXILIARY_WEIGHT)
_SCALE = bounds.MIN_SCALE, bounds.MAX_SCALE
_AXES = "x", "y", "z", "xy", "xz", "yz", "xyz"
_IMAGES = tuple(datasets.IMAGES)
GUIDES = (
    GuideSpec("gradient", "probabilities", Gradient, (_ANY_NUMBER, _SHARE, _SHARE)),
    GuideSpec("stroke", "probabilities", Stroke, (_ANY_NUMBER,) * 3, points=1, several=True),
    GuideSpec("facies", "facies", int, (_FACIES,)),
    GuideSpec("soft", "soft_weight", float, (_SOFT,)),
    GuideSpec("polygon", "active", tuple, points=3),
    GuideSpec("along", "auxiliary", Directions, (_ANY_NUMBER, _ANY_NUMBER)),
    GuideSpec("weight", "auxiliary_weight", float, (_AUXILIARY,)),
    GuideSpec("turning", "angle", Gradient, (_ANY_NUMBER, _DEGREES, _DEGREES)),
    GuideSpec("line", "angle", tuple, points=2, several=True),
    GuideSpec("angle", "angle", float, (_DEGREES,)),
    GuideSpec("flow", "flow_azimuth", float, (_DEGREES,)),
    GuideSpec("scale", "scale", float, (_SCALE,)),
    GuideSpec("mirrored", "mirrored", str, names=_AXES),
    GuideSpec("image", "images", ImageChoice, names=_IMAGES, several=True),
    GuideSpec("zone", "zones", tuple, points=3, several=True),
    GuideSpec("layers", "zones", ZoneLayers, more=_LAYERS),
    GuideSpec("share", "zones", float, (_SHARE,)),
)
_BY_WORD = {spec.word: spec for spec in GUIDES}


def words_of_guides(guides: GuideChoice) -> str:
    """Return guides without files as words; fields with default values are left out."""
    usual, words = GuideChoice(), []
    for spec in GUIDES:
        value = getattr(guides, spec.field)
        if value != getattr(usual, spec.field) and spec.holds(value):
            words.append(spec.write(value))
    return "~".join(words)


def guides_of(text: str) -> GuideChoice:
    """Return the guides of words; raise `CCWSIMError` for another text."""
    try:
        parts = [part.partition("_") for part in text.split("~")]
        specs = [(_BY_WORD[word], value) for word, _, value in parts]
        return GuideChoice(**{spec.field: spec.read(value) for spec, value in specs})
    except (CCWSIMError, KeyError, ValueError):
        raise CCWSIMError("does not describe secondary information") from None


def packed(hard_data: HardData) -> str:
    """Return hard data, at most `MAX_LINK_DATA`, as words of integers in base 36.

    The first word is the box of the data: its first cell and its sides. For each facies, a word has
    the code and the steps from datum to datum, in cells of the box, which are counted row by row.
    The last word is the number of data, so that a cut link is noticed.
    """
    if hard_data.n > MAX_LINK_DATA:
        raise refused("too_many_data_for_link", n=hard_data.n, most=MAX_LINK_DATA)
    low = hard_data.cells.min(axis=0, initial=0).tolist()
    high = hard_data.cells.max(axis=0, initial=0).tolist()
    sides = [end - start + 1 for start, end in zip(low, high, strict=True)]
    places: dict[int, list[int]] = {}
    for cell, code in zip(hard_data.cells.tolist(), hard_data.facies.tolist(), strict=True):
        place = 0
        for index, start, side in zip(cell, low, sides, strict=True):
            place = place * side + index - start
        places.setdefault(code, [0]).append(place)
    steps = [
        [code, *(after - before for before, after in pairwise(positions))]
        for code, positions in places.items()
    ]
    words = [[*low, *sides], *steps, [hard_data.n]]
    return "~".join("_".join(np.base_repr(number, BASE) for number in word) for word in words)


def unpacked(text: str) -> HardData:
    """Return the hard data of `packed`; raise `CCWSIMError` for a changed text."""
    try:
        numbers = [[int(number, BASE) for number in word.split("_")] for word in text.split("~")]
        box, *groups, (n,) = numbers
        n_axes = len(box) // 2
        cells, facies = [], []
        for code, *steps in groups:
            for place in accumulate(steps):
                cell = []
                for start, side in zip(box[n_axes - 1 :: -1], box[: n_axes - 1 : -1], strict=True):
                    place, index = divmod(place, side)
                    cell.append(start + index)
                cells.append(cell[::-1])
                facies.append(code)
        if not len(cells) == n <= MAX_LINK_DATA:
            raise ValueError(text)
        return HardData(np.reshape(cells, (-1, n_axes)), facies)
    except (ValueError, ArithmeticError):
        raise CCWSIMError(
            "the hard data in the link are cut or changed; copy the entire link again"
        ) from None
