"""The reproduction of the paper as one report."""

from __future__ import annotations

from ccwsim.paper.methods import SAID
from ccwsim.paper.reproduction import Finished, Reproduction
from ccwsim.paper.verdicts import seconds
from ccwsim.report import Block, Document, Facts, Judgements, Section, Text, surroundings

TITLE = "CCWSIM: the paper's experiments, run again"
PAPER = (
    "Bavandsavadkoohi, M., Gloaguen, E., Tokhmechi, B., Arab-Amiri, A. and Giroux, B. (2024): "
    "CCWSIM, sections 5.1 to 5.9, Figs. 6 to 17, Tables 1 and 2"
)
KNOWN = (
    "What the paper says is given here as far as it is known from its abstract, the captions on "
    "the authors' page, and the numbers of Fig. 6, Fig. 7, Fig. 13 and Table 2; other numbers of "
    "figures and sections, and the Ganges delta image, are not at hand. Nothing is filled in: "
    "where no number is known, the report says so. Seconds of MATLAB on another machine are set "
    "beside ours for the record; only ratios within one run can be compared."
)
SMALL = (
    "This was a quick run, on small grids with few realizations: it shows that everything works. "
    "Its verdicts are not results; take the full run for those."
)
WORDS = (
    "“agrees”: what the paper says is found here too. “better”, “behind”: our number against the "
    "other one. “differs”: the paper's statement is not found. “in part”: one of two measures, "
    "or some of the lags. “surrounded”: the image's curve lies among the realizations'. "
    "“less time”: on another machine. “not comparable”: our grid is not the paper's."
)


def document_of(reproduction: Reproduction) -> Document:
    """Return the report: all verdicts first, then one section an experiment.

    Examples
    --------
    >>> from ccwsim.paper.reproduction import reproduce
    >>> document_of(reproduce(experiments=())).sections
    ()
    """
    return Document(
        TITLE,
        tuple(map(_section, reproduction.finished)),
        subtitle=PAPER,
        opening=_opening(reproduction),
        colophon=Facts((*surroundings(), *_settings(reproduction))),
    )


def _opening(r: Reproduction) -> tuple[Block, ...]:
    blocks: list[Block] = [Text(summary(r)), Text(KNOWN)]
    if r.extent.name != "full":
        blocks.append(Text(SMALL))
    if r.stopped:
        blocks.append(Text("The run was stopped: the experiments that are missing were not done."))
    blocks.append(Text(WORDS, quiet=True))
    return tuple(blocks)


def summary(r: Reproduction) -> str:
    """Say in one sentence how the experiments went.

    Examples
    --------
    >>> from ccwsim.paper.reproduction import reproduce
    >>> summary(reproduce(experiments=()))
    '0 experiments were run. Verdicts: none.'
    """
    failed = sum(f.outcome is None for f in r.finished)
    tail = f", {failed} of them failed" if failed else ""
    counted = ", ".join(f"{n} × {word}" for word, n in r.words.most_common()) or "none"
    return f"{len(r.finished)} experiments were run{tail}. Verdicts: {counted}."


def verdict_of(finished: Finished) -> str:
    """Return the words of an experiment's verdicts, or why there are none.

    Examples
    --------
    >>> from ccwsim.paper.limits import LIMITS
    >>> verdict_of(Finished(LIMITS, None, "no memory", 1.0))
    'failed: no memory'
    """
    if finished.outcome is None:
        return f"failed: {finished.problem}"
    counts: dict[str, int] = {}
    for judgement in finished.outcome.judgements:
        counts[judgement.word] = counts.get(judgement.word, 0) + 1
    return ", ".join(word if n == 1 else f"{n} × {word}" for word, n in counts.items())


def _section(finished: Finished) -> Section:
    e = finished.experiment
    first = Text(e.shows)
    if finished.outcome is None:
        words = Text(f"This experiment failed: {finished.problem}")
        return Section(e.title, (first, words), e.place, verdict_of(finished))
    judged = Judgements(finished.outcome.judgements, "The paper says", "Found here")
    return Section(
        e.title, (first, judged, *finished.outcome.blocks), e.place, verdict_of(finished)
    )


def _settings(r: Reproduction) -> tuple[tuple[str, str], ...]:
    folder = "the bundled training images and data" if r.inputs.folder is None else (
        f"training images and data of the folder “{r.inputs.folder.name}”")  # fmt: skip
    x = r.extent
    took = ", ".join(f"{f.experiment.title} {seconds(f.seconds)}" for f in r.finished)
    return (
        ("Inputs", folder),
        ("Extent", f"{x.name}: {x.n_many} realizations where the paper has 100, {x.n_few} to "
                   f"compare methods, {x.n_anodi} for distances, {x.n_timed} for times"),
        ("Seed", str(r.seed)),
        ("Parameters", f"{SAID}, unless a section says otherwise"),
        ("Time", f"{seconds(r.seconds)} in all; {took}"),
    )  # fmt: skip
