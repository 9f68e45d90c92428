"""What a pick in the quiz was, and where the seams are that could have told."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
import streamlit as st

from ccwsim.ui.examples.quiz_rounds import Round
from ccwsim.ui.examples.quiz_shapes import SIDE
from ccwsim.ui.examples.state import Quiz
from ccwsim.ui.widgets.maps import CellMap, draw_map
from ccwsim.ui.widgets.steps import panel_title
from ccwsim.ui.widgets.theme import chart_theme

MAP_HEIGHT = 340
MAX_FACIES = 120
"""Of an image whose seams can be drawn: each facies needs a second colour."""


def draw_reveal(quiz: Quiz, shown: Round, colours: Sequence[str]) -> None:
    """Say whether the pick was right, and draw the seams of a realization."""
    picked = quiz.picked
    assert picked is not None
    k = shown.easiest if picked == shown.answer else picked
    tone = "good" if picked == shown.answer else "bad"
    verdict = escape(said_verdict(picked, shown))
    st.html(f'<p class="verdict {tone}" role="status">{verdict}</p>')
    left, middle, words = st.columns([1.0, 1.0, 1.6], gap="medium")
    with left:
        panel_title(f"Seams of picture {k + 1}")
        draw_map(seam_map(shown, k, colours), "map_quiz_seams", name="seams",
                 max_height=MAP_HEIGHT)  # fmt: skip
    with middle:
        panel_title("Where its pieces are from")
        draw_map(piece_map(shown, k, colours), "map_quiz_pieces", name="pieces",
                 max_height=MAP_HEIGHT)  # fmt: skip
    with words:
        panel_title("What gives it away")
        st.html("".join(f'<p class="telling">{escape(line)}</p>' for line in said_seams(shown, k)))


def said_verdict(picked: int, shown: Round) -> str:
    """Say whether a pick was right."""
    if picked == shown.answer:
        return f"Yes: picture {picked + 1} is the training image."
    return (
        f"No: picture {picked + 1} is a realization. The training image is picture "
        f"{shown.answer + 1}."
    )


def said_seams(shown: Round, k: int) -> list[str]:
    """Say what the seams of picture k are like, beside those of the others."""
    found, own = shown.reuse_of(k), shown.shapes_at(k)[1]
    others = [shown.shapes_at(j)[1] for j in range(len(shown.pictures)) if j != shown.answer]
    low, high = (f"{100 * share:.1f}" for share in (min(others), max(others)))
    return [
        f"Picture {k + 1} is put together from pieces of the training image: "
        f"{100 * found.seams.mean():.0f} % of its cells lie at a seam, and the largest square of "
        f"one piece has {found.largest_square} × {found.largest_square} cells.",
        "Most seams cannot be seen. One shows where it makes a shape that the training image has "
        f"nowhere (red): {100 * own:.1f} % of the windows of {SIDE} × {SIDE} cells here, {low} to "
        f"{high} % in the realizations of this round. Look there for banks with a step, and for "
        "bodies that end or change their width at once.",
        "The training image has no such windows, by definition. A higher level, more candidates "
        "or refine off make more of them.",
    ]


def seam_map(shown: Round, k: int, colours: Sequence[str]) -> CellMap:
    """Return picture k with its seams, and in front of them the shapes that are new."""
    theme, names = chart_theme(), shown.training_image.facies_names
    indices = shown.pictures[k]
    n = len(names)
    if n > MAX_FACIES:
        return CellMap(indices, colours, names, f"Picture {k + 1}")
    marked = np.where(shown.reuse_of(k).seams, n + indices, indices)
    marked = np.where(shown.shapes_at(k)[0], 2 * n, marked).astype(np.uint8)
    return CellMap(
        indices=marked,
        colours=[*colours, *(_greyed(colour) for colour in colours), theme.reference],
        labels=[*names, *(f"{name}, at a seam" for name in names), "a shape that is new"],
        alt=f"Seams of picture {k + 1}, and shapes that the training image does not have",
        keys=[("a seam", _greyed(colours[0])), ("a new shape", theme.reference)],
    )


def piece_map(shown: Round, k: int, colours: Sequence[str]) -> CellMap:
    """Return the training image with the cells that picture k has, the others greyed."""
    image = shown.training_image
    n = image.n_facies
    if n > MAX_FACIES:
        return CellMap(image.indices, colours, image.facies_names, "The training image")
    used = shown.reuse_of(k).uses > 0
    return CellMap(
        indices=np.where(used, image.indices, n + image.indices).astype(np.uint8),
        colours=[*colours, *(_greyed(colour, 0.25) for colour in colours)],
        labels=[*image.facies_names, *(f"{name}, not used" for name in image.facies_names)],
        alt=f"The training image; what picture {k + 1} has of it is in full colour",
    )


def _greyed(colour: str, kept: float = 0.6) -> str:
    """Return a colour part of the way to grey."""
    channels = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(kept * c + (1 - kept) * 150):02X}" for c in channels)
