"""Table of the fields of a study, for links, projects, the command line and fields of pages."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from itertools import zip_longest
from typing import Any, Literal, get_args

import numpy as np

from ccwsim import CCWSIMError, HardData, Parameters, datasets
from ccwsim.model import bounds, fault_of_crs
from ccwsim.sharing.choices import (
    Answers,
    CellsOfWells,
    Choices,
    CompareChoice,
    EMap,
    FaciesAnswers,
    FlowChoice,
    GuideChoice,
    ImageChoice,
    Shown,
    SweepChoice,
)
from ccwsim.sharing.parts import from_json, json_text
from ccwsim.sharing.words import packed, unpacked

YES_NO = {"yes": True, "no": False}
MAX_LETTERS = 40  # maximum length of a word in a link, such as the name of a method or of a facies
TURN_WORDS = ("ew", "ns", "transpose")
Decision = tuple[Literal["on_collision", "on_outside", "on_unknown"], str]
DataAnswers = tuple[Decision | tuple[Literal["facies_names"], FaciesAnswers], ...]
"""The answers about hard data that a link contains; other answers are about files."""
_PER_AXIS = "whole", "number"  # kinds of fields that may have three values if the study is a volume
_FIGURE = r"-?\d{1,400}(?:\.\d{1,400})?"
_PATTERNS = {"count": r"-?\d{1,19}", "whole": r"-?\d{1,9}", "number": r"\d{1,9}(?:\.\d{1,400})?"}


@dataclass(frozen=True)
class FieldSpec:
    """One row of the table of a study's fields.

    In volumes, fields of kind "sizes" or "lengths" have a third number, along z. Fields of kind
    "whole" or "number" may have three numbers, written as x, y, z and stored as z, y, x.
    """

    key: str  # name in a link and in a project file
    part: str  # part of a study: a key of `parts_of`
    fields: tuple[str, ...]  # names in `part`; up to one per axis
    # count, sizes, lengths, choice or a key of `_TEXTS`; or whole or number (`Parameters` checks)
    kind: str
    low: float = 0  # minimum in a page, link or option
    high: float = 0  # maximum in a page, link or option
    project_high: float = 2**63 - 1  # maximum in a project file
    first: int = 0  # offset added to numbers in a link
    words: Mapping[str, Any] | None = None  # values of a choice, by the word used in a link
    option: str = ""  # command line option of a grid or parameter; `no_option` turns it off
    many: bool = False  # whether the value is a tuple, each item of which has a text

    @property
    def no_option(self) -> str:
        """The command line option that turns a yes-or-no choice off."""
        return self.option.replace("--", "--no-", 1) if self.words == YES_NO else ""

    def value_in(self, parts: Mapping[str, Any]) -> Any:
        """Return the value of this field, read from the parts of a study."""
        values = [getattr(parts[self.part], name) for name in self.fields]
        if len(values) == 1:
            return values[0]
        return tuple(value for value in values if value is not None)  # a map has no layers

    def as_fields(self, value: Any) -> dict[str, Any]:
        """Return a value of this field as a dictionary from field names to values."""
        values = value if len(self.fields) > 1 else (value,)
        return dict(zip_longest(self.fields, values))

    def texts(self, value: Any) -> list[str]:
        """Return the texts of a value in a link or project; none if they would be empty."""
        return [text for text in map(self.write, value if self.many else (value,)) if text]

    def write(self, value: Any) -> str:
        """Return a value as a text that `read` converts back."""
        if self.words:
            return next(word for word, meaning in self.words.items() if meaning == value)
        if self.kind in _TEXTS:
            return _TEXTS[self.kind][0](value)
        if isinstance(value, tuple):
            return "x".join(map(format_exactly, value[::-1] if self.kind in _PER_AXIS else value))
        if isinstance(value, int):
            return str(value + self.first)
        return "" if value is None else format_exactly(value)

    def read(self, text: str, *, project: bool = False) -> Any:
        """Convert a text to a value; error messages begin with "is" and follow the name.

        The limits are those of links or, if `project`, those of project files.
        """
        if self.words:
            if text not in self.words:
                raise CCWSIMError(f"is none of {', '.join(self.words)}")
            return self.words[text]
        if self.kind in _TEXTS:
            return _TEXTS[self.kind][1](text)
        high = self.project_high if project else self.high
        if self.kind in ("sizes", "lengths"):
            return self._numbers(text, high)
        if self.kind in _PER_AXIS and "x" in text:
            return self._per_axis(text)
        matches = re.fullmatch(_PATTERNS[self.kind], text, re.ASCII)
        if self.kind == "count":
            value = int(text) - self.first if matches else -1
            if self.low <= value <= high:
                return value
            raise CCWSIMError(
                f"is not a whole number from {self.write(self.low)} to {self.write(high)}"
            )
        if not matches:
            raise CCWSIMError("is not a number")
        return int(text) if self.kind == "whole" else float(text)

    def _numbers(self, text: str, high: float) -> tuple[Any, ...]:
        """Convert a text to two numbers, or to three for a volume."""
        figure, kind = (r"[1-9]\d{0,9}", int) if self.kind == "sizes" else (_FIGURE, float)
        if re.fullmatch(f"{figure}([xX×]{figure}){{1,2}}", text, re.ASCII):
            numbers = tuple(map(kind, re.split("[xX×]", text)))
            if self.low <= min(numbers) and max(numbers) <= high:
                return numbers
        raise CCWSIMError("is not two or three numbers in range, such as 640x480 or 100x100x48")

    def _per_axis(self, text: str) -> tuple[Any, ...]:
        """Convert a text with numbers along x, y, z to numbers in the order z, y, x."""
        figure = _PATTERNS[self.kind]
        if not re.fullmatch(f"{figure}(x{figure}){{2}}", text, re.ASCII):
            raise CCWSIMError("is neither one number nor three, along x, y and z")
        kind = int if self.kind == "whole" else float
        return tuple(kind(part) for part in reversed(text.split("x")))


def format_exactly(value: float) -> str:
    """Return a number as text without powers of ten; reading the text gives exactly this number."""
    return np.format_float_positional(value, trim="-")


def link_name(name: str) -> str:
    """Return the name of a parameter in a link and on the command line."""
    if name == "variant":
        return "as"  # as in the paper, a word that Python reserves
    short = name.removesuffix("_size").removeprefix("wavelet_").removeprefix("n_")
    return short.replace("_", "-")


def parts_of(choices: Choices, shown: Shown) -> dict[str, Any]:
    """Return the parts of a study by the names used in `FIELDS`."""
    parts = {name: getattr(choices, name) for name in ("image", "data", "grid", "parameters")}
    return {**parts, "study": choices, "guides": choices, "shown": shown}


def _read_crs(text: str) -> str:
    if text and (reason := fault_of_crs(text)):
        raise CCWSIMError(reason)
    return text


def _read_name(text: str) -> str:
    return text[:MAX_LETTERS].encode("utf-8", "replace").decode()


def _read_image(text: str) -> str:
    if text not in datasets.BUNDLED_IMAGES:
        raise CCWSIMError(f"is not a bundled training image ({', '.join(datasets.BUNDLED_IMAGES)})")
    return text


def _write_source(value: tuple[str, str]) -> str:
    """Return a source of data and a bundled name as one word, which is none for a user's file."""
    source, bundled = value
    return {"bundled": bundled, "file": "none"}.get(source, source)


