"""Write a study as the query of a web address, with only the values that differ from defaults."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache
from typing import Any

from ccwsim import CCWSIMError, datasets
from ccwsim.io.data_file import printable
from ccwsim.model import MAX_LINK_DATA, MAX_LINK_LETTERS, MAX_LINK_VALUES
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice, Shown
from ccwsim.sharing.codec import FIELDS, MAX_LETTERS, FieldSpec, fields_of, parts_of

OWN = "own"  # prefix of the names that replace the sender's own images and data in a link
Own = ImageChoice | DataChoice | GuideChoice
KEYS = tuple(row.key for row in FIELDS)
"""Names of all values that an address may contain."""
KEY_OF = {ImageChoice: "ti", DataChoice: "data", GuideChoice: "guides"}
"""Name, in an address, of each part of a study that can be the user's own."""
OWN_PARTS = {"ti": "training image", "data": "hard data", "guides": "secondary information"}
BY_HAND = "set by hand or by a script"  # instead of names of files
CONSISTENT_SETTINGS = ("method", "level", "template", "overlap")
"""Settings whose values must be consistent with each other."""
LIKENESS = 0.75  # similarity, from 0 to 1, at which a known name is suggested for an unknown one
MAX_FILE_NAMES = 200  # maximum letters of the names of the user's own files in a link
MAX_NAME = round(max(map(len, KEYS)) * (2 / LIKENESS - 1))
"""Maximum length of an unknown name; longer names cannot resemble any known name."""


def link_of(choices: Choices, shown: Shown | None = None) -> dict[str, list[str]]:
    """Return the names and values by which an address describes a study, except default values."""
    present, usual = parts_of(choices, shown or Shown()), parts_of(Choices(), Shown())
    usual["data"] = usual_data(choices.image)
    named = {KEY_OF[type(choice)]: name for name, choice in own_choices(choices).items()}
    parts = {row.part for row in FIELDS if row.key in named}
    changed = [row for row in FIELDS if row.value_in(present) != row.value_in(usual)]
    query = {row.key: row.texts(row.value_in(present)) for row in changed if row.part not in parts}
    query |= {key: [name] for key, name in named.items()}
    return {key: texts for key, texts in query.items() if texts}


def link_settings(
    choices: Choices, parts: Sequence[str], shown: Shown | None = None
) -> dict[str, list[str]]:
    """Return the names and values of parts of a study, including default values."""
    present = parts_of(choices, shown or Shown())
    return {row.key: row.texts(row.value_in(present)) for row in FIELDS if row.part in parts}


def usual_data(image: ImageChoice) -> DataChoice:
    """Return the default hard data for an image: bundled data of this image, or no data."""
    usual = Choices().data
    image_name = datasets.hard_data_training_image(usual.bundled)
    return usual if image.upload is None and image.bundled == image_name else DataChoice()


def parts_left_out(choices: Choices) -> tuple[str, ...]:
    """Return a description of each part of a study that an address cannot contain."""
    own = own_choices(choices)
    return tuple(f"the {OWN_PARTS[KEY_OF[type(own[name])]]} {files_named(name)}" for name in own)


def own_choices(choices: Choices) -> dict[str, Own]:
    """Return the parts of a study whose content does not fit into an address, by name.

    A name has a digest, and the names of files.
    """
    image, data, guides = choices.image, choices.data, choices.guides
    own: list[Own] = [] if image.upload is None else [image]
    if data.source == "file" and data.upload is not None:
        own.append(data)
    if data.source == "placed" and data.placed is not None and data.placed.n > MAX_LINK_DATA:
        own.append(replace(data, upload=None, tables=None))
    if guides.files or guides.saved is not None or len(guides.points) > MAX_LINK_DATA:
        own.append(guides)
    names = [", ".join(file.name for file in part.files) or BY_HAND for part in own]
    parts = zip(own, names, strict=True)
    return {f"{OWN}-{part.digest}-{files[:MAX_FILE_NAMES]}": part for part, files in parts}


def files_named(name: str) -> str:
    """Return the names of files in a name of `own_choices`."""
    return printable(name.split("-", 2)[-1])


def missing_parts(query: Mapping[str, Sequence[str]], available: Iterable[str]) -> dict[str, str]:
    """Return the value of each part in an address that is the sender's own and not available."""
    reader = StudyReader(query)
    values = {key: query[key][-1] for key in OWN_PARTS if reader.names_own(key)}
    return {key: text for key, text in values.items() if text not in available}


