"""Placed hard data as words of a link."""

from itertools import accumulate, pairwise

import numpy as np

from ccwsim import CCWSIMError, HardData
from ccwsim.model import MAX_LINK_DATA, refused

BASE = 36  # base of the integers in packed hard data


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
