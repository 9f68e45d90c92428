"""Test that the bundled images have their documented properties and can be regenerated."""

import numpy as np
import pytest
from numpy.random import RandomState
from scipy import ndimage

from ccwsim import datasets
from ccwsim.datasets.catalogue import ASSETS, FIELD_SIDES, read_image, reference_field
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.training_image import TrainingImage
from tests.some import some
from tools import datasets as tools
from tools.datasets.__main__ import main
from tools.datasets.fields import wave, without_specks

SHARES = {
    "channels": [(0.70, 0.76), (0.24, 0.30)],
    "stone_wall": [(0.71, 0.77), (0.23, 0.29)],
    "barchans": [(0.48, 0.60), (0.18, 0.28), (0.18, 0.28)],
    "dunes": [(0.44, 0.56), (0.28, 0.40), (0.12, 0.22)],
    "levees": [(0.60, 0.74), (0.10, 0.18), (0.02, 0.08), (0.10, 0.18)],
    "delta": [(0.72, 0.84), (0.10, 0.18), (0.05, 0.12)],
    "bend": [(0.68, 0.80), (0.20, 0.32)],
    "fractures": [(0.80, 0.92), (0.08, 0.20)],
    "lenses": [(0.48, 0.62), (0.26, 0.40), (0.08, 0.17)],
}


def bodies_reaching_across(inside: np.ndarray) -> np.ndarray:
    """Return the labels of the 4-connected geobodies on both the west and the east edge."""
    geobodies, _ = ndimage.label(inside)
    both = np.intersect1d(geobodies[:, 0], geobodies[:, -1])
    return both[both > 0]


def largest_share(inside: np.ndarray) -> float:
    geobodies, _ = ndimage.label(inside)
    sizes = np.bincount(geobodies.ravel())[1:]
    return sizes.max() / sizes.sum()


def sand(name: str, facies: str) -> np.ndarray:
    ti = datasets.load(name)
    return ti.indices == ti.facies_names.index(facies)


def test_every_image_has_its_range_of_shares_here():
    assert set(SHARES) == set(datasets.names())
    assert len(datasets.names()) >= 7


@pytest.mark.parametrize("name", datasets.names())
def test_the_generator_makes_the_bundled_image(name):
    made, bundled = tools.generate(name), datasets.load(name)
    assert made.shape == bundled.shape
    assert made.facies_names == bundled.facies_names
    # Another processor may round single cells at a bank differently.
    assert np.mean(made.array == bundled.array) >= 0.999


FIELDS = [(name, side) for name, sides in FIELD_SIDES.items() for side in sides]


@pytest.mark.parametrize("field", some(FIELDS, [("channels", 256)]))
def test_the_generator_makes_the_reference_field(field):
    name, side = field
    made, bundled = tools.generate_reference_field(name, side), reference_field(name, (side, side))
    assert made.facies_names == bundled.facies_names == datasets.load(name).facies_names
    assert np.mean(made.array == bundled.array) >= 0.999


def test_help_writes_nothing(capsys, monkeypatch):
    def refuse():
        raise AssertionError("written")

    monkeypatch.setattr("tools.datasets.__main__.write_assets", refuse)
    for arguments in (["--help"], []):
        monkeypatch.setattr("sys.argv", ["tools.datasets", *arguments])
        with pytest.raises(SystemExit):
            main()
    assert str(ASSETS) in capsys.readouterr().out.replace("\n", "").replace(" ", "")


@pytest.mark.parametrize("name", datasets.names())
def test_facies_sizes_and_shares(name):
    ti = datasets.load(name)
    assert ti.name == name
    assert min(ti.shape) >= 200
    assert max(ti.shape) <= 512
    assert ti.codes.tolist() == list(range(len(SHARES[name])))
    for share, (low, high) in zip(ti.proportions, SHARES[name], strict=True):
        assert low <= share <= high


