"""Inputs of the experiments: the authors' files if available, otherwise bundled files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ccwsim import datasets
from ccwsim.datasets.catalogue import reference_field
from ccwsim.datasets.sampling import sample_random
from ccwsim.io import read_hard_data, read_training_image
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage

IMAGES = {
    "channel": ("ti_channel_256x256", "channels"),
    "stone wall": ("ti_stonewall_200x200", "stone_wall"),
    "three facies": ("ti_three_facies_400x400", "barchans"),
}
"""The authors' file of each image, and the bundled image used if that file is missing."""
FACIES = {"channel": ("mud", "sand"), "stone wall": ("stone", "mortar")}
DATA = {
    ("channel", 100): "paper/hd_channel_100_grid512x512",
    ("channel", 300): "paper/hd_channel_300_grid512x512",
    ("channel", 400): "paper/hd_channel_400_grid512x512",
    ("channel", 1000): "reference/hd_channel_1000_grid512x512",
    ("channel", 2000): "reference/hd_channel_2000_grid512x512",
    ("channel", 4000): "paper/hd_channel_dense_4000_grid256x256",
    ("stone wall", 300): "paper/hd_stonewall_300_grid512x512",
    ("three facies", 400): "paper/hd_three_facies_400_grid1000x1000",
}
DENSE_REFERENCE = "paper/reference_channel_dense_256x256"


@dataclass(frozen=True)
class PaperInputs:
    """Training images, hard data and published realizations in a folder."""

    folder: Path | None = None  # folder with `paper` and `reference`; None for bundled images

    def image(self, name: str) -> TrainingImage:
        """Return the training image "channel", "stone wall" or "three facies"."""
        file, bundled = IMAGES[name]
        path = self._file(f"paper/{file}.npy")
        if path is None:
            return datasets.load(bundled)
        found = read_training_image(path)
        names = FACIES.get(name, ())
        names = names if len(names) == found.n_facies else None
        return TrainingImage(found.array, name=f"{name} (authors')", facies_names=names)

    def describe(self, name: str) -> str:
        """Return a phrase that says which image is used for one of the paper's images."""
        if self.is_own(name):
            return f"the authors' {name} training image"
        return f"our bundled image “{IMAGES[name][1]}” in place of the authors' {name} image"

    def is_own(self, name: str) -> bool:
        """Return whether the authors' file of this image is available."""
        return self._file(f"paper/{IMAGES[name][0]}.npy") is not None

    def data(self, name: str, n: int, shape: tuple[int, int]) -> HardData:
        """Return about `n` hard data for an image and a grid shape.

        If available, the authors' data inside the grid are returned. Otherwise, data of equal
        density are sampled from the reference field of the bundled image.
        """
        stem = DATA[name, n]
        ny, nx = map(int, stem.rsplit("grid", 1)[1].split("x"))
        path = self._file(f"{stem}.csv") if self.is_own(name) else None
        if path is not None:
            return inside(read_hard_data(path, Grid(ny, nx)), shape)
        share = shape[0] * shape[1] / (ny * nx)
        truth = reference_field(IMAGES[name][1], shape).array
        return sample_random(truth, max(round(n * share), 1), seed=n)

    def dense_reference(self, shape: tuple[int, int]) -> tuple[HardData, TrainingImage]:
        """Return dense data and the image from which they were sampled, cut to a grid shape."""
        path = self._file(f"{DENSE_REFERENCE}.npy") if self.is_own("channel") else None
        if path is not None and self._file(f"{DATA['channel', 4000]}.csv") is not None:
            truth = read_training_image(path).array
        else:
            truth = reference_field(IMAGES["channel"][1], shape).array
        truth = truth[: shape[0], : shape[1]]
        return self.data("channel", 4000, (truth.shape[0], truth.shape[1])), TrainingImage(truth)

    def published(self, name: str, image: TrainingImage) -> NDArray[np.uint8] | None:
        """Return the realizations of a published code as facies indices, or None if unavailable.

        Raises `CCWSIMError` for a file with unexpected content.
        """
        path = self._file(f"reference/{name}.npz")
        if path is None:
            return None
        try:
            with np.load(path, allow_pickle=False) as saved:
                codes = saved["r"]
        except (OSError, ValueError, KeyError) as error:
            raise CCWSIMError(
                f"{path}: the file must contain realizations named r; remove it or write it again "
                f"({error})"
            ) from error
        if codes.ndim != 3 or not np.isin(codes, image.codes).all():
            raise CCWSIMError(
                f"{path}: the file must contain an array (n, ny, nx) with the image's facies"
            )
        return np.searchsorted(image.codes, codes).astype(np.uint8)

    def _file(self, relative: str) -> Path | None:
        if self.folder is None:
            return None
        path = self.folder / relative
        return path if path.is_file() else None


def inputs_in(folder: str | Path | None) -> PaperInputs:
    """Return the inputs of a folder; if the folder is named `paper`, use its parent.

    Raises `CCWSIMError` for a missing folder, or one without the authors' training images.

    Examples
    --------
    >>> inputs_in(None).image("channel").name
    'channels'
    """
    if folder is None:
        return PaperInputs()
    given = Path(folder)
    if not given.is_dir():
        raise CCWSIMError(f"{folder}: no such folder; give none to use the bundled images")
    for candidate in (given, given.parent):
        found = PaperInputs(candidate.resolve())
        if any(found.is_own(name) for name in IMAGES):
            return found
    raise CCWSIMError(
        f"{folder}: no file paper/{IMAGES['channel'][0]}.npy; give the folder that contains the "
        "folders paper and reference, or give no folder to use the bundled images"
    )


def inside(data: HardData, shape: tuple[int, int]) -> HardData:
    """Return the data whose cells are inside a grid of this shape."""
    kept = (data.cells < shape).all(axis=1)
    return HardData(data.cells[kept], data.facies[kept])
