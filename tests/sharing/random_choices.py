"""Random choices of the dashboard, whose files and settings cover each field of `Choices`.

`random_study(number, files=…)` returns choices that can be simulated, and what the pages show.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from io import BytesIO
from typing import Any, get_args, get_type_hints

import numpy as np

from ccwsim import Grid, HardData, Parameters, TrainingImage, datasets
from ccwsim.io import training_image_as_bytes, write_maps
from ccwsim.sharing.choices import (
    Choices,
    CompareChoice,
    DataChoice,
    Directions,
    EMap,
    FlowChoice,
    Gradient,
    GuideChoice,
    ImageChoice,
    Shown,
    Stroke,
    SweepChoice,
    Upload,
    WellTables,
    ZoneLayers,
)

Rng = np.random.Generator
SMALL_IMAGES = ("channels", "stone_wall")
MATCHES = (("stone", 0), ("mortar", 1))
COLLARS = Upload("collars.csv", b"p;q;r;s;t\nA;10,5;2,5;12;40\nB;20,5;9,5;12;40\n")
LOG = Upload("log.csv", b"p,q,r,s\nA,0,3,sand\nA,3,12,clay\nB,0,12,Sand\n")
SURVEYS = Upload("surveys.csv", b"p,q,r,s\nB,0,90,-80\n")
COLUMNS = {
    **{"collar_well": "p", "x": "q", "y": "r", "z": "s", "well": "p", "depth_from": "q"},
    **{"depth_to": "r", "facies": "s", "survey_well": "p", "survey_depth": "q"},
    **{"survey_azimuth": "r", "survey_dip": "s"},
}


def random_study(number: int, *, files: bool) -> tuple[Choices, Shown]:
    """Return choices and shown results; every fifth study is a volume with tables of wells."""
    rng = np.random.default_rng([11, number, files])
    if number % 5 == 0:
        choices = _volume(rng, files=files)
    elif number % 5 == 3 and files:
        choices = _values(rng)
    else:
        ny, nx = (int(n) for n in rng.integers(24, 40, 2))
        grid = Grid(ny, nx)
        if rng.random() < 0.7:
            origin = tuple(rng.uniform(1e5, 7e6, 2).round(3).tolist())
            grid = Grid(ny, nx, (float(rng.integers(1, 30)), 2.5), origin, crs="EPSG:2154")
        image = _image(rng, files=files)
        choices = Choices(
            image,
            _data(rng, image, grid, files=files),
            grid,
            _parameters(rng),
            n_realizations=int(rng.integers(1, 30)),
            seed=int(rng.integers(1, 10**6)),
            guides=_guides(rng, image, grid, files=files),
        )
    if number == 7:  # published variants have no guides
        published = choices.parameters.as_in("paper")
        choices = replace(choices, parameters=published, guides=GuideChoice())
    e_types = get_args(EMap)
    shown = Shown(
        realization=int(rng.integers(9)),
        facies=1,
        e_type=e_types[rng.integers(len(e_types))],
        threshold=float(rng.normal()) if rng.random() < 0.5 else None,
        flow=_flow(rng, choices.grid),
        compare=_compare(rng),
        sweep=_sweep(rng),
    )
    return choices, shown


def _named_image(rng: Rng, shape: tuple[int, int] = (96, 120)) -> TrainingImage:
    cells = np.kron(rng.integers(0, 2, (shape[0] // 6, shape[1] // 6)), np.ones((6, 6), int))
    cells[0, :2] = 0, 1
    return TrainingImage(cells * 7, name="wall")


def _image(rng: Rng, *, files: bool) -> ImageChoice:
    look: dict[str, Any] = {
        **{name: bool(rng.integers(2)) for name in ("flip_ew", "flip_ns", "transpose")},
        "names": (("sand/gravel", "clay, upper"), ())[rng.integers(2)],
        "colours": (((0, "#112233"),), ())[rng.integers(2)],
    }
    if not files or rng.random() < 0.3:
        return ImageChoice(str(rng.choice(SMALL_IMAGES)), **look)
    upload = Upload("aquifer/upper v1.npy", training_image_as_bytes(_named_image(rng), "npy"))
    answers = (("crop", (0, 0, 84, 108)), ("numbering", "codes"))
    return ImageChoice(upload=upload, answers=answers[: rng.integers(3)], **look)


def _codes(image: ImageChoice) -> tuple[int, int]:
    return (0, 1) if image.upload is None else (0, 7)


def _data(rng: Rng, image: ImageChoice, grid: Grid, *, files: bool) -> DataChoice:
    source = str(rng.choice(["none", "bundled", "sampled", "placed", "file", "file"]))
    cells = np.unique(rng.integers(0, 24, (20, 2)), axis=0)
    codes = rng.choice(_codes(image), len(cells))
    if source == "bundled" and image.upload is None:
        answers: tuple[Any, ...] = (("on_outside", "drop"),)
        if image.bundled == "stone_wall" and image.names:
            matches = (("mud", int(rng.integers(2))), ("sand", int(rng.integers(2))))
            answers += (("facies_names", matches),)
        return DataChoice(source, "channels_60_wells", answers=answers)
    if source == "sampled":
        return DataChoice(source, n_sampled=int(rng.integers(1, 40)), seed_sampled=3)
    if source == "placed":
        wells = (("north/1~a_b", ((3, 4), (5, 6))), ("Süd", ((1, 2),)))
        placed = HardData(cells, codes)
        return DataChoice(source, placed=placed, wells=wells[: rng.integers(3)])
    if source != "file" or not files:
        return DataChoice()
    x, y = grid.centers_of(cells[:, ::-1] % grid.shape[::-1][0]).T
    places = [*zip(x.tolist(), y.tolist(), codes.tolist(), strict=True)]
    rows = [f"W{k},{a!r},{b!r},{code}" for k, (a, b, code) in enumerate(places)]
    rows += ["far,-1e6,-1e6,0", f"again,{x[0]},{y[0]},{sum(_codes(image)) - codes[0]}"]
    text = "\n".join(["name,easting,northing,lithology", *rows, ""])
    answers = (("on_collision", "majority"), ("on_outside", "drop"), ("on_unknown", "drop"))
    return DataChoice("file", upload=Upload("wells.csv", text.encode()), answers=answers)


def _volume(rng: Rng, *, files: bool) -> Choices:
    """Return a volume: with files, its wells are in tables."""
    grid = Grid(30, 40, nz=12)
    image = ImageChoice("sinuous_channels", names=("clay", "Sand"))
    data = DataChoice("placed", placed=HardData([[3, 4, 5], [8, 0, 0]], [1, 0]))
    if files:
        tables = WellTables(COLLARS, SURVEYS if rng.random() < 0.5 else None)
        data = DataChoice("file", upload=LOG, tables=tables, answers=tuple(COLUMNS.items()))
    layers = GuideChoice(images=(ImageChoice("stacked_lenses"),), zones=ZoneLayers((5,)))
    layers = replace(layers, images=(replace(layers.images[0], facies_names=_lens_matches()),))
    parameters = Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1))
    return Choices(image, data, grid, parameters, n_realizations=2, seed=4, guides=layers)


def _values(rng: Rng) -> Choices:
    """Return a map of a continuous variable, with data from a file or placed by hand."""
    content = BytesIO()
    np.save(content, rng.normal(size=(60, 70)).cumsum(axis=0).cumsum(axis=1))
    image = ImageChoice(
        upload=Upload("depth.npy", content.getvalue()),
        answers=(("continuous", True), ("units", "m")),
        flip_ew=bool(rng.integers(2)),
        transpose=bool(rng.integers(2)),
    )
    cells = np.unique(rng.integers(0, 24, (12, 2)), axis=0)
    measured = rng.normal(size=len(cells)).round(3)
    placed = HardData(cells, values={"depth": measured})
    text = "".join(f"{x},{y},{m}\n" for (y, x), m in zip(cells.tolist(), measured, strict=True))
    file = Upload("points.csv", f"x,y,depth\n{text}".encode())
    data = (DataChoice("placed", placed=placed), DataChoice("file", upload=file), DataChoice())
    return Choices(
        image,
        data[rng.integers(3)],
        Grid(30, 40),
        Parameters(16, 4, 1, n_candidates=int(rng.integers(1, 30))),
        n_realizations=2,
        seed=int(rng.integers(99)),
    )


def _lens_matches() -> tuple[tuple[str, int], ...]:
    names = datasets.load("stacked_lenses").facies_names
    return tuple((name, k % 2) for k, name in enumerate(names))


def _parameters(rng: Rng) -> Parameters:
    def chosen(*choices: Any) -> Any:
        return choices[rng.integers(len(choices))]

    switches = ("random_path", "match_proportions", "published_draw", "repair_seams", "refine")
    return Parameters(
        16,
        4,
        1,
        n_candidates=int(rng.integers(1, 30)),
        method=chosen("ccwsim", "ccsim", "ms-ccsim"),
        similarity=chosen("ssd", "correlation"),
        search_fraction=chosen(0.1, 1.0),
        co_template=chosen(1, 2),
        template_variation=chosen(0.0, 0.5),
        location_weight=chosen(0.0, 1.0),
        exact_data=chosen(True, False),
        **{name: chosen(True, False) for name in switches},
    )


def _corners(rng: Rng, grid: Grid) -> tuple[tuple[float, float], ...]:
    x, y = grid.axes[:2]
    (west, east), (south, north) = np.quantile(x, (0.1, 0.8)), np.quantile(y, (0.2, 0.9))
    shift = float(rng.uniform(0, 0.1) * (east - west))
    corners = (west + shift, south), (east, south), (east, north)
    return tuple((float(a), float(b)) for a, b in corners)


def _map_file(grid: Grid, name: str, **maps: np.ndarray) -> Upload:
    content = BytesIO()
    write_maps(content, maps, grid, format="gslib")
    return Upload(name, content.getvalue())


def _guides(rng: Rng, image: ImageChoice, grid: Grid, *, files: bool) -> GuideChoice:
    def chosen(*choices: Any) -> Any:
        return choices[rng.integers(len(choices))]

    corners, share = _corners(rng, grid), rng.random(grid.shape)
    stroke = Stroke(0.9, float(rng.uniform(1, 9)) * grid.cell_size[0], 0.5, corners[:2])
    choice: dict[str, Any] = {
        "probabilities": chosen(None, Gradient(45.0, 0.1, 0.8), (stroke,)),
        "facies": int(rng.integers(2)),
        "soft_weight": chosen(1.0, 2.5),
        "active": chosen(None, corners),
        "auxiliary": chosen(None, None, Directions(10.0, 30.0)),
        "auxiliary_weight": chosen(1.0, 3.0),
        "angle": chosen(None, 30.0, Gradient(90.0, 0.0, 90.0), (corners[:2],)),
        "flow_azimuth": chosen(0.0, 45.0),
        "scale": chosen(1.0, 1.2),
        "mirrored": chosen("", "x", "xy"),
    }
    if rng.random() < 0.4:
        matched = () if image.upload is None and image.bundled == "stone_wall" else MATCHES
        codes = dict(zip(range(2), _codes(image), strict=True))
        matched = tuple((label, codes[code]) for label, code in matched)
        others = (ImageChoice("stone_wall", facies_names=matched),)
        choice |= {"auxiliary": None, "images": others, "zones": chosen(None, 0.25, (corners,))}
    if files and rng.random() < 0.7:
        ring = json.dumps({"type": "Polygon", "coordinates": [corners]}).encode()
        maps = {"P_A": share, "P_B": 1 - share}
        labels = tuple(zip("AB", _codes(image), strict=True))
        further = Upload("wall 2.npy", training_image_as_bytes(_named_image(rng), "npy"))
        zones = _map_file(grid, "zones.gslib", zone=(share > 0.5) * 1.0)
        basins = _map_file(grid, "basins.gslib", basin=np.floor(3 * share))
        own = ImageChoice(
            upload=further, answers=(("numbering", "codes"),), facies_names=_by_code(image)
        )
        choice |= chosen(
            {"active": Upload("outline.geojson", ring)},
            {"active": basins, "active_codes": (0.0, 2.0)},
            {"probabilities": _map_file(grid, "soft.gslib", **maps), "facies_names": labels},
            {"angle": _map_file(grid, "angle.gslib", angle=90 * share)},
            {
                "auxiliary": None,
                "images": (own,),
                "zones": zones,
            },
        )
    return GuideChoice(**choice)


def _by_code(image: ImageChoice) -> tuple[tuple[str, int], ...]:
    return () if image.upload else (("0", 0), ("7", 1))


def _flow(rng: Rng, grid: Grid) -> FlowChoice:
    x, y = grid.axes[:2]
    return FlowChoice(
        rocks=(("mud/clay ~_", (float(rng.uniform(1e-9, 1e-3)), 0.3)), ("sand", (2e-5, 0.1))),
        values_are=("classes", "K", "log K", "porosity")[rng.integers(4)],
        unit=("m/s", "m/d")[rng.integers(2)],
        axis=(None, "x", "y", "edge")[rng.integers(4)],
        along=("x", "y", "points", "constant")[rng.integers(4)],
        points=(float(x[0]), float(y[0]), float(x[-1]), float(y[-1]))[: 4 * rng.integers(2)],
        thickness=float(rng.uniform(1, 30)),
        high=float(rng.uniform(2, 30)),
        low=float(rng.uniform(-1, 1)),
        anisotropy=float(rng.uniform(0.1, 1)),
        well=tuple(n // 2 for n in grid.shape) if rng.random() < 0.7 else None,
        rate=float(rng.uniform(1, 9)),
    )


def _compare(rng: Rng) -> CompareChoice:
    others = Parameters(24, 6, 1), None, Parameters(40, 8, 2, n_candidates=5)
    beside = "", "two-point", ImageChoice("delta", flip_ew=True)
    return CompareChoice(
        others=others[rng.integers(3) :],
        n=int(rng.integers(2, 20)),
        beside=beside[rng.integers(3)],
    )


def _sweep(rng: Rng) -> SweepChoice:
    return SweepChoice(
        ranges=(("template_size", (16, 24)), ("method", ("ccsim",)), ("overlap_size", ())),
        n_realizations=int(rng.integers(5, 9)),
        error=("patterns", "proportions")[rng.integers(2)],
    )


def fields_in(hint: Any) -> Iterator[tuple[str, str]]:
    """Yield each class and field that a type contains."""
    for option in get_args(hint):
        yield from fields_in(option)
    if is_dataclass(hint):
        for name, kind in get_type_hints(hint).items():
            yield hint.__name__, name
            yield from fields_in(kind)


def changed_in(value: Any) -> Iterator[tuple[str, str]]:
    """Yield each class and field whose value in an object is not the default."""
    for item in value if isinstance(value, tuple) else ():
        yield from changed_in(item)
    if is_dataclass(value):
        for field in fields(value):
            part = getattr(value, field.name)
            if part is not field.default and (part == field.default) is not True:
                yield type(value).__name__, field.name
            yield from changed_in(part)
