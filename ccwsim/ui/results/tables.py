"""Numbers as tables on the page and as CSV."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from io import StringIO
from typing import Any

import streamlit as st

from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.curves import connectivity_bundle, variogram_bundle


def curves_csv(ensemble: Ensemble, facies: int) -> bytes:
    """Return variograms and connectivity of a facies: one line a lag, one column a realization."""
    n = 0
    lines = []
    for statistic, direction, bundle in (
        ("variogram", "E-W", variogram_bundle(ensemble, facies, "E-W")),
        ("variogram", "N-S", variogram_bundle(ensemble, facies, "N-S")),
        ("connection", "E-W", connectivity_bundle(ensemble, facies, "E-W")),
        ("connection", "N-S", connectivity_bundle(ensemble, facies, "N-S")),
    ):
        n = len(bundle.each)
        for k, lag in enumerate(bundle.lags):
            curves = (bundle.reference, bundle.low, bundle.median, bundle.high, *bundle.each)
            lines.append([statistic, direction, int(lag), *(f"{curve[k]:.6g}" for curve in curves)])
    head = ["statistic", "direction", "lag_cells", "training_image", "q05", "median", "q95"]
    return as_csv([*head, *(f"realization_{r + 1}" for r in range(n))], lines)


def realizations_csv(ensemble: Ensemble) -> bytes:
    """Return one line a realization: CPU time, data not honoured, facies proportions."""
    codes = ensemble.training_image.codes
    head = ["realization", "cpu_seconds", "data_not_honoured"]
    lines = []
    for r, seconds in enumerate(ensemble.cpu_seconds):
        shares = (f"{share:.6g}" for share in ensemble.proportions[r])
        lines.append([r + 1, f"{seconds:.6g}", int(ensemble.n_mismatched[r]), *shares])
    return as_csv([*head, *(f"proportion_{code}" for code in codes)], lines)


def as_csv(head: Iterable[str], lines: Iterable[Iterable[object]]) -> bytes:
    """Return a table as CSV.

    Examples
    --------
    >>> as_csv(["a", "b"], [[1, 2]])
    b'a,b\\n1,2\\n'
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(list(head))
    writer.writerows([list(line) for line in lines])
    return text.getvalue().encode()


def csv_button(
    label: str, name: str, content: Callable[[], bytes], of: str, **options: Any
) -> None:
    """Draw a button that saves a table `of` a study, which is made when it is pressed."""
    options = {"key": f"download_{name}", "width": "stretch", **options}
    file: dict[str, Any] = {
        "file_name": f"{of}_{name}.csv",
        "mime": "text/csv",
        "on_click": "ignore",
    }
    st.download_button(label, content, **file, **options)


def numbers_table(rows: Iterable[Sequence[str]], head: Sequence[str] = (), kind: str = "") -> str:
    """Return a table as HTML; cells are HTML, and the first cell of a row is its name.

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
