"""The example studies, read from `catalogue.toml`, and the lecture as a sheet to print."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

from ccwsim import Grid, Parameters
from ccwsim.model import read_toml
from ccwsim.report.document import Document, Section, Text
from ccwsim.sharing.choices import (
    Choices,
    CompareChoice,
    DataChoice,
    GuideChoice,
    ImageChoice,
    Shown,
)
from ccwsim.sharing.link import link_of
from ccwsim.sharing.parts import from_json
from ccwsim.ui.widgets import page_labels

N_COMPARED = 8  # realizations of each setting of an example that is compared


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


def _parameters_of_row(row: dict[str, Any]) -> Parameters:
    """Return the parameters in a TOML table; lists contain the numbers along z, y and x."""
    values: dict[str, Any] = {
        name: tuple(v) if isinstance(v, list) else v for name, v in row.items()
    }
    return Parameters(**values)


def _example(row: dict[str, Any]) -> Example:
    """Return the example described by a TOML table, in which default values may be missing."""
    side = row.pop("side", 512)
    choices = Choices(
        ImageChoice(row.pop("image")),
        DataChoice(**row.pop("data", {})),
        Grid.of(tuple(row.pop("grid", (side, side)))),
        _parameters_of_row(row.pop("parameters", {})),
        row.pop("n_realizations", 12),
        guides=from_json(row.pop("guides", {}), GuideChoice),
    )
    others = tuple(map(_parameters_of_row, row.pop("others", [])))
    shows = tuple(row.pop("shows", Example.shows))
    return Example(**row, choices=choices, others=others, shows=shows)


LECTURE_PARTS = tuple(
    LecturePart(part["title"], part["minutes"], tuple(map(_example, part["example"])))
    for part in read_toml("ui/examples/catalogue.toml")["part"]
)
# minutes, address, what to show, and a question of each screen of the short lecture
SHORT_LECTURE = page_labels("lecture_in_20_minutes")
EXAMPLES = tuple(example for part in LECTURE_PARTS for example in part.examples)


def example_named(name: str) -> Example | None:
    """Return the example with this name, or None if no example has this name."""
    return next((example for example in EXAMPLES if example.name == name), None)


def next_example(name: str) -> Example | None:
    """Return the next example of the lecture, or None after the last example."""
    names = [example.name for example in EXAMPLES]
    following = names.index(name) + 1 if name in names else len(names)
    return EXAMPLES[following] if following < len(names) else None


def lecture_sheet(page: str) -> Document:
    """Return the lecture as a report; `page` is the address of a page of the dashboard."""
    sections = [
        Section(
            part.title,
            tuple(Text(_line(e, e.task), link=example_address(e, page)) for e in part.examples),
            note=f"{part.minutes} minutes",
        )
        for part in LECTURE_PARTS
    ]
    start = study_address({}, page).removesuffix("simulate")
    short = tuple(
        Text(f"{title}, {minutes} minutes: {' '.join(texts)}", link=f"{start}{address}")
        for title, (minutes, address, *texts) in SHORT_LECTURE.items()
    )
    answers = tuple(Text(_line(e, e.text), quiet=True) for e in EXAMPLES)
    return Document(
        f"A lecture of {sum(part.minutes for part in LECTURE_PARTS)} minutes on CCWSIM",
        (
            *sections,
            Section("Lecture in 20 minutes", short, note="Six screens instead of the examples."),
            Section("Answers", answers, on_new_page=True),
        ),
        "Write down what you predict before you open a study. The answers are on the last pages. "
        f"The dashboard is at {start}",
    )


def study_address(query: Mapping[str, list[str]], page: str, target: str = "simulate") -> str:
    """Return the address that opens a study on `target`; `page` is the address of any page."""
    start = page.split("?")[0].rpartition("/")[0]
    return f"{start}/{target}?{urlencode(query, doseq=True)}".rstrip("?")


def example_address(example: Example, page: str) -> str:
    """Return the address that opens an example: on Compare if it has several settings."""
    if not example.others:
        return study_address(link_of(example.choices), page)
    shown = Shown(compare=CompareChoice(example.others, N_COMPARED))
    return study_address(link_of(example.choices, shown), page, "compare")


def _line(example: Example, text: str) -> str:
    """Return a text, without marks of code and emphasis, after number and title of its example."""
    return f"{EXAMPLES.index(example) + 1}. {example.title}: {re.sub('[`*]', '', text.strip())}"
