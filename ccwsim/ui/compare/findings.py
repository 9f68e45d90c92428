"""Results of a comparison as sentences, tables and CSV."""

from dataclasses import fields
from html import escape

import numpy as np
from numpy.typing import NDArray

from ccwsim import Ensemble, Parameters
from ccwsim.experiments.comparison import Comparison, PairRatio
from ccwsim.figures import DARK, LIGHT
from ccwsim.io.formats.csv_table import records_as_csv
from ccwsim.metrics import fit_proportions
from ccwsim.model.numbers import duration, three_digits
from ccwsim.report.verdicts import describe_proportion
from ccwsim.ui.compare.settings import TWO_POINT
from ccwsim.ui.widgets.text import numbers_table, page_text

DATA_COLUMNS = ("data_wrong", "data_mended", "data_forced")
MAX_EQUAL_TIME = 1.05
"""Two settings count as equally fast if the ratio of CPU times is at most this value."""


def colour_of(k: int) -> str:
    """Return the colour of setting `k` as a CSS value for the light and the dark theme."""
    light, dark = (theme.settings[k] for theme in (LIGHT, DARK))
    return f"light-dark({light}, {dark})"


def sentences(found: Comparison) -> list[str]:
    """Return sentences that compare the settings, and describe their proportions and data."""
    each = [describe_against_first(found, k) for k in range(1, len(found.names))]
    n = found.ensembles[0].hard_data.n
    text = page_text("Two-point simulation") + (f" It ignores the {n} hard data." if n else "")
    two_point = [text] if TWO_POINT in found.names else []
    return [*each, *two_point, *_describe_proportions(found), *_describe_data(found)]


def describe_against_first(found: Comparison, k: int) -> str:
    """Return a comparison of setting `k` with the first setting, by speed and ANODI ratios."""
    name, first = found.names[k], found.names[0]
    text = f"{name} is {describe_speed(found.cpu_seconds[k] / found.cpu_seconds[0])} {first}"
    if found.anodi is None:
        return f"{text}."
    return f"{text}; {describe_grades(found.ratio_of(name, first))}."


def describe_speed(ratio: float) -> str:
    """Return a ratio of CPU times in words, such as "4 times faster than"."""
    if 1 / MAX_EQUAL_TIME < ratio < MAX_EQUAL_TIME:
        return "as fast as"
    return f"{three_digits(max(ratio, 1 / ratio))} times {'slower' if ratio > 1 else 'faster'} than"


def _describe_proportions(found: Comparison) -> list[str]:
    """Describe proportions that are outside the range of crops of the training image."""
    said = []
    for name, ensemble in zip(found.names, found.ensembles, strict=True):
        fit = fit_proportions(ensemble)
        off = [] if fit is None else np.flatnonzero(fit.outside).tolist()
        off = off[1:] if len(off) == ensemble.training_image.n_facies == 2 else off
        said += [f"{name}: {describe_proportion(ensemble, k)}." for k in off]
    return [f"Proportions off: {' '.join(said)}"] if said else []


def _describe_data(found: Comparison) -> list[str]:
    n = found.ensembles[0].hard_data.n
    if not n:
        return []
    each = zip(found.names, found.ensembles, strict=True)
    wrong = {name: float(e.n_mismatched.mean()) for name, e in each if name != TWO_POINT}
    broken = [f"{name} {three_digits(w)}" for name, w in wrong.items() if w]
    if not broken:
        return [f"All {n} data are honoured by all settings."]
    rest = "" if len(broken) == len(wrong) else "; the other settings honour all data"
    return [f"Mean number of the {n} data not honoured: {', '.join(broken)}{rest}."]


def describe_grades(row: PairRatio) -> str:
    """Describe a pair of settings; a ratio that is within two standard errors of 1 counts as 1."""
    if not np.isfinite(row.ratio):
        return "one realization shows no variety"
    if np.isnan(row.errors).any():
        return "too few realizations to distinguish the patterns of the settings"
    between, within, ratio = row.grades
    if not (between or within or ratio):
        return "no difference in patterns beyond two standard errors"
    percent = [f"{100 * abs(value - 1):.0f} %" for value in (row.between, row.within)]
    varied = _graded(between, f"{percent[0]} less varied", "as varied", f"{percent[0]} more varied")
    near = _graded(within, f"{percent[1]} nearer to", "as near to", f"{percent[1]} farther from")
    verdict = _graded(ratio, "worse", "as good", "better")
    return f"{varied}, {near} the training image; {verdict} by ANODI"


def describe_ratio(row: PairRatio) -> str:
    """Return a sentence for a row of the table of ratios."""
    return f"{row.name} against {row.other}: {describe_grades(row)}"


def _graded(grade: int, below: str, same: str, above: str) -> str:
    return (same, above, below)[grade]