@pytest.mark.parametrize("name", datasets.names())
def test_no_image_has_dust(name):
    ti = datasets.load(name)
    for index in range(ti.n_facies):
        geobodies, n = ndimage.label(ti.indices == index)
        assert n > 0
        assert np.bincount(geobodies.ravel())[1:].min() >= 4


def test_channels_join_west_and_east():
    channels = sand("channels", "sand")
    across = bodies_reaching_across(channels)
    assert len(across) >= 1
    geobodies, _ = ndimage.label(channels)
    assert np.isin(geobodies, across).sum() > 0.9 * channels.sum()


def test_channels_split_and_rejoin():
    enclosed, n = ndimage.label(~sand("channels", "sand"))
    edge = np.unique(np.concatenate([enclosed[[0, -1]].ravel(), enclosed[:, [0, -1]].ravel()]))
    assert n - np.count_nonzero(edge) >= 3


def test_mortar_is_one_body_and_stones_are_many():
    mortar = sand("stone_wall", "mortar")
    assert largest_share(mortar) > 0.97
    _, n_stones = ndimage.label(~mortar)
    assert n_stones > 40
    assert largest_share(~mortar) < 0.1


def test_the_delta_is_one_tree_that_divides_eastwards():
    channels = sand("delta", "channel")
    assert largest_share(channels) > 0.9
    n_west = ndimage.label(channels[:, 5])[1]
    n_east = ndimage.label(channels[:, 200])[1]
    assert n_west == 1
    assert n_east >= 6


def test_rivers_between_levees_cross_the_whole_image():
    assert len(bodies_reaching_across(sand("levees", "channel"))) == 3


def test_the_bend_gets_wider_and_sparser_towards_the_south_west():
    inside = sand("bend", "sand")
    width = ndimage.distance_transform_edt(inside)
    assert width[:150, :150].max() > 1.3 * width[150:, 150:].max()
    assert ndimage.label(~inside[150:, 150:])[1] > ndimage.label(~inside[:150, :150])[1]


@pytest.mark.parametrize("name", ["barchans", "dunes"])
def test_every_slip_face_leans_on_sand(name):
    ti = datasets.load(name)
    geobodies, n = ndimage.label(sand(name, "slip face"))
    bare = ti.indices == ti.facies_names.index("interdune")
    touching = ndimage.binary_dilation(~bare & (geobodies == 0), iterations=2)
    inner = np.zeros(ti.shape, bool)
    inner[10:-10, 10:-10] = True
    whole = [k for k in range(1, n + 1) if inner[geobodies == k].all()]
    assert len(whole) > 3
    assert sum(touching[geobodies == k].any() for k in whole) >= 0.9 * len(whole)


@pytest.mark.slow
@pytest.mark.parametrize("name", datasets.names())
def test_seeds_differ_and_repeat(name):
    first = tools.generate(name, shape=(96, 128), seed=5)
    again = tools.generate(name, shape=(96, 128), seed=5)
    other = tools.generate(name, shape=(96, 128), seed=6)
    assert first.shape == (96, 128)
    assert first.digest == again.digest
    assert first.digest != other.digest


@pytest.mark.parametrize("name", datasets.names())
def test_the_smallest_size_works(name):
    for seed in range(5):
        assert tools.generate(name, shape=(64, 64), seed=seed).shape == (64, 64)


@pytest.mark.parametrize("name", datasets.names())
def test_descriptions_are_one_line_with_the_size(name):
    line = datasets.describe(name)
    ny, nx = datasets.load(name).shape
    assert "\n" not in line
    assert f"{nx} × {ny}" in line


@pytest.mark.parametrize(
    "call",
    [datasets.load, tools.generate, datasets.describe],
)
def test_an_unknown_image_lists_the_names(call):
    with pytest.raises(CCWSIMError, match=r"'chanels' is unknown; there are channels, stone_wall"):
        call("chanels")


@pytest.mark.parametrize("call", [datasets.load_hard_data, datasets.hard_data_grid_shape])
def test_unknown_hard_data_list_the_names(call):
    with pytest.raises(CCWSIMError, match="channels_60_wells"):
        call("wells")


