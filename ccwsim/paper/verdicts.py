"""Verdicts that compare our numbers with the paper's numbers.

Two times are *alike* if they differ by less than a factor of `ALIKE`. The *order* of a ratio is
below 1, above 1, or equal to 1 up to a factor of `NOISE`, which is the precision of our median CPU
times. Two ratios agree if their logarithms differ by less than two standard errors.
"""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from math import isnan, log

from ccwsim.model import duration, minus
from ccwsim.paper.experiment import said
from ccwsim.report.document import Judgement, Tone

AGREES, BETTER, BEHIND, DIFFERENT, NOT_COMPARABLE = (
    "agrees",
    "better",
    "behind",
    "differs",
    "not comparable",
)
SAME_ORDER, IN_PART = "same order", "in part"
TONES: dict[str, Tone] = {
    AGREES: "good",
    BETTER: "good",
    BEHIND: "bad",
    DIFFERENT: "bad",
    NOT_COMPARABLE: "unknown",
}
ALIKE = 1.25
NOISE = 1.1


def judged(claim: str, finding: str, word: str) -> Judgement:
    """Return a judgement; its tone is neutral if `word` is not a constant of this module."""
    return Judgement(claim, finding, word, TONES.get(word, "plain"))


def by_claim(judgements: Iterable[Judgement]) -> tuple[Judgement, ...]:
    """Return one judgement a claim; cases with different verdicts are merged to "in part"."""
    cases: dict[str, list[Judgement]] = {}
    for judgement in judgements:
        cases.setdefault(judgement.claim, []).append(judgement)
    return tuple(each[0] if len(each) == 1 else _merged(each) for each in cases.values())


def _merged(cases: list[Judgement]) -> Judgement:
    if len({case.word for case in cases}) == 1:
        return judged(cases[0].claim, " ".join(case.finding for case in cases), cases[0].word)
    finding = " ".join(f"{case.finding.removesuffix('.')}: {case.word}." for case in cases)
    return judged(cases[0].claim, finding, IN_PART)


def judge_claim(claim: str, finding: str, holds: bool) -> Judgement:
    """Return a judgement that states whether a claim of the paper holds in this run."""
    return judged(claim, finding, AGREES if holds else DIFFERENT)


def judge_order(claim: str, finding: str, order: int) -> Judgement:
    """Judge our number as worse than (−1), equal to (0) or better than (1) another number."""
    return judged(claim, finding, {-1: BEHIND, 0: AGREES, 1: BETTER}[order])


def sign_of(difference: float, alike: float = 0.0) -> int:
    """Return −1, 0 or 1 for a difference below −alike, between −alike and alike, or above it."""
    return int(difference > alike) - int(difference < -alike)


def order_of(ratio: float, noise: float = NOISE) -> int:
    """Return −1 for a ratio below 1, 1 for a ratio above 1, and 0 for a ratio close to 1."""
    return int(ratio > noise) - int(ratio < 1 / noise)


def judge_time(
    what: str, ours: float, theirs: float, where: str, comparable: bool = True
) -> Judgement:
    """Judge our CPU time against the paper's CPU time if the grids are comparable."""
    claim = f"{where}: {duration(theirs)} for {what}."
    if not comparable:
        return judged(claim, f"{duration(ours)} on a smaller grid; not comparable.", NOT_COMPARABLE)
    ratio = theirs / ours
    factor = f"{ratio:.3g} times less" if ratio >= 1 else f"{1 / ratio:.3g} times more"
    finding = said("time", ours=duration(ours), how=factor)
    words = {-1: "more time", 0: "like time", 1: "less time"}
    return judged(claim, finding, words[order_of(ratio, ALIKE)])


def judge_ratio(
    claim: str, finding: str, ours: float, theirs: float, error: float = log(NOISE)
) -> Judgement:
    """Judge a ratio against the paper's; `error` is the standard error of the logarithm of ours."""
    if isnan(error):  # too few realizations
        return judged(claim, finding, NOT_COMPARABLE)
    apart = abs(log(ours / theirs))
    if not apart <= error and order_of(ours) != order_of(theirs):
        return judged(claim, finding, DIFFERENT)
    return judged(claim, finding, AGREES if apart <= 2 * error else SAME_ORDER)


def judge_ratios(claim: str, title: str, ratios: Iterable[tuple[str, float, float]]) -> Judgement:
    """Judge several ratios (case, ours, the paper's) in one sentence."""
    each = [
        judge_ratio(claim, f"{case} {ours:.2f} ({theirs:.2f})", ours, theirs)
        for case, ours, theirs in ratios
    ]
    words = {judgement.word for judgement in each}
    finding = f"{title}: {', '.join(judgement.finding for judgement in each)}."
    return judged(claim, finding, words.pop() if len(words) == 1 else IN_PART)


def judge_levels(times: Mapping[int, float], title: str) -> Judgement:
    """Judge whether each level takes less CPU time (in seconds) than the level below."""
    levels = sorted(times)
    words = {-1: "less than", 0: "as long as", 1: "more than"}
    orders = {(a, b): order_of(times[b] / times[a]) for a, b in pairwise(levels)}
    steps = (f"level {b} takes {words[order]} level {a}" for (a, b), order in orders.items())
    each = ", ".join(f"level {level} {duration(times[level])}" for level in levels)
    falls = all(order < 0 for order in orders.values())
    claim = "Fig. 13: each level takes less CPU time than the level below."
    return judge_claim(claim, f"{title}, {each}: {', '.join(steps)}.", falls)


def judge_both(connectivity: int, patterns: int) -> str:
    """Return the verdict on a claim that a method is better; measures are −1, 0 or 1 (better)."""
    if connectivity > 0 and patterns > 0:
        return AGREES
    return IN_PART if max(connectivity, patterns) > 0 else DIFFERENT


def judge_data(wrong: float, n_data: int, theirs: float | None, title: str) -> Judgement:
    """Judge the share of missed data, compared with the published code's share if that is known."""
    text = "honoured" if wrong == 0 else "missed"
    finding = said(text, title=title, n=n_data, wrong=percent(wrong))
    claim = "Section 4.4: the method searches for a candidate that honours the data."
    if theirs is None:
        return judge_claim(claim, finding, wrong == 0)
    finding += f" Realizations of the authors' code miss {percent(theirs)}."
    return judge_order(claim, finding, sign_of(theirs - wrong))


def percent(share: float) -> str:
    """Return a share in percent."""
    return minus(f"{100 * share:.1f} %")
