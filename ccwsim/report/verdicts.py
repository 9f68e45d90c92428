"""Sentences that compare realizations with their training image, shared by all pages."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ccwsim import Ensemble
from ccwsim.metrics.bands import Statistic
from ccwsim.metrics.checks import Check
from ccwsim.metrics.diagnosis import facies_at_edges
from ccwsim.metrics.flow_fit import MIN_EFFICIENCY_GAP, FlowFit
from ccwsim.metrics.joins import JOINS_SIDE
from ccwsim.metrics.lags import VERTICAL, Direction, axes_of
from ccwsim.metrics.measures import MEASURES, Measured
from ccwsim.metrics.reference_band import Fit
from ccwsim.model import Floats, describe_shape, minus, plural, three_digits

SIGNS: dict[str, str] = {"variogram": "γ", "connectivity": "τ", "values": "γ"}


class Verdict(NamedTuple):
    """A finding in at most eight words, with its numbers, and whether it is good."""

    words: str
    numbers: str = ""
    good: bool | None = True  # None if nothing could be judged

    def __str__(self) -> str:
        """Return words and numbers as one text."""
        return f"{self.words}: {self.numbers}" if self.numbers else self.words


VERDICTS: dict[str, tuple[str, str]] = {
    "connectivity": ("too little connected", "too much connected"),
    "variogram": ("variogram too low", "variogram too high"),
    "values": ("variogram too low", "variogram too high"),
}
FORMATS = {"variogram": "{:.3f}".format, "connectivity": "{:.2f}".format, "values": three_digits}
HOW_JUDGED = (
    "Titles compare pieces of the realizations with crops of the training image (TI) of equal "
    "size, relative to the spread of the crops. Dotted lines are the means of crops and of pieces; "
    "the other curves are computed from entire images. The numbers appear when the mouse rests on "
    "a title."
)
OTHER_AMOUNT = "the map of probabilities asks for another amount"
NO_CROPS = (
    "image, grid or active area are too small for crops, patches are turned, scaled or of other "
    f"images, or {OTHER_AMOUNT}"
)
NOT_JUDGED = Verdict("not judged", NO_CROPS, None)
LAYERS_NOT_JUDGED = Verdict("one image cannot tell this", "layers are not judged", None)
KINDS = {"variogram": "curves", "connectivity": "curves"}
"""Names of kinds of checks in a sentence, if they differ from the kinds."""
CHANCE = "3 %"  # share of good ensembles in which a check differs (see the page on measures)


NOTABLE = 0.1  # relative difference from the image above which a facies at the edges is named
MAX_STRESS = 0.2  # stress above which an MDS plot distorts the distances


def describe_scaling(stress: float, note: str) -> Verdict:
    """Return a note below an MDS plot, with a warning if the plot distorts distances."""
    if stress <= MAX_STRESS:
        return Verdict(note, good=None)
    numbers = f"stress {stress:.2f}, above {MAX_STRESS}: two axes cannot show all distances"
    return Verdict(f"distances are distorted; {note}", numbers, None)


def way_name(direction: Direction) -> str:
    """Return the name of a direction, such as "E–W", or an azimuth in degrees."""
    if isinstance(direction, str):
        return direction.replace("-", "–")
    if isinstance(direction, (int, float)):
        return f"{direction:.0f}°"
    return f"({', '.join(map(str, direction))})"


def curve_title(statistic: Statistic, direction: Direction) -> str:
    """Return the title for a chart of a statistic along a direction."""
    name = "variogram" if statistic == "values" else statistic
    return (
        f"Vertical {name}"
        if direction == VERTICAL
        else f"{name.capitalize()} {way_name(direction)}"
    )


def crop_size_text(fit: Fit) -> str:
    """Return the size of the crops as text (columns × rows × layers)."""
    return describe_shape(fit.crop_shape)


def describe_curve(fit: Fit | None, statistic: Statistic) -> Verdict:
    """Describe whether a curve is inside the band of crops, or at which lags the curve differs."""
    if fit is None or not fit.judged:
        return NOT_JUDGED
    numbers = _numbers(statistic, fit, fit.worst)
    if fit.fits:
        numbers += f", up to {plural(int(fit.at[-1]), 'cell')}"
        return _unless_unsure(fit, Verdict("inside the band of TI crops", numbers))
    return Verdict(_words_outside(statistic, fit, fit.worst), numbers, False)


def _numbers(kind: str, fit: Fit, k: int, names: Sequence[str] = (), against: str = "") -> str:
    """Return value k of pieces beside the reference, with the tolerance if the value is inside."""
    name, text = _value(kind, fit, k, names)
    found, reference, tolerance = (text(v[k]) for v in (fit.found, fit.reference, fit.tolerance))
    band = "" if fit.outside[k] else f" ± {tolerance}"
    if kind == "proportions":
        return f"{name} {found}, {reference}{band} in the {against}"
    return f"{name} {found} in pieces, {reference}{band} in TI crops of {crop_size_text(fit)}"


def _value(
    kind: str, fit: Fit, k: int, names: Sequence[str] = ()
) -> tuple[str, Callable[[float], str]]:
    """Return the name of value k of a fit, and the function that writes it."""
    at = int(fit.at[k])
    if kind in SIGNS:
        return f"{SIGNS[kind]}({at})", FORMATS[kind]
    if kind == "geobodies":
        axis = axes_of(fit.crop_shape)[k - 1]
        way = "vertically" if axis == VERTICAL else way_name(axis)
        return f"percolation {way}" if k else "Γ", "{:.2f}".format
    if kind == "patterns":
        size = describe_shape((*(min(at, n) for n in fit.crop_shape[:-2]), at, at))
        return f"{size} cells,", "{:.4f} bits".format
    if kind == "measures":
        return MEASURES[at].title, MEASURES[at].text
    return names[k], lambda share: f"{100 * share:.1f} %"


def _words_outside(kind: str, fit: Fit, k: int, name: str = "", names: Sequence[str] = ()) -> str:
    """Describe value k, which is outside the band, of the facies `name` or of all facies."""
    more, value = bool(fit.found[k] > fit.reference[k]), _value(kind, fit, k, names)[0]
    if kind in SIGNS:
        return f"{VERDICTS[kind][more]} {_lags_text(fit)}"
    if kind == "patterns":
        return "patterns farther from the TI than crops"
    if kind == "measures":
        return f"{(measure := MEASURES[int(fit.at[k])]).name} {measure.words[more]}"
    if kind == "proportions":
        return f"too {'much' if more else 'little'} {value}"
    if not k:
        return f"geobodies of {name} {'more' if more else 'less'} connected"
    return f"{name} percolates {value.split(' ')[1]} too {'often' if more else 'seldom'}"


def _unless_unsure(fit: Fit, verdict: Verdict, k: int | None = None) -> Verdict:
    """Return a good verdict, or that the tolerance (of value k) is too wide to tell."""
    tolerance = fit.median_tolerance if k is None else float(fit.relative_tolerance[k])
    if tolerance <= fit.useful_tolerance[0]:
        return verdict
    size = f" (± {100 * tolerance:.0f} %)" if np.isfinite(tolerance) else ""
    return verdict._replace(words=f"cannot tell{size}", good=None)


def describe_curves(fits: Mapping[str, Fit | None], statistic: Statistic) -> Verdict:
    """Describe the settings whose curves are outside the band of crops, and name the others."""
    judged = {name: fit for name, fit in fits.items() if fit is not None and fit.judged}
    if not judged:
        return NOT_JUDGED
    verdicts = {name: describe_curve(fit, statistic) for name, fit in judged.items()}
    inside = [name for name, verdict in verdicts.items() if verdict.good]
    if len(inside) == len(fits):
        verdict = verdicts[inside[0]]
        return verdict._replace(words=f"all {verdict.words}")
    off = {name: verdict for name, verdict in verdicts.items() if verdict.good is False}
    words = [f"{name} {verdict.words}" for name, verdict in off.items()]
    words += [f"{' and '.join(inside)} inside the band"] if inside else []
    words += [
        f"{name} {verdict.words}" for name, verdict in verdicts.items() if verdict.good is None
    ]
    numbers = "; ".join(f"{name}: {verdict.numbers}" for name, verdict in off.items())
    return Verdict("; ".join(words), numbers, False if off else None)


def _lags_text(fit: Fit) -> str:
    """Describe the range of lags of consecutive outside values around the worst value."""
    above = fit.found > fit.reference
    outside = fit.outside & (above == above[fit.worst])
    inside = np.flatnonzero(~outside)
    first = int(inside[inside < fit.worst].max(initial=-1)) + 1
    last = int(inside[inside > fit.worst].min(initial=len(outside))) - 1
    start, end = int(fit.at[first]), int(fit.at[last])
    if last == len(fit.at) - 1:
        return f"beyond {plural(int(fit.at[first - 1]), 'cell')}" if first else "at all lags"
    return f"at {plural(start, 'cell')}" if start == end else f"at {start} to {end} cells"


def compare_proportion(ensemble: Ensemble, facies: int) -> dict[str, str]:
    """Return the shares of a facies (given by index) by their names, and the relative difference.

    Names are "simulated", "given", "TI" or "TIs", "data" and "relative difference" (from the first
    compared share). Without given probabilities or data, there is no share of this name.
    """
    image, secondary = ensemble.training_image, ensemble.secondary
    means = (ensemble.proportions, ensemble.expected_proportions, ensemble.image_proportions)
    simulated, expected, of_image = (float(p[..., facies].mean()) for p in means)
    shares = {"simulated": simulated}
    shares |= {"given": expected} if ensemble.has_probabilities else {}
    shares["TIs" if secondary and secondary.images else "TI"] = of_image
    if ensemble.hard_data.n:
        shares["data"] = float((ensemble.hard_data.facies == image.codes[facies]).mean())
    texts = {name: f"{100 * share:.1f} %" for name, share in shares.items()}
    return texts | {"relative difference": relative_text(simulated, expected) if expected else ""}


def describe_proportion(ensemble: Ensemble, facies: int, *, short: bool = False) -> str:
    """Describe the share of a facies (given by index), and all or the first of compared shares."""
    (_, mean), *compared, (_, off) = compare_proportion(ensemble, facies).items()
    texts = ", ".join(f"{name} {share}" for name, share in compared[: 1 if short else None])
    end = f"; {off}" if off and not short else ""
    return f"{ensemble.training_image.facies_names[facies]} {mean} ({texts}{end})"


def relative_text(value: float, reference: float) -> str:
    """Describe the difference of a value from a nonzero reference, in percent of the reference."""
    off = 100 * (value / reference - 1)
    return minus(f"{off:+.0f} %") if round(off) else "±0 %"


def lost_at_edges(ensemble: Ensemble) -> int | None:
    """Return the index of a facies at the image's edges that realizations have too rarely."""
    k = facies_at_edges(ensemble.parameters, ensemble.training_image)
    if k is None:
        return None
    enough = (1 - NOTABLE) * ensemble.expected_proportions[k]
    return None if ensemble.proportions[:, k].mean() > enough else k


