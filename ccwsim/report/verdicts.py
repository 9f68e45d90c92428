"""Sentences that compare realizations with their training image, shared by all pages."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.bands import Statistic
from ccwsim.metrics.checks import Check
from ccwsim.metrics.diagnosis import facies_at_edges
from ccwsim.metrics.flow_fit import FlowFit
from ccwsim.metrics.lags import VERTICAL, Direction, axes_of
from ccwsim.metrics.measures import MEASURES, Measured
from ccwsim.metrics.reference_band import Fit
from ccwsim.model.arrays import describe_shape
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.numbers import minus, plural

SIGNS: dict[Statistic, str] = {"variogram": "γ", "connectivity": "τ"}


class Verdict(NamedTuple):
    """A finding in at most eight words, with its numbers, and whether it is good."""

    words: str
    numbers: str = ""
    good: bool | None = True  # None if nothing could be judged

    def __str__(self) -> str:
        """Return words and numbers as one text."""
        return f"{self.words}: {self.numbers}" if self.numbers else self.words


VERDICTS: dict[Statistic, tuple[str, str]] = {
    "connectivity": ("too little connected", "too much connected"),
    "variogram": ("variogram too low", "variogram too high"),
}
HOW_JUDGED = (
    "Titles compare pieces of the realizations with crops of the training image (TI) of equal "
    "size, relative to the spread of the crops. Dotted lines are the means of crops and of pieces; "
    "the other curves are computed from entire images. The numbers appear when the mouse rests on "
    "a title."
)
NO_CROPS = "image or grid are too small for crops, or patches are turned, scaled or of other images"
NOT_JUDGED = Verdict("not judged", NO_CROPS, None)
LAYERS_NOT_JUDGED = Verdict("one image cannot tell this", "layers are not judged", None)
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
    if direction == VERTICAL:
        return f"Vertical {statistic}"
    return f"{statistic.capitalize()} {way_name(direction)}"


def size_text(fit: Fit) -> str:
    """Return the size of the crops as text (columns × rows × layers)."""
    return describe_shape(fit.crop_shape)


def describe_curve(fit: Fit | None, statistic: Statistic) -> Verdict:
    """Describe whether a curve is inside the band of crops, or at which lags the curve differs."""
    if fit is None or not fit.judged:
        return NOT_JUDGED
    if fit.fits:
        reach = plural(int(fit.at[-1]), "cell")
        return Verdict("inside the band of TI crops", f"{size_text(fit)}, up to {reach}")
    k = fit.worst
    low, high = VERDICTS[statistic]
    verdict = high if fit.found[k] > fit.reference[k] else low
    digits = 3 if statistic == "variogram" else 2
    value, reference = (f"{v:.{digits}f}" for v in (fit.found[k], fit.reference[k]))
    numbers = f"{SIGNS[statistic]}({int(fit.at[k])}) {value} in pieces, {reference} in TI crops"
    return Verdict(f"{verdict} {_lags_text(fit)}", f"{numbers} of {size_text(fit)}", False)


def describe_curves(fits: Mapping[str, Fit | None], statistic: Statistic) -> Verdict:
    """Describe the settings whose curves are outside the band of crops, and name the others."""
    judged = {name: fit for name, fit in fits.items() if fit is not None and fit.judged}
    if not judged:
        return NOT_JUDGED
    inside = [name for name, fit in judged.items() if fit.fits]
    if len(inside) == len(fits):
        verdict = describe_curve(next(iter(judged.values())), statistic)
        return verdict._replace(words=f"all {verdict.words}")
    off = {name: describe_curve(fit, statistic) for name, fit in judged.items() if not fit.fits}
    words = [f"{name} {verdict.words}" for name, verdict in off.items()]
    words += [f"{' and '.join(inside)} inside the band"] if inside else []
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


def describe_proportion(ensemble: Ensemble, facies: int) -> str:
    """Describe the share of a facies (given by index) in realizations, training image and data."""
    image, secondary = ensemble.training_image, ensemble.secondary
    mean, image_share = (
        float(p[..., facies].mean()) for p in (ensemble.proportions, ensemble.image_proportions)
    )
    comparisons = [f"{'TIs' if secondary and secondary.images else 'TI'} {100 * image_share:.1f} %"]
    expected = float(ensemble.expected_proportions[facies])
    if secondary is not None and secondary.probabilities is not None:
        comparisons.insert(0, f"given {100 * expected:.1f} %")
    if ensemble.hard_data.n:
        share = float((ensemble.hard_data.facies == image.codes[facies]).mean())
        comparisons.append(f"data {100 * share:.1f} %")
    off = f"; {relative_text(mean, expected)}" if expected else ""
    return f"{image.facies_names[facies]} {100 * mean:.1f} % ({', '.join(comparisons)}{off})"


def relative_text(value: float, reference: float) -> str:
    """Describe the difference of a value from a nonzero reference, in percent of the reference."""
    off = 100 * (value / reference - 1)
    return minus(f"{off:+.0f} %") if round(off) else "±0 %"


def lost_at_edges(ensemble: Ensemble) -> int | None:
    """Return the index of a facies at the image's edges that realizations have too rarely."""
    image = ensemble.training_image
    k = facies_at_edges(ensemble.parameters, image)
    if k is None:
        return None
    enough = (1 - NOTABLE) * ensemble.expected_proportions[k]
    return None if ensemble.proportions[:, k].mean() > enough else k