def read_link(
    query: Mapping[str, Sequence[str]], available: Mapping[str, Own] | None = None
) -> tuple[Choices, Shown, tuple[str, ...]]:
    """Return the study in an address, and a sentence for each part that cannot be read.

    Unknown names are ignored; if one resembles a known name, a sentence suggests the known name.
    `available` contains the user's own images and data, by the names that `own_choices` returns.
    """
    first = first_values(query.items())
    reader = StudyReader(first, available or {})
    image = reader.own("ti") or reader.image()
    data = DataChoice() if reader.names_own("data") else usual_data(image)
    choices = Choices(
        image=image,
        data=reader.own("data") or reader.part("data", data),
        grid=reader.part("grid", Choices().grid),
        parameters=reader.part("parameters", Choices().parameters),
        guides=reader.own("guides") or reader.part("guides", Choices()).guides,
    )
    choices = reader.part("study", choices)
    shown = reader.part("shown", Shown())
    for name in first:
        if name not in KEYS and meant(name):
            reader.notes.append(
                f"There is no setting {printable(name, 40)}. Did you mean {meant(name)}?"
            )
    ignored = next((name for name in query if name not in first), None)
    if ignored is not None:
        reader.notes.append(
            f"The address is too long: {printable(ignored, 40)} and everything after it is ignored."
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


class StudyReader:
    """Reader of the parts of a study in a link or, if `project`, in a project file.

    In a link, wrong values are replaced by defaults, with a note; in a project, they are errors.
    """

    def __init__(
        self,
        query: Mapping[str, Sequence[str]],
        available: Mapping[str, Own] | None = None,
        *,
        project: bool = False,
    ) -> None:
        self._query, self._available, self._project = query, available or {}, project
        self.notes: list[str] = []

    def part(self, name: str, usual: Any) -> Any:
        """Return a part of a study, in which `usual` has the default values."""
        groups: dict[str, list[tuple[FieldSpec, Any]]] = {}
        for row in fields_of(name):
            if (value := self._value(row, usual)) is not None:
                group = "sizes" if row.key in CONSISTENT_SETTINGS else row.key
                groups.setdefault(group, []).append((row, value))
        for group in groups.values():
            values: dict[str, Any] = {}
            for row, value in group:
                values |= row.as_fields(value)
            try:
                usual = replace(usual, **values)
            except CCWSIMError as error:
                self._refuse(str(error), [row for row, _ in group], usual)
        return usual

    def image(self) -> ImageChoice:
        """Return the choice of a bundled image, with as many names as the image has facies."""
        image = self.part("image", ImageChoice())
        names, n_facies = image.names, datasets.load(image.bundled).n_facies
        if not names or (len(names) == n_facies and all(name.strip() for name in names)):
            return image
        self.notes.append(f"{len(names)} names for {n_facies} facies: the default names are used.")
        return replace(image, names=())

    def names_own(self, key: str) -> bool:
        """Return whether a value is the name of the sender's own image, data or guides."""
        text = (self._query.get(key) or [""])[-1]
        return text == OWN or text.startswith(f"{OWN}-")

    def own(self, key: str) -> Any:
        """Return the user's own part of a study; None if the link names no available part."""
        if not self.names_own(key):
            return None
        choice = self._available.get(self._query[key][-1])
        if KEY_OF.get(type(choice)) == key:
            return choice
        part = f"the {OWN_PARTS[key]} {files_named(self._query[key][-1])}"
        self.notes.append(f"This server does not have {part} of this link.")
        return None

    def _value(self, row: FieldSpec, usual: Any) -> Any:
        """Return the value of a setting, or None if the value is absent or unreadable."""
        texts = self._query.get(row.key)
        if not texts or (row.key in OWN_PARTS and self.names_own(row.key)):
            return None
        values = []
        for text in texts if row.many else texts[-1:]:
            try:
                values.append(row.read(text, project=self._project))
            except CCWSIMError as error:
                problem = f"{row.key} = {printable(text, MAX_LETTERS)} {error}"
                self._refuse(problem, [row], usual)
        return tuple(values) if row.many else next(iter(values), None)

    def _refuse(self, problem: str, rows: Sequence[FieldSpec], usual: Any) -> None:
        """Add a note on values that cannot be used, or raise an error."""
        if self._project:
            raise CCWSIMError(problem)
        usual_texts = (row.texts(row.value_in({row.part: usual})) for row in rows)
        words = [" ".join(texts) or "(none)" for texts in usual_texts]
        if len(rows) > 1:
            words = [f"{row.key} {word}" for row, word in zip(rows, words, strict=True)]
        self.notes.append(f"{problem}: the default {', '.join(words)} is used.")