@pytest.mark.parametrize("shape", [(63, 100), (100, 1025), (100,), (100.0, 100), 100, (64, 64, 1)])
def test_a_shape_out_of_range_is_refused(shape):
    with pytest.raises(CCWSIMError, match="shape = "):
        tools.generate("channels", shape=shape)


@pytest.mark.parametrize("seed", [-1, 2**32, 1.5, True])
def test_a_seed_out_of_range_is_refused(seed):
    with pytest.raises(CCWSIMError, match="seed = "):
        tools.generate("channels", seed=seed)


@pytest.mark.slow
@pytest.mark.parametrize("name", datasets.hard_data_names())
def test_hard_data_fit_their_grid_image_and_reference_field(name):
    data = datasets.load_hard_data(name)
    ti = datasets.load(datasets.hard_data_training_image(name))
    data.check(Grid(*datasets.hard_data_grid_shape(name)), ti)
    field = datasets.load_reference_field(name)
    assert field.shape == datasets.hard_data_grid_shape(name)
    assert data.n_mismatched(field.array) <= 0.001 * data.n
    assert str(data.n) in datasets.describe_hard_data(name)
    made = tools.generate_hard_data(name)
    np.testing.assert_array_equal(made.cells, data.cells)


def test_wells_keep_their_distance():
    data = tools.scattered_data(np.zeros((100, 100), int), 30, 9.0, RandomState(3))
    offsets = data.cells[:, None] - data.cells[None]
    distance = np.hypot(offsets[..., 0], offsets[..., 1])
    assert data.n == 30
    assert distance[~np.eye(30, dtype=bool)].min() >= 9.0


def test_no_room_gives_fewer_data():
    assert 0 < tools.scattered_data(np.zeros((20, 20), int), 50, 10.0, RandomState(3)).n < 10


def test_image_files_keep_every_cell(tmp_path):
    facies = RandomState(1).randint(0, 4, (37, 51)).astype(np.uint8)
    tools.write_image(tmp_path / "a.png", facies)
    np.testing.assert_array_equal(read_image(tmp_path / "a.png"), facies)


def test_a_missing_file_says_how_to_write_it(tmp_path):
    with pytest.raises(CCWSIMError, match=r"python -m tools\.datasets write"):
        read_image(tmp_path / "none.png")


def test_wave_has_unit_variance_and_its_wavelength():
    series = wave(400_000, 80, 0.2, RandomState(0))
    assert series.var() == pytest.approx(1, rel=0.1)
    covariance = [np.mean(series[:-lag] * series[lag:]) for lag in range(1, 80)]
    # The correlation of a damped oscillator is lowest after half a damped period.
    assert 1 + np.argmin(covariance) == pytest.approx(40 / np.sqrt(1 - 0.2**2), abs=3)


def test_specks_take_the_facies_around_them():
    facies = np.zeros((20, 20), np.uint8)
    facies[3:5, 3:5] = 1
    facies[8:18, 8:18] = 2
    cleaned = without_specks(facies, 5)
    assert TrainingImage(cleaned).codes.tolist() == [0, 2]
    np.testing.assert_array_equal(cleaned == 2, facies == 2)


def test_the_generator_makes_the_bundled_values_and_measurements():
    made, bundled = tools.generate_values("porous_channels"), datasets.load("porous_channels")
    assert np.allclose(made.values["porosity"], bundled.values["porosity"], atol=2e-4)
    (name,) = datasets.BUNDLED_MEASUREMENTS
    data, sampled = datasets.load_hard_data(name), tools.generate_measurements(name)
    assert np.array_equal(data.cells, sampled.cells)
    assert np.allclose(data.values["porosity"], sampled.values["porosity"], atol=2e-4)
    assert 0.01 <= bundled.sorted_values[0] < bundled.sorted_values[-1] <= 0.4


def test_values_of_high_porosity_reach_across():
    inside = datasets.load("porous_channels").values["porosity"] > 0.2
    assert bodies_reaching_across(inside).size
