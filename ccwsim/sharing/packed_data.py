"""A few hard data as one short word that may stand in an address."""

from __future__ import annotations

import binascii
from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Iterator

import numpy as np

from ccwsim.model.bounds import MAX_LINK_DATA
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.hard_data import HardData

MAX_LETTERS = 8000


def packed(data: HardData) -> str:
    """Return hard data as letters, digits, - and _.

    First how many there are, then each facies in turn: its code, how many data it has, and the
    steps from one cell to the next along rows and columns, all in as few bytes as they need.

    Raises
    ------
    CCWSIMError
        For more than `MAX_LINK_DATA`.

    Examples
    --------
    >>> packed(HardData([[3, 4], [3, 9], [60, 2]], [1, 1, 0]))
    'BgACeAQCBAYIAAo'
    """
    if data.n > MAX_LINK_DATA:
        raise CCWSIMError(
            f"{data.n} hard data are more than the {MAX_LINK_DATA} an address can carry"
        )
    content = bytearray(_number(data.n))
    for code in np.unique(data.facies).tolist():
        cells = data.cells[data.facies == code].tolist()
        content += _number(code) + _number(len(cells))
        row, column = 0, 0
        for own_row, own_column in cells:
            content += _number(own_row - row) + _number(own_column - column)
            row, column = own_row, own_column
    return urlsafe_b64encode(content).decode().rstrip("=")


def unpacked(text: str) -> HardData:
    """Return the hard data of a packed word.

    Raises
    ------
    CCWSIMError
        For a word that was cut or changed.

    Examples
    --------
    >>> unpacked('BgACeAQCBAYIAAo').cells.tolist()
    [[3, 4], [3, 9], [60, 2]]
    """
    if len(text) > MAX_LETTERS:
        raise CCWSIMError(f"{len(text)} letters are more than an address of hard data has")
    try:
        content = urlsafe_b64decode(text + "=" * (-len(text) % 4))
    except (binascii.Error, ValueError):
        raise _broken() from None
    numbers = _numbers(content)
    cells, facies, n = [], [], _next(numbers)
    for code in numbers:
        row, column = 0, 0
        for _ in range(_next(numbers)):
            row, column = row + _next(numbers), column + _next(numbers)
            cells.append((row, column))
            facies.append(code)
            if len(cells) > MAX_LINK_DATA:
                raise _broken()
    if len(cells) != n:
        raise _broken()
    return HardData(cells, facies)


def _number(value: int) -> bytes:
    """A whole number in bytes of seven bits, the lowest first, its sign in the lowest bit."""
    folded = value << 1 if value >= 0 else (-value << 1) - 1
    found = bytearray()
    while folded >= 128:
        found.append(folded & 127 | 128)
        folded >>= 7
    return bytes([*found, folded])


def _numbers(content: bytes) -> Iterator[int]:
    folded, shift = 0, 0
    for byte in content:
        folded |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            yield folded >> 1 if folded % 2 == 0 else -((folded + 1) >> 1)
            folded, shift = 0, 0
        elif shift > 63:
            raise _broken()
    if shift:
        raise _broken()


def _next(numbers: Iterator[int]) -> int:
    try:
        return next(numbers)
    except StopIteration:
        raise _broken() from None


def _broken() -> CCWSIMError:
    return CCWSIMError("the hard data in the address are cut or changed; copy the whole link again")