def advise_proportions(ensemble: Ensemble, fit: Fit | None) -> str:
    """Return advice if proportions differ from the training image's, otherwise an empty text.

    A facies is named only if image and hard data are both above, or both below, the realizations.
    """
    if ensemble.secondary is not None and ensemble.secondary.guides:
        return ""
    if (lost := lost_at_edges(ensemble)) is not None:
        name = ensemble.training_image.facies_names[lost]
        return f"{name} is at the edges of the TI: half the template would bring it nearer"
    if fit is None or fit.fits or ensemble.parameters.match_proportions:
        return ""
    image, data, mean = ensemble.training_image, ensemble.hard_data, ensemble.proportions.mean(0)
    nearer = fit.outside
    if data.n:
        shares = (data.facies[:, None] == image.codes).mean(axis=0)
        nearer = nearer & ((shares - mean) * (image.proportions - mean) >= 0)
    names = image.facies_names
    off = [name for name, missed in zip(names, nearer, strict=True) if missed]
    off = off[1:] if len(off) == len(names) == 2 else off  # of two facies, name only one
    if not off:
        return ""
    return f"“Match proportions” is off and would bring {' and '.join(off)} nearer to the TI"


def describe_geobodies(fit: Fit | None, name: str) -> list[Verdict]:
    """Describe Γ and the percolation of a facies if these values are outside the band of crops."""
    if fit is None:
        return []
    return [
        Verdict(_words_outside("geobodies", fit, k, name), _numbers("geobodies", fit, k), False)
        for k in np.flatnonzero(fit.outside).tolist()
    ]


