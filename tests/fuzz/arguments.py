"""Random valid and absurd arguments for all functions of the library with arguments."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator
from dataclasses import fields
from typing import Any

import numpy as np

import ccwsim
from ccwsim import (
    Auxiliary,
    Grid,
    HardData,
    Parameters,
    Secondary,
    TrainingImage,
    metrics,
    simulate,
)
from ccwsim.datasets.sampling import sample_grid, sample_random, sample_wells
from ccwsim.io import (
    Conversion,
    PointColumns,
    classify,
    hard_data_as_bytes,
    parameters_from_json,
    place_points,
    read_points,
    training_image_as_bytes,
)
from ccwsim.model.study import Study
from ccwsim.sharing.choices import Choices
from ccwsim.sharing.link import KEYS, link_of, read_link
from ccwsim.sharing.recipe import reproduction_recipe
from ccwsim.sharing.words import packed, unpacked
from tests.fuzz.flows import flow_call

Act = Callable[[], object]
ABSURD: tuple[Any, ...] = (
    -1, 0, 1, 2, 255, 256, 2**31 - 1, 2**31, 2**53 + 1, 2**63 - 1, 2**63, 2**64, -(2**63) - 1,
    10**400, 10**5000, -(10**5000), 0.0, -0.0, 0.5, 1e-320, 1e308, -1e308, float("nan"),
    float("inf"), float("-inf"), True, False, None, "", "0", "12", "ssd", "E-W",
    "\ud800", "a" * 10**6, b"\xff", (), [], [1], (3, 4), [[1, 2], [3]], {}, {"a": 1}, {1}, 1j,
    object(), range(10),
    np.nan, np.float32(3), np.int8(-1), np.uint64(2**64 - 1), np.bool_(True), np.array([]),
    np.array(3), np.array([1, 2]), np.zeros((0, 5)), np.zeros((2, 2, 2)), np.array(["a"]),
    np.array([None]), np.array([[np.nan, 1]]), np.datetime64("2020-01-01"), lambda: None, Ellipsis,
    np.ma.masked_array([1, 2], [True, False]), np.array([2**63], np.uint64), "1e5", "½", "x" * 41,
)  # fmt: skip
SMALL = Parameters(template_size=8, overlap_size=4, wavelet_level=1)


def arguments(source: random.Random) -> Iterator[tuple[str, Act]]:
    """Yield one operation, with a random set of arguments."""
    target = source.choice(TARGETS)
    yield target.__name__, target(source)


def absurd(source: random.Random) -> Any:
    """Return a value that is usually invalid."""
    return source.choice(ABSURD)


def maybe(source: random.Random, good: Any, share: float = 0.1) -> Any:
    """Return a valid value, or sometimes an absurd value."""
    return absurd(source) if source.random() < share else good


def image_of(source: random.Random) -> TrainingImage:
    """Return a small training image with random codes."""
    rng = np.random.default_rng(source.randrange(2**32))
    codes = rng.choice(np.arange(-300, 300), source.randint(1, 5), replace=False)
    least = source.choice((1, 12, 12, 12))
    shape = source.randint(least, 40), source.randint(least, 40)
    return TrainingImage(codes[rng.integers(0, len(codes), shape)])


def stack_of(source: random.Random) -> np.ndarray:
    """Return facies indices of one or several maps, as metrics accept them."""
    rng = np.random.default_rng(source.randrange(2**32))
    shape = source.choice(((9, 12), (1, 1), (40, 3), (3, 16, 16), (1, 20, 20), (5, 30, 2)))
    kind = source.choice((np.uint8, np.uint8, np.uint8, np.int64, np.float64, bool))
    return rng.integers(0, source.randint(1, 3), shape).astype(kind)


def parameters(source: random.Random) -> Act:
    names = source.sample([f.name for f in fields(Parameters)], source.randint(1, 5))
    given = {name: maybe(source, getattr(SMALL, name), 0.25) for name in names}
    return lambda: Parameters(**given).digest


def json_of_parameters(source: random.Random) -> Act:
    names = [f.name for f in fields(Parameters)] * 4 + ["x", "\ud800", "a" * 500]
    good: dict[str, Any] = {}
    for name in source.sample(names, 3):
        values = (0, -1, 1e999, 10**60, None, [], {}, "x" * 99, [[1]], 7, "ccsim", 0.5)
        good[name] = source.choice(values) if source.random() < 0.2 else getattr(SMALL, name, 1)
    text = json.dumps(good)
    at = source.randrange(len(text))
    broken = text[:at], text[:at] + "[" * 50_000, text.replace("1", "9" * 5000), text[::-1]
    text = source.choice((text, text, text, *broken))
    given = source.choice((text, text.encode("utf-8", "surrogatepass")))
    return lambda: parameters_from_json(given)


def grid(source: random.Random) -> Act:
    given = [maybe(source, source.randint(1, 50), 0.12) for _ in range(2)]
    sizes = [maybe(source, (source.random() + 0.1, 5.0), 0.2) for _ in range(2)]
    points = [
        maybe(source, [source.uniform(-9, 99), source.choice((1e300, 3.0, 4.0, 5.0, 6.0))], 0.1)
        for _ in range(2)
    ]

    def act() -> object:
        own = Grid(*given, *sizes)
        cells = own.cells_of(*points)
        return own.holds(cells), own.centers_of(cells), repr(own)

    return act


def fitted_grid(source: random.Random) -> Act:
    size = source.choice((1.0, 1e-9, 1e6, 1e14))
    places = [[source.uniform(-9, 99) * size, maybe(source, 4.0, 0.03)] for _ in range(4)]
    given = maybe(source, places, 0.12)
    options = {name: maybe(source, None, 0.3) for name in ("shape", "cell_size")}
    return lambda: Grid.fit(given, **options)


def grid_of_shape(source: random.Random) -> Act:
    given = maybe(source, [maybe(source, 5), maybe(source, 7)], 0.15)
    return lambda: Grid.of(given).shape


def hard_data(source: random.Random) -> Act:
    n = source.randint(1, 6)
    cells = [[k, maybe(source, source.randint(0, 8), 0.02)] for k in range(n)]
    facies = [maybe(source, source.randint(0, 2), 0.02) for _ in range(n)]
    given = maybe(source, cells), maybe(source, facies)
    image, kind = TrainingImage([[0, 1, 2]]), source.choice(("csv", "gslib", "csv", "x"))

    def act() -> object:
        data = HardData(*given)
        data.check(Grid(9, 9), image)
        return data.digest, packed(data), hard_data_as_bytes(data, kind, Grid(9, 9))

    return act


def training_image(source: random.Random) -> Act:
    rows = [[maybe(source, source.randint(0, 3), 0.01) for _ in range(4)] for _ in range(3)]
    array = maybe(source, rows, 0.12)
    names, name = maybe(source, None, 0.12), maybe(source, "a", 0.12)
    code, kind = maybe(source, 1), source.choice(("npy", "png", "sgems", "png", "x"))

    def act() -> object:
        image = TrainingImage(array, name=name, facies_names=names)
        repr(image), image.digest, image.proportions, training_image_as_bytes(image, kind)
        return image.index_of(code)

    return act


LEGAL = {
    "template_size": 12, "overlap_size": 2, "wavelet_level": 0, "n_candidates": 3,
    "method": "ms-ccsim", "similarity": "correlation", "search_fraction": 0.5,
    "co_template": 1, "random_path": False, "template_variation": 0.4,
    "match_proportions": True, "location_weight": 2.0, "refine": False, "exact_data": False,
    "published_draw": True, "repair_seams": False, "variant": "paper",
}  # fmt: skip
"""A valid value of each parameter, other than the default."""


def secondary(image: TrainingImage, shape: Any, source: random.Random) -> dict[str, Any]:
    """Return valid values of all arguments of `Secondary`, for a map."""
    rng, size = np.random.default_rng(source.randrange(2**32)), shape
    if not (isinstance(shape, tuple) and all(type(n) is int and 0 < n < 99 for n in shape)):
        size = 20, 20
    others = source.choice((1, 2)) * [TrainingImage(image.array[::-1])]
    weights = [1, *(source.random() for _ in others)]
    return {
        "active": rng.random(size) < source.random(),
        "probabilities": {int(image.codes[0]): rng.random(size)},
        "auxiliary": [Auxiliary(rng.random(image.shape), rng.random(size))],
        "soft_weight": source.uniform(0, 5),
        "images": others,
        "zones": rng.integers(0, 2, size),
        "weights": source.choice((weights, np.array(weights))),
        "angle": source.choice((37.0, rng.uniform(-360, 360, size))),
        "scale": source.choice((1.3, (0.8, rng.uniform(0.2, 5, size)))),
        "dip": 20.0,
        "mirrored": source.choice(("x", "xy", "yz")),
        "angle_tolerance": source.uniform(0.5, 45),
        "facies": None,
    }


def simulation(source: random.Random) -> Act:
    image = image_of(source)
    names = source.sample([f.name for f in fields(Parameters)], 2)
    given = {name: maybe(source, LEGAL[name], 0.1) for name in names}
    shape = maybe(source, (maybe(source, source.randint(11, 50), 0.1), source.randint(11, 50)), 0.1)
    options = {
        "n_realizations": maybe(source, source.randint(1, 3), 0.1),
        "seed": maybe(source, source.randint(0, 99), 0.1),
        "n_workers": maybe(source, source.choice((None, 1, 2)), 0.1),
        "first_realization": maybe(source, source.randint(0, 5), 0.1),
        "keep_sources": source.random() < 0.3,
    }
    n = source.randint(0, 5)
    far = source.choice((10, 10, 60))
    cells = [[source.randint(0, far), source.randint(0, far)] for _ in range(n)]
    codes = [int(source.choice(image.codes)) for _ in range(n)]

    good = secondary(image, shape, source)
    some = {*source.sample(sorted(good), source.choice((0, 0, 1, 2, 3)))}
    if "weights" in some:  # they need images, and exclude zones
        some = {"images", *some} - {"zones", "auxiliary"}
    guides = {name: maybe(source, good[name], 0.1) for name in sorted(some)}

    def act() -> object:
        if guides:
            options["secondary"] = given_secondary = Secondary(**guides)
            given_secondary.describe()
        own = Parameters(**{"template_size": 8, "overlap_size": 4, "wavelet_level": 1, **given})
        return simulate(image, shape, own, HardData(cells, codes), **options).digest  # type: ignore[arg-type]

    return act


def simulation_of_anything(source: random.Random) -> Act:
    given = [maybe(source, good, 0.12) for good in (image_of(source), (20, 20), SMALL, HardData())]
    return lambda: (Study(*[given[0], Grid.of(given[1]), *given[2:]]), simulate(*given))


def samples(source: random.Random) -> Act:
    truth = maybe(source, image_of(source).array, 0.12)
    n, every = maybe(source, source.randint(1, 30), 0.15), maybe(source, source.randint(1, 9), 0.15)
    seed = maybe(source, 3, 0.15)
    along = maybe(source, source.choice(("N-S", "E-W")), 0.12)
    return source.choice((
        lambda: sample_random(truth, n, seed),
        lambda: sample_grid(truth, every),
        lambda: sample_wells(truth, n, seed, direction=along, every=every),
    ))  # fmt: skip


def address(source: random.Random) -> Act:
    words = (
        "own", "dunes", "channels", "10x10", "1e5x1e5", "9" * 5000, "-1", "99999x99999", "placed",
        "sampled", "yes", "no", "no", "drop", "ew-ns", "٣x٣", "\ud800", "<b>", "", "x",
        "BgACeAQCBAYIAAo", "0.5", "0", "ms-ccsim", "1-ff0000", "9" * 400 + "x1", "1x1", "a" * 10**5,
        "nan", "inf", "512x512", "0-" * 50_000, "16", "8", "3", "1000", "2147483647", "data",
        "channels_400_data", "\x00",
    )  # fmt: skip
    names = [*KEYS, "utm_source", "templte", "\ud800", "x" * 10**4, ""]
    query = {
        source.choice(names): [
            source.choice(words) for _ in range(source.choice((0, 1, 1, 1, 3, 300)))
        ]
        for _ in range(source.randint(1, 12))
    }

    def act() -> object:
        choices, shown, notes = read_link(query)
        assert all(len(note) < 1500 and note.isprintable() for note in notes)
        link = link_of(choices, shown)
        assert read_link(link)[:2] == (choices, shown) or choices.data.placed is not None
        image = ccwsim.datasets.load(choices.image.bundled)
        return reproduction_recipe(
            choices, Study(image, choices.grid, seed=choices.seed), "a.ccwsim"
        )

    return act


def packed_word(source: random.Random) -> Act:
    letters = source.choice(("ABCZaz09-_", "ABCZaz09-_=+/ \u00e9\ud800"))
    if source.random() < 0.4:
        n = source.randint(1, 9)
        good = packed(HardData([[k, source.randint(-9, 999)] for k in range(n)], [1] * n))
        at = source.randrange(len(good))
        word = good[:at] + source.choice((good[at:], "A", "_____", good[at + 1 :]))
        return lambda: unpacked(word)
    word = "".join(source.choice(letters) for _ in range(source.choice((0, 1, 5, 50, 8001))))
    return lambda: unpacked(word)


def classes(source: random.Random) -> Act:
    values = maybe(source, [source.random() for _ in range(9)], 0.15)
    given = (
        {"threshold": maybe(source, 0.5), "classes": maybe(source, None)}
        if source.random() < 0.5
        else {"classes": maybe(source, source.choice((2, 3, [0.5])))}
    )
    return lambda: classify(values, **given)


def points(source: random.Random) -> Act:
    from io import BytesIO

    figures = [source.choice("11122222") for _ in range(15)]
    figures[source.randrange(15)] += source.choice(("", "", "", ".5", "e300"))
    rows = "\n".join(",".join(figures[k : k + 3]) for k in range(0, 15, 3))
    text = f"{source.choice(('x,y,facies', 'row,col,facies', 'a,b,c'))}\n{rows}\n"
    sizes = source.choice(((1.0, 1.0), (1e-300, 1e300), (1e-9, 5.0)))
    options = {name: maybe(source, None, 0.12) for name in ("threshold", "classes")}
    named = ("x", "y", "facies", "coordinates", "up", "slice_index")
    choices = {name: maybe(source, None, 0.12) for name in named}
    options["facies_names"] = maybe(source, {"1": 0, "sand": maybe(source, 1, 0.3)}, 0.2)
    image = image_of(source)

    def act() -> object:
        found = read_points(BytesIO(text.encode()), PointColumns(**choices))
        return place_points(found, Grid(9, 9, sizes), image, Conversion(**options))

    return act


_OF_MAPS = {
    "variogram": ("facies", "direction", "lags"), "variogram_map": ("facies", "max_lag"),
    "connectivity": ("facies", "direction", "lags", "neighbours"),
    "transiograms": ("codes", "direction", "lags"),
    "geobody_statistics": ("facies", "neighbours"), "connected_geobodies": ("facies", "neighbours"),
    "etype": ("codes",), "facies_counts": ("codes",), "proportions": ("codes",),
    "pattern_histogram": ("codes", "size"),
    "pyramid_histograms": ("codes", "size", "factors"),
    "entropy": (), "etype_of_counts": (), "classical_scaling": (), "metric_scaling": (),
    "coarsened": ("size", "codes"),
    "granulometry": ("facies",), "feature_spacing": ("codes",), "stationarity": ("codes",),
}  # fmt: skip


def maps(source: random.Random) -> Act:
    """Return the call of a measure of maps."""
    name = source.choice(list(_OF_MAPS))
    good = {
        "facies": source.randint(0, 3), "direction": source.choice(("E-W", "N-S", (1, 2), 45.0)),
        "lags": source.choice((5, 100, [0, 1, 2])), "max_lag": source.randint(0, 60),
        "neighbours": source.choice((4, 8)),
        "codes": source.choice((None, range(source.randint(2, 5)))),
        "size": source.randint(1, 6), "factors": (1, 2, 3),
    }  # fmt: skip
    given = [
        maybe(source, stack_of(source), 0.06),
        *(maybe(source, good[w]) for w in _OF_MAPS[name]),
    ]

    def act() -> object:
        return getattr(metrics, name)(*given)

    return act


def comparisons(source: random.Random) -> Act:
    """Return the call of a measure that compares realizations with an image or reference field."""
    stack, one = maybe(source, stack_of(source), 0.06), maybe(source, stack_of(source), 0.06)
    n, some = maybe(source, source.randint(2, 4)), maybe(source, 2, 0.15)
    weights, quantiles = maybe(source, (1.0, 0.5)), [maybe(source, q) for q in (0.1, 0.9)]
    many = np.random.default_rng(source.randrange(2**32)).integers(0, 3, (3, 20, 24))
    return source.choice((
        lambda: metrics.anodi(stack, many[0], n, some),
        lambda: metrics.anodi({"a": many, "b": many}, many[0], range(3), 2, (1, 2), weights),
        lambda: metrics.pattern_distance(many, many[0], None, some),
        lambda: metrics.score_reference(metrics.etype(many), many[0], n),
        lambda: metrics.calibration(metrics.etype(many), many[0], some),
        lambda: metrics.copying(many[0], maybe(source, (3, 3))),
        lambda: metrics.band(many, *quantiles),
        lambda: metrics.anodi({"a": stack, "b": one}, one, n, 2, (1, 2), some),
        lambda: metrics.pattern_distance(stack, one, n),
        lambda: metrics.score_reference(stack, one, n),
        lambda: metrics.calibration(stack, one, n, some),
        lambda: metrics.copying(stack, one),
        lambda: metrics.data_match(stack, source.choice((HardData([[0, 0]], [1]), some))),
        lambda: metrics.diagnose(stack),
        lambda: metrics.templates_that_fit(stack, some),
        lambda: metrics.band(stack, some, n),
        lambda: metrics.js_divergence(stack, one),
    ))  # fmt: skip


def judged(source: random.Random) -> Act:
    """Return the call of a measure of an ensemble."""
    image, facies = image_of(source), maybe(source, None)
    own: Any = {"n_realizations": source.randint(1, 3), "n_workers": 1}

    def act() -> object:
        ensemble = simulate(image, (24, 30), SMALL, **own)
        metrics.fit_curve(
            ensemble, "variogram", maybe(source, int(image.codes[0])), maybe(source, "E-W")
        )
        metrics.fit_geobodies(ensemble, maybe(source, int(image.codes[-1])))
        return metrics.judge(ensemble, facies), ensemble.probability(
            maybe(source, int(image.codes[0]))
        )

    return act


def flows(source: random.Random) -> Act:
    """Return the call of a function of flow."""
    return flow_call(source, maybe)


def link(source: random.Random) -> Act:
    return lambda: link_of(Choices(seed=source.randint(0, 9)))


TARGETS = (
    parameters, json_of_parameters, grid, fitted_grid, grid_of_shape, hard_data, training_image,
    simulation, simulation, simulation_of_anything, samples, address, address, packed_word, classes,
    points, maps, maps, maps, comparisons, comparisons, judged, flows, flows,
)  # fmt: skip
"""Functions that return an operation with random arguments, for a source of random numbers."""
