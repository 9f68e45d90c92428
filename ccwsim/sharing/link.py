"""Write a study as the query of a web address, with only the values that differ from defaults."""

import binascii
import re
from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache
from itertools import chain
from typing import Any

import numpy as np

from ccwsim import CCWSIMError, Grid, HardData, Parameters, datasets
from ccwsim.io.data_file import printable
from ccwsim.model import bounds
from ccwsim.model.arrays import check_int, check_number, digest
from ccwsim.model.bounds import MAX_LINK_DATA, MAX_LINK_LETTERS, MAX_LINK_VALUES
from ccwsim.model.errors import refused
from ccwsim.sharing.choices import (
    Choices,
    DataChoice,
    Directions,
    DrawnLines,
    Gradient,
    GuideChoice,
    ImageChoice,
    Shown,
    Stroke,
    ZoneLayers,
)
from ccwsim.sharing.codec import FIELDS, MAX_LETTERS, FieldSpec, fields_of, parts_of

MAX_PACKED_LETTERS = 8000  # maximum number of characters for hard data in an address
VOLUME = -3  # first number in packed data of a volume
OWN = "own"  # prefix of the names that replace the sender's own images and data in a link
Own = ImageChoice | DataChoice | GuideChoice
TURNS = {"ew": "flip_ew", "ns": "flip_ns", "transpose": "transpose"}
ANSWERS = {"outside": "on_outside", "unknown": "on_unknown"}
OF_IMAGE = ("ti", "turn", "name", "colour")
OF_DATA = ("data", "data-n", "data-seed", "points", *ANSWERS)
GUIDES = "guides"
KEYS = (*OF_IMAGE, *OF_DATA, GUIDES, *(row.key for row in FIELDS if row.part != "data"))
"""Names of all values that an address may contain."""
KEY_OF = {ImageChoice: "ti", DataChoice: "data", GuideChoice: GUIDES}
"""Name, in an address, of each part of a study that can be the user's own."""
TOGETHER = ("method", "wavelet_level", "template_size", "overlap_size")
"""Parameters whose values must be consistent with each other."""
LIKENESS = 0.75  # similarity, from 0 to 1, at which a known name is suggested for an unknown one
MAX_NAME = round(max(map(len, KEYS)) * (2 / LIKENESS - 1))
"""Maximum length of an unknown name; longer names cannot resemble any known name."""


def link_of(choices: Choices, shown: Shown | None = None) -> dict[str, list[str]]:
    """Return the names and values by which an address describes a study, except default values."""
    names = own_choices(choices)
    query = {**_image_query(choices.image), **_data_query(choices)}
    if word := _guides_word(choices.guides):
        query[GUIDES] = [word]
    for key, choice in names.items():
        query[KEY_OF[type(choice)]] = [key]
    own, usual = parts_of(choices, shown or Shown()), parts_of(Choices(), Shown())
    for row in FIELDS:
        if row.part != "data" and row.value_in(own) != row.value_in(usual):
            query[row.key] = [row.write(row.value_in(own))]
    return query


def usual_data(image: ImageChoice) -> DataChoice:
    """Return the default hard data for an image: bundled data of this image, or no data."""
    usual = Choices().data
    own = datasets.hard_data_training_image(usual.bundled)
    return usual if image.upload is None and image.bundled == own else DataChoice()


def left_out(choices: Choices) -> tuple[str, ...]:
    """Return a description of each part of a study that an address cannot contain."""
    found = []
    for choice in own_choices(choices).values():
        names = ", ".join(file.name for file in choice.files)
        what = "training image" if isinstance(choice, ImageChoice) else "hard data"
        if isinstance(choice, GuideChoice):
            found.append(f"the secondary information {names}".strip())
        elif choice.files:
            found.append(f"the {what} {names}")
        elif isinstance(choice, DataChoice) and choice.placed is not None:
            n = choice.placed.n
            found.append(f"the {n} data placed by hand (a link contains at most {MAX_LINK_DATA})")
    return tuple(found)


def own_choices(choices: Choices) -> dict[str, Own]:
    """Return the parts of a study, by name, whose content does not fit into an address."""
    image, data, found = choices.image, choices.data, dict[str, Own]()
    if image.upload is not None:
        found[f"{OWN}-{image.digest}"] = image
    if data.source == "file" and data.upload is not None:
        files = tuple(file.digest for file in data.files)
        found[f"{OWN}-{digest(*files, data.answers)}"] = data
    placed = data.placed if data.source == "placed" else None
    if placed is not None and placed.n > MAX_LINK_DATA:
        found[f"{OWN}-{digest(placed.digest, data.answers)}"] = replace(
            data, upload=None, tables=None
        )
    guides = choices.guides
    if guides.files or guides.saved is not None or len(guides.points) > MAX_LINK_DATA:
        found[f"{OWN}-{guides.digest}"] = guides
    return found