def describe_joins(fit: Fit | None, name: str) -> list[Verdict]:
    """Describe how the geobodies of a facies join, compared with crops of the image."""
    if fit is None or not fit.judged:
        return []
    pieces, crops, gaps = fit.found, fit.reference, fit.tolerance
    unions, loops, ends = (pieces - crops) / gaps
    if loops > 1:
        words = "rejoin themselves"
    elif unions < -1:
        words = "unite too seldom"
    else:
        words = "end too often" if ends > 1 else "join as in TI crops"
    numbers = (
        f"unions {pieces[0]:.1f} ({crops[0]:.1f} ± {gaps[0]:.1f}), "
        f"loops {pieces[1]:.1f} ({crops[1]:.1f} ± {gaps[1]:.1f}), "
        f"ends {pieces[2]:.1f} ({crops[2]:.1f} ± {gaps[2]:.1f}) "
        f"per 100 squares of {JOINS_SIDE} cells (TI crops of {crop_size_text(fit)})"
    )
    verdict = Verdict(f"bodies of {name} {words}", numbers, max(loops, -unions, ends) <= 1)
    return [_unless_unsure(fit, verdict) if verdict.good else verdict]


def describe_flow(flow_fit: FlowFit, axis: int) -> Verdict:
    """Compare the flow efficiency of pieces along an axis with that of crops."""
    fit = flow_fit.fit
    if fit is None or np.isnan(fit.tolerance[axis]):
        return NOT_JUDGED
    pieces, crops = float(fit.found[axis]), float(fit.reference[axis])
    numbers = f"E {pieces:.3f} in pieces, {crops:.3f} in TI crops of {crop_size_text(fit)}"
    if not fit.outside[axis]:
        verdict = _unless_unsure(fit, Verdict("flows like the TI", numbers), axis)
        each, image = flow_fit.each[:, axis], float(flow_fit.reference[axis])
        is_comparable = flow_fit.is_of_image_size and len(each) > 1
        if is_comparable and abs(each.mean() - image) > MIN_EFFICIENCY_GAP:
            for side, is_there in (("below", each < image), ("above", each > image)):
                if is_there.all():
                    words = f"all {len(each)} {side} the image's {image:.2f}"
                    return verdict._replace(words=words, good=None)
        return verdict
    return Verdict("flows too well" if pieces > crops else "flows too badly", numbers, False)


