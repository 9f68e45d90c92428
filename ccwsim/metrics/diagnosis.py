"""What a training image is like, and which template, overlap and level suit it."""

from __future__ import annotations

from dataclasses import dataclass

from ccwsim.metrics.advice import (
    MIN_ACROSS,
    Advice,
    advise_level,
    advise_overlap,
    advise_template,
    feature_size,
    templates_that_fit,
)
from ccwsim.metrics.granulometry import THICK_SHARE, granulometry
from ccwsim.metrics.spacing import Spacing, feature_spacing
from ccwsim.metrics.stationarity import (
    PROPORTION_LIMIT,
    QUARTERS,
    VARIOGRAM_LIMIT,
    Stationarity,
    stationarity,
)
from ccwsim.model.training_image import TrainingImage

STRICT = 0.5
"""From this strength on the image repeats itself like wallpaper."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What a training image is like.

    Attributes
    ----------
    stationarity : Stationarity
    thickness : tuple of int
        By facies: the largest square, in cells, that 95 % of the facies can hold.
    spacing_ew, spacing_ns : Spacing
        Range and repetition of the features.
    feature_size : int
        How many cells a template needs to hold a feature.
    n_templates : int
        Templates of the advised size that fit without overlap.
    advice : tuple of Advice
        For wavelet_level, template_size and overlap_size, which fit each other.
    warnings : tuple of str
        What may go wrong, one sentence each.
    """

    stationarity: Stationarity
    thickness: tuple[int, ...]
    spacing_ew: Spacing
    spacing_ns: Spacing
    feature_size: int
    n_templates: int
    advice: tuple[Advice, ...]
    warnings: tuple[str, ...]

    def advised(self, parameter: str) -> int:
        """Return the advised value of a parameter."""
        return next(a.value for a in self.advice if a.parameter == parameter)


def diagnose(training_image: TrainingImage) -> Diagnosis:
    """Look at a training image and advise template size, overlap and wavelet level.

    Parameters
    ----------
    training_image : TrainingImage

    Raises
    ------
    CCWSIMError
        For an image of fewer than 8 rows or columns.

    Examples
    --------
    >>> import numpy as np
    >>> rivers = TrainingImage(np.tile(np.arange(192)[:, None] % 24 < 6, (1, 192)).astype(int))
    >>> found = diagnose(rivers)
    >>> [(a.parameter, a.value) for a in found.advice]
    [('wavelet_level', 2), ('template_size', 24), ('overlap_size', 8)]
    """
    image, n_facies = training_image.indices, training_image.n_facies
    looks = stationarity(image, n_facies)
    thickness = tuple(
        granulometry(image, k, down_to=THICK_SHARE).thickness() for k in range(n_facies)
    )
    ew, ns = (feature_spacing(image, n_facies, d) for d in ("E-W", "N-S"))
    side = min(training_image.shape)
    wanted, why = feature_size(ew, ns, side)
    level = advise_level(min(thickness), side)
    template = advise_template(wanted, why, side, level.value)
    overlap = advise_overlap(template.value, min(thickness), level.value)
    return Diagnosis(
        looks,
        thickness,
        ew,
        ns,
        wanted,
        templates_that_fit(training_image.shape, template.value),
        (level, template, overlap),
        tuple(_warnings(training_image, looks, (ew, ns), wanted)),
    )


def _warnings(
    ti: TrainingImage,
    looks: Stationarity,
    spacings: tuple[Spacing, Spacing],
    wanted: int,
) -> list[str]:
    said = []
    n_fit = templates_that_fit(ti.shape, wanted)
    if n_fit < MIN_ACROSS**2:
        said.append(
            f"Only {n_fit} templates large enough for its features ({wanted} cells) fit the image: "
            "pieces of it will be seen again and again; a larger one would give more variety."
        )
    quarter, facies = divmod(int(looks.proportion_shift.argmax()), ti.n_facies)
    if looks.proportion_shift.max() > PROPORTION_LIMIT:
        said.append(
            f"The {QUARTERS[quarter]} quarter has {looks.proportions[quarter, facies]:.0%} of "
            f"{ti.facies_names[facies]}, the whole image {ti.proportions[facies]:.0%}: it is not "
            "stationary, and realizations mix what belongs to different places."
        )
    elif looks.variogram_shift.max() > VARIOGRAM_LIMIT:
        where = QUARTERS[int(looks.variogram_shift.max(axis=(1, 2)).argmax())]
        said.append(
            f"The variogram of the {where} quarter differs from that of the whole image: sizes or "
            "directions change from place to place, and realizations mix them."
        )
    for name, spacing in zip(("east–west", "north–south"), spacings, strict=True):
        if spacing.spacing is not None and spacing.strength >= STRICT:
            said.append(
                f"The image repeats itself every {spacing.spacing} cells {name}; an overlap that "
                "is too narrow lets the rhythm slip."
            )
    return said
