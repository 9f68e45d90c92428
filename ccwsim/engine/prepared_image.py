"""The training image prepared for the search: turned to each orientation of the path."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.stages.bits import to_bits
from ccwsim.engine.stages.conditioning import MAX_DATA, legal_splits
from ccwsim.engine.stages.path import to_path
from ccwsim.engine.stages.pyramid import Pyramid, build_pyramid
from ccwsim.engine.stages.resimulation import isolated_datum_thresholds
from ccwsim.engine.stages.similarity import overlap_energies, score_type
from ccwsim.engine.stages.upgrid import upgrid
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.system.workers import check_stop


class OrientedImage(NamedTuple):
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


def orient_image(
    image: NDArray[np.uint8],
    n_facies: int,
    parameters: Parameters,
    template_size: int,
    may_split: bool,
) -> OrientedImage:
    """Return an image, in the path frame and at the scale of the search, as the search needs it."""
    p, scale = parameters, parameters.scale
    level = p.level - scale
    one_plane = p.similarity == "ssd" and n_facies <= 2
    check_stop()  # each step takes a second for an image of many million cells
    pyramid = build_pyramid(image, level, 1 if one_plane else n_facies)
    if level and not p.exact_data:
        blocks = np.broadcast_to(upgrid(pyramid.image, 2**level), pyramid.phases.shape)
        pyramid = pyramid._replace(phases=np.ascontiguousarray(blocks))
    template, overlap = template_size >> scale, p.overlap_size >> scale
    kind = score_type(level, template, overlap)
    splits = legal_splits(template, overlap) if may_split else [1]
    places = tuple(length - (template >> level) + 1 for length in pyramid.sums.shape[1:])
    energies = np.empty((len(splits), 4, *places), kind)
    for k, parts in enumerate(splits):
        check_stop()
        size = (template - overlap) // parts + overlap
        own = overlap_energies(pyramid.sums, size >> level, overlap >> level, kind)
        energies[k] = own[:, : places[0], : places[1]]
    if p.similarity == "correlation":
        energies[:] = 0
    return OrientedImage(pyramid, np.array(splits), energies)


class PreparedImage:
    """The training image as all realizations of a study share it; parts are made when needed.

    Two threads may both make the same part.
    """

    def __init__(self, study: Study) -> None:
        self._study = study
        self._turned: dict[tuple[int, int], OrientedImage] = {}
        self._scaled: dict[tuple[int, int], NDArray[np.uint8]] = {}
        self._bits: dict[tuple[int, int], NDArray[np.uint64]] = {}

    def oriented(self, orientation: int, template_size: int) -> OrientedImage:
        """Return the image turned for one orientation, at the scale that is searched."""
        key = orientation, template_size
        if key not in self._turned:
            p, data = self._study.parameters, self._study.hard_data
            self._turned[key] = orient_image(
                self.scaled(orientation, p.scale),
                self._study.training_image.n_facies,
                p,
                template_size,
                may_split=p.exact_data and data.n > MAX_DATA,
            )
        return self._turned[key]

    def scaled(self, orientation: int = 0, scale: int = 0) -> NDArray[np.uint8]:
        """Return the image turned for one orientation and up-gridded `scale` times."""
        key = orientation, scale
        if key not in self._scaled:
            if scale == 0:
                oriented = to_path(self._study.training_image.indices, orientation)
                self._scaled[key] = np.array(oriented, order="C")  # writable: kernels know one type
            else:
                self._scaled[key] = upgrid(self.scaled(orientation, scale - 1), 2)
        return self._scaled[key]

    def bits(self, orientation: int = 0, scale: int = 0) -> NDArray[np.uint64]:
        """Return the same as `to_bits` gives it."""
        key = orientation, scale
        if key not in self._bits:
            self._bits[key] = to_bits(self.scaled(orientation, scale))
        return self._bits[key]

    @cached_property
    def isolated_datum_thresholds(self) -> NDArray[np.float64]:
        """What `mend` takes for a scar, by facies index."""
        return isolated_datum_thresholds(self._study.training_image.indices)
