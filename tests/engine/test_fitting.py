"""Test templates that do not fit between the gaps of an image, or into its scaled copies."""

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, Parameters, Secondary, TrainingImage, simulate
from ccwsim.engine.lengths import templates
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.stages.path import to_path
from ccwsim.model.study import Study
from tests.small_images import blobs

P = Parameters(12, 4, 1, template_variation=0.5)
IMAGE = blobs((61, 64), 2).astype(float)
IMAGE[::19, ::19] = np.nan
VOLUME = blobs((13, 30, 30), 2)


def fits(known: np.ndarray, side: int, block: int) -> bool:
    """Return whether a square at a corner of a block is known, also if refinement shifts it."""
    ny, nx = known.shape
    return any(
        known[max(y - block + 1, 0) : y + side + block - 1][
            :, max(x - block + 1, 0) : x + side + block - 1
        ].all()
        for y in range(0, ny // block * block - side + 1, block)
        for x in range(0, nx // block * block - side + 1, block)
    )


@pytest.mark.parametrize("orientation", range(8))
def test_the_next_smaller_template_that_fits_is_used(orientation):
    image = TrainingImage(IMAGE)
    prepared = PreparedImage(Study(image, Grid(40, 50), P))
    assert image.known is not None
    known = to_path(image.known[None], orientation)[0]
    sides = [side for _, _, side in templates(P, image.shape)]
    assert sides[-1] == 18
    for drawn in sides:
        expected = max(side for side in sides if side <= drawn and fits(known, side, 2))
        (_, _, side), oriented = prepared.fitting(orientation, (1, drawn, drawn))
        assert side == expected
        assert oriented is prepared.oriented(orientation, (1, side, side))
    assert not fits(known, 18, 2)


def test_realizations_of_an_image_with_gaps_have_varied_templates():
    image = TrainingImage(IMAGE)
    e = simulate(image, (40, 50), P, n_realizations=12, keep_sources=True)
    assert e.sources is not None
    assert (e.indices < 2).all()
    copied = e.sources >= 0
    np.testing.assert_array_equal(image.indices.ravel()[e.sources[copied]], e.indices[copied])


@pytest.mark.parametrize("start", [20, 21])
@pytest.mark.parametrize("side", range(14, 22))
def test_a_template_that_fits_nowhere_is_refused(start, side):
    window = np.full((64, 64), np.nan)
    piece = slice(start, start + side)
    window[piece, piece] = blobs((side, side), 2)
    image, p = TrainingImage(window), Parameters(16, 4, 1)
    if side + start % 2 >= 19:  # blocks begin at even rows
        assert (simulate(image, (30, 30), p, n_realizations=8).indices < 2).all()
        return
    with pytest.raises(CCWSIMError, match="known completely"):
        simulate(image, (30, 30), p, n_realizations=8)


@pytest.mark.parametrize("scale", [0.2, 0.3, 0.4, 0.6])
def test_a_copy_thinner_than_the_template_is_refused(scale):
    p = Parameters((8, 8, 8), (2, 2, 2), 1)
    with pytest.raises(CCWSIMError, match="8 × 8 × 8 cells of the training image is complete"):
        simulate(VOLUME, (12, 20, 20), p, secondary=Secondary(scale=(1.0, 1.0, scale)))


def test_a_copy_smaller_than_the_template_is_refused():
    with pytest.raises(CCWSIMError, match="16 × 16 cells of the training image is complete"):
        simulate(IMAGE[1:19, 1:19], (30, 30), Parameters(16, 4, 1), secondary=Secondary(scale=0.2))


def test_turned_volumes_have_templates_that_fit():
    p = Parameters((8, 8, 8), (2, 2, 2), 1, template_variation=0.5)
    turned = Secondary(angle=30.0)
    e = simulate(VOLUME[:10], (12, 20, 20), p, n_realizations=4, secondary=turned)
    assert (e.indices < 2).all()
