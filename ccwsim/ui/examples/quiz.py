"""The quiz: find the piece of the training image among pieces of realizations.

A realization differs from the training image by seams, because windows of cells at a seam may be
absent from the training image.
"""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field as dataclass_field
from functools import cached_property
from html import escape
from secrets import randbelow

import numpy as np
import streamlit as st

from ccwsim import Parameters, TrainingImage, datasets, simulate
from ccwsim.figures import facies_colours, map_png, mixed
from ccwsim.jobs.job import FIRST_RESULT_SECONDS, Job
from ccwsim.metrics import Copying, copying
from ccwsim.metrics.pattern_codes import codes_in
from ccwsim.model import Bytes, Int32s, Mask, Shape, UInt64s, fitted, levels, window_at
from ccwsim.sharing.choices import ImageChoice
from ccwsim.ui.frontend.cells import CellMap, draw_cells
from ccwsim.ui.frontend.component import draw_tiles
from ccwsim.ui.results.maps import pretty
from ccwsim.ui.session import State, follow, image_of
from ccwsim.ui.study.run import failed
from ccwsim.ui.widgets import (
    bound_to,
    button,
    chart_theme,
    field,
    help_of,
    if_possible,
    in_row,
    page_text,
    panel_title,
    plain,
    step_note,
)

N_PICTURES = 6
MAX_PIECE_SIDE = 96
SIDES_PER_REALIZATION = 2  # ratio of the side of a realization to the side of the piece shown
# side of the compared windows in cells; windows of this size can be seen at a glance
WINDOW_SIDE = 6
PICTURES = "quiz_pictures"
MAX_QUIZ_LEVEL = 4
"""Maximum wavelet level of the quiz; at higher levels realizations are too easy to recognize."""
MAX_QUIZ_CANDIDATES = 2000
REVEAL_HEIGHT = 340
SEAM_GREY = "#969696"
MAX_FACIES_MARKED = 120
"""Maximum number of facies for drawing seams, because each facies then needs two colours."""


@dataclass(frozen=True, eq=False)
class Round:
    """The pictures of a round of the quiz.

    `pictures` are facies indices, and `sources` are the positions of cells in the training image;
    both have shape (n, side, side). Picture `answer` is a piece of the training image. The other
    pictures are pieces of different realizations, simulated with `parameters`.
    """

    training_image: TrainingImage
    parameters: Parameters
    pictures: Bytes
    sources: Int32s
    answer: int

    def copying_of(self, k: int) -> Copying:
        """Return the pieces of the training image of which picture k consists."""
        return copying(self.sources[k], self.training_image.shape)

    @cached_property
    def image_codes(self) -> UInt64s:
        """The codes of all windows in the training image."""
        image = self.training_image
        return np.unique(window_codes(image.indices, image.n_facies))

    def shapes_at(self, k: int) -> tuple[Mask, float]:
        """Return a mask of the new shapes in picture k, and their share (see `new_shapes`)."""
        return new_shapes(self.pictures[k], self.training_image.n_facies, self.image_codes)

    @property
    def easiest(self) -> int:
        """The picture with the most shapes that are absent from the training image."""
        shares = [self.shapes_at(k)[1] for k in range(len(self.pictures))]
        shares[self.answer] = -1.0
        return int(np.argmax(shares))


def draw_round(image: TrainingImage, parameters: Parameters, seed: int) -> Round:
    """Create a round from a seed; pieces are cut at random, so edges do not tell the answer."""
    rng = np.random.default_rng(seed)
    side = piece_side(image.shape)
    p, n, length = fitted(parameters, image.shape), N_PICTURES - 1, SIDES_PER_REALIZATION * side
    own_seed, shape = int(rng.integers(2**31)), (length, length)
    e = simulate(image, shape, p, n_realizations=n, seed=own_seed, keep_sources=True)
    assert e.sources is not None
    maps, origins = list(e.indices), list(e.sources)
    answer = int(rng.integers(N_PICTURES))
    maps.insert(answer, image.indices)
    origins.insert(answer, np.arange(image.indices.size, dtype=np.int32).reshape(image.shape))
    pictures, sources = [], []
    for indices, source in zip(maps, origins, strict=True):
        corner = [int(rng.integers(n - side + 1)) for n in indices.shape]
        window = window_at(corner, (side, side))
        pictures.append(indices[window])
        sources.append(source[window])
    return Round(image, p, np.array(pictures), np.array(sources), answer)


