"""Test simulation with probabilities, auxiliary variables, inactive cells, and images with gaps."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from ccwsim import Auxiliary, Grid, Parameters, Secondary, TrainingImage, datasets, simulate
from ccwsim.engine.corrections.guidance import guide_terms, score_bound
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.raster import make_plan
from ccwsim.engine.stages.path import Box, to_path
from ccwsim.metrics import reliability, warn_of_probabilities
from ccwsim.model.missing import UNKNOWN
from ccwsim.model.study import Study
from tests.small_images import blobs
from tests.some import some

METHODS = ["ccwsim", "ccsim", "ms-ccsim"]
CHANNELS = datasets.load("channels")
SAND = int(CHANNELS.codes[-1])


def wells(shape, n, seed=0, n_facies=2):
    rng = np.random.default_rng(seed)
    chosen = rng.choice(int(np.prod(shape)), n, replace=False)
    cells = np.stack(np.unravel_index(chosen, shape), axis=1)
    return cells, rng.integers(0, n_facies, n)


def disc(shape):
    rows, columns = np.indices(shape[-2:])
    middle = np.hypot(rows - shape[-2] / 2, columns - shape[-1] / 2) < min(shape[-2:]) / 3
    return np.broadcast_to(middle, shape).copy()


@pytest.mark.parametrize("method", METHODS)
def test_no_cell_outside_a_mask_and_no_wrong_datum(method):
    active, data = disc((150, 170)), wells((150, 170), 400)
    e = simulate(
        CHANNELS, (150, 170), Parameters(method=method), data, 3, secondary=Secondary(active=active)
    )
    assert (e.indices[:, active] < 2).all()
    assert (e.indices[:, ~active] == UNKNOWN).all()
    assert e.n_mismatched.tolist() == [0, 0, 0]
    assert np.isnan(e.realizations[:, ~active]).all()
    assert np.isnan(e.probability(SAND)[~active]).all()
    inside = e.indices[:, active]
    np.testing.assert_allclose(e.proportions[:, 1], (inside == 1).mean(axis=1))


def test_data_outside_a_mask_change_nothing():
    active, (cells, facies) = disc((150, 170)), wells((150, 170), 300)
    inside = active[tuple(cells.T)]
    secondary = Secondary(active=active)
    every = simulate(CHANNELS, (150, 170), None, (cells, facies), 2, secondary=secondary)
    some = simulate(
        CHANNELS, (150, 170), None, (cells[inside], facies[inside]), 2, secondary=secondary
    )
    assert every.digest == some.digest
    assert every.hard_data.n == inside.sum()


def test_a_mask_of_all_cells_changes_no_cell():
    whole = Secondary(active=np.ones((90, 100), bool))
    plain = simulate(CHANNELS, (90, 100), n_realizations=2)
    assert simulate(CHANNELS, (90, 100), n_realizations=2, secondary=whole).digest == plain.digest
    assert simulate(CHANNELS, (90, 100), n_realizations=2, secondary=Secondary()).digest == (
        plain.digest
    )


def test_an_active_strip_costs_less_work_than_the_grid():
    from ccwsim.engine.prepared_image import PreparedImage
    from ccwsim.engine.raster import make_plan
    from ccwsim.model.study import Study

    active = np.zeros((512, 512), bool)
    active[np.arange(512), np.arange(512)] = True  # the smallest box is the whole grid
    counts = []
    for secondary in (None, Secondary(active=active)):
        study = Study(CHANNELS, Grid(512, 512), secondary=secondary)
        rng = np.random.default_rng(0)
        plan = make_plan(PreparedImage(study), (1, 32, 32), rng)
        counts.append(len(plan.inputs.patches))
    assert counts[1] < counts[0] / 6


@pytest.mark.parametrize("shape", some([(60, 70), (6, 40, 44)], always=[(60, 70)]))
@pytest.mark.parametrize("seed", range(4))
def test_random_masks_and_data_are_honoured(shape, seed):
    rng = np.random.default_rng(seed)
    image = TrainingImage(
        blobs((8, 48, 48), 3, seed) if len(shape) == 3 else blobs((1, 80, 80), 3)[0]
    )
    p = Parameters(8, 2, int(rng.integers(2)), method=METHODS[seed % 3])
    if len(shape) == 3:
        p = Parameters((4, 8, 8), (1, 2, 2), (0, 1, 1))
    active = rng.random(shape) < 0.5 if seed % 2 else disc(shape)
    soft = {0: rng.random(shape) * 0.5, 1: 0.3}
    secondary = Secondary(active=active, probabilities=soft)
    data = wells(shape, 150, seed, 3)
    e = simulate(image, shape, p, data, 2, seed, secondary=secondary, keep_sources=True)
    assert e.n_mismatched.tolist() == [0, 0]
    assert (e.indices[:, active] < 3).all()
    assert (e.indices[:, ~active] == UNKNOWN).all()
    assert e.sources is not None
    kept = e.sources >= 0
    taken = image.indices.ravel()[e.sources[kept]]
    assert np.mean(taken == e.indices[kept]) == 1.0


def test_probabilities_are_met():
    given = np.tile(np.linspace(0.05, 0.55, 300), (300, 1))
    e = simulate(
        CHANNELS, (300, 300), n_realizations=24, secondary=Secondary(probabilities={SAND: given})
    )
    table = reliability(e, SAND)
    held = table.count > 0.02 * table.count.sum()
    assert np.abs(table.observed - table.forecast)[held].max() < 0.08
    slope = np.polyfit(given.ravel(), e.probability(SAND).ravel(), 1)[0]
    assert 0.8 < slope < 1.25
    free = simulate(CHANNELS, (300, 300), n_realizations=24)
    assert abs(np.polyfit(given.ravel(), free.probability(SAND).ravel(), 1)[0]) < 0.3


@pytest.mark.parametrize("p", [Parameters(), Parameters(24, 8, 1)])
def test_probabilities_are_met_although_many_locations_fit_equally_well(p):
    """Test bodies larger than a patch: locations with extreme proportions are not preferred."""
    field = gaussian_filter(np.random.default_rng(0).normal(size=(240, 240)), 12)
    image = (field > np.quantile(field, 0.7)).astype(int)
    given = np.tile(np.linspace(0.1, 0.6, 150), (150, 1))
    e = simulate(image, (150, 150), p, None, 40, secondary=Secondary(probabilities={1: given}))
    table = reliability(e, 1)
    held = table.count > 0.02 * table.count.sum()
    # 0.4 and 0.2 if the best location is always used
    assert np.abs(table.observed - table.forecast)[held].max() < 0.1
    assert 0.8 < np.polyfit(given.ravel(), e.probability(1).ravel(), 1)[0] < 1.4


def test_a_weight_of_zero_means_no_probabilities():
    given = Secondary(probabilities={SAND: 0.9}, soft_weight=0)
    plain = simulate(CHANNELS, (90, 100), n_realizations=2)
    assert simulate(CHANNELS, (90, 100), n_realizations=2, secondary=given).digest == plain.digest


@pytest.mark.parametrize("turns", range(4))
def test_an_auxiliary_variable_turns_a_trend(turns):
    shares = np.linspace(0.05, 0.9, 200)
    rng = np.random.default_rng(0)
    from scipy.ndimage import gaussian_filter

    field = gaussian_filter(rng.standard_normal((200, 200)), 3)
    limits = np.quantile(field, 1 - shares)[:, None]
    image = TrainingImage((field > limits).astype(int))
    own = np.tile(shares[:, None], (1, 200))
    wanted = np.rot90(own, turns)
    secondary = Secondary(auxiliary=[Auxiliary(own, wanted)])
    e = simulate(image, (200, 200), Parameters(24, 6, 1), None, 12, secondary=secondary)
    slope = np.polyfit(wanted.ravel(), e.probability(1).ravel(), 1)[0]
    assert 0.8 < slope < 1.2


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("n_data", [0, 300])
@pytest.mark.parametrize("template", some([16, 32], always=[16]))
def test_no_patch_contains_unknown_cells(template, method, n_data):
    cells = CHANNELS.array.astype(float)
    cells[60:110, 80:150] = np.nan
    image, data = TrainingImage(cells), wells((150, 160), n_data) if n_data else None
    p = Parameters(template, template // 4, method=method)
    e = simulate(image, (150, 160), p, data, 3, keep_sources=True)
    assert (e.indices < 2).all()
    assert e.sources is not None
    assert image.known is not None
    assert image.known.ravel()[e.sources[e.sources >= 0]].all()
    assert (e.n_mismatched == 0).all()


def test_revisions_use_secondary_information():
    from ccwsim import revise

    secondary = Secondary(active=disc((90, 100)), probabilities={SAND: 0.4})
    here = simulate(CHANNELS, (90, 100), n_realizations=2, secondary=secondary)
    after = revise(here, ([[45, 50], [0, 0]], [1, 1]))
    assert after.n_mismatched.tolist() == [0, 0]
    assert after.hard_data.n == 1
    assert (after.indices[:, ~disc((90, 100))] == UNKNOWN).all()


def test_compartments_are_the_connected_parts():
    active = np.zeros((60, 90), bool)
    active[5:55, 3:40] = active[10:30, 45:85] = True
    soft = {SAND: np.full((60, 90), 0.4)}
    parts = Secondary(active=active, probabilities=soft).compartments(Grid(60, 90))
    assert [part.active.sum() for part in parts] == [50 * 37, 20 * 40]
    assert (parts[0].active | parts[1].active == active).all()
    each = [
        simulate(CHANNELS, (60, 90), n_realizations=1, seed=seed, secondary=part)
        for seed, part in enumerate(parts)
    ]
    assert not (each[0].indices[0] < 2)[parts[1].active].any()
    other = simulate(CHANNELS, (60, 90), n_realizations=1, seed=1, secondary=parts[1])
    assert other.digest == each[1].digest
    assert [part.active.all() for part in Secondary().compartments(Grid(9, 9))] == [True]


def test_few_locations_that_fit_the_guides_are_noted():
    shape = (200, 200)

    def notes(**given):
        secondary = Secondary(**given).fitted(Grid(*shape), CHANNELS)
        found = warn_of_probabilities(secondary, CHANNELS, Parameters())
        return [note for note in found if "locations" in note]

    rng = np.random.default_rng(0)
    assert notes(probabilities={SAND: rng.random(shape)})
    assert not notes(probabilities={SAND: 0.25})
    assert not notes(active=disc(shape))
    of_image = rng.random(CHANNELS.shape)
    assert notes(auxiliary=[Auxiliary(of_image, np.full(shape, 9.0), weight=10)])
    assert not notes(auxiliary=[Auxiliary(of_image, rng.random(shape), weight=0.01)])


def test_an_image_without_a_main_direction_is_noted_if_angles_are_given():
    turned, parameters = Secondary(angle=30.0).fitted(Grid(60, 60), CHANNELS), Parameters()
    assert warn_of_probabilities(turned, CHANNELS, parameters) == []
    (note,) = warn_of_probabilities(turned, datasets.load("levees"), parameters)
    assert note.endswith("differ from 179° by 35° on average (45° if no direction prevails)")
    assert warn_of_probabilities(Secondary(active=disc((60, 60))), CHANNELS, parameters) == []


@pytest.mark.slow
def test_a_realization_does_not_depend_on_those_before_it():
    """Test this for two images with so many locations that λ is computed from a sample of them."""
    rows, columns = np.indices((150, 167))
    soft = np.clip(0.1 + 0.4 * columns / 150 + 0.2 * np.sin(rows / 9), 0, 1)
    zones = (columns > 75 + 9 * np.sin(rows / 11)).astype(int)
    given = Secondary(probabilities={SAND: soft}, images=[datasets.load("stone_wall")], zones=zones)
    several = simulate(CHANNELS, (150, 167), n_realizations=4, seed=3, secondary=given, n_workers=1)
    for r in (0, 3):
        alone = simulate(CHANNELS, (150, 167), seed=3, first_realization=r, secondary=given)
        np.testing.assert_array_equal(alone.indices[0], several.indices[r])


@pytest.mark.parametrize("shape", [(33, 40), (34, 200)])
def test_costs_of_guides_are_within_the_bound_of_scores(shape):
    """Test patches that begin before a grid hardly larger than a patch; scores may overflow."""
    image, rng = datasets.load("delta"), np.random.default_rng(0)
    given = Secondary(
        probabilities={k: rng.random(shape) / 2 for k in (0, 1)},
        auxiliary=[Auxiliary(rng.random(image.shape), 9 * rng.random(shape) - 4, 5.0)],
    )
    study = Study(image, Grid.of(shape), Parameters(location_weight=10.0), secondary=given)
    prepared, n_before = PreparedImage(study), 0
    for seed in range(20):
        plan = make_plan(prepared, (1, 32, 32), np.random.default_rng(seed))
        guide, lengths = plan.inputs.guide, plan.lengths[-1]
        bound, (ny, nx) = (
            score_bound(study, lengths, 3),
            prepared.oriented(0, (1, 32, 32)).places[1:],
        )
        flat, width = guide.values.ravel(), guide.values.shape[3]
        at = (np.arange(ny)[:, None] * width + np.arange(nx)).ravel()
        for patch in plan.inputs.patches:
            n, _ = guide_terms.__wrapped__(guide, Box(*patch.tolist()[:7], 0, 8, 8))
            costs = flat[np.add.outer(guide.offsets[:n], at)].T @ guide.terms[:n]
            assert np.abs(costs).max() + guide.spread * np.abs(guide.random).max() <= bound
        n_before += (plan.inputs.patches[:, 1:3] < plan.path.offset[1:]).any()
    assert n_before


@pytest.mark.parametrize("axis", [None, 0, 1, 2])
def test_the_cost_of_the_first_part_comes_from_the_mean_of_its_cells_in_every_orientation(axis):
    """Test an auxiliary variable, and the position along each axis of a location weight."""
    image, shape, template = datasets.load("sinuous_channels"), (20, 60, 70), (8, 16, 16)
    depth, seen = np.random.default_rng(0).random(shape), set()
    of_image = np.linspace(0, 1, image.array.size).reshape(image.shape)
    given = Secondary(auxiliary=[Auxiliary(of_image, depth)])
    weights = 0.0 if axis is None else tuple(float(k == axis) for k in range(3))
    p = Parameters(template, (2, 4, 4), 1, location_weight=weights)
    if axis is not None:
        given, depth = None, np.indices(shape)[axis]
    study = Study(image, Grid.of(shape), p, secondary=given)
    prepared = PreparedImage(study)
    for seed in range(80):
        plan = make_plan(prepared, template, np.random.default_rng(seed))
        guide, path, patches = plan.inputs.guide, plan.path, plan.inputs.patches
        inside = ((patches[:, :3] >= path.offset) & (patches[:, 3:6] == template)).all(axis=1)
        patch = patches[inside][seed % inside.sum()]
        n, _ = guide_terms.__wrapped__(guide, Box(*patch.tolist()[:7], 2, 4, 4))
        first = patch[:3] - path.offset
        if axis is None:
            part = tuple(slice(k, k + n) for k, n in zip(first, (4, 4, 4), strict=True))
            mean = to_path(depth, path.orientation)[part].mean() / 32
        else:  # the first cell of the patch along the axis of the grid, relative to the last
            part = tuple(slice(k, k + n) for k, n in zip(first, template, strict=True))
            mean = to_path(depth, path.orientation)[part].min() / (shape[axis] - template[axis])
        plane = 2 if axis is None else 0  # the plane with the term −2·a·b
        own = guide.terms[:n][guide.offsets[:n] == plane * guide.values[0].size]
        np.testing.assert_allclose(own[0], -abs(guide.weights[plane]) * mean, rtol=1e-5)
        seen.add(path.orientation)
        if len(seen) == 16:
            break
    assert seen == set(range(16))