def read_link(
    query: Mapping[str, Sequence[str]], own: Mapping[str, Own] | None = None
) -> tuple[Choices, Shown, tuple[str, ...]]:
    """Return the study in an address, and a sentence for each part that cannot be read.

    Unknown names are ignored; if one resembles a known name, a sentence suggests the known name.
    `own` contains the user's available images and data, by the names that `own_choices` returns.
    """
    first = first_values(query.items())
    reader, usual, shown = _Reader(first, own or {}), Choices(), Shown()
    parts = parts_of(usual, shown)
    image = reader.image(usual.image)
    parameters = reader.parameters()
    data = reader.data(usual_data(image))
    grid = reader.grid(usual.grid, parts)
    numbers = reader.fields("study", parts)
    choices = Choices(image, data, grid, parameters, **numbers, guides=reader.guides())
    shown = replace(shown, **reader.fields("shown", parts))
    for name in first:
        if name not in KEYS and meant(name):
            reader.notes.append(
                f"There is no setting {printable(name, 40)}. Did you mean {meant(name)}?"
            )
    left = next((name for name in query if name not in first), None)
    if left is not None:
        reader.notes.append(
            f"The address is too long: {printable(left, 40)} and everything after it is ignored."
        )
    return choices, shown, tuple(reader.notes)


def first_values(pairs: Iterable[tuple[str, Sequence[str]]]) -> dict[str, list[str]]:
    """Return names and values up to `MAX_LINK_VALUES` values and `MAX_LINK_LETTERS` letters."""
    first: dict[str, list[str]] = {}
    n_left, letters_left = MAX_LINK_VALUES, MAX_LINK_LETTERS
    for name, values in pairs:
        n_left -= max(len(values), 1)
        if n_left >= 0:
            letters_left -= len(name) + sum(map(len, values))
        if min(n_left, letters_left) < 0:
            break
        first[name] = list(values)
    return first


def meant(name: str) -> str:
    """Return the valid name that equals or resembles a name, or an empty text."""
    return _closest(name) if len(name) <= MAX_NAME else ""


@lru_cache(maxsize=10 * MAX_LINK_VALUES)
def _closest(name: str) -> str:
    close = get_close_matches(name, KEYS, n=1, cutoff=LIKENESS)
    return close[0] if close else ""


def _image_query(image: ImageChoice) -> dict[str, list[str]]:
    if image.upload is not None:
        return {}  # `own_choices` returned this name
    turns = [short for short, name in TURNS.items() if getattr(image, name)]
    query = {
        "ti": [image.bundled] if image.bundled != ImageChoice().bundled else [],
        "turn": ["-".join(turns)] if turns else [],
        "name": list(image.names),
        "colour": [f"{code}-{colour.lstrip('#')}" for code, colour in image.colours],
    }
    return {name: values for name, values in query.items() if values}


def _data_query(choices: Choices) -> dict[str, list[str]]:
    data, usual = choices.data, usual_data(choices.image)
    source = data.source
    query: dict[str, list[str]] = {}
    if source == "bundled":
        query["data"] = [data.bundled] if data.bundled != usual.bundled else []
    elif source == "sampled":
        query["data"] = [source]
        for row in fields_of("data"):
            value = row.value_in({"data": data})
            query[row.key] = [row.write(value)] if value != row.value_in({"data": usual}) else []
    elif source == "placed" and data.placed is not None and data.placed.n <= MAX_LINK_DATA:
        query["data"] = [source]
        query["points"] = [packed(data.placed)] if data.placed.n else []
    else:
        return {"data": ["none"]}  # `own_choices` returns the names of the user's data
    answers = dict(data.answers)
    query |= {key: [answers[name]] for key, name in ANSWERS.items() if name in answers}
    return {name: values for name, values in query.items() if values}


