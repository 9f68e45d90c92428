"""A study as the part of an address behind the question mark: only what is not as usual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from typing import Any

import numpy as np

from ccwsim.io.data_file import printable
from ccwsim.model.choices import Choices, DataChoice, ImageChoice, Shown
from ccwsim.model.parameters import Parameters
from ccwsim.sharing.link_parts import data_of, grid_of, image_of, parameters_of
from ccwsim.sharing.link_values import Reading, Words
from ccwsim.sharing.packed_data import MAX_DATA, packed

OWN = "own"
"""Stands for an image or data of the sender's own, which no address can carry."""
TURNS = {"ew": "flip_ew", "ns": "flip_ns", "transpose": "transpose"}
MAPS = {"most-likely": "most likely", "entropy": "entropy"}
SETTLED = {"outside": "on_outside", "unknown": "on_unknown"}


def short_name(name: str) -> str:
    """Return what a parameter is called in an address and on the command line.

    Examples
    --------
    >>> [short_name(name) for name in ("template_size", "wavelet_level", "n_candidates")]
    ['template', 'level', 'candidates']
    """
    short = name.removesuffix("_size").removeprefix("wavelet_").removeprefix("n_")
    return short.replace("_", "-")


PARAMETERS = {short_name(f.name): f.name for f in fields(Parameters)}
KEYS = (
    "ti", "turn", "name", "colour", "data", "data-n", "data-seed", "points", *SETTLED, "grid",
    "cell", "origin", *PARAMETERS, "realizations", "seed", "show", "facies", "map",
)  # fmt: skip
"""All names that a study may have in an address."""


def link_of(choices: Choices, shown: Shown | None = None) -> dict[str, list[str]]:
    """Return a study as names and values of an address; what is as usual is left out.

    Examples
    --------
    >>> link_of(Choices(image=ImageChoice("dunes"), seed=7))
    {'ti': ['dunes'], 'seed': ['7']}
    """
    usual, words, shown = Choices(), Words(), shown or Shown()
    _write_image(words, choices.image, usual.image)
    _write_data(words, choices.data, usual.data)
    grid = choices.grid
    words.put("grid", f"{grid.nx}x{grid.ny}", grid.shape != usual.grid.shape)
    for name, own, its in (
        ("cell", grid.cell_size, usual.grid.cell_size),
        ("origin", grid.origin, usual.grid.origin),
    ):
        words.put(name, "x".join(map(number, own)), own != its)
    for short, name in PARAMETERS.items():
        own = getattr(choices.parameters, name)
        words.put(short, said(own), own != getattr(usual.parameters, name))
    words.put(
        "realizations", choices.n_realizations, choices.n_realizations != usual.n_realizations
    )
    words.put("seed", choices.seed, choices.seed != usual.seed)
    words.put("show", shown.realization + 1, shown.realization != 0)
    words.put("facies", shown.facies, shown.facies != 1)
    words.put("map", shown.e_type.replace(" ", "-"), shown.e_type != "probability")
    return words.found


def number(value: float) -> str:
    """Return a number as it can be read back exactly, without powers of ten.

    Examples
    --------
    >>> number(5.0), number(1e-7), number(-0.1)
    ('5', '0.0000001', '-0.1')
    """
    return np.format_float_positional(value, trim="-")


def said(value: object) -> str:
    """Return the value of a parameter as a word.

    Examples
    --------
    >>> said(True), said(0.5), said(48)
    ('yes', '0.5', '48')
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    return number(value) if isinstance(value, float) else str(value)


def left_out(choices: Choices) -> tuple[str, ...]:
    """Return what of a study an address cannot carry, in sentences.

    Examples
    --------
    >>> left_out(Choices())
    ()
    """
    found = []
    if choices.image.upload is not None:
        found.append(f"the training image {choices.image.upload.name}")
    data = choices.data
    if data.source == "file" and data.upload is not None:
        found.append(f"the hard data {data.upload.name}")
    if data.source == "placed" and data.placed is not None and data.placed.n > MAX_DATA:
        found.append(f"the {data.placed.n} data placed by hand (it can carry {MAX_DATA})")
    return tuple(found)


def read_link(query: Mapping[str, Sequence[str]]) -> tuple[Choices, Shown, tuple[str, ...]]:
    """Return the study of an address, and what of it could not be taken, in sentences.

    Names that are none of ours are passed over; one that is nearly ours is asked after.

    Examples
    --------
    >>> choices, shown, notes = read_link({"ti": ["dunes"], "seed": ["x"], "show": ["3"]})
    >>> choices.image.bundled, choices.seed, shown.realization
    ('dunes', 0, 2)
    >>> notes
    ('seed = x is no whole number from 0 to 2147483647: the usual 0 is taken.',)
    """
    reading, usual = Reading(query), Choices()
    image = image_of(reading, usual.image)
    parameters = parameters_of(reading, PARAMETERS)
    data = data_of(reading, usual.data, SETTLED)
    choices = Choices(
        image, data, grid_of(reading, usual.grid), parameters,
        reading.whole("realizations", usual.n_realizations, 1, 1000),
        reading.whole("seed", usual.seed, 0, 2**31 - 1),
    )  # fmt: skip
    e_type = reading.one_of("map", "probability", MAPS)
    shown = Shown(
        reading.whole("show", 1, 1, 1000) - 1, reading.whole("facies", 1, 0, 253), e_type  # type: ignore[arg-type]
    )  # fmt: skip
    for name in query:
        if name not in KEYS and meant(name):
            reading.notes.append(
                f"There is no setting {printable(name, 40)}: {meant(name)} may be meant."
            )
    return choices, shown, tuple(reading.notes)


def meant(name: str) -> str:
    """Return which of our names a name is or nearly is, or an empty text.

    Examples
    --------
    >>> meant("templte"), meant("utm_source")
    ('template', '')
    """
    close = get_close_matches(name, KEYS, n=1, cutoff=0.75)
    return close[0] if close else ""


def _write_image(words: Words, image: ImageChoice, usual: ImageChoice) -> None:
    if image.upload is not None:
        words.put("ti", OWN)
        return
    words.put("ti", image.bundled, image.bundled != usual.bundled)
    turns = [short for short, name in TURNS.items() if getattr(image, name)]
    words.put("turn", "-".join(turns), bool(turns))
    words.put_all("name", image.names)
    words.put_all("colour", [f"{code}-{colour.lstrip('#')}" for code, colour in image.colours])


def _write_data(words: Words, data: DataChoice, usual: DataChoice) -> None:
    source: Any = data.source
    if source == "bundled":
        words.put("data", data.bundled, data.bundled != usual.bundled)
    elif source == "sampled":
        words.put("data", source)
        words.put("data-n", data.n_sampled, data.n_sampled != usual.n_sampled)
        words.put("data-seed", data.seed_sampled, data.seed_sampled != usual.seed_sampled)
    elif source == "placed" and data.placed is not None and data.placed.n <= MAX_DATA:
        words.put("data", source)
        words.put("points", packed(data.placed), data.placed.n > 0)
    else:
        words.put("data", OWN if source in ("file", "placed") else "none")
        return
    answers = dict(data.answers)
    for short, name in SETTLED.items():
        words.put(short, answers.get(name), name in answers)
