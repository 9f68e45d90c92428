"""The training image prepared for the search: turned to each orientation of the path."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.parameters import Parameters
from ccwsim.stages.conditioning import MOST_DATA, legal_splits
from ccwsim.stages.mending import rare_counts
from ccwsim.stages.path import to_path_frame
from ccwsim.stages.pyramid import Pyramid, build_pyramid
from ccwsim.stages.similarity import overlap_energies, score_type
from ccwsim.study import Study
from ccwsim.training_image import TrainingImage


class TurnedImage(NamedTuple):
    """A training image in one orientation of the path, prepared for the search.

    Attributes
    ----------
    pyramid : Pyramid
    splits : ndarray of int64, shape (n_splits,)
        Into how many parts, along each axis, a tile may be split; the first is 1.
    energies : ndarray, shape (n_splits, 4, ny_places, nx_places)
        ΣA² by split, shape of the overlap and place; see `overlap_energies`.
    """

    pyramid: Pyramid
    splits: NDArray[np.int64]
    energies: NDArray[np.signedinteger]


def turn_image(
    training_image: TrainingImage,
    parameters: Parameters,
    orientation: int,
    template_size: int,
    may_split: bool,
) -> TurnedImage:
    """Return the training image as the search needs it in one orientation of the path."""
    level = parameters.level
    one_plane = parameters.similarity == "ssd" and training_image.n_facies <= 2
    pyramid = build_pyramid(
        to_path_frame(training_image.indices, orientation),
        level,
        1 if one_plane else training_image.n_facies,
    )
    template = template_size >> level
    overlap = parameters.overlap_size >> level
    kind = score_type(level, template_size, parameters.overlap_size)
    splits = legal_splits(template_size, parameters.overlap_size) if may_split else [1]
    places = tuple(length - template + 1 for length in pyramid.sums.shape[1:])
    energies = np.empty((len(splits), 4, *places), kind)
    for k, parts in enumerate(splits):
        size = (template_size - parameters.overlap_size) // parts + parameters.overlap_size
        own = overlap_energies(pyramid.sums, size >> level, overlap, kind)
        energies[k] = own[:, : places[0], : places[1]]
    if parameters.similarity == "correlation":
        energies[:] = 0
    return TurnedImage(pyramid, np.array(splits), energies)


class PreparedImage:
    """The training image as all realizations of a study share it; parts are made when needed."""

    def __init__(self, study: Study) -> None:
        self._study = study
        self._turned: dict[tuple[int, int], TurnedImage] = {}

    def turned(self, orientation: int, template_size: int) -> TurnedImage:
        """Return the image turned for one orientation; two threads may both make the same."""
        key = orientation, template_size
        if key not in self._turned:
            self._turned[key] = turn_image(
                self._study.training_image,
                self._study.parameters,
                orientation,
                template_size,
                may_split=self._study.hard_data.n > MOST_DATA,
            )
        return self._turned[key]

    @cached_property
    def rare_counts(self) -> NDArray[np.float64]:
        """What `mend` takes for a scar, by facies index."""
        return rare_counts(self._study.training_image.indices)
