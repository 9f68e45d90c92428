"""Words for how our numbers go with the paper's; every word follows from the numbers."""

from __future__ import annotations

from ccwsim.report import Judgement, Tone

AGREES, BETTER, BEHIND, DIFFERS, OPEN = "agrees", "better", "behind", "differs", "not comparable"
TONES: dict[str, Tone] = {AGREES: "good", BETTER: "good", BEHIND: "bad", DIFFERS: "bad"}
TONES[OPEN] = "unknown"
CONDITIONING = "Data conditioning “to a considerable degree” (the authors' page)."
ALIKE = 1.25
"""Two times or ratios are alike where they differ by less than this factor."""


def judged(claim: str, found: str, word: str) -> Judgement:
    """Return a judgement in one of the words above, or in another one that is neutral.

    Examples
    --------
    >>> judged("a", "b", BEHIND).tone
    'bad'
    """
    return Judgement(claim, found, word, TONES.get(word, "plain"))


def compared(ours: float, theirs: float, *, more_is_better: bool, alike: float = ALIKE) -> str:
    """Return how our number compares with theirs."""
    if max(ours, theirs) <= alike * min(ours, theirs):
        return AGREES
    return BETTER if (ours > theirs) == more_is_better else BEHIND


def of_time(what: str, ours: float, theirs: float, where: str) -> Judgement:
    """Judge a CPU time of ours against one of the paper, which is of another machine."""
    ratio = theirs / ours
    how = f"{ratio:.3g} times less" if ratio >= 1 else f"{1 / ratio:.3g} times more"
    found = (
        f"{seconds(ours)} of CPU time on this machine, {how}. Machines and languages differ "
        "(MATLAB there, compiled code here): this is no speed-up of the method."
    )
    word = compared(ours, theirs, more_is_better=False)
    shown = {BETTER: "less time", BEHIND: "more time"}.get(word, "like time")
    return Judgement(f"{where}: {seconds(theirs)} for {what}.", found, shown, TONES[word])


def not_comparable(claim: str, ours: float) -> Judgement:
    """Leave a CPU time of the paper open where our grid is smaller than the paper's."""
    return judged(claim, f"{seconds(ours)} on a smaller grid; not comparable.", OPEN)


def of_order(claim: str, found: str, ours: float, theirs: float) -> Judgement:
    """Judge whether the ratio of two methods lies on the same side of 1 here as in the paper.

    A ratio within `ALIKE` of 1 in the paper says that the two are alike, which is found where it
    is within the square of that here.
    """
    if 1 / ALIKE <= theirs <= ALIKE:
        holds = 1 / ALIKE**2 <= ours <= ALIKE**2
    else:
        holds = ours < 1 / ALIKE if theirs < 1 else ours > ALIKE
    return judged(claim, found, AGREES if holds else DIFFERS)


def of_ratio(claim: str, ours: float, theirs: float, *, alike: float = 1.5) -> Judgement:
    """Judge a ratio within our run against the same ratio within the paper's."""
    found = f"Here {ours:.2f} times; in the paper {theirs:.2f} times."
    near = max(ours, theirs) <= alike * min(ours, theirs)
    return judged(claim, found, AGREES if near else DIFFERS)


def of_data(wrong: float, n_data: int, theirs: float | None) -> Judgement:
    """Judge the share of data not honoured against that of the published code, where known."""
    found = (
        f"Every one of {n_data} data is honoured at full resolution in every realization."
        if wrong == 0
        else f"{percent(wrong)} of {n_data} data are not honoured."
    )
    if theirs is None:
        return judged(CONDITIONING, found, AGREES if wrong == 0 else DIFFERS)
    found += f" Realizations of the authors' code miss {percent(theirs)}."
    word = AGREES if wrong == theirs else BETTER if wrong < theirs else BEHIND
    return judged(CONDITIONING, found, word)


def seconds(value: float) -> str:
    """Return a time with its unit.

    Examples
    --------
    >>> seconds(0.0123), seconds(56.0)
    ('12.3 ms', '56 s')
    """
    return f"{1000 * value:.3g} ms" if value < 1 else f"{value:.3g} s"


def percent(share: float) -> str:
    """Return a share in percent.

    Examples
    --------
    >>> percent(0.0653)
    '6.5 %'
    """
    return f"{100 * share:.1f} %"
