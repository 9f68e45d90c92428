"""Pictures with captions and zoomable charts for notebooks; volumes show their middle layer."""

from base64 import b64encode
from collections.abc import Sequence
from html import escape

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from ccwsim import Ensemble, Grid, HardData, TrainingImage
from ccwsim.figures.maps import contact_sheet, data_png
from ccwsim.figures.style import as_written, facies_colours, value_steps, written
from ccwsim.model import (
    Bytes,
    Cells,
    Floats,
    Mask,
    cells_of,
    describe_shape,
    minus,
    three_digits,
)

# length in pixels of the longer side of a picture; halved if there are many pictures
NOTEBOOK_PIXELS = 240
MAX_LARGE_PICTURES = 4
MAX_TILES = 12  # maximum number of realizations shown in a picture of an ensemble
CHART_ROW_HEIGHT = 380  # height in pixels of a row of maps in a chart with several maps


def image_html(image: TrainingImage) -> str:
    """Return a picture of a training image with a caption; north is at the top."""
    name, content = image.name or "Training image", _content(image, image.proportions, image.values)
    layer, words = _middle(image.shape)
    caption = f"{name}: {describe_shape(image.shape)} cells{words}, {content}"
    indices, colours = _drawn(cells_of(image, layer), image, HardData())
    return _html(contact_sheet(indices[None], colours, longest=NOTEBOOK_PIXELS)[0], caption)


def ensemble_html(ensemble: Ensemble) -> str:
    """Return a picture of the first realizations with a caption."""
    image, n = ensemble.training_image, ensemble.n
    shown = min(n, MAX_TILES)
    layer, words = _middle(ensemble.grid.shape)
    cells = cells_of(ensemble, (slice(shown), *layer))
    indices, colours = _drawn(cells, image, ensemble.hard_data)
    longest = NOTEBOOK_PIXELS if shown <= MAX_LARGE_PICTURES else NOTEBOOK_PIXELS // 2
    sheet, _ = contact_sheet(indices, colours, longest=longest)
    caption = (
        f"{n} {'realization' if n == 1 else 'realizations'} of "
        f"{describe_shape(ensemble.grid.shape)} cells{words}"
        f"{f', the first {shown} shown' if shown < n else ''}, {ensemble.hard_data.n} hard data, "
        f"seed {ensemble.seed}: "
        f"{_content(image, ensemble.proportions.mean(axis=0), ensemble.values)}"
    )
    return _html(sheet, caption)


def data_html(data: HardData) -> str:
    """Return a picture of hard data in their bounding box; the caption states their number."""
    if not data.n:
        return _html(b"", "no hard data")
    low, high = data.cells.min(axis=0), data.cells.max(axis=0)
    codes, facies = np.unique(data.facies, return_inverse=True)
    shape = tuple((high - low + 1).tolist())[-2:]
    colours = facies_colours(TrainingImage(codes[None]))
    longest = min(NOTEBOOK_PIXELS, 8 * max(shape))
    drawn_mask, words = _middle_of_data(data)
    drawn_cells = (data.cells - low)[drawn_mask, -2:]
    picture = data_png(drawn_cells, facies[drawn_mask], shape, colours, longest=longest)
    counts = ", ".join(
        f"{n} of facies {c}" for c, n in zip(codes, np.bincount(facies), strict=True)
    )
    *layers, rows, columns = (f"{a} to {b}" for a, b in zip(low, high, strict=True))
    where = f"layers {layers[0]}{words}, rows {rows}" if layers else f"rows {rows}"
    return _html(picture, f"{data.n} hard data in {where}, columns {columns}: {counts}")


def image_chart(image: TrainingImage) -> go.Figure:
    """Return a chart of a training image with the facies as hover text."""
    layer, words = _middle(image.shape)
    title = (image.name or "Training image") + words
    return _maps([image.indices[layer]], [written(title)], image, Grid.of(image.shape[-2:]))


def ensemble_chart(ensemble: Ensemble, realizations: Sequence[int] | None = None) -> go.Figure:
    """Return a chart of selected realizations (by default the first three) in world coordinates."""
    which = range(min(3, ensemble.n)) if realizations is None else realizations
    layer, words = _middle(ensemble.grid.shape)
    indices = [np.asarray(ensemble.indices[(r, *layer)]) for r in which]
    titles = [f"Realization {ensemble.numbers[r] + 1}{words}" for r in which]
    grid, data = ensemble.grid, ensemble.hard_data
    if layer and data.n:
        cells, facies = data.cells, data.facies
        data = HardData(cells[cells[:, 0] == layer[0], 1:], facies[cells[:, 0] == layer[0]])
    grid = Grid(grid.ny, grid.nx, grid.cell_size[:2], grid.origin[:2])
    return _maps(indices, titles, ensemble.training_image, grid, data)