def advise_proportions(ensemble: Ensemble, fit: Fit | None) -> str:
    """Return advice if proportions differ from the training image's, otherwise an empty text.

    A facies is named only if image and hard data are both above, or both below, the realizations.
    """
    guided = ensemble.secondary is not None and ensemble.secondary.guides
    if guided:
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
    (gamma, *percolation), (image_gamma, *image_ways) = fit.found, fit.reference
    crops = f"in TI crops of {size_text(fit)}"
    verdicts = []
    if fit.outside[0]:
        word = "more" if gamma > image_gamma else "less"
        numbers = f"Γ {gamma:.2f} in pieces, {image_gamma:.2f} {crops}"
        verdicts.append(Verdict(f"geobodies of {name} {word} connected", numbers, False))
    for k, axis in enumerate(axes_of(fit.crop_shape)):
        if fit.outside[k + 1]:
            direction = "vertically" if axis == VERTICAL else way_name(axis)
            word = "too often" if percolation[k] > image_ways[k] else "too seldom"
            numbers = (
                f"{100 * percolation[k]:.0f} % of the pieces, {100 * image_ways[k]:.0f} % {crops}"
            )
            verdicts.append(Verdict(f"{name} percolates {direction} {word}", numbers, False))
    return verdicts


def describe_flow(flow_fit: FlowFit, axis: int) -> Verdict:
    """Compare the flow efficiency of pieces along an axis with that of crops."""
    fit = flow_fit.fit
    if fit is None or np.isnan(fit.tolerance[axis]):
        return NOT_JUDGED
    pieces, crops = float(fit.found[axis]), float(fit.reference[axis])
    numbers = f"E {pieces:.3f} in pieces, {crops:.3f} in TI crops of {size_text(fit)}"
    if not fit.outside[axis]:
        return Verdict("flows like the TI", numbers)
    return Verdict("flows too well" if pieces > crops else "flows too badly", numbers, False)


def describe_patterns(fit: Fit | None) -> list[Verdict]:
    """Compare pieces with crops by pattern size; a distance below the crops' is good."""
    if fit is None or not fit.judged:
        return [NOT_JUDGED]
    verdicts = []
    for k, side in enumerate(fit.at.astype(int).tolist()):
        size = describe_shape((*(min(side, n) for n in fit.crop_shape[:-2]), side, side))
        pieces, crops = float(fit.found[k]), float(fit.reference[k])
        numbers = f"{size} cells, {pieces:.4f} bits in pieces, {crops:.4f} in TI crops"
        far = bool(fit.outside[k])
        words = "patterns farther from the TI than crops"
        words = words if far else "patterns as near to the TI as crops"
        verdicts.append(Verdict(words, f"{numbers} of {size_text(fit)}", not far))
    return verdicts


def describe_checks(checks: Sequence[Check], names: Sequence[str]) -> list[Verdict]:
    """Return a headline on all checks of an ensemble, and a verdict on each check that differs."""
    if not checks:
        return [Verdict("curves not judged", NOT_JUDGED.numbers, None)]
    off = [check for check in checks if not check.fit.fits]
    kinds = "proportions, patterns, and curves, geobodies and measures of the facies"
    numbers = f"{kinds}, along all axes; in about {CHANCE} of good ensembles any check differs"
    if not off:
        return [Verdict(f"all {len(checks)} checks fit the training image", numbers)]
    word = "differ" if len(off) > 1 else "differs"
    verdicts = [Verdict(f"{len(off)} of {len(checks)} checks {word} from the TI", numbers, False)]
    for kind, facies, direction, fit in off:
        name = "" if facies is None else names[facies]
        if direction is not None:
            verdict = describe_curve(fit, "variogram" if kind == "variogram" else "connectivity")
            verdicts.append(
                verdict._replace(words=f"{name}, {way_name(direction)}: {verdict.words}")
            )
        elif kind == "geobodies":
            verdicts += describe_geobodies(fit, name)
        elif kind == "measures":
            verdicts.append(_describe_worst_measure(fit, name))
        elif kind == "patterns":
            verdicts += [verdict for verdict in describe_patterns(fit) if not verdict.good][:1]
    return verdicts


def _describe_worst_measure(fit: Fit, facies: str) -> Verdict:
    """Describe the measure that differs most from the crops; an empty `facies` means all facies."""
    k = fit.worst
    measure = MEASURES[int(fit.at[k])]
    word = measure.words[int(fit.found[k] > fit.reference[k])]
    pieces, crops = measure.text(fit.found[k]), measure.text(fit.reference[k])
    numbers = f"{measure.title} {pieces} in pieces, {crops} in TI crops of {size_text(fit)}"
    words = f"{measure.name} {word}"
    return Verdict(f"{facies}: {words}" if facies else words, numbers, False)


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
    "of the realizations with crops of the training image of equal size, because crops cut "
    "geobodies. ± is the tolerance, computed from the spread of the crops."
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
            words = "" if good else f"{measure.words[int(fit.found[k] > fit.reference[k])]}: "
            crops = f"{text(fit.reference[k])} ± {text(fit.tolerance[k])}"
            verdict = f"{words}{text(fit.found[k])}, crops {crops}"
        spread = f"{text(mean)} ({text(low)} to {text(high)})"
        rows.append(
            MeasureRow(
                title=measure.title,
                definition=measure.definition,
                image=text(measured.reference[k]),
                realizations=spread,
                verdict=verdict,
                good=good,
            )
        )
    return rows


def _spread(values: NDArray[np.float64]) -> tuple[float, float, float]:
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
