"""Names and values of an address, put there and read with words for what cannot be taken."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

from ccwsim import datasets
from ccwsim.choices import DataChoice, ImageChoice
from ccwsim.errors import CCWSIMError
from ccwsim.grid import Grid
from ccwsim.hard_data import HardData
from ccwsim.parameters import Parameters
from ccwsim.sharing.packed_data import packed, unpacked

LARGEST_GRID = 10_000
MOST_SAMPLED = 100_000
MOST_LETTERS = 40
"""Of a facies' name, and of a bad value that is said again."""
SIZES = ("method", "wavelet_level", "template_size", "overlap_size")
"""Parameters that are legal or not together."""


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

    def refuse(self, name: str, reason: str, taken: str) -> None:
        """Note a value that cannot be taken."""
        value = (self.text(name) or "")[:MOST_LETTERS]
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

    def image(self, usual: ImageChoice) -> ImageChoice:
        """Return the training image."""
        name = self.text("ti")
        if name == "own":
            self.notes.append(
                "This link was made with a training image of the sender's own, which an address "
                f"cannot carry: {usual.bundled} is taken. Ask for the project file."
            )
            return usual
        if name is not None and name not in datasets.names():
            there = ", ".join(datasets.names())
            self.refuse(
                "ti", f"is no bundled training image ({there})", f"{usual.bundled} is taken"
            )
            return usual
        turns = self._turns()
        names = tuple(n[:MOST_LETTERS] for n in self._query.get("name", ()))
        n_facies = datasets.load(name or usual.bundled).n_facies
        if names and (len(names) != n_facies or not all(n.strip() for n in names)):
            self.notes.append(
                f"{len(names)} names for {n_facies} facies: the usual ones are taken."
            )
            names = ()
        return ImageChoice(
            name or usual.bundled, names=names, colours=self._colours(),
            flip_ew="ew" in turns, flip_ns="ns" in turns, transpose="transpose" in turns,
        )  # fmt: skip

    def _turns(self) -> set[str]:
        turns = set((self.text("turn") or "").split("-")) - {""}
        if turns <= {"ew", "ns", "transpose"}:
            return turns
        self.refuse("turn", "is not made of ew, ns and transpose", "the image is not turned")
        return set()

    def _colours(self) -> tuple[tuple[int, str], ...]:
        found: dict[int, str] = {}
        for text in self._query.get("colour", ()):
            match = re.fullmatch(r"(-?\d{1,18})-([0-9a-fA-F]{6})", text, re.ASCII)
            if match:
                found[int(match[1])] = f"#{match[2]}"
            else:
                self.notes.append(
                    f"colour = {text[:MOST_LETTERS]} is no code and #rrggbb: left out."
                )
        return tuple(sorted(found.items()))

    def data(self, usual: DataChoice, settled: Mapping[str, str]) -> DataChoice:
        """Return the hard data."""
        name = self.text("data")
        answers = tuple(sorted(
            (own, "drop") for short, own in settled.items()
            if self.one_of(short, "", {"drop": "drop"})
        ))  # fmt: skip
        usual = replace(usual, answers=answers)
        if name == "own":
            self.notes.append(
                "This link was made with hard data of the sender's own, which an address cannot "
                "carry: there are none. Ask for the project file."
            )
        if name in ("own", "none"):
            return DataChoice()
        if name == "sampled":
            n = self.whole("data-n", usual.n_sampled, 1, MOST_SAMPLED)
            seed = self.whole("data-seed", usual.seed_sampled, 0, 2**31 - 1)
            return DataChoice("sampled", answers=answers, n_sampled=n, seed_sampled=seed)
        if name == "placed":
            return self._placed(answers)
        if name is None or name in datasets.hard_data_names():
            return replace(usual, bundled=name or usual.bundled)
        there = ", ".join([*datasets.hard_data_names(), "sampled", "placed", "none"])
        self.refuse("data", f"is none of {there}", "there are none")
        return DataChoice()

    def _placed(self, answers: tuple[tuple[str, str], ...]) -> DataChoice:
        try:
            data = unpacked(self.text("points") or packed(HardData()))
            return DataChoice("placed", answers=answers, placed=data)
        except CCWSIMError as error:
            self.notes.append(f"{error}: there are none.")
            return DataChoice()

    def grid(self, usual: Grid) -> Grid:
        """Return the simulation grid."""
        nx, ny = self._pair("grid", (usual.nx, usual.ny), r"[1-9]\d{0,4}", 1, LARGEST_GRID)
        usual = replace(usual, nx=int(nx), ny=int(ny))
        figure = r"-?\d{1,400}(?:\.\d{1,400})?"
        cell = self._pair("cell", usual.cell_size, figure, 5e-324, 1.8e308)
        origin = self._pair("origin", usual.origin, figure, -1.8e308, 1.8e308)
        return replace(usual, cell_size=cell, origin=origin)

    def _pair(
        self, name: str, usual: tuple[float, float], figure: str, low: float, high: float
    ) -> tuple[float, float]:
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

    def parameters(self, names: Mapping[str, str]) -> Parameters:
        """Return the parameters; sizes that do not go together are left as usual together."""
        given = {own: self._parameter(short, own) for short, own in names.items()}
        given = {own: value for own, value in given.items() if value is not None}
        sizes = {own: value for own, value in given.items() if own in SIZES}
        parts = [sizes, *({own: value} for own, value in given.items() if own not in SIZES)]
        taken = Parameters()
        for part in parts:
            try:
                taken = replace(taken, **part)
            except CCWSIMError as error:
                shorts = {own: short for short, own in names.items()}
                usual = ", ".join(f"{shorts[own]} {getattr(taken, own)}" for own in part)
                self.notes.append(f"{error}. The usual is taken: {usual}.")
        return taken

    def _parameter(self, short: str, own: str) -> object:
        text = self.text(short)
        if text is None:
            return None
        usual = next(f.default for f in fields(Parameters) if f.name == own)
        if isinstance(usual, bool):
            return self.one_of(short, "yes" if usual else "no", {"yes": "yes", "no": "no"}) == "yes"
        if isinstance(usual, str):
            return text[:MOST_LETTERS]
        kind, figure = (int, r"-?\d{1,9}") if isinstance(usual, int) else (
            float, r"\d{1,9}(?:\.\d{1,400})?")  # fmt: skip
        if re.fullmatch(figure, text, re.ASCII):
            return kind(text)
        self.refuse(short, "is no number", f"the usual {usual} is taken")
        return None