def data_chart(data: HardData) -> go.Figure:
    """Return a chart of hard data as points at their columns and rows."""
    codes = np.unique(data.facies)
    colours = facies_colours(TrainingImage(codes[None])) if data.n else []
    drawn_mask, words = _middle_of_data(data)
    chart = go.Figure()
    for code, colour in zip(codes.tolist(), colours, strict=True):
        rows, columns = data.cells[drawn_mask & (data.facies == code), -2:].T
        marker = {"color": colour, "line": {"color": "#FFFFFF", "width": 0.5}}
        chart.add_scatter(x=columns, y=rows, mode="markers", marker=marker, name=f"facies {code}")
    chart.update_xaxes(title="column")
    chart.update_yaxes(title="row", scaleanchor="x", scaleratio=1)
    return chart.update_layout(title=f"Hard data{words}") if words else chart


def _middle(shape: Sequence[int]) -> tuple[tuple[int, ...], str]:
    """Return index and description of the middle layer of a volume; for a map, both are empty."""
    if len(shape) == 2:
        return (), ""
    layer = shape[0] // 2
    return (layer,), f", layer {layer} (of 0 to {shape[0] - 1})"


def _middle_of_data(data: HardData) -> tuple[Mask, str]:
    """Return a mask of the data to draw (one layer of a volume), and a note on the layer."""
    if data.n_dimensions == 2 or not data.n:
        return np.ones(data.n, bool), ""
    layers = np.unique(data.cells[:, 0])
    layer = layers[len(layers) // 2]
    return data.cells[:, 0] == layer, f" (layer {layer} drawn)"


def _maps(
    maps: Sequence[Bytes],
    titles: Sequence[str],
    image: TrainingImage,
    grid: Grid,
    data: HardData | None = None,
) -> go.Figure:
    n, colours, names = image.n_facies, facies_colours(image), as_written(image.facies_names)
    chart = make_subplots(1, len(maps), subplot_titles=titles, shared_yaxes=True)
    steps = [(end / n, c) for k, c in enumerate(colours) for end in (k, k + 1)]
    (width, height), (west, south) = grid.cell_size, grid.origin
    for column, indices in enumerate(maps, 1):
        heatmap = go.Heatmap(
            z=indices if indices.max() < n else np.where(indices < n, indices, np.nan),
            x0=west + width / 2,
            dx=width,
            y0=south + height / 2,
            dy=height,
            zmin=-0.5,
            zmax=n - 0.5,
            colorscale=steps,
            colorbar={"tickvals": list(range(n)), "ticktext": names},
            showscale=column == len(maps),
            hovertemplate="x %{x}, y %{y}: %{customdata}<extra></extra>",
            hoverongaps=False,
            customdata=np.array([*names, ""])[np.minimum(indices, n)],
        )
        chart.add_trace(heatmap, 1, column)
        if data is not None and data.n:
            x, y = grid.centers_of(data.cells).T
            marker = {
                "color": [colours[k] for k in np.searchsorted(image.codes, data.facies)],
                "size": 5,
                "line": {"color": "#FFFFFF", "width": 0.8},
            }
            points = go.Scatter(
                x=x, y=y, mode="markers", marker=marker, name="hard data", showlegend=False
            )
            chart.add_trace(points, 1, column)
        anchor = "x" if column == 1 else f"x{column}"
        chart.update_yaxes(scaleanchor=anchor, scaleratio=1, row=1, col=column)
    return chart.update_layout(height=CHART_ROW_HEIGHT, margin={"l": 50, "r": 20, "t": 40, "b": 40})


def _drawn(cells: Cells, image: TrainingImage, data: HardData) -> tuple[Bytes, list[str]]:
    """Return indices of colours, and the colours, of facies or of a continuous variable."""
    if cells.values is None:
        return cells.indices, facies_colours(image)
    return value_steps(cells.values, image, data)


def _content(image: TrainingImage, shares: Floats, variables: dict[str, Floats]) -> str:
    """Return the proportions of the facies, or range and mean of a continuous variable."""
    for name, values in variables.items():
        numbers = np.nanmin(values), np.nanmax(values), np.nanmean(values)
        low, high, mean = (three_digits(float(number)) for number in numbers)
        return minus(f"{name} {low} to {high}, mean {mean} {image.units}".rstrip())
    pairs = zip(image.facies_names, shares, strict=True)
    return ", ".join(f"{name} {100 * share:.1f} %" for name, share in pairs)


def _html(picture: bytes, caption: str) -> str:
    source = f"data:image/png;base64,{b64encode(picture).decode()}"
    tag = f'<img src="{source}" alt="{escape(caption)}" style="image-rendering: pixelated">'
    return f"<figure>{tag if picture else ''}<figcaption>{escape(caption)}</figcaption></figure>"