def _read_source(text: str) -> tuple[str, str]:
    if text in datasets.BUNDLED_DATA:
        return "bundled", text
    other_sources = "sampled", "placed", "none"
    if text not in other_sources:
        raise CCWSIMError(f"is none of {', '.join([*datasets.BUNDLED_DATA, *other_sources])}")
    return text, ""


def _read_flags(text: str, names: tuple[str, ...]) -> tuple[bool, ...]:
    if not {*text.split("-")} <= {*names}:
        raise CCWSIMError(f"is not made of {', '.join(names[:-1])} and {names[-1]}")
    return tuple(name in text.split("-") for name in names)


def _write_flags(flags: tuple[bool, ...], names: tuple[str, ...]) -> str:
    return "-".join(name for name, flag in zip(names, flags, strict=True) if flag)


def _write_answers(answers: Answers) -> str:
    names = "on_collision", "on_outside", "on_unknown", "facies_names"
    return json_text(tuple(answer for answer in answers if answer[0] in names))


def _write_colour(value: tuple[int, str]) -> str:
    code, colour = value
    return f"{code}-{colour.removeprefix('#')}"


def _read_colour(text: str) -> tuple[int, str]:
    match = re.fullmatch(r"(-?\d{1,18})-([0-9a-fA-F]{6})", text, re.ASCII)
    if match is None:
        raise CCWSIMError("is not a code with #rrggbb")
    return int(match[1]), f"#{match[2]}"


def _write_points(data: HardData | None) -> str:
    if data is None or data.n > bounds.MAX_LINK_DATA:
        return ""
    return json_text(data) if data.values else packed(data)


def _read_points(text: str) -> HardData:
    return from_json(text, HardData) if text.startswith("[") else unpacked(text)


def _write_compare(choice: CompareChoice) -> str:
    has_file = isinstance(choice.beside, ImageChoice) and choice.beside.upload is not None
    return json_text(replace(choice, beside="") if has_file else choice)


