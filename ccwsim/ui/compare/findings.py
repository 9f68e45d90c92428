"""Results of a comparison as sentences, tables and CSV."""

from dataclasses import fields
from html import escape

import numpy as np

from ccwsim import Ensemble, Parameters
from ccwsim.experiments.comparison import Comparison, PairRatio
from ccwsim.figures import DARK, LIGHT
from ccwsim.io.formats.csv_table import records_as_csv
from ccwsim.metrics import fit_proportions
from ccwsim.model import Floats, duration, three_digits
from ccwsim.report.verdicts import describe_proportion
from ccwsim.ui.compare.settings import TWO_POINT
from ccwsim.ui.widgets import numbers_table, page_text

PLACE_COLUMNS = ("distance_to_image_bits", "mds_1", "mds_2")
DATA_COLUMNS = ("data_wrong", "data_mended", "data_forced")
MAX_EQUAL_TIME = 1.05
"""Two settings count as equally fast if the ratio of CPU times is at most this value."""


def setting_colour(k: int) -> str:
    """Return the colour of setting `k` as a CSS value for the light and the dark theme."""
    light, dark = (theme.settings[k] for theme in (LIGHT, DARK))
    return f"light-dark({light}, {dark})"


def sentences(comparison: Comparison) -> list[str]:
    """Return sentences that compare the settings, and describe their proportions and data."""
    n = comparison.first.hard_data.n
    text = page_text("Two-point simulation") + (f" It ignores the {n} hard data." if n else "")
    two_point = [text] if TWO_POINT in comparison.names else []
    return [
        *[describe_against_first(comparison, k) for k in range(1, len(comparison.names))],
        *two_point,
        *_describe_proportions(comparison),
        *_describe_data(comparison),
    ]


def describe_against_first(comparison: Comparison, k: int) -> str:
    """Return a comparison of setting `k` with the first setting, by speed and ANODI ratios."""
    name, first = comparison.names[k], comparison.names[0]
    text = (
        f"{name} is {describe_speed(comparison.cpu_seconds[k] / comparison.cpu_seconds[0])} {first}"
    )
    if comparison.anodi is None:
        return f"{text}."
    return f"{text}; {describe_grades(comparison.ratio_of(name, first))}."


def describe_speed(ratio: float) -> str:
    """Return a ratio of CPU times in words, such as "4 times faster than"."""
    if 1 / MAX_EQUAL_TIME < ratio < MAX_EQUAL_TIME:
        return "as fast as"
    return f"{three_digits(max(ratio, 1 / ratio))} times {'slower' if ratio > 1 else 'faster'} than"


def _describe_proportions(comparison: Comparison) -> list[str]:
    """Describe proportions that are outside the range of crops of the training image."""
    deviations = []
    for name, ensemble in comparison.by_name.items():
        fit = fit_proportions(ensemble)
        off = [] if fit is None else np.flatnonzero(fit.outside).tolist()
        off = off[1:] if len(off) == ensemble.training_image.n_facies == 2 else off
        deviations += [f"{name}: {describe_proportion(ensemble, k)}." for k in off]
    return [f"Proportions off: {' '.join(deviations)}"] if deviations else []


def _describe_data(comparison: Comparison) -> list[str]:
    n = comparison.first.hard_data.n
    if not n:
        return []
    ensembles = comparison.by_name.items()
    wrong = {name: float(e.n_mismatched.mean()) for name, e in ensembles if name != TWO_POINT}
    broken = [f"{name} {three_digits(w)}" for name, w in wrong.items() if w]
    if not broken:
        return [f"All {n} data are honoured by all settings."]
    ending = "" if len(broken) == len(wrong) else "; the other settings honour all data"
    return [f"Mean number of the {n} data not honoured: {', '.join(broken)}{ending}."]


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


def _graded(grade: int, below: str, equal: str, above: str) -> str:
    return (equal, above, below)[grade]


