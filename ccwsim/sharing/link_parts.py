"""The parts of a study as an address has them: image, data, grid and parameters."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, replace

from ccwsim import datasets
from ccwsim.io.data_file import printable
from ccwsim.model.choices import DataChoice, ImageChoice
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.sharing.link_values import MAX_LETTERS, Reading
from ccwsim.sharing.packed_data import packed, unpacked

LARGEST_GRID = 10_000
MAX_SAMPLED = 100_000
SIZES = ("method", "wavelet_level", "template_size", "overlap_size")
"""Parameters that are legal or not together."""


def image_of(reading: Reading, usual: ImageChoice) -> ImageChoice:
    """Return the training image."""
    name = reading.text("ti")
    if name == "own":
        reading.notes.append(
            "This link was made with a training image of the sender's own, which an address "
            f"cannot carry: {usual.bundled} is taken. Ask for the project file."
        )
        return usual
    if name is not None and name not in datasets.names():
        there = ", ".join(datasets.names())
        reading.refuse("ti", f"is no bundled training image ({there})", f"{usual.bundled} is taken")
        return usual
    turns = _turns(reading)
    names = tuple(n[:MAX_LETTERS].encode("utf-8", "replace").decode() for n in reading.all("name"))
    n_facies = datasets.load(name or usual.bundled).n_facies
    if names and (len(names) != n_facies or not all(n.strip() for n in names)):
        reading.notes.append(f"{len(names)} names for {n_facies} facies: the usual ones are taken.")
        names = ()
    return ImageChoice(
        name or usual.bundled, names=names, colours=_colours(reading),
        flip_ew="ew" in turns, flip_ns="ns" in turns, transpose="transpose" in turns,
    )  # fmt: skip


def _turns(reading: Reading) -> set[str]:
    turns = set((reading.text("turn") or "").split("-")) - {""}
    if turns <= {"ew", "ns", "transpose"}:
        return turns
    reading.refuse("turn", "is not made of ew, ns and transpose", "the image is not turned")
    return set()


def _colours(reading: Reading) -> tuple[tuple[int, str], ...]:
    found: dict[int, str] = {}
    for text in reading.all("colour"):
        match = re.fullmatch(r"(-?\d{1,18})-([0-9a-fA-F]{6})", text, re.ASCII)
        if match:
            found[int(match[1])] = f"#{match[2]}"
        else:
            reading.notes.append(
                f"colour = {printable(text, MAX_LETTERS)} is no code and #rrggbb: left out."
            )
    return tuple(sorted(found.items()))


def data_of(reading: Reading, usual: DataChoice, settled: Mapping[str, str]) -> DataChoice:
    """Return the hard data."""
    name = reading.text("data")
    answers = tuple(sorted(
        (own, "drop") for short, own in settled.items()
        if reading.one_of(short, "", {"drop": "drop"})
    ))  # fmt: skip
    usual = replace(usual, answers=answers)
    if name == "own":
        reading.notes.append(
            "This link was made with hard data of the sender's own, which an address cannot "
            "carry: there are none. Ask for the project file."
        )
    if name in ("own", "none"):
        return DataChoice()
    if name == "sampled":
        n = reading.whole("data-n", usual.n_sampled, 1, MAX_SAMPLED)
        seed = reading.whole("data-seed", usual.seed_sampled, 0, 2**31 - 1)
        return DataChoice("sampled", answers=answers, n_sampled=n, seed_sampled=seed)
    if name == "placed":
        return _placed(reading, answers)
    if name is None or name in datasets.hard_data_names():
        return replace(usual, bundled=name or usual.bundled)
    there = ", ".join([*datasets.hard_data_names(), "sampled", "placed", "none"])
    reading.refuse("data", f"is none of {there}", "there are none")
    return DataChoice()


def _placed(reading: Reading, answers: tuple[tuple[str, str], ...]) -> DataChoice:
    try:
        data = unpacked(reading.text("points") or packed(HardData()))
        return DataChoice("placed", answers=answers, placed=data)
    except CCWSIMError as error:
        reading.notes.append(f"{error}: there are none.")
        return DataChoice()


def grid_of(reading: Reading, usual: Grid) -> Grid:
    """Return the simulation grid."""
    nx, ny = reading.pair("grid", (usual.nx, usual.ny), r"[1-9]\d{0,4}", 1, LARGEST_GRID)
    usual = replace(usual, nx=int(nx), ny=int(ny))
    figure = r"-?\d{1,400}(?:\.\d{1,400})?"
    cell = reading.pair("cell", usual.cell_size, figure, 5e-324, 1.8e308)
    origin = reading.pair("origin", usual.origin, figure, -1.8e308, 1.8e308)
    return replace(usual, cell_size=cell, origin=origin)


def parameters_of(reading: Reading, names: Mapping[str, str]) -> Parameters:
    """Return the parameters; sizes that do not go together are left as usual together."""
    given = {own: _parameter(reading, short, own) for short, own in names.items()}
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
            reading.notes.append(f"{error}. The usual is taken: {usual}.")
    return taken


def _parameter(reading: Reading, short: str, own: str) -> object:
    text = reading.text(short)
    if text is None:
        return None
    usual = next(f.default for f in fields(Parameters) if f.name == own)
    if isinstance(usual, bool):
        return reading.one_of(short, "yes" if usual else "no", {"yes": "yes", "no": "no"}) == "yes"
    if isinstance(usual, str):
        return printable(text, MAX_LETTERS)
    kind, figure = (int, r"-?\d{1,9}") if isinstance(usual, int) else (
        float, r"\d{1,9}(?:\.\d{1,400})?")  # fmt: skip
    if re.fullmatch(figure, text, re.ASCII):
        return kind(text)
    reading.refuse(short, "is no number", f"the usual {usual} is taken")
    return None