class _Reader:
    """Reader of the parts of a study, which replaces wrong values by defaults and reports them."""

    def __init__(self, query: Mapping[str, Sequence[str]], own: Mapping[str, Own]) -> None:
        self._query, self._own = query, own
        self.notes: list[str] = []

    def text(self, name: str) -> str | None:
        """Return the last value of a name in the address."""
        values = self._query.get(name)
        return values[-1] if values else None

    def refuse(self, name: str, reason: str, taken: str) -> None:
        """Add a note on a value that cannot be used."""
        value = printable(self.text(name) or "", MAX_LETTERS)
        self.notes.append(f"{name} = {value} {reason}: {taken}.")

    def value(self, row: FieldSpec, usual: Any) -> Any:
        """Return the value of a setting, or the default if the value is absent or unreadable."""
        text = self.text(row.key)
        try:
            return usual if text is None else row.read(text)
        except CCWSIMError as error:
            self.refuse(row.key, str(error), f"the default {row.write(usual) or '(none)'} is used")
            return usual

    def fields(self, part: str, parts: Mapping[str, Any]) -> dict[str, Any]:
        """Return the settings of a part of a study, by field name."""
        found: dict[str, Any] = {}
        for row in fields_of(part):
            found |= row.as_fields(self.value(row, row.value_in(parts)))
        return found

    def grid(self, usual: Grid, parts: Mapping[str, Any]) -> Grid:
        """Return the grid; if its numbers are inconsistent, use the default world coordinates."""
        fields = self.fields("grid", parts)
        try:
            return replace(usual, **fields)
        except CCWSIMError as error:
            self.notes.append(f"{error}. The default world coordinates are used.")
            return replace(usual, **{name: fields[name] for name in ("nx", "ny", "nz")})

    def parameters(self) -> Parameters:
        """Return the parameters; if sizes are inconsistent, use the default of each size."""
        taken = Parameters()
        rows = {row.fields[0]: row for row in fields_of("parameters")}
        given = {
            name: self.value(row, getattr(taken, name))
            for name, row in rows.items()
            if self.text(row.key) is not None
        }
        sizes = {name: value for name, value in given.items() if name in TOGETHER}
        for part in (sizes, *({name: given[name]} for name in given if name not in TOGETHER)):
            try:
                taken = replace(taken, **part)
            except CCWSIMError as error:
                usual = ", ".join(f"{rows[name].key} {getattr(taken, name)}" for name in part)
                self.notes.append(f"{error}. The default is used: {usual}.")
        return taken

    def image(self, usual: ImageChoice) -> ImageChoice:
        """Return the choice of the training image."""
        name = self.text("ti")
        if isinstance(kept := self._own.get(name or ""), ImageChoice):
            return kept
        if _is_own(name):
            used = f"The bundled image {usual.bundled} is used instead"
            self._miss("training image of this link is the sender's own file", used, "image")
            return usual
        known = datasets.IMAGES
        if name is not None and name not in known:
            reason = f"is not a bundled training image ({', '.join(known)})"
            self.refuse("ti", reason, f"{usual.bundled} is used")
            return usual
        bundled = name or usual.bundled
        choice = ImageChoice(bundled, names=self._names(bundled), colours=self._colours())
        return replace(choice, **{TURNS[short]: True for short in self._turns()})

    def _miss(self, own: str, used: str, what: str) -> None:
        """Note that `own` part of the study is missing, and what is `used` instead."""
        there = f"The {own}, which is not on this server."
        self.notes.append(f"{there} {used}. Open the project file or the {what} again.")

    def _turns(self) -> set[str]:
        turns = set((self.text("turn") or "").split("-")) - {""}
        if turns <= TURNS.keys():
            return turns
        self.refuse("turn", "is not made of ew, ns and transpose", "the image is not turned")
        return set()

    def _names(self, bundled: str) -> tuple[str, ...]:
        given = self._query.get("name", ())
        names = tuple(n[:MAX_LETTERS].encode("utf-8", "replace").decode() for n in given)
        n_facies = datasets.load(bundled).n_facies
        if names and (len(names) != n_facies or not all(n.strip() for n in names)):
            self.notes.append(
                f"{len(names)} names for {n_facies} facies: the default names are used."
            )
            return ()
        return names

    def _colours(self) -> tuple[tuple[int, str], ...]:
        found: dict[int, str] = {}
        for text in self._query.get("colour", ()):
            match = re.fullmatch(r"(-?\d{1,18})-([0-9a-fA-F]{6})", text, re.ASCII)
            if match:
                found[int(match[1])] = f"#{match[2]}"
            else:
                value = printable(text, MAX_LETTERS)
                self.notes.append(
                    f"colour = {value} is not a code with #rrggbb; the value is ignored."
                )
        return tuple(sorted(found.items()))

    def guides(self) -> GuideChoice:
        """Return the choice of the secondary information."""
        name = self.text(GUIDES)
        if isinstance(kept := self._own.get(name or ""), GuideChoice):
            return kept
        if name is not None and not _is_own(name):
            try:
                return guides_of(name or "?")
            except (CCWSIMError, ValueError):
                self.refuse(GUIDES, "does not describe secondary information", "none is used")
        elif name is not None:
            own = "secondary information of this link is the sender's own"
            self._miss(own, "None is used", "maps")
        return GuideChoice()

    def data(self, usual: DataChoice) -> DataChoice:
        """Return the choice of the hard data."""
        name, bundled = self.text("data"), datasets.HARD_DATA
        answers = tuple(sorted((own, "drop") for key, own in ANSWERS.items() if self._drops(key)))
        if isinstance(kept := self._own.get(name or ""), DataChoice):
            return kept
        if _is_own(name):
            own = "hard data of this link are the sender's own file"
            self._miss(own, "No data are used", "data")
        if name == "none" or _is_own(name):
            return DataChoice()
        if name == "sampled":
            fields = self.fields("data", {"data": usual})
            return DataChoice("sampled", answers=answers, **fields)
        if name == "placed":
            return self._placed(answers)
        if name is None:
            return replace(usual, answers=answers)
        if name in bundled:
            return DataChoice("bundled", name, answers=answers)
        there = ", ".join([*bundled, "sampled", "placed", "none"])
        self.refuse("data", f"is none of {there}", "there are none")
        return DataChoice()

    def _drops(self, key: str) -> bool:
        text = self.text(key)
        if text not in (None, "drop"):
            self.refuse(key, "is not drop", "no data are left out")
        return text == "drop"

    def _placed(self, answers: tuple[tuple[str, str], ...]) -> DataChoice:
        try:
            data = unpacked(self.text("points") or packed(HardData()))
            return DataChoice("placed", answers=answers, placed=data)
        except CCWSIMError as error:
            self.notes.append(f"{error}: no data are used.")
            return DataChoice()