def describe_patterns(fit: Fit | None) -> list[Verdict]:
    """Compare pieces with crops by pattern size; a distance below the crops' is good."""
    if fit is None or not fit.judged:
        return [NOT_JUDGED]
    return [
        Verdict(_words_outside("patterns", fit, k), numbers, False)
        if fit.outside[k]
        else _unless_unsure(fit, Verdict("patterns as near to the TI as crops", numbers), k)
        for k, numbers in enumerate(_numbers("patterns", fit, k) for k in range(len(fit.at)))
    ]


class CheckLine(NamedTuple):
    """One line of the summary of all checks; the numbers of the verdict name the reference."""

    kind: str
    what: str
    verdict: Verdict


def describe_checks(
    checks: Sequence[Check], names: Sequence[str]
) -> tuple[Verdict, list[CheckLine]]:
    """Return a headline on all checks of an ensemble, and a line on each check.

    Lines are sorted: first checks that differ, then checks that cannot tell, are not judged, or
    fit. `names` are the names of the facies.

    Examples
    --------
    >>> from ccwsim import datasets, metrics, simulate
    >>> image = datasets.load("channels")
    >>> checks = metrics.check_ensemble(simulate(image, (128, 128), n_realizations=4))
    >>> headline, lines = describe_checks(checks, image.facies_names)
    >>> len(lines), lines[-1].what, lines[-1].verdict.words
    (13, 'Measures of sand', 'as in TI crops')
    """
    lines = [_describe_check(check, names) for check in checks]
    lines.sort(key=lambda line: (False, None, True).index(line.verdict.good))
    return _headline([check for check in checks if check.fit.judged]), lines