def figures_table(found: Comparison) -> str:
    """Return an HTML table with time, data and pattern distances of each setting."""
    with_data = found.ensembles[0].hard_data.n > 0
    data_heads = ("data wrong", "re-simulated", "forced") if with_data else ()
    heads = ("", "CPU a realization", f"to {found.names[0]}", *data_heads)
    rows = []
    for k, (name, e) in enumerate(zip(found.names, found.ensembles, strict=True)):
        letter = f'<b class="own" style="--own: {colour_of(k)}">{escape(name)}</b>'
        ratio = found.cpu_seconds[k] / found.cpu_seconds[0]
        means = map(three_digits, _counts_of_data(name, e).mean(axis=1)) if with_data else ()
        patterns = _patterns(found, k)
        rows.append([letter, duration(found.cpu_seconds[k]), f"{ratio:.2f} ×", *means, *patterns])
    return numbers_table(rows, (*heads, "from the image", "variety"), "figures")


def _counts_of_data(name: str, e: Ensemble) -> NDArray[np.float64]:
    """Return wrong, re-simulated and forced data, shape (3, n); NaN if the method ignores data."""
    counts = np.array([e.n_mismatched, e.n_resimulated, e.n_forced], float)
    return counts * np.nan if name == TWO_POINT else counts


def _patterns(found: Comparison, k: int) -> list[str]:
    """Return distance and variety of a setting: the first in bits, others as ANODI ratios to it."""
    first = found.names[0]
    if k and found.anodi is not None:
        row = found.ratio_of(found.names[k], first)
        return [f"{v:.2f} × {first}" if np.isfinite(v) else "–" for v in (row.within, row.between)]
    bits = found.distance[k], found.variety[k]
    return ["–" if np.isnan(v) else f"{three_digits(v)} bits" for v in bits]


def ratio_table(found: Comparison) -> str:
    """Return an HTML table of distances (between, within), ratio and verdict of each pair."""
    rows = []
    for row in found.ratios:
        ratios = (row.between, row.within, row.ratio)
        cells = (f"{value:.2f}" if np.isfinite(value) else "–" for value in ratios)
        name = f"{escape(row.name)} : {escape(row.other)}"
        rows.append([name, *cells, escape(describe_ratio(row))])
    return numbers_table(rows, ("", "between", "within", "ratio", ""), "ratios")


def settings_csv(found: Comparison) -> bytes:
    """Return CSV with parameters and mean results of each setting."""
    records = []
    for k, (name, e) in enumerate(zip(found.names, found.ensembles, strict=True)):
        own = "" if name == TWO_POINT else e.parameters
        record: dict[str, object] = {"setting": name}
        record |= {f.name: str(own and getattr(own, f.name)) for f in fields(Parameters)}
        record["cpu_seconds"] = found.cpu_seconds[k]
        record["cpu_ratio_to_first"] = found.cpu_seconds[k] / found.cpu_seconds[0]
        record |= zip(DATA_COLUMNS, _counts_of_data(name, e).mean(axis=1), strict=True)
        record["distance_to_image_bits"] = found.distance[k]
        record["variety_bits"] = found.variety[k]
        records.append(record | _shares(found, found.proportions[k].mean(axis=0)))
    return records_as_csv(records)


def realizations_csv(found: Comparison) -> bytes:
    """Return CSV with a line per realization, including its position in the MDS plot."""
    records = []
    for k, (name, e) in enumerate(zip(found.names, found.ensembles, strict=True)):
        placed = np.full((e.n, 3), np.nan)
        if found.anodi is not None and found.scaling is not None:
            positions = found.scaling.positions[found.anodi.owner == k]
            placed = np.column_stack([found.distances[k], positions])
        counts = _counts_of_data(name, e)
        for r in range(e.n):
            record: dict[str, object] = {"setting": name, "realization": r + 1}
            record["cpu_seconds"] = e.cpu_seconds[r]
            record |= zip(DATA_COLUMNS, counts[:, r], strict=True)
            record |= _shares(found, found.proportions[k][r])
            record |= zip(("distance_to_image_bits", "mds_1", "mds_2"), placed[r], strict=True)
            records.append(record)
    return records_as_csv(records)


def _shares(found: Comparison, proportions: NDArray[np.float64]) -> dict[str, object]:
    codes = found.ensembles[0].training_image.codes
    return {f"proportion_{code}": share for code, share in zip(codes, proportions, strict=True)}


def ratios_csv(found: Comparison) -> bytes:
    """Return the table of ANODI ratios as CSV."""
    return records_as_csv(
        [
            {
                "setting": row.name,
                "to": row.other,
                "between_ratio": row.between,
                "within_ratio": row.within,
                "ratio": row.ratio,
            }
            for row in found.ratios
        ]
    )
