"""The training image prepared for the search, in each orientation of the path."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.stages.bits import to_bits
from ccwsim.engine.stages.conditioning import MAX_DATA, legal_splits
from ccwsim.engine.stages.path import to_path
from ccwsim.engine.stages.pyramid import Pyramid, build_pyramid, upgrid
from ccwsim.engine.stages.resimulation import isolated_datum_thresholds
from ccwsim.engine.stages.similarity import overlap_energies, score_type
from ccwsim.model.study import Study
from ccwsim.system.workers import check_stop


class OrientedImage(NamedTuple):
    """A training image in one orientation of the path, prepared for the search."""

    pyramid: Pyramid
    # shape (n_splits,): into how many parts, along each axis, a tile may be split; the first is 1
    splits: NDArray[np.int64]
    # shape (n_splits, 4, ny_places, nx_places): σA² by split, shape of the overlap and location;
    # see `overlap_energies`
    energies: NDArray[np.signedinteger]
    proportions: NDArray[np.float64]  # shape (n_facies,): of the training image


def orient_image(study: Study, image: NDArray[np.uint8], template_size: int) -> OrientedImage:
    """Return an image, in path coordinates and at the searched scale, as the search needs it."""
    p, scale, n_facies = study.parameters, study.parameters.scale, study.training_image.n_facies
    level, may_split = p.level - scale, p.exact_data and study.hard_data.n > MAX_DATA
    one_plane = p.similarity == "ssd" and n_facies <= 2
    check_stop()  # each step takes a second for an image of many million cells
    pyramid = build_pyramid(image, level, 1 if one_plane else n_facies)
    if level and not p.exact_data:
        blocks = np.broadcast_to(upgrid(pyramid.image, 2**level), pyramid.phases.shape)
        pyramid = pyramid._replace(phases=np.ascontiguousarray(blocks))
    template, overlap = template_size >> scale, p.overlap_size >> scale
    kind = score_type(level, template, overlap)
    splits = legal_splits(template, overlap) if may_split else [1]
    shape = tuple(length - (template >> level) + 1 for length in pyramid.sums.shape[1:])
    energies = np.empty((len(splits), 4, *shape), kind)
    for k, parts in enumerate(splits):
        check_stop()
        size = (template - overlap) // parts + overlap
        own = overlap_energies(pyramid.sums, size >> level, overlap >> level, kind)
        energies[k] = own[:, : shape[0], : shape[1]]
    if p.similarity == "correlation":
        energies[:] = 0
    proportions = np.array(study.training_image.proportions)  # writable: kernels know one type
    return OrientedImage(pyramid, np.array(splits), energies, proportions)


class PreparedImage:
    """The training image as all realizations of a study share it; parts are made when needed.

    Two threads may both make the same part.
    """

    def __init__(self, study: Study) -> None:
        self._study = study
        self._oriented: dict[tuple[int, int], OrientedImage] = {}
        self._scaled: dict[tuple[int, int], NDArray[np.uint8]] = {}
        self._bits: dict[tuple[int, int], NDArray[np.uint64]] = {}

    def oriented(self, orientation: int, template_size: int) -> OrientedImage:
        """Return the image in one orientation, at the scale that is searched."""
        key = orientation, template_size
        if key not in self._oriented:
            image = self.scaled(orientation, self._study.parameters.scale)
            self._oriented[key] = orient_image(self._study, image, template_size)
        return self._oriented[key]

    def scaled(self, orientation: int = 0, scale: int = 0) -> NDArray[np.uint8]:
        """Return the image in one orientation, up-gridded `scale` times."""
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
        """When a datum counts as isolated, by facies index."""
        return isolated_datum_thresholds(self._study.training_image.indices)
