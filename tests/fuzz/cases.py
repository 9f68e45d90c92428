"""Determine each case, a file or a set of arguments, from its number and the seed."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple

from tests.fuzz.arguments import arguments
from tests.fuzz.evil import EVIL
from tests.fuzz.mutations import mutated
from tests.fuzz.reading import NAMES, readings, uploads
from tests.fuzz.seeds import seed_of


class Case(NamedTuple):
    """A case, small enough to be sent to another process.

    Attributes
    ----------
    kind : "file" or "arguments"
    number, seed : int
    """

    kind: Literal["file", "arguments"]
    number: int
    seed: int


def acts_of(case: Case) -> Iterator[tuple[str, Callable[[], object]]]:
    """Return the operations of a case; handmade files are read in another process, like uploads."""
    source = random.Random(f"{case.kind} {case.number} {case.seed}")
    if case.kind == "arguments":
        return arguments(source)
    by_hand = case.number < 2 * len(EVIL)
    return (uploads if by_hand else readings)(content_of(case)[1], source.choice(NAMES))


def content_of(case: Case) -> tuple[str, bytes]:
    """Return the origin and the content of a file.

    The first files are handmade hostile files, then these files truncated, then mutated valid
    files.
    """
    source = random.Random(f"content {case.number} {case.seed}")
    if case.number < 2 * len(EVIL):
        name = list(EVIL)[case.number % len(EVIL)]
        content = EVIL[name]()
        if case.number >= len(EVIL):
            name, content = f"{name}, cut", content[: source.randrange(len(content))]
        return name, content
    name, content = seed_of(source)
    return name, mutated(content, source, seed_of(source)[1])
