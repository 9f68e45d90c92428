"""Read a file in all ways that scripts can use, and as the dashboard reads uploads."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator

import numpy as np

import ccwsim.io as cio
from ccwsim import Grid, TrainingImage
from ccwsim.io.limits import limited, upload_limits
from ccwsim.sharing.choices import Upload
from ccwsim.sharing.project import read_project
from ccwsim.ui.session.resolve import opened

NAMES = (
    "ti.dat", "../../../etc/passwd", "C:\\x\\y.png", "a\x00b", "**x**", "<script>alert(1)</script>",
    "$math$ :material/home:", "x" * 5000, "", ".", "\u202ename", "a\nb", "\ud800", "%s%n{0}",
)  # fmt: skip
"""File names that a client may send."""

_TI = TrainingImage(np.array([[0, 0, 1, 2], [0, 1, 1, 2], [2, 1, 0, 0]]))
_COLLARS, _LOG = b"well,x,y,z\nA,1,2,5\n", b"well,from,to,facies\nA,0,2,1\n"
_DROP = {"on_collision": "majority", "on_outside": "drop", "on_unknown": "drop"}

WAYS: dict[str, Callable] = {
    "inspect": lambda file: cio.inspect(file),
    "image": lambda file: cio.read_training_image(file),
    "image of a shape": lambda file: cio.read_training_image(file, shape=(3, 4)),
    "image by threshold": lambda file: cio.read_training_image(file, threshold=1, slice_index=0),
    "image in classes": lambda file: cio.read_training_image(file, classes=3, up=True),
    "grid": lambda file: cio.read_grid(file, slice_index=0),
    "points": lambda file: cio.import_hard_data(file),
    "points on a grid": lambda file: cio.import_hard_data(file, Grid(3, 4), _TI, **_DROP),
    "points sorted out": lambda file: cio.import_hard_data(
        file, Grid(1000, 1000), threshold=0.5, **{**_DROP, "on_collision": "nearest"}
    ),
    "points by name": lambda file: cio.import_hard_data(
        file, Grid(3, 4), _TI, facies_names={"sand": 1, "a": 0}, on_unknown="drop"
    ),
    "preview": lambda file: cio.preview_points(file),
    "points of a volume": lambda file: cio.import_hard_data(file, Grid(3, 4, nz=5), **_DROP),
    "preview of a volume": lambda file: cio.preview_points(file, grid_shape=(5, 3, 4)),
    "collars": lambda file: cio.import_wells(file, io.BytesIO(_LOG), Grid(3, 4, nz=5), **_DROP),
    "intervals": lambda file: cio.import_wells(
        io.BytesIO(_COLLARS), file, Grid(3, 4, nz=5), **_DROP
    ),
    "surveys": lambda file: cio.import_wells(
        io.BytesIO(_COLLARS), io.BytesIO(_LOG), Grid(3, 4, nz=5), surveys=file, **_DROP
    ),
    "preview of collars": lambda file: cio.preview_wells(file, "collars"),
    "preview of intervals": lambda file: cio.preview_wells(file, "intervals"),
    "preview of surveys": lambda file: cio.preview_wells(file, "surveys"),
    "fitted grid": lambda file: cio.fit_grid(cio.read_points(file)),
    "project": lambda file: read_project(file),
    "realizations": lambda file: cio.read_realizations(file),
    "realizations of an image": lambda file: cio.read_realizations(file, _TI),
    "parameters": lambda file: cio.parameters_from_json(file.getvalue()),
    "probabilities": lambda file: cio.read_probabilities(file, Grid(3, 4)),
    "probability of a facies": lambda file: cio.read_probabilities(file, Grid(6, 8), 1),
    "vertical curves": lambda file: cio.read_probabilities(file, Grid(3, 4, nz=5)),
    "values": lambda file: cio.read_values(file, Grid(6, 8, cell_size=(2.0, 2.0))),
    "active cells": lambda file: cio.read_active(file, Grid(3, 4)),
}  # fmt: skip


UPLOADED = {
    **{word: WAYS[word] for word in ("inspect", "image", "points", "preview", "surveys")},
    **{word: WAYS[word] for word in ("probabilities", "vertical curves", "active cells")},
    "project": lambda file: file.read_with(read_project),
}
"""Ways in which the dashboard reads an upload; together they use all readers."""


def uploads(content: bytes, name: str) -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield name and function of each way in which the dashboard reads an upload."""
    upload = Upload(name, content)
    for word, way in UPLOADED.items():

        def act(way: Callable = way) -> object:
            with opened(upload) as file:
                return way(file)

        yield word, act


def readings(content: bytes, name: str) -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield name and function of each way in which a script can read a file."""
    for word, way in WAYS.items():

        def act(way: Callable = way) -> object:
            file = io.BytesIO(content)
            file.name = name
            with limited(upload_limits()):
                return way(file)

        yield word, act
