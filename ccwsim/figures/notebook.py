"""Images, data and ensembles in a notebook: a picture with a line of words, a chart to zoom in."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from ccwsim.figures.maps import contact_sheet, data_png
from ccwsim.figures.palette import facies_colours
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage

THUMB = 240
"""Pixels of the longer side of a picture alone; those of an ensemble have half of it."""
MAX_TILES = 12
"""Realizations in a picture of an ensemble."""
HEIGHT = 380
"""Pixels of a row of maps in a chart."""


def image_html(image: TrainingImage) -> str:
    """Return a picture of a training image, north at the top, and what it is."""
    ny, nx = image.shape
    name, shares = image.name or "Training image", _facies(image, image.proportions)
    said = f"{name}: {nx} × {ny} cells, {shares}"
    colours = facies_colours(image)
    return _html(contact_sheet(image.indices[None], colours, longest=THUMB)[0], said)


def ensemble_html(ensemble: Ensemble) -> str:
    """Return a picture of the first realizations and what they are."""
    image, n = ensemble.training_image, ensemble.n
    shown = min(n, MAX_TILES)
    colours = facies_colours(image)
    sheet, _ = contact_sheet(ensemble.indices[:shown], colours, longest=THUMB // 2)
    said = (
        f"{n} realizations of {ensemble.grid.nx} × {ensemble.grid.ny} cells"
        f"{f', the first {shown} shown' if shown < n else ''}, {ensemble.hard_data.n} hard data, "
        f"seed {ensemble.seed}: {_facies(image, ensemble.proportions.mean(axis=0))}"
    )
    return _html(sheet, said)


def data_html(data: HardData) -> str:
    """Return a picture of hard data in the box that holds them, and how many there are."""
    if not data.n:
        return _html(b"", "no hard data")
    low, high = data.cells.min(axis=0), data.cells.max(axis=0)
    codes, facies = np.unique(data.facies, return_inverse=True)
    shape = tuple((high - low + 1).tolist())
    colours = facies_colours(TrainingImage(codes[None]))
    longest = min(THUMB, 8 * max(shape))
    picture = data_png(data.cells - low, facies, shape, colours, longest=longest)
    counts = ", ".join(
        f"{n} of facies {c}" for c, n in zip(codes, np.bincount(facies), strict=True)
    )
    rows, columns = (f"{a} to {b}" for a, b in zip(low, high, strict=True))
    return _html(picture, f"{data.n} hard data in rows {rows}, columns {columns}: {counts}")


def image_chart(image: TrainingImage) -> go.Figure:
    """Return a training image as a chart; hovering says the facies.

    Examples
    --------
    >>> image_chart(TrainingImage([[0, 1], [1, 1]])).data[0].z.tolist()
    [[0, 1], [1, 1]]
    """
    return _maps([image.indices], [image.name or "Training image"], image, Grid(*image.shape))


def ensemble_chart(ensemble: Ensemble, realizations: Sequence[int] | None = None) -> go.Figure:
    """Return realizations side by side in world coordinates, the first three by default."""
    which = range(min(3, ensemble.n)) if realizations is None else realizations
    indices = [np.asarray(ensemble.indices[r]) for r in which]
    titles = [f"Realization {ensemble.numbers[r] + 1}" for r in which]
    return _maps(indices, titles, ensemble.training_image, ensemble.grid, ensemble.hard_data)


def data_chart(data: HardData) -> go.Figure:
    """Return hard data as points at their columns and rows."""
    codes = np.unique(data.facies)
    colours = facies_colours(TrainingImage(codes[None])) if data.n else []
    chart = go.Figure()
    for code, colour in zip(codes.tolist(), colours, strict=True):
        rows, columns = data.cells[data.facies == code].T
        marker = {"color": colour, "line": {"color": "#FFFFFF", "width": 0.5}}
        points = {"x": columns, "y": rows, "mode": "markers", "marker": marker}
        chart.add_scatter(**points, name=f"facies {code}")
    chart.update_xaxes(title="column")
    chart.update_yaxes(title="row", scaleanchor="x", scaleratio=1)
    return chart


def _maps(
    maps: Sequence[NDArray[np.uint8]],
    titles: Sequence[str],
    image: TrainingImage,
    grid: Grid,
    data: HardData | None = None,
) -> go.Figure:
    n, colours = image.n_facies, facies_colours(image)
    chart = make_subplots(1, len(maps), subplot_titles=titles, shared_yaxes=True)
    steps = [(end / n, c) for k, c in enumerate(colours) for end in (k, k + 1)]
    (width, height), (west, south) = grid.cell_size, grid.origin
    for column, indices in enumerate(maps, 1):
        heatmap = go.Heatmap(
            z=indices,
            x0=west + width / 2,
            dx=width,
            y0=south + height / 2,
            dy=height,
            zmin=-0.5,
            zmax=n - 0.5,
            colorscale=steps,
            colorbar={"tickvals": list(range(n)), "ticktext": list(image.facies_names)},
            showscale=column == len(maps),
            hovertemplate="x %{x}, y %{y}: %{customdata}<extra></extra>",
            customdata=np.array(image.facies_names)[indices],
        )
        chart.add_trace(heatmap, 1, column)
        if data is not None and data.n:
            x, y = grid.centers_of(data.cells).T
            own = [colours[k] for k in np.searchsorted(image.codes, data.facies)]
            marker = {"color": own, "size": 5, "line": {"color": "#FFFFFF", "width": 0.8}}
            points = go.Scatter(
                x=x, y=y, mode="markers", marker=marker, name="hard data", showlegend=False
            )
            chart.add_trace(points, 1, column)
        anchor = "x" if column == 1 else f"x{column}"
        chart.update_yaxes(scaleanchor=anchor, scaleratio=1, row=1, col=column)
    return chart.update_layout(height=HEIGHT, margin={"l": 50, "r": 20, "t": 40, "b": 40})


def _facies(image: TrainingImage, shares: NDArray[np.float64]) -> str:
    pairs = zip(image.facies_names, shares, strict=True)
    return ", ".join(f"{name} {100 * share:.1f} %" for name, share in pairs)


def _html(picture: bytes, said: str) -> str:
    source = f"data:image/png;base64,{b64encode(picture).decode()}"
    tag = f'<img src="{source}" alt="{escape(said)}" style="image-rendering: pixelated">'
    return f"<figure>{tag if picture else ''}<figcaption>{escape(said)}</figcaption></figure>"
