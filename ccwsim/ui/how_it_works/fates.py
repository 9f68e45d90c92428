"""Which places fell out and why: words for each, and the table."""

from __future__ import annotations

from html import escape

import streamlit as st

from ccwsim.engine.trace import PlaceFate, Trace, TracedPatch
from ccwsim.ui.how_it_works.words import counted, say
from ccwsim.ui.widgets.scrolled import scrolled

MAX_ROWS = 24
DATA = "datum", "data"


def said_fate(place: PlaceFate, step: TracedPatch, share: float) -> str:
    """Say what became of a place, and why."""
    return {
        "drawn": "drawn",
        "candidate": "a candidate that was not drawn",
        "fraction": f"fell out: its overlap is not among the best {100 * share:.3g} %",
        "slack": "fell out: too much worse than the best",
        "data": f"fell out: {_misses(place)}",
        "location": "fell out: too far from its own place in the image",
        "tie": "fell out: by lot among equal places",
    }[place.fate]


def _misses(place: PlaceFate) -> str:
    parts = [
        f"misses {counted(n, *DATA)} {where}"
        for n, where in ((place.missed, "in the patch"), (place.held, "that the cut would have to "
                          "keep"), (place.ahead, "ahead"))
        if n
    ]  # fmt: skip
    return ", ".join(parts) or "may miss data ahead, where the image ends"


def xy_of(trace: Trace, row: int, column: int, size: int) -> str:
    """Return the south-west cell in the image of a patch at a place in blocks, as (x, y)."""
    unit = trace.search.unit
    box = trace.image_frame.box_to_world(row * unit, column * unit, size, size)
    return f"({box.column}, {box.row})"


def draw_fates(trace: Trace, step: TracedPatch, told: list[PlaceFate]) -> None:
    """Draw the table of places: what each scored, what it would miss, and what became of it."""
    has_data = step.data is not None
    head = ["place (x, y)", "CCW"] + (["missed", "ahead"] if has_data else []) + ["fate"]
    share = trace.study.parameters.search_fraction
    out = [place for place in told if place.fate not in ("drawn", "candidate")]
    shown = told[: MAX_ROWS - min(len(out), MAX_ROWS // 2)]
    shown += [place for place in out if place not in shown][: MAX_ROWS - len(shown)]
    rows = []
    for place in shown:
        cells = [xy_of(trace, place.row, place.column, step.patch.size), f"{place.ccw:.4g}"]
        cells += [str(place.missed + place.held), str(place.ahead)] if has_data else []
        words = said_fate(place, step, share)
        kind = place.fate if place.fate in ("drawn", "candidate") else "out"
        rows.append(
            f'<tr class="{kind}">' + "".join(f"<td>{cell}</td>" for cell in cells)
            + f'<td class="reason"><i class="mark {kind}"></i>{escape(words)}</td></tr>'
        )  # fmt: skip
    titles = "".join(f"<th>{escape(name)}</th>" for name in head)
    left = len(told) - len(shown)
    tail = f'<p class="note">and {counted(left, "place")} more</p>' if left else ""
    table = (
        f'<table class="numbers fates"><thead><tr>{titles}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table>"
    )
    st.html(scrolled(table, "Places") + tail)


def candidate_words(trace: Trace, step: TracedPatch, told: list[PlaceFate]) -> None:
    """Say how the candidates were chosen, with and without data."""
    k = len(step.places)
    if step.data is None:
        text = (
            f"The K = {k} places with the best scores are the candidates."
            if step.patch.shape
            else f"All places being equal, K = {k} of them are drawn by lot."
        )
        if trace.study.hard_data.n:
            text += " No hard data lie in this patch or just ahead, so none has a say here."
        say(text, "Algorithm 1, lines 7 and 8")
        return
    d, share = step.data, trace.study.parameters.search_fraction
    inside = [datum for datum in d.seen if datum.inside]
    ahead = len(d.seen) - len(inside)
    looked = (
        "All places are looked at, as data are dense here."
        if d.weights.everywhere
        else "All places are looked at."
        if not d.ruled_out.any()
        else f"Only the best {100 * share:.3g} % of overlaps are looked at "
        f"({counted(int((~d.ruled_out).sum()), 'place')})."
    )
    fell = sum(place.fate not in ("drawn", "candidate") for place in told)
    text = (
        f"<b>{counted(len(inside), *DATA)}</b> lie in the patch and <b>{ahead}</b> ahead of the "
        f"path, in a square of {d.reach} cells. {looked} Each datum that a place would miss costs "
        f"as much as {d.weights.missed} wrong cells of overlap ({d.weights.held} where the grid "
        f"has it right already, {d.weights.ahead} ahead). Of the K = {k} best, those within "
        f"{d.weights.slack} cells of the very best are drawn from: <b>{step.n_candidates}</b>."
    )
    if fell:
        text += f" {counted(fell, 'place')} that fit the overlap fell out."
    say(text, "section 4.4")
