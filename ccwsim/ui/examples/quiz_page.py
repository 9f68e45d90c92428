"""The quiz: which one is the training image? And, afterwards, what gives the others away."""

from __future__ import annotations

from base64 import b64encode

import streamlit as st

from ccwsim import datasets
from ccwsim.figures import facies_colours, map_png
from ccwsim.model.choices import ImageChoice
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.parameters import Parameters
from ccwsim.ui.examples.quiz_reveal import draw_reveal
from ccwsim.ui.examples.quiz_rounds import N_PICTURES, Round, draw_round
from ccwsim.ui.examples.state import Examples, Quiz
from ccwsim.ui.jobs.job import Job
from ccwsim.ui.results.facies import pretty
from ccwsim.ui.session.fitting import fitted, levels
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import PATIENCE, failed
from ccwsim.ui.widgets.fields import button, field, help_of
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.maps import canvas_component
from ccwsim.ui.widgets.steps import step_note

KEY = "quiz_pictures"
HIGHEST = 4
"""Of the levels: a round is quick to look at, and higher ones leave nothing to find."""


def draw_quiz(state: State) -> None:
    """Draw the settings, the pictures of the round, and what a pick said."""
    quiz = state.page(Examples).quiz
    _controls(state)
    if quiz.asked != _asked(state):
        begin_round(state)
    if quiz.job is not None and quiz.job.wait(PATIENCE):
        collect_round(quiz)
    if quiz.message:
        st.error(plain(quiz.message))
    if quiz.job is not None:
        follow(quiz.job, on_finished=lambda: collect_round(quiz), label=lambda: "Drawing a round …")
    if quiz.round is not None:
        _draw_round(state, quiz.round)


def begin_round(state: State) -> None:
    """Draw new pictures; what was picked before counts already."""
    quiz = state.page(Examples).quiz
    quiz.asked, quiz.picked, quiz.message = _asked(state), None, ""
    quiz.n_rounds += 1
    image, parameters = _image(state), _parameters(quiz)
    seed = quiz.seed + quiz.n_rounds
    quiz.round = None
    quiz.job = Job(lambda job: draw_round(image, parameters, seed))


def collect_round(quiz: Quiz) -> None:
    """Take the pictures when they are there."""
    job = quiz.job
    if job is None or not job.finished:
        return
    quiz.job, quiz.round = None, job.result
    if job.error is not None:
        quiz.message = failed(job.error)


def pick(quiz: Quiz, k: int) -> None:
    """Take a pick and count it; only the first one of a round counts."""
    if quiz.round is None or quiz.picked is not None or not 0 <= k < len(quiz.round.pictures):
        return
    quiz.picked = k
    said = said_setting(quiz)
    found, tries = quiz.tallies.get(said, (0, 0))
    quiz.tallies[said] = found + (k == quiz.round.answer), tries + 1


def said_setting(quiz: Quiz) -> str:
    """Say what a round is drawn with.

    Examples
    --------
    >>> said_setting(Quiz(level=3, refine=False))
    'channels, level 3, K 20, no refine'
    """
    name = pretty(quiz.image) if quiz.image else "your image"
    refine = [] if quiz.refine else ["no refine"]
    return ", ".join([name, f"level {quiz.level}", f"K {quiz.n_candidates}", *refine])


def _controls(state: State) -> None:
    quiz = state.page(Examples).quiz
    upload = state.choices.image.upload
    names = ["", *datasets.names()] if upload else list(datasets.names())
    if quiz.image not in names:
        quiz.image = names[0]
    possible = [level for level in levels(_image(state).shape) if level <= HIGHEST]

    def change(name: str):
        return lambda value: setattr(quiz, name, value)

    with st.container(horizontal=True, vertical_alignment="bottom", gap="small", key="quiz_row"):
        field(
            st.selectbox, "Training image", key="quiz_image", value=quiz.image, options=names,
            format_func=lambda name: pretty(name) if name else upload.name if upload else "",
            write=change("image"), width=180,
        )  # fmt: skip
        field(
            st.selectbox, "Level", key="quiz_level", value=quiz.level, options=possible,
            write=change("level"), width=90, help=help_of("wavelet_level"),
        )  # fmt: skip
        field(
            st.number_input, "Candidates K", key="quiz_k", value=quiz.n_candidates, width=130,
            min_value=1, max_value=2000, write=lambda k: setattr(quiz, "n_candidates", int(k)),
            help=help_of("n_candidates"),
        )  # fmt: skip
        field(
            st.checkbox, "Refine", key="quiz_refine", value=quiz.refine, write=change("refine"),
            help=help_of("refine"),
        )  # fmt: skip
        button("Next round", key="quiz_next", type="primary", on_click=begin_round,
                  args=(state,))  # fmt: skip


def _draw_round(state: State, shown: Round) -> None:
    quiz = state.page(Examples).quiz
    n = len(shown.pictures)
    if quiz.picked is None:
        step_note(
            f"One of these {n} is a piece of the training image; the others are pieces of "
            "realizations made from it. Pick it."
        )
    colours = _colours(state, shown)
    pictures = [b64encode(map_png(p, colours)).decode() for p in shown.pictures]
    number = quiz.n_rounds

    def chosen() -> None:
        answer = st.session_state[KEY].chosen
        if answer and int(answer["round"]) == number:
            pick(quiz, int(answer["k"]))

    told = quiz.picked is not None
    data = {
        "pictures": pictures, "round": number, "picked": quiz.picked,
        "answer": shown.answer if told else None,  # the browser knows it only afterwards
    }  # fmt: skip
    canvas_component("quiz")(key=KEY, data=data, on_chosen_change=chosen)
    if told:
        draw_reveal(quiz, shown, colours)
    _draw_score(quiz)


def _draw_score(quiz: Quiz) -> None:
    if not quiz.tallies:
        return
    lines = "".join(
        f"<li>{said}: <b>{found} of {tries}</b> found</li>"
        for said, (found, tries) in quiz.tallies.items()
    )
    found, tries = (sum(t[k] for t in quiz.tallies.values()) for k in (0, 1))
    st.html(
        f'<div class="score"><p class="facts">{found} of {tries} found; guessing finds one in '
        f"{N_PICTURES}</p><ul>{lines}</ul></div>"
    )


def _asked(state: State) -> tuple:
    quiz = state.page(Examples).quiz
    digest = state.choices.image.digest if not quiz.image else ""
    return quiz.image, digest, quiz.level, quiz.n_candidates, quiz.refine


def _image(state: State):
    quiz = state.page(Examples).quiz
    choice = ImageChoice(quiz.image) if quiz.image else state.choices.image
    try:
        return image_of(choice)
    except CCWSIMError:
        return datasets.load("channels")


def _parameters(quiz: Quiz) -> Parameters:
    wanted = {"wavelet_level": quiz.level, "n_candidates": quiz.n_candidates}
    return fitted(Parameters(), (1024, 1024), refine=quiz.refine, **wanted)


def _colours(state: State, shown: Round) -> list[str]:
    own = dict(state.choices.image.colours) if not state.page(Examples).quiz.image else {}
    return facies_colours(shown.training_image, own)
