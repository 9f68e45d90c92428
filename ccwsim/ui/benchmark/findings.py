"""Measured times as sentences, tables and CSV, with explanations of how to read them."""

from collections.abc import Iterable, Sequence
from html import escape
from math import prod

import numpy as np

from ccwsim.engine.stages.path import in_layers
from ccwsim.experiments.timing import growth, level_of
from ccwsim.experiments.trials import Trial, TrialResult
from ccwsim.io.formats.csv_table import records_as_csv
from ccwsim.model.arrays import describe_shape
from ccwsim.model.numbers import duration, plural, three_digits
from ccwsim.model.parameters import Parameters
from ccwsim.paper import published_times as published
from ccwsim.paper.published_times import PAPER, published_time
from ccwsim.report.settings import describe_value, short_name
from ccwsim.ui.benchmark.measurement import TimingRun, size_text
from ccwsim.ui.results.maps import pretty
from ccwsim.ui.widgets.text import numbers_table, page_text, scrolled

Setting = tuple[str, int, bool]
"""Key of a curve: method, level (for volumes, within layers), and whether volumes are simulated."""
NONE = "–"


def by_setting(timings: Sequence[TrialResult]) -> dict[Setting, list[TrialResult]]:
    """Return the times by method and level, in the order in which they were measured."""
    groups: dict[Setting, list[TrialResult]] = {}
    for timing in timings:
        groups.setdefault(setting_of(timing.trial), []).append(timing)
    return groups


def setting_of(trial: Trial) -> Setting:
    """Return the method, level and dimension of a trial."""
    p = trial.parameters
    return p.method, level_of(p), trial.grid.n_dimensions > 2


def name_of(setting: Setting, settings: Sequence[Setting]) -> str:
    """Return the name of a setting, including the method if methods differ between settings."""
    method, level, volume = setting
    several = len({method for method, _, _ in settings}) > 1
    kind = ("volume " if volume else "map ") if any(v for _, _, v in settings) else ""
    return f"{kind}{method.upper()} level {level}" if several else f"{kind}level {level}"


def describe_growth(name: str, timings: Sequence[TrialResult]) -> str:
    """Describe the growth of a setting's time with the number of cells; empty for a single size."""
    if len({t.trial.grid.n_cells for t in timings}) < 2:
        return ""
    fit = growth(timings)
    ends = (f((t.trial for t in timings), key=lambda trial: trial.grid.n_cells) for f in (min, max))
    low, high = (size_text(trial.grid.shape) for trial in ends)
    trend, reason = "linear", ""
    if not fit.linear:
        trend = "more than linear" if fit.exponent > 1 else "less than linear"
    if fit.exponent < 1 and not fit.linear:
        reason = ": on small grids, preparing the training image takes a larger share of the time"
    return (
        f"{name[:1].upper()}{name[1:]}: {three_digits(fit.seconds_per_million)} µs a cell from "
        f"{low} to {high}: {trend} (cells to the power {fit.exponent:.2f}){reason}."
    )


def growth_lines(timings: Sequence[TrialResult]) -> list[str]:
    """Describe how each setting's time grows with the grid; compare levels, volumes and maps."""
    groups = by_setting(timings)
    growths = [
        describe_growth(name_of(setting, list(groups)), group) for setting, group in groups.items()
    ]
    comparisons = (describe_levels(timings), describe_volumes(timings))
    return [line for line in (*growths, *comparisons) if line]


def describe_volumes(timings: Sequence[TrialResult]) -> str:
    """Compare the times per cell of volumes and of maps, on the largest grid of each."""
    groups = by_setting(timings)
    pairs = [
        (setting, group[-1], groups[(*setting[:2], False)][-1])
        for setting, group in groups.items()
        if setting[2] and (*setting[:2], False) in groups
    ]
    if not pairs:
        return ""
    ratios = (
        f"{three_digits(a.seconds_per_cell / b.seconds_per_cell)} (level {level})"
        for (_, level, _), a, b in pairs
    )
    return page_text("Volumes and maps", times=", ".join(ratios))


