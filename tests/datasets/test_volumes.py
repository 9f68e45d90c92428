"""Test the properties of the bundled volumes, their regeneration, and their wells."""

import numpy as np
import pytest
from scipy import ndimage

from ccwsim import CCWSIMError, datasets
from ccwsim.datasets.catalogue import WELLS_SHAPE, image_path
from tools import datasets as tools

SHARES = {
    "sinuous_channels": [(0.70, 0.75), (0.25, 0.30)],
    "stacked_lenses": [(0.55, 0.60), (0.22, 0.34), (0.10, 0.18)],
    "folded_layers": [(0.08, 0.45)] * 4,
}


def facies(name: str, of: str) -> np.ndarray:
    volume = datasets.load(name)
    return volume.indices == volume.facies_names.index(of)


@pytest.mark.slow
@pytest.mark.parametrize("name", datasets.volume_names())
def test_the_generator_makes_the_bundled_volume_and_its_wells(name):
    made, bundled = tools.generate_volume(name), datasets.load(name)
    assert made.facies_names == bundled.facies_names
    assert np.mean(made.array == bundled.array) >= 0.999
    wells = datasets.load_hard_data(f"{name}_10_wells")
    assert np.mean(tools.generate_wells(name).facies == wells.facies) >= 0.99
    assert image_path(name).stat().st_size < 1_000_000


@pytest.mark.parametrize("name", datasets.volume_names())
def test_shares_wells_and_what_is_said_of_them(name):
    volume, wells = datasets.load(name), datasets.load_hard_data(f"{name}_10_wells")
    for share, (low, high) in zip(volume.proportions, SHARES[name], strict=True):
        assert low <= share <= high
    assert "160 × 160 × 48 cells" in datasets.describe(name)
    columns, counts = np.unique(wells.cells[:, 1:], axis=0, return_counts=True)
    assert counts.tolist() == [WELLS_SHAPE[0]] * 10
    distances = np.hypot(*(columns[:, None] - columns[None]).transpose(2, 0, 1))
    assert distances[np.triu_indices(10, 1)].min() >= tools.WELL_SPACING
    assert set(wells.facies) == set(volume.codes)


def test_channels_cross_the_volume_with_a_flat_top():
    sand = facies("sinuous_channels", "sand")
    bodies, n = ndimage.label(sand, np.ones((3, 3, 3)))
    across = np.intersect1d(bodies[..., 0], bodies[..., -1])
    assert np.isin(bodies, across[across > 0]).sum() > 0.9 * sand.sum()
    assert n < 40


def test_gravel_lies_below_sand_or_shale_that_is_younger():
    gravel, sand = facies("stacked_lenses", "gravel"), facies("stacked_lenses", "sand")
    bases = gravel[1:] & ~gravel[:-1]
    assert (sand[1:] & gravel[:-1]).sum() > 0.8 * bases.sum()
    _, n = ndimage.label(gravel)
    assert n > 30


def test_beds_are_thin_and_go_far():
    volume = datasets.load("folded_layers").indices
    changes = (np.diff(volume.astype(int), axis=0) != 0).sum(axis=0)
    assert 7 < changes.mean() < 14
    sides = (np.diff(volume.astype(int), axis=2) != 0).mean()
    assert sides < 0.1 < (np.diff(volume.astype(int), axis=0) != 0).mean()


def test_an_unknown_volume_is_refused_in_words():
    with pytest.raises(CCWSIMError, match="sinuous_channels_10_wells, stacked_lenses_10_wells"):
        datasets.load_hard_data("channels_10_wells")
    with pytest.raises(CCWSIMError, match="folded_layers"):
        datasets.load("nowhere")
