"""What the page says beside each step, for someone who sees the method for the first time."""

from __future__ import annotations

from html import escape

import streamlit as st

from ccwsim.engine.stages.similarity import LEFT, TOP
from ccwsim.engine.trace import PlaceFate, Trace, TracedPatch

BEHIND = {
    "south-west": ("south", "west"), "south-east": ("south", "east"),
    "north-west": ("north", "west"), "north-east": ("north", "east"),
}  # fmt: skip
OPPOSITE = {"east": "west", "west": "east", "north": "south", "south": "north"}


def say(text: str, where: str) -> None:
    """Write the words of a panel, with where the paper has it; `text` is HTML."""
    st.html(f'<p class="say">{text} <span class="ref">{escape(where)}</span></p>')


def counted(n: int, one: str, many: str = "") -> str:
    """Return a number with its noun.

    Examples
    --------
    >>> counted(1, "cell"), counted(3, "cell"), counted(2, "datum", "data")
    ('1 cell', '3 cells', '2 data')
    """
    return f"{n:,} {one if n == 1 else many or one + 's'}".replace(",", "\u202f")


def said_shape(trace: Trace, shape: int) -> str:
    """Say what the overlap looks like in the world: the strips lie where the path came from."""
    frame = trace.grid_frame
    beside = OPPOSITE[frame.direction]
    behind = next(side for side in BEHIND[frame.origin] if side not in (beside, frame.direction))
    if shape == LEFT | TOP:
        return f"L-shaped overlap, {behind} and {beside}"
    if not shape:
        return "the first patch, no overlap"
    return f"overlap in the {beside if shape == LEFT else behind}"


def path_words(trace: Trace) -> str:
    """Say where the path comes from and goes to."""
    frame, p = trace.grid_frame, trace.study.parameters
    drawn = "drawn at random for each realization" if p.random_path else "the same for all"
    step = trace.template - p.overlap_size
    return (
        f"The path starts in the <b>{frame.origin}</b> and runs <b>{frame.direction}</b>, row "
        f"after row ({drawn}). Patches of T = {trace.template} cells are laid T − OR = {step} "
        f"cells apart, so each overlaps what is there by OR = {p.overlap_size}: the part in full "
        "colour. Click the grid to jump to a patch; left and right arrow keys step."
    )


def overlap_words(trace: Trace, step: TracedPatch) -> str:
    """Say what the overlap is, and how few numbers its approximation has."""
    level, cells = trace.study.parameters.level, int(step.in_overlap.sum())
    if not cells:
        return "Nothing has been simulated yet, so there is nothing to compare the image with."
    if level == 0:
        return (
            f"The overlap is {counted(cells, 'cell')}. At level 0 there is no wavelet transform: "
            "cells are compared one by one, as CCSIM does."
        )
    n = int((step.approximation == step.approximation)[0].sum())
    return (
        f"The overlap is {counted(cells, 'cell')}. Its Haar approximation at level {level} keeps "
        f"one number a block of {step.unit} × {step.unit} cells, {step.unit} times their mean: "
        f"<b>{counted(n, 'coefficient')}</b> instead of {counted(cells, 'number')}."
    )


def score_words(step: TracedPatch) -> str:
    """Say what the score map is."""
    places = counted(step.scores.size, "place")
    if not step.patch.shape:
        decide = " The hard data alone decide." if step.data is not None else ""
        return f"Without an overlap all {places} of the image fit equally well.{decide}"
    ccw = step.ccw
    best = ccw.max() if step.correlation else ccw.min()
    how = (
        "the cross-correlation ΣA·B; the largest fits best"
        if step.correlation
        else "Σ(A − B)² = ΣA² − 2·ΣA·B + ΣB², whose middle term is the cross-correlation; the "
        "smallest fits best"
    )
    return (
        f"The coefficients B of the overlap are compared with those of the image, A, at all "
        f"{places}: {how}. Bright is a good fit; the best is {best:.4g}, the middle of all "
        f"{float(sorted(ccw.ravel())[ccw.size // 2]):.4g}."
    )


def draw_words(step: TracedPatch, told: list[PlaceFate]) -> str:
    """Say what was drawn, and what the shift did."""
    drawn = told[0]
    n = step.n_candidates
    chance = (
        "It is the only candidate."
        if n == 1
        else f"One of {n} candidates, all equally likely: that is where realizations differ."
    )
    (a, b), (c, d) = step.drawn_place, step.place
    shifted = max(abs(a - c), abs(b - d))
    moved = (
        f" Then it was shifted by {counted(shifted, 'cell')} to where it fits best at full "
        "resolution."
        if shifted
        else ""
    )
    return f"Drawn: CCW {drawn.ccw:.4g}. {chance}{moved}"


def cut_words(step: TracedPatch) -> str:
    """Say what the cut keeps."""
    if not step.patch.shape:
        return "Nothing to cut: the whole patch is pasted."
    wrong, kept = int(step.error.sum()), int(step.kept.sum())
    cells = int(step.in_overlap.sum())
    return (
        f"Patch and grid differ in {wrong} of {counted(cells, 'cell')} of the overlap. The "
        f"cheapest boundary through that error surface is found by dynamic programming: before it "
        f"{counted(kept, 'cell')} stay as they were, from it on the patch is pasted."
    )


def inverse_words(trace: Trace, step: TracedPatch, largest: float) -> str:
    """Say what the inverse transform of the drawn place gives."""
    level = trace.study.parameters.level
    if level == 0:
        return "At level 0 the patch is a slice of the image."
    n = step.cells.shape[0] // step.unit
    shown = "0" if largest == 0 else f"{largest:.0e}"
    return (
        f"The drawn patch is {n} × {n} approximation coefficients and their details. The inverse "
        f"DWT puts back all {step.cells.shape[0]} × {step.cells.shape[0]} cells; for Haar it "
        f"equals the slice of the image (largest difference {shown}), so nothing is lost by "
        "searching the approximation only."
    )