def describe_levels(timings: Sequence[TrialResult]) -> str:
    """Compare the lowest and highest wavelet level by time, as measured here and in the paper."""
    paper = {t.level: t.cpu_seconds or 0.0 for t in published.FIGURE_13}
    maps = [t for t in timings if setting_of(t.trial)[::2] == ("ccwsim", False)]
    by_level = {t.parameters.level: t for t in maps}
    compared = {level: t for level, t in by_level.items() if level in paper}
    if len(compared) < 2:
        return ""
    low, high = min(compared), max(compared)
    if compared[low].trial.grid != compared[high].trial.grid:
        return ""
    ratio = f"{compared[low].seconds / compared[high].seconds:.1f}"
    published_ratio = f"{paper[low] / paper[high]:.1f}"
    shares = published.LEVEL_CHANGES.items()
    changes = " and ".join(f"−{-100 * v:.1f} % ({a} to {b})" for (a, b), v in shares)
    return page_text(
        "Levels",
        low=low,
        high=high,
        ratio=ratio,
        changes=changes,
        side=compared[low].trial.grid.nx,
        published=published_ratio,
    )


def describe_run(run: TimingRun | None) -> str:
    """Describe the training image and parameters of a run."""
    if run is None:
        return ""
    image, p = run.main.training_image, run.main.parameters
    off = (
        "" if p.exact_data else "; data only condition the search, and mismatches are not corrected"
    )
    return (
        f"Training image {pretty(image.name)}, {describe_shape(image.shape)} cells, "
        f"{image.n_facies} facies; {_describe_sizes(p)}, K {p.n_candidates}"
        f"{_describe_maps(run.trials)}; median time of "
        f"{plural(run.n_realizations, 'realization')}, including preparation of the training "
        f"image; one thread; seed {run.main.seed}{off}."
    )


def _describe_maps(trials: Sequence[Trial]) -> str:
    """Describe the maps that are timed in addition to volumes; empty if no maps are timed."""
    maps = [trial.parameters for trial in trials if trial.grid.n_dimensions == 2]
    if not maps or len(maps) == len(trials):
        return ""
    return (
        "; maps of the middle layer of the image, with as many cells as the volumes, "
        f"{_describe_sizes(maps[0])}"
    )


def _describe_sizes(p: Parameters) -> str:
    names = ("template_size", "overlap_size")
    return ", ".join(
        f"{short_name(name)} {describe_value(name, getattr(p, name))}" for name in names
    )


def grid_table(timings: Sequence[TrialResult]) -> str:
    """Return an HTML table of times by grid size; for maps, the paper's largest grid is last."""
    groups = by_setting(timings)
    head = ["cells", *(name_of(setting, list(groups)) for setting in groups)]
    rows = []
    for shape in sorted({t.trial.grid.shape for t in timings}, key=lambda s: (prod(s), len(s))):
        row = [
            next((t for t in group if t.trial.grid.shape == shape), None)
            for group in groups.values()
        ]
        rows.append([size_text(shape), *(duration(t.seconds) if t else NONE for t in row)])
    if any(volume for _, _, volume in groups):
        return times_table(rows, head)
    paper = {t.level: t.cpu_seconds for t in published.FIGURE_13}
    last = [
        f"{paper[level]:.0f} s" if method == "ccwsim" and level in paper else NONE
        for method, level, _ in groups
    ]
    return times_table([*rows, ["paper, 5000²", *last]], head, "with-paper")


