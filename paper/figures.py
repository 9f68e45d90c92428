"""Draw the figures of the paper with the public API: ``python -m paper.figures``."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import ccwsim
from ccwsim import Secondary, datasets, figures

FOLDER = Path(__file__).parent
SIDE = 512
"""Side of a panel in pixels."""
GAP, TITLE = 16, 40
COLOURS = ("#E9DFC6", "#1F4E79", "#C8321F", "#F0AD2E")
DOTS = ("white", "#F0AD2E")
"""Colours of facies on maps and of the dots of wells."""


def facies_panel(cells: np.ndarray, wells: ccwsim.HardData | None = None) -> Image.Image:
    """Return a map of facies with row 0 at the bottom, and the cells of wells as dots."""
    indices = np.ascontiguousarray(cells, np.uint8)
    scale = max(1, SIDE // max(indices.shape))
    panel = opened(figures.map_png(indices, COLOURS, scale=scale))
    draw = ImageDraw.Draw(panel)
    for (row, column), facies in zip(wells.cells, wells.facies, strict=True) if wells else ():
        x, y = (column + 0.5) * scale, (indices.shape[0] - row - 0.5) * scale
        draw.ellipse((x - 5, y - 5, x + 5, y + 5), fill=DOTS[facies], outline="black", width=1)
    return panel


def probability_panel(probability: np.ndarray) -> Image.Image:
    """Return a map of probabilities in grey, black for 1, with row 0 at the bottom."""
    grey = np.round(255 * (1 - probability[::-1])).astype(np.uint8)
    return Image.fromarray(grey).convert("RGB").resize((SIDE, SIDE), Image.Resampling.NEAREST)


def opened(png: bytes) -> Image.Image:
    """Return the picture of a PNG in colours."""
    return Image.open(BytesIO(png)).convert("RGB")


def sheet(panels: Sequence[tuple[str, Image.Image]]) -> Image.Image:
    """Return panels side by side, each below its title."""
    width = len(panels) * (SIDE + GAP) - GAP
    picture = Image.new("RGB", (width, SIDE + TITLE), "white")
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(26)
    for k, (title, panel) in enumerate(panels):
        left = k * (SIDE + GAP)
        draw.text((left, 0), title, "black", font)
        picture.paste(panel.resize((SIDE, SIDE), Image.Resampling.NEAREST), (left, TITLE))
    return picture.quantize(64, dither=Image.Dither.NONE)


def wells_figure() -> Image.Image:
    """Return training image, wells with a realization, another realization, and probabilities."""
    image = datasets.load("channels")
    wells = datasets.load_hard_data("channels_60_wells")
    e = ccwsim.simulate(image, (512, 512), hard_data=wells, n_realizations=100, seed=0)
    assert not e.n_mismatched.any()
    return sheet([
        ("training image", facies_panel(image.array)),
        ("realization and 60 wells", facies_panel(e.indices[0], wells)),
        ("another realization", facies_panel(e.indices[1])),
        ("probability of sand, 100 realizations", probability_panel(e.probability(1))),
    ])  # fmt: skip


def more_figure() -> Image.Image:
    """Return directions from a map, a trend, and two sections of a volume."""
    channels, volume = datasets.load("channels"), datasets.load("sinuous_channels")
    angle = np.broadcast_to(np.linspace(-45.0, 45.0, 256), (256, 256))
    turned = ccwsim.simulate(channels, (256, 256), seed=1, secondary=Secondary(angle=angle))
    trend = ccwsim.Parameters(location_weight=0.5)
    delta = ccwsim.simulate(datasets.load("delta"), (256, 256), trend, seed=1)
    solid = ccwsim.simulate(volume, (48, 128, 128), seed=1)
    section = np.repeat(solid.indices[0][:, 64], 2, axis=0)
    return sheet([
        ("directions from a map", facies_panel(turned.indices[0])),
        ("trend of an image of a delta", facies_panel(delta.indices[0])),
        ("volume: a layer", facies_panel(solid.indices[0][24])),
        ("volume: a section, twice as high", framed(facies_panel(section))),
    ])  # fmt: skip


def framed(panel: Image.Image) -> Image.Image:
    """Return a picture in the middle of a white square of the same width."""
    square = Image.new("RGB", (panel.width, panel.width), "white")
    square.paste(panel, (0, (panel.width - panel.height) // 2))
    return square


FIGURES = {"wells.png": wells_figure, "more.png": more_figure}
"""Functions that draw the figures, by file."""


def main() -> None:
    """Draw and store all figures."""
    for name, draw in FIGURES.items():
        draw().save(FOLDER / name, optimize=True)


if __name__ == "__main__":
    main()