def figures_table(comparison: Comparison) -> str:
    """Return an HTML table with time, data and pattern distances of each setting."""
    with_data = comparison.first.hard_data.n > 0
    data_heads = ("data wrong", "re-simulated", "forced") if with_data else ()
    heads = ("", "CPU a realization", f"to {comparison.names[0]}", *data_heads)
    rows = []
    for k, (name, e) in enumerate(comparison.by_name.items()):
        letter = f'<b class="own" style="--own: {setting_colour(k)}">{escape(name)}</b>'
        ratio = comparison.cpu_seconds[k] / comparison.cpu_seconds[0]
        means = map(three_digits, _counts_of_data(name, e).mean(axis=1)) if with_data else ()
        patterns = _patterns(comparison, k)
        rows.append(
            [letter, duration(comparison.cpu_seconds[k]), f"{ratio:.2f} ×", *means, *patterns]
        )
    return numbers_table(rows, (*heads, "from the image", "variety"), "figures")


def _counts_of_data(name: str, e: Ensemble) -> Floats:
    """Return wrong, re-simulated and forced data, shape (3, n); NaN if the method ignores data."""
    counts = np.array([e.n_mismatched, e.n_resimulated, e.n_forced], float)
    return counts * np.nan if name == TWO_POINT else counts


def _patterns(comparison: Comparison, k: int) -> list[str]:
    """Return distance and variety: of the first setting in bits, of others as ratios to it."""
    first = comparison.names[0]
    if k and comparison.anodi is not None:
        row = comparison.ratio_of(comparison.names[k], first)
        return [f"{v:.2f} × {first}" if np.isfinite(v) else "–" for v in (row.within, row.between)]
    bits = comparison.distance[k], comparison.variety[k]
    return ["–" if np.isnan(v) else f"{three_digits(v)} bits" for v in bits]


def ratio_table(comparison: Comparison) -> str:
    """Return an HTML table of distances (between, within), ratio and verdict of each pair."""
    rows = []
    for row in comparison.ratios:
        ratios = (row.between, row.within, row.ratio)
        texts = (f"{value:.2f}" if np.isfinite(value) else "–" for value in ratios)
        name = f"{escape(row.name)} : {escape(row.other)}"
        rows.append([name, *texts, escape(describe_ratio(row))])
    return numbers_table(rows, ("", "between", "within", "ratio", ""), "ratios")


def settings_csv(comparison: Comparison) -> bytes:
    """Return CSV with parameters and mean results of each setting."""
    records = []
    for k, (name, e) in enumerate(comparison.by_name.items()):
        parameters = "" if name == TWO_POINT else e.parameters
        values = {
            f.name: str(parameters and getattr(parameters, f.name)) for f in fields(Parameters)
        }
        records.append(
            {
                "setting": name,
                **values,
                "cpu_seconds": comparison.cpu_seconds[k],
                "cpu_ratio_to_first": comparison.cpu_seconds[k] / comparison.cpu_seconds[0],
                **dict(zip(DATA_COLUMNS, _counts_of_data(name, e).mean(axis=1), strict=True)),
                "distance_to_image_bits": comparison.distance[k],
                "variety_bits": comparison.variety[k],
                **_shares(comparison, comparison.proportions[k].mean(axis=0)),
            }
        )
    return records_as_csv(records)


def comparison_csv(comparison: Comparison) -> bytes:
    """Return CSV with a line per realization, including its position in the MDS plot."""
    records = []
    for k, (name, e) in enumerate(comparison.by_name.items()):
        placed = np.full((e.n, 3), np.nan)
        if comparison.anodi is not None and comparison.scaling is not None:
            positions = comparison.scaling.positions[comparison.anodi.owner == k]
            placed = np.column_stack([comparison.distances[k], positions])
        counts = _counts_of_data(name, e)
        records += [
            {
                "setting": name,
                "realization": r + 1,
                "cpu_seconds": e.cpu_seconds[r],
                **dict(zip(DATA_COLUMNS, counts[:, r], strict=True)),
                **_shares(comparison, comparison.proportions[k][r]),
                **dict(zip(PLACE_COLUMNS, placed[r], strict=True)),
            }
            for r in range(e.n)
        ]
    return records_as_csv(records)


def _shares(comparison: Comparison, proportions: Floats) -> dict[str, object]:
    codes = comparison.first.training_image.codes
    return {f"proportion_{code}": share for code, share in zip(codes, proportions, strict=True)}


def ratios_csv(comparison: Comparison) -> bytes:
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
            for row in comparison.ratios
        ]
    )