def data_table(timings: Sequence[TrialResult], trials: Sequence[Trial]) -> str:
    """Return measured and published times (none for volumes) as HTML, laid out as Table 2."""
    measured = {(setting_of(t.trial), t.trial.n_data): t for t in timings}
    n_cells_of = {setting_of(trial): trial.grid.n_cells for trial in trials}
    numbers = sorted({trial.n_data for trial in trials})
    nonzero, has_free = [n for n in numbers if n], 0 in numbers
    first = ["method", "level", *["no data"] * has_free]
    head = [*first, *(f"{n} data" for n in nonzero for _ in range(3))]
    second = [""] * len(first) + ["here", "paper", "wrong"] * len(nonzero)
    if len(nonzero) > 1:
        head += [f"{nonzero[-1]} / {nonzero[-2]}"] * 2
        second += ["here", "paper"]
    rows = []
    for setting, n_cells in n_cells_of.items():
        method, level, volume = setting
        ours = [measured.get((setting, n)) for n in nonzero]
        theirs = [
            published_time(PAPER, method, level, 0 if volume else n_cells, n) for n in nonzero
        ]
        row = [method.upper(), str(level), *[_time(measured.get((setting, 0)))] * has_free]
        for timing, stated in zip(ours, theirs, strict=True):
            row += [_time(timing), f"{stated.cpu_seconds} s" if stated else NONE, _wrong(timing)]
        if len(nonzero) > 1:
            row.append(_ratio([timing and timing.seconds for timing in ours]))
            row.append(_ratio([stated and stated.cpu_seconds for stated in theirs]))
        rows.append(row)
    return times_table(rows, head, subhead=second)


def octave_table() -> str:
    """Return an HTML table with times and numbers of wrong data of the published codes."""
    rows = []
    for t in published.OCTAVE_TIMES:
        took = NONE if t.cpu_seconds is None else f"{t.cpu_seconds:.1f} s"
        wrong = NONE if t.wrong_share is None else f"{100 * t.wrong_share:.1f} %"
        grid = f"{round((t.n_cells or 0) ** 0.5)}²"
        case = [t.image, grid, str(t.n_data), t.method.upper(), str(t.level)]
        rows.append([*case, took, wrong, t.note])
    head = ["image", "grid", "data", "method", "level", "CPU time", "data wrong", ""]
    return times_table(rows, head, "octave")


def times_table(
    rows: Iterable[Sequence[str]], head: Sequence[str], kind: str = "", subhead: Sequence[str] = ()
) -> str:
    """Return an HTML table of CPU times that scrolls sideways."""
    escaped_rows = [list(map(escape, row)) for row in rows]
    return scrolled(numbers_table(escaped_rows, head, f"times {kind}", subhead), "CPU times")


def _time(timing: TrialResult | None) -> str:
    return duration(timing.seconds) if timing else NONE


def _wrong(timing: TrialResult | None) -> str:
    if timing is None:
        return NONE
    share = 100 * float(np.mean(timing.n_mismatched)) / timing.trial.n_data
    return "0" if share == 0 else f"{three_digits(share)} %"


def _ratio(times: Sequence[float | None]) -> str:
    """Return the ratio of the last time to the time before it."""
    before, last = times[-2:]
    return f"{last / before:.2f}" if before and last else NONE


def timings_csv(runs: Sequence[TimingRun], machine: str) -> bytes:
    """Return CSV with a line per timed realization, including its setting and the machine."""
    records = []
    for timing in (timing for run in runs for timing in list(run.rows)):
        trial, p = timing.trial, timing.parameters
        image_nz, image_ny, image_nx = in_layers(trial.training_image.shape)
        nz, ny, nx = in_layers(trial.grid.shape)
        for r, cpu_seconds in enumerate(timing.cpu_seconds):
            records.append(
                {
                    "image": trial.training_image.name,
                    "image_nx": image_nx,
                    "image_ny": image_ny,
                    "image_nz": image_nz,
                    "method": p.method,
                    "level": describe_value("wavelet_level", p.level),
                    "template": describe_value("template_size", p.template_size),
                    "overlap": describe_value("overlap_size", p.overlap_size),
                    "candidates": p.n_candidates,
                    "exact_data": p.exact_data,
                    "nx": nx,
                    "ny": ny,
                    "nz": nz,
                    "n_data": trial.n_data,
                    "seed": trial.seed,
                    "realization": r + 1,
                    "cpu_seconds": cpu_seconds,
                    "data_not_honoured": timing.n_mismatched[r],
                    "machine": machine,
                }
            )
    return records_as_csv(records)
