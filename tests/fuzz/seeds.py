"""Valid files to start from: one of each format, and published files if available."""

from __future__ import annotations

import os
import random
from functools import cache
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image

from ccwsim import Grid, HardData, Parameters, Project, TrainingImage
from ccwsim.io import parameters_to_json
from ccwsim.model.study import Study
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice, Upload
from ccwsim.sharing.project import project_as_bytes
from tests.io import every_reader, sample_files as sample

LARGEST = 2 * 2**20
"""Maximum size in bytes of a published file."""


@cache
def seeds() -> dict[str, bytes]:
    """Return valid files by name."""
    return {**_made(), **_published()}


def seed_of(source: random.Random) -> tuple[str, bytes]:
    """Return a random valid file, more often a small generated file than a published file."""
    made = [name for name in seeds() if not name.startswith("published")]
    names = made if source.random() < 0.92 else list(seeds())
    name = source.choice(names)
    return name, seeds()[name]


def _made() -> dict[str, bytes]:
    hard = {f"hard {name}": content for name, content in sample.hard_data().items()}
    return {
        **sample.training_images(), **hard,
        "two variables": sample.two_variables(), "table": sample.gslib_table(),
        "crlf": sample.crlf(sample.sgems()), "jpeg": sample.picture("JPEG"),
        "progressive jpeg": sample.picture("JPEG", progressive=True),
        "grey png": _picture(Image.new("LA", (5, 4), (7, 9))),
        "palette png": _picture(Image.new("P", (5, 4), 3)),
        "cmyk jpeg": _picture(Image.new("CMYK", (5, 4)), "JPEG"),
        "sixteen bits": _picture(Image.fromarray(np.arange(12, dtype=np.uint16).reshape(3, 4))),
        "animated gif": _animated(),
        "deflated tiff": sample.picture("TIFF", compression="tiff_adobe_deflate"),
        "plain tiff": sample.picture("TIFF"),
        "utf-16": sample.csv().decode().encode("utf-16"),
        **{f"of {kind}": content for kind, content in every_reader.files().items()},
        "shp alone": b"\x00\x00\x27\x0a" + bytes(200),
        **_gis(), "names of facies": sample.in_utm(),
        "geojson of names": sample.geojson(["a", "b", "1", ""]),
        "probabilities": sample.probabilities(), "vertical curves": sample.vertical_curves(),
        "polygons": sample.polygons(),
        "project": project(), "parameters": parameters_to_json(Parameters()).encode(),
    }  # fmt: skip


def _gis() -> dict[str, bytes]:
    """Return files whose format needs pyogrio, if pyogrio is installed."""
    if find_spec("pyogrio") is None:
        return {}
    return {"geopackage": sample.gis("gpkg"), "shapefile": sample.gis("shz")}


def _published() -> dict[str, bytes]:
    beside = Path(__file__).resolve().parents[2].parent / "shared" / "data"
    folder = Path(os.environ.get("CCWSIM_DATA") or beside)
    files = sorted(folder.rglob("*")) if folder.is_dir() else []
    return {
        f"published {path.name}": path.read_bytes()
        for path in files
        if path.is_file() and path.stat().st_size < LARGEST
    }


def project() -> bytes:
    """Return a small study as a project file."""
    array = np.kron(np.random.default_rng(1).integers(0, 3, (8, 8)), np.ones((3, 3), int))
    image = TrainingImage(array, name="the wall", facies_names=["<mud>", "sand", "Löss"])
    parameters = Parameters(template_size=8, overlap_size=4, wavelet_level=1)
    study = Study(image, Grid(20, 24), parameters, HardData([[3, 4], [0, 0]], [0, 2]), seed=3)
    wells = DataChoice("file", upload=Upload("wells.csv", b"x,y,facies\n1,2,0\n"))
    guides = GuideChoice(active=((1.0, 1.0), (20.0, 2.0), (9.0, 18.0)))
    choices = Choices(ImageChoice("lenses"), wells, study.grid, parameters, guides=guides)
    return project_as_bytes(Project(study, 2, settings={"show": ["2"]}, choices=choices))


def _picture(image: Image.Image, format: str = "PNG") -> bytes:
    content = BytesIO()
    image.save(content, format)
    return content.getvalue()


def _animated() -> bytes:
    content = BytesIO()
    frames = [Image.new("P", (6, 5), k) for k in range(4)]
    frames[0].save(content, "GIF", save_all=True, append_images=frames[1:], comment=b"frames")
    return content.getvalue()
