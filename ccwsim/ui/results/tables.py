"""Tables of numbers, on the page and as CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from ccwsim.figures import Bundle
from ccwsim.io.formats.csv_table import csv_as_bytes
from ccwsim.metrics import VERTICAL, axes_of
from ccwsim.metrics.bands import Statistic
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.curves import curve_bundle, vertical_proportions_bundle
from ccwsim.ui.widgets.fields import download


def curves_csv(ensemble: Ensemble, facies: int) -> bytes:
    """Return the curves of a facies with a row per lag and a column per realization.

    A volume also has vertical proportions and a column of layers; the bottom layer is 0.
    Proportions are empty for layers that the training image or the grid does not have.
    """
    ways, is_volume = axes_of(ensemble.grid.shape), ensemble.grid.nz is not None
    names: dict[Statistic, str] = {"variogram": "variogram", "connectivity": "connection"}
    curves = [
        (name, way, curve_bundle(ensemble, statistic, facies, way))
        for statistic, name in names.items()
        for way in ways
    ]
    lines: list[list[object]] = []
    for statistic, way, bundle in curves:
        at = [[int(lag), *([""] if is_volume else [])] for lag in bundle.lags]
        lines += _lines([statistic, way], at, bundle)
    if is_volume:
        layers = vertical_proportions_bundle(ensemble, facies)
        at = [["", k] for k in range(max(len(layers.lags), len(layers.reference)))]
        lines += _lines(["proportion", VERTICAL], at, layers)
    head = ["statistic", "direction", "lag_cells", *(["layer"] if is_volume else [])]
    head += ["training_image", "q05", "median", "q95"]
    n = len(curves[0][2].each)
    return csv_as_bytes([*head, *(f"realization_{r + 1}" for r in range(n))], lines)


def _lines(
    name: Sequence[object], at: Sequence[Sequence[object]], bundle: Bundle
) -> list[list[object]]:
    curves = (bundle.reference, bundle.low, bundle.median, bundle.high, *bundle.each)
    return [
        [*name, *where, *(f"{curve[k]:.6g}" if k < len(curve) else "" for curve in curves)]
        for k, where in enumerate(at)
    ]


def realizations_csv(ensemble: Ensemble) -> bytes:
    """Return a table with CPU time, data not honoured and proportions of each realization."""
    codes = ensemble.training_image.codes
    head = ["realization", "cpu_seconds", "data_not_honoured"]
    lines = []
    for r, seconds in enumerate(ensemble.cpu_seconds):
        shares = (f"{share:.6g}" for share in ensemble.proportions[r])
        lines.append([r + 1, f"{seconds:.6g}", int(ensemble.n_mismatched[r]), *shares])
    return csv_as_bytes([*head, *(f"proportion_{code}" for code in codes)], lines)


def csv_button(
    label: str, name: str, content: Callable[[], bytes], of: str, **options: Any
) -> None:
    """Draw a button that saves a table named after the study `of`; a click computes the table."""
    options = {"key": f"download_{name}", "width": "stretch", **options}
    download(label, content, f"{of}_{name}.csv", **options)


def numbers_table(rows: Iterable[Sequence[str]], head: Sequence[str] = (), kind: str = "") -> str:
    """Return a table as HTML; cells are HTML, and the first cell of a row is the row's name.

    Examples
    --------
    >>> numbers_table([["level", "2"]])
    '<table class="numbers"><tr><th>level</th><td>2</td></tr></table>'
    """
    lines = [f"<th>{name}</th>" + "".join(f"<td>{c}</td>" for c in cells) for name, *cells in rows]
    if head:
        lines.insert(0, "".join(f"<th>{cell}</th>" for cell in head))
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<table class="{f"numbers {kind}".strip()}">{body}</table>'