def _headline(checks: Sequence[Check]) -> Verdict:
    """Describe how many of the judged checks differ, fit or cannot tell."""
    if not checks:
        return Verdict("curves not judged", NOT_JUDGED.numbers, None)
    n, n_off = len(checks), sum(not check.fit.fits for check in checks)
    n_unsure = sum(check.fit.cannot_tell for check in checks)
    kinds = ", ".join(dict.fromkeys(KINDS.get(check.kind, check.kind) for check in checks))
    numbers = f"{kinds}; in about {CHANCE} of good ensembles any check differs"
    unsure, n_fitting = f", {n_unsure} cannot tell" if n_unsure else "", n - n_unsure
    if n_off:
        word = "differ" if n_off > 1 else "differs"
        return Verdict(f"{n_off} of {n} checks {word} from the TI", f"{numbers}{unsure}", False)
    subject = f"all {n} checks fit" if n > 1 else "the only check fits"
    subject = f"{n_fitting} of {n} checks fit" if n_unsure else subject
    words = f"{subject} the training image{unsure}"
    return Verdict(words if n_fitting else "no check can tell", numbers, bool(n_fitting) or None)


def _describe_check(check: Check, names: Sequence[str]) -> CheckLine:
    """Return the line of a check, with the numbers of the largest difference / tolerance."""
    kind, facies, direction, fit, against = check
    name = "" if facies is None else names[facies]
    way = "" if direction is None else f", {way_name(direction)}"
    what = f"{kind.capitalize()}{name and f' of {name}'}{way}"
    if not fit.judged:
        return CheckLine(kind, what, Verdict("not judged", OTHER_AMOUNT, None))
    numbers = _numbers(kind, fit, fit.worst, names, against)
    if fit.fits:
        words = f"as in the {against}" if kind == "proportions" else "as in TI crops"
        return CheckLine(kind, what, _unless_unsure(fit, Verdict(words, numbers)))
    return CheckLine(
        kind, what, Verdict(_words_outside(kind, fit, fit.worst, name, names), numbers, False)
    )


def describe_unseen(share: float, at_data: float | None, size: str = "3 × 3 × 3") -> str:
    """Describe the share of patterns that do not occur in the image, overall and at hard data."""
    data_text = "" if at_data is None else f", {100 * at_data:.2f} % of those at data,"
    return f"{100 * share:.2f} % of the {size} patterns{data_text} do not occur in the TI"


class MeasureRow(NamedTuple):
    """Name, values and verdict of one measure as text, and whether the verdict is good."""

    title: str
    definition: str
    image: str
    realizations: str
    verdict: str
    good: bool


HOW_MEASURED = (
    "The columns “TI” and “realizations” describe entire images. The last column compares pieces "
    "of the realizations without inactive cells with crops of the training image of equal size, "
    "because crops cut geobodies. ± is the tolerance, computed from the spread of the crops."
)
MEASURES_HEAD = ("measure", "TI", "realizations, 5–95 %", "beside crops of the TI")


def describe_measures(measured: Measured) -> list[MeasureRow]:
    """Return all measures as text, with verdicts on realizations beside crops of the image."""
    rows = []
    for k, measure in enumerate(measured.measures):
        text, fit = measure.text, measured.fit
        low, mean, high = _spread(measured.each[:, k])
        verdict, good = "not judged", True
        if fit is not None and np.isfinite(fit.found[k] - fit.reference[k] + fit.tolerance[k]):
            good = not fit.outside[k]
            words = "" if good else measure.words[int(fit.found[k] > fit.reference[k])]
            words = _unless_unsure(fit, Verdict(words), k).words if good else words
            words = f"{words}: " if words else ""
            crops = f"{text(fit.reference[k])} ± {text(fit.tolerance[k])}"
            verdict = f"{words}{text(fit.found[k])}, crops {crops}"
        rows.append(
            MeasureRow(
                title=measure.title,
                definition=measure.definition,
                image=text(measured.reference[k]),
                realizations=f"{text(mean)} ({text(low)} to {text(high)})",
                verdict=verdict,
                good=good,
            )
        )
    return rows


def _spread(values: Floats) -> tuple[float, float, float]:
    """Return the 5 % quantile, the mean and the 95 % quantile of the values that are not NaN."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return np.nan, np.nan, np.nan
    low, high = np.quantile(finite, (0.05, 0.95))
    return float(low), float(finite.mean()), float(high)


def describe_variety(differing: float, proportions: Sequence[float]) -> str:
    """Describe in how many cells two realizations differ, with the share expected by chance."""
    independent = 1 - float(np.sum(np.square(proportions)))
    return (
        f"two realizations differ in {100 * differing:.0f} % of the cells "
        f"({100 * independent:.0f} % if cells were independent)"
    )
