"""Table of the fields of a study, for links, projects, the command line and fields of pages."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import zip_longest
from typing import Any, get_args

import numpy as np

from ccwsim import CCWSIMError, Parameters
from ccwsim.model import bounds
from ccwsim.model.arrays import check_int
from ccwsim.model.grid import fault_of_crs
from ccwsim.sharing.choices import Choices, EMap, Shown

YES_NO = {"yes": True, "no": False}
MAX_LETTERS = 40  # maximum length of a word in a link, such as the name of a method or of a facies
_PER_AXIS = "whole", "number"  # kinds of fields that may have three values if the study is a volume
_FIGURE = r"-?\d{1,400}(?:\.\d{1,400})?"
_PATTERNS = {"count": r"-?\d{1,18}", "whole": r"-?\d{1,9}", "number": r"\d{1,9}(?:\.\d{1,400})?"}


@dataclass(frozen=True)
class FieldSpec:
    """One row of the table of a study's fields.

    In volumes, fields of kind "sizes" or "lengths" have a third number, along z. Fields of kind
    "whole" or "number" may have three numbers, written as x, y, z and stored as z, y, x.
    """

    key: str  # name in a link
    part: str  # part of a study: "study", "data", "grid", "parameters" or "shown"
    fields: tuple[str, ...]  # names in `part` and in a project file; up to one per axis
    # count, sizes, lengths, choice, word or crs; whole or number, which `Parameters` checks
    kind: str
    low: float = 0  # minimum in a page, link or option
    high: float = 0  # maximum in a page, link or option
    file_high: float = 2**63 - 1  # maximum in a project file
    first: int = 0  # offset added to numbers in a link
    words: Mapping[str, Any] | None = None  # values of a choice, by the word used in a link
    option: str = ""  # command line option of a grid or parameter; `no_option` turns it off

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

    def write(self, value: Any) -> str:
        """Return a value as a text that `read` converts back."""
        if self.words:
            return next(word for word, own in self.words.items() if own == value)
        if isinstance(value, tuple):
            return "x".join(map(format_number, value[::-1] if self.kind in _PER_AXIS else value))
        if isinstance(value, int):
            return str(value + self.first)
        return format_number(value) if isinstance(value, float) else str(value)

    def read(self, text: str) -> Any:
        """Convert a text to a value; error messages begin with "is" and follow the name."""
        if self.words:
            if text not in self.words:
                raise CCWSIMError(f"is none of {', '.join(self.words)}")
            return self.words[text]
        if self.kind == "crs":
            if text and (reason := fault_of_crs(text)):
                raise CCWSIMError(reason)
            return text
        if self.kind == "word":
            return text[:MAX_LETTERS]
        if self.kind in ("sizes", "lengths"):
            return self._numbers(text)
        if self.kind in _PER_AXIS and "x" in text:
            return self._per_axis(text)
        matches = re.fullmatch(_PATTERNS[self.kind], text, re.ASCII)
        if self.kind == "count":
            value = int(text) - self.first if matches else -1
            if self.low <= value <= self.high:
                return value
            raise CCWSIMError(
                f"is not a whole number from {self.write(self.low)} to {self.write(self.high)}"
            )
        if not matches:
            raise CCWSIMError("is not a number")
        return int(text) if self.kind == "whole" else float(text)

    def check(self, value: Any, where: str) -> Any:
        """Check a value of a project file and return the value."""
        name = self.fields[0]
        if self.words:
            if value not in self.words.values():
                raise CCWSIMError(f"{where}: {name} is none of {', '.join(self.words)}")
            return value
        n = check_int(f"{where}: {name}", value, int(self.low))
        if n > self.file_high:
            raise CCWSIMError(f"{where}: {n} {name.removeprefix('n_')} are too many")
        return n

    def _numbers(self, text: str) -> tuple[Any, ...]:
        """Convert a text to two numbers, or to three for a volume."""
        figure, kind = (r"[1-9]\d{0,4}", int) if self.kind == "sizes" else (_FIGURE, float)
        if re.fullmatch(f"{figure}([xX×]{figure}){{1,2}}", text, re.ASCII):
            found = tuple(map(kind, re.split("[xX×]", text)))
            if self.low <= min(found) and max(found) <= self.high:
                return found
        raise CCWSIMError("is not two or three numbers in range, such as 640x480 or 100x100x48")

    def _per_axis(self, text: str) -> tuple[Any, ...]:
        """Convert a text with numbers along x, y, z to numbers in the order z, y, x."""
        figure = _PATTERNS[self.kind]
        if not re.fullmatch(f"{figure}(x{figure}){{2}}", text, re.ASCII):
            raise CCWSIMError("is neither one number nor three, along x, y and z")
        kind = int if self.kind == "whole" else float
        return tuple(kind(part) for part in reversed(text.split("x")))


def format_number(value: float) -> str:
    """Return a number as text without powers of ten; reading the text gives exactly this number."""
    return np.format_float_positional(value, trim="-")


def short_name(name: str) -> str:
    """Return the name of a parameter in a link and on the command line."""
    short = name.removesuffix("_size").removeprefix("wavelet_").removeprefix("n_")
    return short.replace("_", "-")


def parts_of(choices: Choices, shown: Shown) -> dict[str, Any]:
    """Return the parts of a study by the names used in `FIELDS`."""
    own = {"data": choices.data, "grid": choices.grid, "parameters": choices.parameters}
    return {"study": choices, "shown": shown, **own}


def _parameter(name: str, default: Any) -> FieldSpec:
    kind, words = "whole", None
    if isinstance(default, bool):
        kind, words = "choice", YES_NO
    elif isinstance(default, float):
        kind = "number"
    elif isinstance(default, str):
        kind = "word"
    key, (low, high) = short_name(name), bounds.PARAMETERS.get(name, (0, 0))
    row = key, "parameters", (name,), kind, low, high
    return FieldSpec(*row, words=words, option=f"--{key}")


_MAPS = {name.replace(" ", "-"): name for name in get_args(EMap)}
_SIDE, _REAL, _SEED = bounds.MAX_GRID_SIDE_OFFERED, bounds.MAX_FLOAT, bounds.MAX_SEED
FIELDS = (
    FieldSpec("data-n", "data", ("n_sampled",), "count", 1, bounds.MAX_SAMPLED),
    FieldSpec("data-seed", "data", ("seed_sampled",), "count", 0, _SEED),
    FieldSpec("grid", "grid", ("nx", "ny", "nz"), "sizes", 1, _SIDE, option="--grid"),
    FieldSpec(
        *("cell", "grid", ("cell_size",), "lengths", bounds.MIN_FLOAT, _REAL), option="--cell-size"
    ),
    FieldSpec("origin", "grid", ("origin",), "lengths", -_REAL, _REAL, option="--origin"),
    FieldSpec("crs", "grid", ("crs",), "crs", option="--crs"),
    *(_parameter(field.name, field.default) for field in fields(Parameters)),
    FieldSpec(
        *("realizations", "study", ("n_realizations",), "count", 1, bounds.MAX_REALIZATIONS),
        file_high=bounds.MAX_REALIZATIONS_OF_PROJECT,
    ),
    FieldSpec("seed", "study", ("seed",), "count", 0, _SEED),
    FieldSpec("show", "shown", ("realization",), "count", 0, bounds.MAX_REALIZATIONS - 1, first=1),
    FieldSpec("facies", "shown", ("facies",), "count", 0, bounds.MAX_FACIES - 1),
    FieldSpec("map", "shown", ("e_type",), "choice", words=_MAPS),
)


def fields_of(part: str) -> tuple[FieldSpec, ...]:
    """Return the rows of the table for a part of a study."""
    return tuple(field for field in FIELDS if field.part == part)
