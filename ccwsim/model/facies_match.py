"""Match the facies of data, probabilities or another image with those of a training image."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ccwsim.model.errors import warn
from ccwsim.model.training_image import TrainingImage

# facies of a training image, by code or name, for other codes or names; also as pairs
FaciesNames = Mapping[Any, str | int] | Iterable[tuple[Any, str | int]]
WHOLE_NUMBER = re.compile(r"([+-]?\d{1,18})(\.0*)?")  # the integer, which int64 holds, is a group


class FaciesMatch(NamedTuple):
    """Codes of facies in a training image by the label, a name or a code as text, of other facies.

    `codes` has all labels: first by what the user has stated, then by an equal name or code. Facies
    that the image lacks keep their code or name. `open_labels` have a code of the image that may
    mean another facies. `likeliest` has, by proportions, all labels that are not matched for sure.
    """

    image: TrainingImage
    codes: dict[str, int | str]
    open_labels: list[str]
    likeliest: dict[str, int]

    def warn(self, what: str) -> None:
        """Warn if facies are matched by a number that may mean another facies."""
        if self.open_labels:
            used = {label: self.codes[label] for label in self.open_labels}
            message = (
                f"{what}: facies are matched by number ({describe_codes(used, self.image)}), but "
                "numbers of colours or classes are no codes; by proportions, "
                f"{describe_codes(self.likeliest, self.image)} is likeliest. State the facies of "
                "the training image for each code: facies={code: code or name}, of a file "
                "facies_names=; or read the image with numbering='codes' if its numbers are codes"
            )
            warn(message)


def match_facies(
    labels: Iterable[str | int],
    image: TrainingImage,
    *,
    numbering: str = "codes",
    facies: FaciesNames | None = None,
    shares: Sequence[float],
) -> FaciesMatch:
    """Match facies with those of a training image: by name, by code, or as the likeliest.

    Parameters
    ----------
    labels : iterable of str or int
        Names or codes of the facies, each once.
    numbering : str
        What the codes are, as in `TrainingImage`, or `TrainingImage.numbering_of_data` of their
        image. Numbers of colours differ from picture to picture.
    facies : mapping or pairs, optional
        Facies of the image, by code or name, that the user states for labels.
    shares : sequence of float
        The proportion of each label.

    Examples
    --------
    >>> picture = TrainingImage([[0, 0, 0, 1]], numbering="colours")
    >>> match = match_facies([0, 1], picture, shares=[0.3, 0.7])
    >>> match.open_labels, match.likeliest
    (['0', '1'], {'0': 1, '1': 0})
    >>> image = TrainingImage([[0, 1]], facies_names=("sand", "mud"))
    >>> match_facies(["Sand"], image, shares=[1.0]).codes
    {'Sand': 0}
    """
    share_of = dict(zip(map(facies_label, labels), shares, strict=True))
    image_codes, certain = image.codes.tolist(), image.codes_by_name
    if numbering == image.numbering_of_data or numbering == image.numbering == "values":
        certain = {str(code): code for code in image_codes} | certain
    for label, to in dict(facies or {}).items():
        code = image_codes[image.index_of(to)] if isinstance(to, str) else to
        certain = certain | {facies_label(label).casefold(): code}
    codes = {label: certain.get(label.casefold(), code_or_name(label)) for label in share_of}
    others = [label for label in share_of if label.casefold() not in certain]
    likeliest = dict[str, int]()
    if others:
        from scipy.optimize import linear_sum_assignment  # slow to import

        costs = np.abs(np.array([share_of[label] for label in others])[:, None] - image.proportions)
        sure = [code for label, code in codes.items() if label not in others]
        costs[:, np.isin(image_codes, sure)] += 4  # another facies, if there is one
        nearest = costs.argmin(axis=1)
        rows, columns = linear_sum_assignment(costs)
        nearest[rows] = columns
        likeliest = dict(zip(others, image.codes[nearest].tolist(), strict=True))
    open_labels = [label for label in others if codes[label] in image_codes]
    return FaciesMatch(image, codes, open_labels, likeliest)


def describe_codes(codes: Mapping[str, int | str], image: TrainingImage) -> str:
    """Return which facies of an image each label is, as "0 → mud, 1 → sand"."""
    names = dict[Any, str](image.names_by_code)
    return ", ".join(f"{label} → {names.get(code, code)}" for label, code in codes.items())


def facies_label(facies: Any) -> str:
    """Return a name of a facies without spaces around it, or a code without decimals, as text.

    Examples
    --------
    >>> facies_label(" Sand "), facies_label(1.0)
    ('Sand', '1')
    """
    return str(code_or_name(facies))


def code_or_name(facies: Any) -> int | str:
    """Return a facies as a code or, if it is no whole number, as a name without spaces around."""
    text = str(facies).strip()
    number = WHOLE_NUMBER.fullmatch(text)
    return int(number[1]) if number else text
