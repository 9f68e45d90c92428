"""Test turned, scaled and mirrored images, several images, and zones."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ccwsim import (
    CCWSIMError,
    Grid,
    Parameters,
    Secondary,
    TrainingImage,
    datasets,
    simulate,
)
from ccwsim.engine.copies import MAX_TURNS, classes_of, make_copies, n_cells_of_copies
from ccwsim.engine.corrections.unseen_patterns import mean_thickness
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.trace import Trace
from ccwsim.model.study import Study
from tests.small_images import blobs

CHANNELS, WALL = datasets.load("channels"), datasets.load("stone_wall")
STRIPES = TrainingImage(np.tile([[0], [0], [0], [1], [1], [1]], (20, 120)))
"""Stripes along x, from west to east."""
SMALL = Parameters(24, 6, 1)


def along_east(cells: np.ndarray) -> float:
    """Return the share of equal neighbours from west to east, minus that from south to north."""
    return float((cells[:, 1:] == cells[:, :-1]).mean() - (cells[1:] == cells[:-1]).mean())


@given(st.lists(st.floats(-360, 360), min_size=1, max_size=60), st.floats(0.5, 45), st.booleans())
@settings(max_examples=80, deadline=None)
def test_classes_are_within_the_tolerance_and_few(values, tolerance, circular):
    period = 360.0 if circular else None
    array = np.array(values) % 360 if circular else np.array(values)
    distinct, of_value = np.unique(array, return_inverse=True)
    middles, of_distinct = classes_of(distinct, tolerance, period)
    of_value = of_distinct[of_value]
    off = np.abs(array - middles[of_value])
    off = np.minimum(off, 360 - off) if circular else off
    assert off.max() <= tolerance + 1e-6
    assert len(middles) <= len(distinct)
    assert len(np.unique(of_value)) == len(middles)


def test_a_constant_angle_is_one_class_and_exact():
    study = Study(CHANNELS, Grid(60, 70), SMALL, secondary=Secondary(angle=37.0))
    copies = make_copies(study)
    assert copies is not None
    assert copies.turns.tolist() == [[37.0, 1.0, 1.0, 1.0, 0.0]]


def test_many_angles_take_at_most_sixteen_copies():
    angle = np.random.default_rng(0).uniform(0, 360, (60, 70))
    secondary = Secondary(angle=angle, scale=np.linspace(0.8, 1.2, 70)[None].repeat(60, 0))
    copies = make_copies(Study(CHANNELS, Grid(60, 70), SMALL, secondary=secondary))
    assert copies is not None
    assert 1 < len(copies.layers) <= MAX_TURNS


def test_north_turns_to_the_azimuth():
    """Test that stripes from west to east run north to south if north is turned to the east."""
    for angle, sign in ((0.0, 1), (90.0, -1), (180.0, 1), (270.0, -1)):
        e = simulate(STRIPES, (60, 70), SMALL, secondary=Secondary(angle=angle), seed=1)
        assert np.sign(along_east(e.indices[0])) == sign, angle


def test_a_quarter_turn_is_exact():
    image = np.arange(12 * 9).reshape(12, 9) % 7
    image = TrainingImage(np.kron(image, np.ones((4, 4), int)))
    study = Study(image, Grid(30, 30), Parameters(8, 2, 1), secondary=Secondary(angle=90.0))
    copies = make_copies(study)
    assert copies is not None
    np.testing.assert_array_equal(copies.indices[0], np.rot90(image.indices, 1))
    assert copies.known_mask.all()  # row 0 is the south, so `rot90` turns clockwise


@pytest.mark.parametrize("angle", [0.0, 20.0, 45.0, 133.0])
@pytest.mark.parametrize("scale", [0.7, 1.0, 1.4])
def test_copies_keep_proportions_and_every_cell(angle, scale):
    secondary = Secondary(angle=angle, scale=scale)
    study = Study(CHANNELS, Grid(60, 70), SMALL, secondary=secondary)
    if secondary.angle == 0 and scale == 1:
        return
    copies = make_copies(study)
    if copies is None:
        return
    known = copies.indices[copies.known_mask]
    share = np.bincount(known, minlength=2) / known.size
    np.testing.assert_allclose(share, CHANNELS.proportions, atol=0.005)
    n = CHANNELS.indices.size * scale**2
    assert abs(known.size - n) < 0.02 * n
    assert copies.indices.size <= n_cells_of_copies(study)
    origins = copies.origins[copies.known_mask]
    np.testing.assert_array_equal(known, CHANNELS.indices.ravel()[origins])


def test_bodies_of_a_scaled_image_are_as_wide_as_asked():
    def width_of(secondary: Secondary | None) -> float:
        e = simulate(CHANNELS, (200, 200), None, None, 10, 1, secondary=secondary)
        return float(np.mean([mean_thickness(one)[1] for one in e.indices]))

    width = width_of(None)
    for scale in (0.7, 1.4):
        assert width_of(Secondary(scale=scale)) == pytest.approx(scale * width, rel=0.05)


def test_zones_have_the_proportions_of_their_images_and_name_them():
    zones = np.zeros((160, 180), int)
    zones[:, 90:] = 1
    other = TrainingImage(1 - WALL.array)  # another proportion
    e = simulate(
        CHANNELS,
        (160, 180),
        n_realizations=4,
        seed=2,
        secondary=Secondary(images=[other], zones=zones),
        keep_sources=True,
    )
    for zone, image in enumerate((CHANNELS, other)):
        own = e.indices[:, zones == zone]
        assert own.mean() == pytest.approx(image.proportions[1], abs=0.08)
    both = np.concatenate([CHANNELS.indices.ravel(), other.indices.ravel()])
    assert e.sources is not None
    known = e.sources >= 0
    np.testing.assert_array_equal(both[e.sources[known]], e.indices[known])
    of_other = e.sources >= CHANNELS.indices.size
    assert of_other[:, :, 110:].mean() > 0.95
    assert of_other[:, :, :70].mean() < 0.05


def test_weights_are_the_shares_of_images():
    e = simulate(
        *(CHANNELS, (200, 200)),
        n_realizations=4,
        seed=1,
        secondary=Secondary(images=[WALL], weights=[1, 3]),
        keep_sources=True,
    )
    assert e.sources is not None
    assert (e.sources >= CHANNELS.indices.size).mean() == pytest.approx(0.75, abs=0.1)


@pytest.mark.parametrize("axes", ["x", "y", "xy"])
def test_mirrored_copies_are_further_patterns(axes):
    rng = np.random.default_rng(0)
    image = TrainingImage(np.kron(rng.integers(0, 2, (20, 22)), np.ones((3, 3), int)))
    study = Study(image, Grid(40, 50), Parameters(12, 4, 0), secondary=Secondary(mirrored=axes))
    copies = make_copies(study)
    assert copies is not None
    flipped = image.indices[::-1] if "y" in axes else image.indices
    flipped = flipped[:, ::-1] if "x" in axes else flipped
    assert len(copies.indices) == 2 ** len(axes)
    assert any((layer == flipped).all() for layer in copies.indices)
    e = simulate(image, (40, 50), Parameters(12, 4, 0), secondary=Secondary(mirrored=axes))
    assert e.indices.max() < 2


METHODS = ["ccwsim", *(pytest.param(m, marks=pytest.mark.slow) for m in ("ccsim", "ms-ccsim"))]
EAST = np.linspace(0, 80, 90)[None].repeat(80, 0)
KINDS = {
    "angles": Secondary(angle=EAST),
    "scales": Secondary(scale=(1.3, EAST / 160 + 0.8)),
    "mirrored": Secondary(mirrored="xy"),
    "zones": Secondary(images=[WALL], zones=(EAST > 40).astype(int), angle=30.0),
    "weights": Secondary(images=[WALL], weights=[2, 1]),
    "a mask": Secondary(angle=EAST, active=EAST > 15),
    "probabilities": Secondary(angle=EAST, probabilities={1: 0.4}),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("method", METHODS)
def test_every_datum_is_honoured_and_every_cell_is_known(kind, method):
    rng = np.random.default_rng(3)
    cells = np.stack(np.divmod(rng.choice(80 * 90, 120, replace=False), 90), axis=1)
    e = simulate(
        *(CHANNELS, (80, 90), Parameters(24, 6, 1, method=method)),
        (cells, rng.integers(0, 2, 120)),
        n_realizations=2,
        seed=1,
        secondary=KINDS[kind],
    )
    assert e.n_mismatched.tolist() == [0, 0]
    assert (e.indices[:, e.active] < 2).all() if e.active is not None else e.indices.max() < 2


def test_layers_of_a_volume_dip_towards_the_azimuth():
    layers = np.arange(20)[:, None, None] // 4 % 2 * np.ones((1, 48, 48), int)
    p = Parameters((8, 16, 16), (2, 4, 4), (0, 1, 1))
    secondary = Secondary(dip=45.0, angle=90.0)
    grid = Grid(30, 30, nz=16)
    e = simulate(TrainingImage(np.tile(layers, (2, 1, 1))), grid, p, secondary=secondary, seed=1)
    cells = e.indices[0]
    down = (cells[:-1, :, 1:] == cells[1:, :, :-1]).mean()  # one cell east and one down
    up = (cells[1:, :, 1:] == cells[:-1, :, :-1]).mean()
    assert down > up + 0.2
    assert (cells[:, 1:] == cells[:, :-1]).mean() > 0.9  # level from south to north


@pytest.mark.slow
@given(st.integers(0, 2**16))
@settings(max_examples=30, deadline=None)
def test_volumes_of_every_kind_honour_their_data(seed):
    rng = np.random.default_rng(seed)
    image, other = (TrainingImage(blobs((12, 24, 26), 2, 4 + k)) for k in range(2))
    shape = (8, 20, 22)
    zones = (np.arange(22) > 10).astype(int) * np.ones(shape, int)
    secondary = Secondary(
        images=[other] if seed % 2 else (),
        zones=zones if seed % 2 and seed % 3 else None,
        angle=rng.choice([0.0, 30.0, 90.0]),
        dip=rng.choice([0.0, 10.0, -20.0]),
        scale=rng.choice([1.0, 1.2]),
        mirrored="x" if seed % 5 == 0 else (),
    )
    cells = np.stack(np.unravel_index(rng.choice(3520, 30, replace=False), shape), axis=1)
    p = Parameters((4, 8, 8), (1, 2, 2), 0)
    e = simulate(
        image, shape, p, (cells, rng.integers(0, 2, 30)), 1, seed, secondary=secondary,
        keep_sources=True,
    )  # fmt: skip
    assert e.n_mismatched.tolist() == [0]
    assert e.indices.max() < 2
    both = np.concatenate([image.indices.ravel(), other.indices.ravel()])
    assert e.sources is not None
    known = e.sources >= 0
    np.testing.assert_array_equal(both[e.sources[known]], e.indices[known])


def test_a_piece_is_never_pasted_across_a_border():
    """Test an image of one facies: pasted gaps of its turned copy would show as a second facies."""
    image = TrainingImage(np.pad(np.zeros((50, 50), int), ((0, 0), (0, 1)), constant_values=1))
    study = Study(image, Grid(40, 40), Parameters(12, 4, 1), secondary=Secondary(angle=45.0))
    prepared = PreparedImage(study)
    oriented = prepared.oriented(0, (1, 12, 12))
    for z, y, x in np.argwhere(oriented.illegal == 0):
        piece = prepared.copies.known_mask[z, 2 * y : 2 * y + 12, 2 * x : 2 * x + 12]
        assert piece.all()


def test_a_traced_patch_comes_from_the_copy_of_its_kind():
    secondary = Secondary(images=[WALL], zones=(EAST > 40).astype(int), mirrored="x")
    study = Study(CHANNELS, Grid(80, 90), SMALL, secondary=secondary)
    trace = Trace(study)
    for number in (0, 5, len(trace.patches) - 1):
        step = trace.at(number)
        assert step.n_candidates >= 1
        assert 0 <= step.drawn < len(step.places)
        assert step.scores.ndim == 2
        np.testing.assert_array_equal(step.places[step.drawn] * step.block[1:] // step.block[1:],
                                      step.places[step.drawn])  # fmt: skip
        ty, tx = step.place
        piece = trace.oriented.pyramid.image[
            step.layer, ty : ty + step.box.ny, tx : tx + step.box.nx
        ]
        np.testing.assert_array_equal(piece, step.cells)
        is_wall = make_copies(study).origins[step.layer].max() >= CHANNELS.indices.size
        assert step.source.split(",")[0] == ("stone wall" if is_wall else "channels")
        assert ("mirrored along x" in step.source) == bool(step.layer % 2)
    plain = simulate(CHANNELS, (80, 90), SMALL, secondary=secondary, seed=study.seed)
    np.testing.assert_array_equal(trace.realization.indices, plain.indices[0])


def test_kernels_are_compiled_for_a_mask_without_the_first_corner(monkeypatch):
    monkeypatch.setattr("ccwsim.engine.realization._compiled_kinds", set())
    secondary = Secondary(angle=20.0, active=EAST > 60)
    e = simulate(CHANNELS, (80, 90), SMALL, secondary=secondary, seed=1)
    assert (e.indices[:, e.active] < 2).all()


def test_copies_are_named_with_all_their_changes():
    turned = Secondary(images=[TrainingImage(WALL.array)], angle=37.0, scale=1.5, mirrored="xy")
    copies = make_copies(Study(CHANNELS, Grid(60, 70), SMALL, secondary=turned))
    assert len(copies.names) == len(copies.indices) == 8
    changes = "turned to 37°, scaled by 1.5"
    assert copies.names[0] == f"channels, {changes}"
    assert copies.names[7] == f"image 1, {changes}, mirrored along x and y"


def test_an_image_too_small_for_a_turned_patch_is_named():
    image = TrainingImage(CHANNELS.array[:90, :90])
    with pytest.raises(CCWSIMError, match="64 × 64 cells of the training image is complete"):
        simulate(image, (60, 70), Parameters(64, 8, 2), secondary=Secondary(angle=45.0))
