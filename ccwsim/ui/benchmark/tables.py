"""Tables of times: by size of the grid, in the layout of the paper's Table 2, and as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from ccwsim.experiments.timing import Timing
from ccwsim.paper import published_times as published
from ccwsim.paper.published_times import PAPER, published_time
from ccwsim.ui.benchmark.run import TimingRun
from ccwsim.ui.benchmark.words import NAMES, Setting, by_setting, name_of
from ccwsim.ui.results.tables import as_csv
from ccwsim.ui.widgets.facts import seconds, three_digits
from ccwsim.ui.widgets.scrolled import scrolled

NONE = "–"
PAPER_SIDE = 512
"""Of the grid of Table 2."""


def grid_table(timings: Sequence[Timing], sides: Sequence[int]) -> str:
    """Return times by size of the grid, with the paper's largest grid in the last row."""
    found = by_setting(timings)
    head = ["cells", *(name_of(setting, list(found)) for setting in found)]
    rows = []
    for side in sides:
        took = [next((t for t in own if t.grid_shape[0] == side), None) for own in found.values()]
        if any(took):
            rows.append([f"{side}²", *(seconds(t.seconds) if t else NONE for t in took)])
    paper = {t.level: t.cpu_seconds for t in published.FIGURE_13}
    last = [
        f"{paper[level]:.0f} s" if method == "ccwsim" and level in paper else NONE
        for method, level in found
    ]
    return table_of([head], [*rows, ["paper, 5000²", *last]], marked=len(rows))


def data_table(
    timings: Sequence[Timing], settings: Sequence[Setting], numbers: Sequence[int], side: int
) -> str:
    """Return Table 2: method and level by number of data, measured and published side by side."""
    found = {(t.parameters.method, t.parameters.level, t.n_data): t for t in timings}
    shown = [n for n in numbers if n]
    first = ["method", "level", *(["no data"] if 0 in numbers else [])]
    head = [*first, *(f"{n} data" for n in shown for _ in range(3))]
    second = [""] * len(first) + ["here", "paper", "wrong"] * len(shown)
    has_ratio = len(shown) > 1
    if has_ratio:
        head += [f"{shown[-1]} / {shown[-2]}"] * 2
        second += ["here", "paper"]
    rows = []
    for method, level in settings:
        row = [NAMES.get(method, method), str(level)]
        if 0 in numbers:
            row.append(_time(found.get((method, level, 0))))
        for n in shown:
            own = found.get((method, level, n))
            row += [_time(own), _paper(method, level, n, side), _wrong(own)]
        if has_ratio:
            row += _ratios(found, (method, level), shown[-2:], side)
        rows.append(row)
    return table_of([head, second], rows)


def octave_table() -> str:
    """Return the times and wrong data measured on the published codes."""
    rows = []
    for t in published.OCTAVE_TIMES:
        took = NONE if t.cpu_seconds is None else f"{t.cpu_seconds:.1f} s"
        wrong = NONE if t.wrong_share is None else f"{100 * t.wrong_share:.1f} %"
        grid = f"{round((t.n_cells or 0) ** 0.5)}²"
        case = [t.image, grid, str(t.n_data), NAMES[t.method], str(t.level)]
        rows.append([*case, took, wrong, t.note])
    head = ["image", "grid", "data", "method", "level", "CPU time", "data wrong", ""]
    return table_of([head], rows, words=(0, 3, 7))


def table_of(
    heads: Sequence[Sequence[str]],
    rows: Sequence[Sequence[str]],
    *,
    marked: int = -1,
    words: Sequence[int] = (0,),
) -> str:
    """Return a table in HTML; equal neighbours in a head become one cell, `marked` is a row."""
    top = "".join(f"<tr>{_head(row)}</tr>" for row in heads)
    body = "".join(
        f"<tr{' class=paper' if k == marked else ''}>"
        + "".join(
            f"<td{' class=word' if c in words else ''}>{escape(cell)}</td>"
            for c, cell in enumerate(row)
        )
        + "</tr>"
        for k, row in enumerate(rows)
    )
    return scrolled(f'<table class="times">{top}{body}</table>', "CPU times")


def _head(row: Sequence[str]) -> str:
    cells: list[tuple[str, int]] = []
    for text in row:
        if text and cells and cells[-1][0] == text and " " in text:
            cells[-1] = text, cells[-1][1] + 1
        else:
            cells.append((text, 1))
    return "".join(f"<th colspan={n}>{escape(text)}</th>" for text, n in cells)


def _time(timing: Timing | None) -> str:
    return seconds(timing.seconds) if timing else NONE


def _paper(method: str, level: int, n: int, side: int) -> str:
    found = published_time(PAPER, method, level, side**2, n) if side == PAPER_SIDE else None
    return f"{found.cpu_seconds} s" if found else NONE


def _wrong(timing: Timing | None) -> str:
    if timing is None:
        return NONE
    share = 100 * float(np.mean(timing.n_mismatched)) / timing.n_data
    return "0" if share == 0 else f"{three_digits(share)} %"


def _ratios(found: dict, setting: Setting, numbers: Sequence[int], side: int) -> list[str]:
    own = [found.get((*setting, n)) for n in numbers]
    here = f"{own[1].seconds / own[0].seconds:.2f}" if own[0] and own[1] else NONE
    said = [published_time(PAPER, *setting, side**2, n) for n in numbers]
    a, b = (t.cpu_seconds if t else None for t in said)
    return [here, f"{b / a:.2f}" if a and b else NONE]


IMAGE_HEAD = ["image", "image_nx", "image_ny"]
SETTING_HEAD = ["method", "level", "template", "overlap", "candidates", "exact_data"]
CASE_HEAD = ["nx", "ny", "n_data", "seed"]
RESULT_HEAD = ["realization", "cpu_seconds", "data_not_honoured", "machine"]


def timings_csv(runs: Sequence[TimingRun], machine: str) -> bytes:
    """Return one line a realization that was timed, with its setting and the machine."""
    lines = []
    for run in runs:
        ny, nx = run.training_image.shape
        image = [run.training_image.name, nx, ny]
        for timing in list(run.timings):
            p, (ny, nx) = timing.parameters, timing.grid_shape
            setting = [p.method, p.level, p.template_size, p.overlap_size, p.n_candidates]
            case = [*image, *setting, p.exact_data, nx, ny, timing.n_data, run.seed]
            lines += [
                [*case, r + 1, f"{cpu:.6g}", int(timing.n_mismatched[r]), machine]
                for r, cpu in enumerate(timing.cpu_seconds)
            ]
    return as_csv([*IMAGE_HEAD, *SETTING_HEAD, *CASE_HEAD, *RESULT_HEAD], lines)