def _is_own(name: str | None) -> bool:
    return name == OWN or (name or "").startswith(f"{OWN}-")


def _guides_word(guides: GuideChoice) -> str:
    """Return shapes that guide a simulation as words and numbers, such as along_90_0_1."""
    given: list[tuple[Any, ...]] = []
    if isinstance(soft := guides.probabilities, Gradient):
        size = soft.start, soft.end, soft.azimuth
        given.append(("gradient", *size, guides.facies, guides.soft_weight))
    for line in soft if isinstance(soft, tuple) else ():
        brush = line.value, line.radius, line.softness, guides.facies, guides.soft_weight
        given.append(("stroke", *brush, *chain(*line.points)))
    if isinstance(guides.active, tuple):
        given.append(("polygon", *chain(*guides.active)))
    if isinstance(ways := guides.auxiliary, Directions):
        given.append(("along", ways.image, ways.grid, guides.auxiliary_weight))
    if isinstance(guides.angle, Gradient):
        given.append(("turning", guides.angle.start, guides.angle.end, guides.angle.azimuth))
    elif isinstance(lines := guides.angle, DrawnLines):
        given += [("line", lines.azimuth, *chain(*line)) for line in lines.lines or ((),)]
    elif isinstance(guides.angle, float):
        given.append(("angle", guides.angle))
    if guides.scale != 1:
        given.append(("scale", guides.scale))
    if guides.mirrored:
        given.append(("mirrored", *("xyz".index(axis) for axis in guides.mirrored)))
    given += [("image", image.bundled) for image in guides.images]
    if isinstance(zones := guides.zones, tuple):
        given += [("zone", *chain(*outline)) for outline in zones]
    elif isinstance(zones, ZoneLayers):
        given.append(("layers", *zones.first))
    elif isinstance(zones, float):
        given.append(("share", zones))
    return "~".join("_".join(map(str, words)) for words in given)