def piece_side(shape: Shape) -> int:
    """Return the side of the pieces: at most half of the image's side, so that pieces differ."""
    return max(4, min(MAX_PIECE_SIDE, min(shape) // 2))


def window_codes(indices: Bytes, n_facies: int) -> UInt64s:
    """Return a code of each window of side WINDOW_SIDE; equal windows have equal codes."""
    strips = [codes[0] for codes in codes_in(indices[None], n_facies, 1, WINDOW_SIDE)]
    return np.concatenate(strips) if strips else np.zeros((0, 0), np.uint64)


def new_shapes(indices: Bytes, n_facies: int, image_codes: UInt64s) -> tuple[Mask, float]:
    """Return a mask of the middles of windows with new codes, and the share of these windows."""
    new = ~np.isin(window_codes(indices, n_facies), image_codes)
    new_mask = np.zeros(indices.shape, bool)
    middle = WINDOW_SIDE // 2 - 1
    for down in (middle, middle + 1):
        for along in (middle, middle + 1):
            new_mask[down : down + new.shape[0], along : along + new.shape[1]] |= new
    return new_mask, float(new.mean()) if new.size else 0.0


@dataclass
class Quiz:
    """The state of the quiz.

    `image` is the name of a bundled training image, or empty for the image of the study. `level`,
    `n_candidates` and `refine` are parameters of the realizations. `seed` is random, one per
    session, and `n_rounds` is added to it. `job` computes the round with the settings `asked`.
    `picked` is the picture that the user picked as the training image. `tallies` are the numbers of
    right picks and of all picks for each setting.
    """

    image: str = "channels"
    level: int = 2
    n_candidates: int = 20
    refine: bool = True
    seed: int = dataclass_field(default_factory=lambda: randbelow(2**31))
    n_rounds: int = 0
    job: Job[Round] | None = None
    asked: tuple | None = None
    picked: int | None = None
    tallies: dict[str, tuple[int, int]] = dataclass_field(default_factory=dict)

    @property
    def round(self) -> Round | None:
        """The current round, or None until its pictures are ready."""
        return self.job.result if self.job is not None else None


def draw_quiz(state: State) -> None:
    """Draw the settings, the pictures of the round and, after a pick, the answer."""
    quiz = state.page(Quiz)
    _controls(state)
    if quiz.asked != _asked(state):
        begin_round(state)
    job = quiz.job
    if job is None:
        return
    if not job.wait(FIRST_RESULT_SECONDS):
        follow(job, label=lambda: "Drawing a round …")
    elif job.error is not None:
        st.error(plain(failed(job.error)))
    if quiz.round is not None:
        _draw_round(state, quiz.round)


def begin_round(state: State) -> None:
    """Start a new round with new pictures."""
    quiz = state.page(Quiz)
    quiz.asked, quiz.picked = _asked(state), None
    quiz.n_rounds += 1
    image, seed = _image(state), quiz.seed + quiz.n_rounds
    parameters = fitted(
        Parameters(),
        (1024, 1024),
        refine=quiz.refine,
        wavelet_level=quiz.level,
        n_candidates=quiz.n_candidates,
    )
    quiz.job = Job(lambda _: draw_round(image, parameters, seed))


def pick(quiz: Quiz, k: int) -> None:
    """Store the user's pick; only the first pick of a round counts."""
    if quiz.round is None or quiz.picked is not None or not 0 <= k < len(quiz.round.pictures):
        return
    quiz.picked = k
    setting = describe_round(quiz)
    hits, tries = quiz.tallies.get(setting, (0, 0))
    quiz.tallies[setting] = hits + (k == quiz.round.answer), tries + 1


def describe_round(quiz: Quiz) -> str:
    """Return the settings for the next round."""
    name = pretty(quiz.image) if quiz.image else "your image"
    refine = [] if quiz.refine else ["no refine"]
    return ", ".join([name, f"level {quiz.level}", f"K {quiz.n_candidates}", *refine])


def _controls(state: State) -> None:
    quiz, upload = state.page(Quiz), state.choices.image.upload
    names = ["", *datasets.names()] if upload else list(datasets.names())
    if quiz.image not in names:
        quiz.image = names[0]

    def name_of(name: str) -> str:
        return pretty(name) if name else upload.name if upload else ""

    possible = [level for level in levels(_image(state).shape) if level <= MAX_QUIZ_LEVEL]
    with in_row("quiz_row", "bottom"):
        field(
            st.selectbox,
            "Training image",
            key="quiz_image",
            options=names,
            format_func=name_of,
            width=180,
            **bound_to(quiz, "image"),
        )
        field(
            st.selectbox,
            "Level",
            key="quiz_level",
            options=possible,
            width=90,
            help=help_of("wavelet_level"),
            **bound_to(quiz, "level"),
        )
        field(
            st.number_input,
            "Candidates K",
            key="quiz_k",
            min_value=1,
            max_value=MAX_QUIZ_CANDIDATES,
            width=130,
            help=help_of("n_candidates"),
            **bound_to(quiz, "n_candidates"),
        )
        field(
            st.checkbox,
            "Refine",
            key="quiz_refine",
            help=help_of("refine"),
            **bound_to(quiz, "refine"),
        )
        button("Next round", key="quiz_next", on_click=begin_round, args=(state,), type="primary")


def _draw_round(state: State, quiz_round: Round) -> None:
    quiz = state.page(Quiz)
    if quiz.picked is None:
        step_note(page_text("Quiz", n=len(quiz_round.pictures)))
    colours = _colours(state, quiz_round)
    number, picked = quiz.n_rounds, quiz.picked is not None

    def chosen(value: list[int]) -> None:
        if int(value[0]) == number:
            pick(quiz, int(value[1]))

    def label(k: int) -> str:
        if not picked:  # the browser gets the answer only after the pick
            return f"{k + 1}"
        what = "training image" if k == quiz_round.answer else "realization"
        return f"{k + 1} · {what}{', your pick' if k == quiz.picked else ''}"

    tiles = [
        {
            "value": [number, k],
            "png": b64encode(map_png(picture, colours)).decode(),
            "label": label(k),
            "name": f"Picture {label(k)}",
            "mark": "answer" if picked and k == quiz_round.answer else "",
            "disabled": picked,
        }
        for k, picture in enumerate(quiz_round.pictures)
    ]
    heading = "Which one is the training image?"
    draw_tiles(PICTURES, heading, tiles, chosen, kind="quiz", shown=quiz.picked)
    if picked:
        draw_reveal(quiz, quiz_round, colours)
    if not quiz.tallies:
        return
    lines = "".join(
        f"<li>{setting}: <b>{hits} of {tries}</b> found</li>"
        for setting, (hits, tries) in quiz.tallies.items()
    )
    hits, tries = (sum(t[k] for t in quiz.tallies.values()) for k in (0, 1))
    st.html(
        f'<div class="score"><p class="facts">{hits} of {tries} found; guessing finds one in '
        f"{N_PICTURES}</p><ul>{lines}</ul></div>"
    )


def _asked(state: State) -> tuple:
    quiz = state.page(Quiz)
    digest = state.choices.image.digest if not quiz.image else ""
    return quiz.image, digest, quiz.level, quiz.n_candidates, quiz.refine


def _image(state: State):
    quiz = state.page(Quiz)
    choice = ImageChoice(quiz.image) if quiz.image else state.choices.image
    return if_possible(lambda: image_of(choice)) or datasets.load("channels")


def _colours(state: State, quiz_round: Round) -> list[str]:
    user_colours = dict(state.choices.image.colours) if not state.page(Quiz).image else {}
    return facies_colours(quiz_round.training_image, user_colours)


def draw_reveal(quiz: Quiz, quiz_round: Round, colours: Sequence[str]) -> None:
    """Tell whether the pick was right, and draw the seams of a realization."""
    picked = quiz.picked
    assert picked is not None
    k = quiz_round.easiest if picked == quiz_round.answer else picked
    tone = "good" if picked == quiz_round.answer else "bad"
    verdict = escape(describe_verdict(picked, quiz_round))
    st.html(f'<p class="verdict {tone}" role="status">{verdict}</p>')
    left, middle, words = st.columns([1.0, 1.0, 1.6], gap="medium")
    with left:
        panel_title(f"Seams of picture {k + 1}")
        seams = quiz_seam_map(quiz_round, k, colours)
        draw_cells(seams, "quiz_seams", name="seams", max_height=REVEAL_HEIGHT)
    with middle:
        panel_title("Where the pieces come from in the training image")
        pieces = piece_map(quiz_round, k, colours)
        draw_cells(pieces, "quiz_pieces", name="pieces", max_height=REVEAL_HEIGHT)
    with words:
        panel_title("How to recognize the realization")
        lines = describe_seams(quiz_round, k)
        st.html("".join(f'<p class="telling">{escape(line)}</p>' for line in lines))


def describe_verdict(picked: int, quiz_round: Round) -> str:
    """Return a sentence that tells whether the pick was right."""
    if picked == quiz_round.answer:
        return f"Yes: picture {picked + 1} is the training image."
    return (
        f"No: picture {picked + 1} is a realization. The training image is picture "
        f"{quiz_round.answer + 1}."
    )


def describe_seams(quiz_round: Round, k: int) -> list[str]:
    """Describe the seams of picture k; compare its share of new shapes with the other pictures."""
    copied, new_share = quiz_round.copying_of(k), quiz_round.shapes_at(k)[1]
    others = [
        quiz_round.shapes_at(j)[1]
        for j in range(len(quiz_round.pictures))
        if j != quiz_round.answer
    ]
    low, high, new_share = (f"{100 * share:.1f}" for share in (min(others), max(others), new_share))
    share, side = f"{100 * copied.seams.mean():.0f}", copied.largest_square
    return [
        page_text("Seams of a picture", picture=k + 1, share=share, side=side),
        page_text("Visible seams", own=new_share, side=WINDOW_SIDE, low=low, high=high),
        page_text("Windows of the image"),
    ]


def quiz_seam_map(quiz_round: Round, k: int, colours: Sequence[str]) -> CellMap:
    """Return picture k with its seams, and a mask of shapes absent from the training image."""
    theme, names = chart_theme(), quiz_round.training_image.facies_names
    indices = quiz_round.pictures[k]
    n = len(names)
    if n > MAX_FACIES_MARKED:
        return CellMap(indices, colours, names, f"Picture {k + 1}")
    marked = np.where(quiz_round.copying_of(k).seams, n + indices, indices)
    marked = np.where(quiz_round.shapes_at(k)[0], 2 * n, marked).astype(np.uint8)
    return CellMap(
        indices=marked,
        colours=[*colours, *(mixed(colour, SEAM_GREY, 0.4) for colour in colours), theme.reference],
        labels=[*names, *(f"{name}, at a seam" for name in names), "a new shape"],
        alt=f"Seams of picture {k + 1}, and shapes absent from the training image",
        keys=[("a seam", mixed(colours[0], SEAM_GREY, 0.4)), ("a new shape", theme.reference)],
    )


def piece_map(quiz_round: Round, k: int, colours: Sequence[str]) -> CellMap:
    """Return the training image; cells used in picture k are in colour, and others are grey."""
    image = quiz_round.training_image
    n = image.n_facies
    if n > MAX_FACIES_MARKED:
        return CellMap(image.indices, colours, image.facies_names, "The training image")
    used = quiz_round.copying_of(k).uses > 0
    return CellMap(
        indices=np.where(used, image.indices, n + image.indices).astype(np.uint8),
        colours=[*colours, *(mixed(colour, SEAM_GREY, 0.75) for colour in colours)],
        labels=[*image.facies_names, *(f"{name}, not used" for name in image.facies_names)],
        alt=f"The training image; cells used in picture {k + 1} are in full colour",
    )