_TEXTS: dict[str, tuple[Callable[[Any], str], Callable[[str], Any]]] = {
    "word": (str, lambda text: text[:MAX_LETTERS]),
    "name": (str, _read_name),
    "crs": (str, _read_crs),
    "image": (str, _read_image),
    "source": (_write_source, _read_source),
    "turns": (
        lambda flags: _write_flags(flags, TURN_WORDS),
        lambda text: _read_flags(text, TURN_WORDS),
    ),
    "answers": (_write_answers, lambda text: from_json(text, DataAnswers)),
    "wells": (json_text, lambda text: from_json(text, CellsOfWells)),
    "threshold": (
        lambda value: "" if value is None else json_text(value),
        lambda text: from_json(text, float),
    ),
    "flow": (json_text, lambda text: from_json(text, FlowChoice)),
    "compare": (_write_compare, lambda text: from_json(text, CompareChoice)),
    "sweep": (json_text, lambda text: from_json(text, SweepChoice)),
    "colour": (_write_colour, _read_colour),
    "points": (_write_points, _read_points),
    "guides": (json_text, lambda text: from_json(text, GuideChoice)),
}
"""Functions that write and read a value, by kind of field."""


def _parameter(name: str, default: Any) -> FieldSpec:
    kind, words = "whole", None
    if isinstance(default, bool):
        kind, words = "choice", YES_NO
    elif isinstance(default, float):
        kind = "number"
    elif isinstance(default, str):
        kind = "word"
    key, (low, high) = link_name(name), bounds.PARAMETER_BOUNDS.get(name, (0, 0))
    return FieldSpec(
        key, "parameters", (name,), kind, low=low, high=high, words=words, option=f"--{key}"
    )


_MAPS = {name.replace(" ", "-"): name for name in get_args(EMap)}
_SIDE, _MAX_LENGTH, _SEED = bounds.MAX_GRID_SIDE_OFFERED, bounds.MAX_FLOAT, bounds.MAX_SEED
_SIDES = ("nx", "ny", "nz")
_LENGTHS = {"kind": "lengths", "high": _MAX_LENGTH, "project_high": _MAX_LENGTH}
FIELDS = (
    FieldSpec("ti", "image", ("bundled",), "image"),
    FieldSpec("turn", "image", ("flip_ew", "flip_ns", "transpose"), "turns"),
    FieldSpec("name", "image", ("names",), "name", many=True),
    FieldSpec("colour", "image", ("colours",), "colour", many=True),
    FieldSpec("data", "data", ("source", "bundled"), "source"),
    FieldSpec("data-n", "data", ("n_sampled",), "count", low=1, high=bounds.MAX_SAMPLED),
    FieldSpec("data-seed", "data", ("seed_sampled",), "count", high=_SEED),
    FieldSpec("points", "data", ("placed",), "points"),
    FieldSpec("answers", "data", ("answers",), "answers"),
    FieldSpec("wells", "data", ("wells",), "wells"),
    FieldSpec("guides", "guides", ("guides",), "guides"),
    FieldSpec("grid", "grid", _SIDES, "sizes", low=1, high=_SIDE, option="--grid"),
    FieldSpec(
        "cell", "grid", ("cell_size",), low=bounds.MIN_FLOAT, option="--cell-size", **_LENGTHS
    ),
    FieldSpec("origin", "grid", ("origin",), low=-_MAX_LENGTH, option="--origin", **_LENGTHS),
    FieldSpec("crs", "grid", ("crs",), "crs", option="--crs"),
    *(_parameter(field.name, field.default) for field in fields(Parameters)),
    FieldSpec(
        "realizations",
        "study",
        ("n_realizations",),
        "count",
        low=1,
        high=bounds.MAX_REALIZATIONS,
        project_high=bounds.MAX_REALIZATIONS_OF_PROJECT,
    ),
    FieldSpec("seed", "study", ("seed",), "count", high=_SEED),
    FieldSpec(
        "show", "shown", ("realization",), "count", high=bounds.MAX_REALIZATIONS - 1, first=1
    ),
    FieldSpec("facies", "shown", ("facies",), "count", high=bounds.MAX_FACIES - 1),
    FieldSpec("map", "shown", ("e_type",), "choice", words=_MAPS),
    FieldSpec("threshold", "shown", ("threshold",), "threshold"),
    FieldSpec("flow", "shown", ("flow",), "flow"),
    FieldSpec("compare", "shown", ("compare",), "compare"),
    FieldSpec("sweep", "shown", ("sweep",), "sweep"),
)


def fields_of(part: str) -> tuple[FieldSpec, ...]:
    """Return the rows of the table for a part of a study."""
    return tuple(field for field in FIELDS if field.part == part)