def guides_of(text: str) -> GuideChoice:
    """Return the guides of a word; raise `CCWSIMError` or `ValueError` for another text."""
    guides = GuideChoice()
    for kind, *words in (part.split("_") for part in text.split("~") if text):
        if kind == "image":
            if (name := "_".join(words)) not in datasets.IMAGES:
                raise ValueError(text)
            guides = replace(guides, images=(*guides.images, ImageChoice(name)))
            continue
        numbers = [float(word) for word in words]
        if not np.isfinite(numbers).all():
            raise ValueError(text)
        if kind in ("polygon", "zone") and 6 <= len(numbers) <= 2 * MAX_LINK_DATA:
            corners = tuple(zip(numbers[::2], numbers[1::2], strict=True))
            zones = guides.zones if isinstance(guides.zones, tuple) else ()
            drawn = {"active": corners} if kind == "polygon" else {"zones": (*zones, corners)}
            guides = replace(guides, **drawn)
        elif kind == "line" and len(numbers) % 2 and len(numbers) != 3:
            way = check_number(kind, numbers[0], -bounds.MAX_DEGREES, bounds.MAX_DEGREES)
            lines = guides.angle.lines if isinstance(guides.angle, DrawnLines) else ()
            if points := tuple(zip(numbers[1::2], numbers[2::2], strict=True)):
                lines = *lines, points
            guides = replace(guides, angle=DrawnLines(lines, way))
        elif kind == "layers" and words:
            top = bounds.MAX_GRID_SIDE_OFFERED - 1
            first = tuple(check_int(kind, int(word), 0, top) for word in words)
            guides = replace(guides, zones=ZoneLayers(first))
        elif kind == "share":
            (share,) = numbers
            guides = replace(guides, zones=check_number(kind, share, 0.0, 1.0))
        elif kind in ("gradient", "stroke"):
            first, second, third, _, weight, *xy = numbers
            if kind == "gradient" and not xy:
                ends = (check_number(kind, p, 0.0, 1.0) for p in (first, second))
                soft = Gradient(third, *ends)
            else:
                line = Stroke(first, second, third, tuple(zip(xy[::2], xy[1::2], strict=True)))
                before = guides.probabilities
                soft = *(before if isinstance(before, tuple) else ()), line
            facies = check_int(kind, int(words[3]), 0, bounds.MAX_FACIES - 1)
            weight = check_number(kind, weight, 0.0, bounds.MAX_SOFT_WEIGHT)
            guides = replace(guides, probabilities=soft, facies=facies, soft_weight=weight)
        elif kind == "along":
            image, grid, weight = numbers
            weight = check_number(kind, weight, 0.0, bounds.MAX_AUXILIARY_WEIGHT)
            guides = replace(guides, auxiliary=Directions(image, grid), auxiliary_weight=weight)
        elif kind in ("turning", "angle"):
            start, end, way = numbers if kind == "turning" else (*numbers, 0.0, 0.0)
            limits = -bounds.MAX_DEGREES, bounds.MAX_DEGREES
            ends = [check_number(kind, angle, *limits) for angle in (start, end)]
            angle = Gradient(way, *ends) if kind == "turning" else start
            guides = replace(guides, angle=angle)
        elif kind == "scale":
            (scale,) = numbers
            scale = check_number(kind, scale, bounds.MIN_SCALE, bounds.MAX_SCALE)
            guides = replace(guides, scale=scale)
        elif kind == "mirrored" and 0 < len(numbers) <= 3 and set(numbers) <= {0, 1, 2}:
            guides = replace(guides, mirrored="".join("xyz"[int(n)] for n in numbers))
        else:
            raise ValueError(text)
    return guides


def packed(data: HardData) -> str:
    """Return hard data, at most `MAX_LINK_DATA`, as a word of letters, digits, - and _.

    The word contains the number of data (after -3 for a volume); then, for each facies, the code,
    the number of data, and the steps from cell to cell along (layers,) rows and columns.
    """
    if data.n > MAX_LINK_DATA:
        raise refused("too_many_data_for_link", n=data.n, most=MAX_LINK_DATA)
    volume = data.cells.shape[1] == 3
    content = bytearray(_number(VOLUME) if volume else b"") + _number(data.n)
    for code in np.unique(data.facies).tolist():
        cells = data.cells[data.facies == code].tolist()
        content += _number(code) + _number(len(cells))
        before = [0] * data.cells.shape[1]
        for cell in cells:
            for own, last in zip(cell, before, strict=True):
                content += _number(own - last)
            before = cell
    return urlsafe_b64encode(content).decode().rstrip("=")


def unpacked(text: str) -> HardData:
    """Return the hard data of a word of `packed`; raise `CCWSIMError` for a changed word."""
    if len(text) > MAX_PACKED_LETTERS:
        raise CCWSIMError(f"{len(text)} letters are too long for hard data in a link")
    try:
        content = urlsafe_b64decode(text + "=" * (-len(text) % 4))
    except (binascii.Error, ValueError):
        raise _broken() from None
    numbers = _numbers(content)
    cells, facies, n, axes = [], [], _next(numbers), 2
    if n == VOLUME:
        n, axes = _next(numbers), 3
    for code in numbers:
        cell = (0,) * axes
        for _ in range(_next(numbers)):
            cell = tuple(place + _next(numbers) for place in cell)
            cells.append(cell)
            facies.append(code)
            if len(cells) > MAX_LINK_DATA:
                raise _broken()
    if len(cells) != n:
        raise _broken()
    return HardData(cells, facies)


def _number(value: int) -> bytes:
    """Return an integer as bytes with seven bits each, lowest first; the lowest bit is the sign."""
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
    return CCWSIMError("the hard data in the link are cut or changed; copy the entire link again")
