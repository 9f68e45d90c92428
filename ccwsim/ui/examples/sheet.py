"""The lecture as a sheet to print: the tasks with links and, on the last page, the answers."""

import re
from collections.abc import Mapping
from urllib.parse import urlencode

from ccwsim.report.document import Document, Section, Text
from ccwsim.sharing.link import link_of
from ccwsim.ui.examples.catalogue import EXAMPLES, PARTS, Example


def lecture_sheet(page: str) -> Document:
    """Return the lecture as a report; `page` is the address of a page of the dashboard."""
    sections = [
        Section(
            part.title,
            tuple(
                Text(_line(e, e.task), link=study_address(link_of(e.choices), page))
                for e in part.examples
            ),
            note=f"{part.minutes} minutes",
        )
        for part in PARTS
    ]
    answers = tuple(Text(_line(e, e.text), quiet=True) for e in EXAMPLES)
    return Document(
        f"A lecture of {sum(part.minutes for part in PARTS)} minutes on CCWSIM",
        (*sections, Section("Answers", answers, on_new_page=True)),
        "Write down what you predict before you open a study. The answers are on the last page.",
    )


def study_address(query: Mapping[str, list[str]], page: str) -> str:
    """Return the address that opens a study on Simulate; `page` is the address of any page."""
    start = page.split("?")[0].rpartition("/")[0]
    return f"{start}/simulate?{urlencode(query, doseq=True)}".rstrip("?")


def _line(example: Example, text: str) -> str:
    """Return a text, without marks of code and emphasis, after number and title of its example."""
    return f"{EXAMPLES.index(example) + 1}. {example.title}: {re.sub('[`*]', '', text.strip())}"
