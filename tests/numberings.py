"""One field of channels in files that number its facies in different ways."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO

import numpy as np
import rasterio
from PIL import Image
from scipy.ndimage import gaussian_filter

from ccwsim.io.formats.text_grids import grid_as_bytes

_VALUES = gaussian_filter(np.random.default_rng(3).normal(size=(60, 60)), 2.5)
CHANNEL = (np.quantile(_VALUES, 0.82) < _VALUES).astype(np.uint8)
"""Row 0 in the south; 0 is the background (82 %), 1 the channel."""
CELLS = np.argwhere(np.random.default_rng(4).random(CHANNEL.shape) < 0.06)
COLOURS = np.array([[235, 225, 190], [20, 40, 90]], np.uint8)
"""The background is light, so colours from dark to light begin with the channel."""


def _png(picture: Image.Image) -> bytes:
    content = BytesIO()
    picture.save(content, "PNG")
    return content.getvalue()


def picture() -> bytes:
    return _png(Image.fromarray(COLOURS[CHANNEL[::-1]]))


def palette() -> bytes:
    image = Image.fromarray(CHANNEL[::-1].copy())
    image.putpalette(COLOURS.ravel().tolist())
    return _png(image)


def palette_of_a_map() -> bytes:
    """Return a GeoTIFF whose indices begin with the channel, as a drawing program may do it."""
    profile = {"driver": "GTiff", "height": 60, "width": 60, "count": 1, "dtype": "uint8"}
    place = rasterio.Affine(10, 0, 0, 0, -10, 600)
    with rasterio.MemoryFile() as memory:
        with memory.open(**profile, transform=place, photometric="palette") as file:
            file.write(1 - CHANNEL[::-1], 1)
            file.write_colormap(1, {k: (*rgb, 255) for k, rgb in enumerate(COLOURS[::-1].tolist())})
        return memory.read()


def continuous() -> bytes:
    """Return values that are low in the channel; `THRESHOLD` divides them."""
    content = BytesIO()
    np.save(content, (1.0 - CHANNEL) * 0.2 + np.linspace(0, 0.05, 3600).reshape(60, 60))
    return content.getvalue()


IMAGES: dict[str, tuple[str, Callable[[], bytes], dict[str, object]]] = {
    "picture": ("rivers.png", picture, {}),
    "palette": ("rivers.png", palette, {}),
    "palette of a map": ("rivers.tif", palette_of_a_map, {}),
    "classes": ("rivers.npy", continuous, {"threshold": 0.1}),
}
"""Name, content and answers of images without codes of their own, in which the channel is 0."""


def table() -> bytes:
    rows = [f"{column + 0.5},{row + 0.5},{CHANNEL[row, column]}" for row, column in CELLS.tolist()]
    return "\n".join(["x,y,facies", *rows, ""]).encode()


def grid_with_gaps() -> bytes:
    values = np.full(CHANNEL.shape, -999.0)
    values[tuple(CELLS.T)] = CHANNEL[tuple(CELLS.T)]
    return grid_as_bytes([values], ["facies"])


def probabilities() -> bytes:
    soft = 0.1 + 0.8 * CHANNEL
    return grid_as_bytes([1 - soft, soft], ["P_0", "P_1"])


def codes() -> bytes:
    content = BytesIO()
    np.save(content, CHANNEL)
    return content.getvalue()


def named(content: bytes, name: str) -> BytesIO:
    file = BytesIO(content)
    file.name = name
    return file
