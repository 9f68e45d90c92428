"""The example studies, read from `catalogue.toml`."""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice

CATALOGUE = Path(__file__).with_name("catalogue.toml")


@dataclass(frozen=True)
class Example:
    """A study that demonstrates one aspect of the method.

    `name` is used in keys and addresses. `task` asks what to predict before the pictures are seen;
    `text` is the answer, and says which features to look for. `others` are
    settings to compare with the study. `source` is the section of the paper, if there is one.
    `shows` lists the pictures beside the training image; with `others`, the pictures are one
    realization of each setting.
    """

    name: str
    title: str
    task: str
    text: str
    choices: Choices
    others: tuple[Parameters, ...] = ()
    source: str = ""
    shows: tuple[str, ...] = ("realization", "second")

    @property
    def settings(self) -> tuple[Parameters, ...]:
        """The setting of the study, followed by the settings that are compared with it."""
        return self.choices.parameters, *self.others


@dataclass(frozen=True)
class LecturePart:
    """A part of the lecture: a title, the time that it takes, and its examples."""

    title: str
    minutes: int
    examples: tuple[Example, ...]


def _parameters(row: dict[str, Any]) -> Parameters:
    """Return the parameters in a TOML table; lists contain the numbers along z, y and x."""
    own: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in row.items()}
    return Parameters(**own)


def _example(row: dict[str, Any]) -> Example:
    """Return the example described by a TOML table, in which default values may be missing."""
    side = row.pop("side", 512)
    shape = tuple(row.pop("grid", (side, side)))
    choices = Choices(
        ImageChoice(row.pop("image")),
        DataChoice(**row.pop("data", {})),
        Grid.of(shape),
        _parameters(row.pop("parameters", {})),
        row.pop("n_realizations", 12),
    )
    others = tuple(map(_parameters, row.pop("others", [])))
    shows = tuple(row.pop("shows", Example.shows))
    return Example(**row, choices=choices, others=others, shows=shows)


PARTS = tuple(
    LecturePart(part["title"], part["minutes"], tuple(map(_example, part["example"])))
    for part in tomllib.loads(CATALOGUE.read_text("utf-8"))["part"]
)
EXAMPLES = tuple(example for part in PARTS for example in part.examples)


def example_named(name: str) -> Example | None:
    """Return the example with this name, or None if no example has this name."""
    return next((example for example in EXAMPLES if example.name == name), None)


def next_example(name: str) -> Example | None:
    """Return the next example of the lecture, or None after the last example."""
    names = [example.name for example in EXAMPLES]
    following = names.index(name) + 1 if name in names else len(names)
    return EXAMPLES[following] if following < len(names) else None
