"""Fragments of pages show errors and follow jobs; fragments of the previous page do not run."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import streamlit as st
from streamlit.runtime.scriptrunner import RerunData, ScriptRunner, get_script_run_ctx

from ccwsim.jobs.job import JOB_POLL_SECONDS, Job
from ccwsim.jobs.statistics import StatisticsWorker, Task
from ccwsim.system.log import logged
from ccwsim.ui.session.address import follow_study
from ccwsim.ui.session.progress import progress_text
from ccwsim.ui.session.state import KEY, session_state, start_afresh
from ccwsim.ui.widgets import PENDING_ERROR, button, in_row, is_control_flow, user_message

FAILED = "ccwsim_failed"  # session key that is present while a part of the page cannot be drawn
DRAW_SECONDS = 0.5  # seconds between two checks of a job whose partial results are drawn
BATCH_SECONDS = 1.0  # maximum seconds to wait for further values before finished values are drawn
_run_script = ScriptRunner._run_script


def run_if_there(self: ScriptRunner, rerun_data: RerunData) -> None:
    """Run a page or the requested fragments; if all requested fragments are gone, run nothing.

    A timer of the previous page may still request its fragment. Streamlit would then announce a run
    of the previous page, and the browser would remove the present page.
    """
    fragments = rerun_data.fragment_id_queue
    if not fragments or any(map(self._fragment_storage.contains, fragments)):
        _run_script(self, rerun_data)


ScriptRunner._run_script = run_if_there


@contextmanager
def error_boundary(whole: bool = False, way_back: bool = False) -> Iterator[None]:
    """Show errors as messages, keep the session state, and write changes into the address.

    Use this context for the body of a page or fragment. If a `whole` page or a part with `way_back`
    fails, a button is drawn that returns to the last study that was drawn without an error. The
    address is written once: by the `whole` page, or by a fragment that is drawn without its page.
    """
    if whole:
        st.session_state.pop(FAILED, None)
    if PENDING_ERROR in st.session_state:
        st.error(st.session_state.pop(PENDING_ERROR))
    try:
        yield
        if whole and KEY in st.session_state and FAILED not in st.session_state:
            session_state().note_drawn()
    except Exception as error:
        if is_control_flow(error):
            raise
        st.error(user_message(error, "drawn"))
        first = FAILED not in st.session_state
        st.session_state[FAILED] = True
        if first and (whole or way_back):
            state = session_state()
            with in_row(align="top"):
                if state.drawn not in (None, state.choices):
                    button(
                        "Back to the study before",
                        key="way_back",
                        on_click=state.go_back,
                        args=(state.drawn,),
                        type="primary",
                    )
                button("Start afresh", key="afresh_now", on_click=start_afresh)
    context = get_script_run_ctx(suppress_warning=True)
    of_fragment = context is not None and context.fragment_ids_this_run and not way_back
    if KEY in st.session_state and (whole or of_fragment):
        try:
            follow_study(session_state())
        except Exception as error:  # the page is complete, but the address is not updated
            logged(error)


def follow(
    job: Job,
    *,
    on_finished: Callable[[], None] | None = None,
    has_news: Callable[[], bool] | None = None,
    label: Callable[[], str] | None = None,
    draw: Callable[[], object] | None = None,
    keys: tuple[str, str] = ("progress", "cancel"),
    cancel: str = "Cancel",
) -> None:
    """Show the progress of a job and a button that stops the job; redraw the page at the end.

    The page is also drawn again if `has_news()` is true. `on_finished` is called before the page is
    drawn again. `label` replaces the number of finished pieces, and `draw` draws partial results.
    `keys` are the keys of the progress and of the button; `cancel` is the text of the button.
    """

    @st.fragment(run_every=DRAW_SECONDS if draw else JOB_POLL_SECONDS)
    def draw_progress() -> None:
        with error_boundary():
            if job.finished or (has_news and has_news()):
                if on_finished:
                    on_finished()
                st.rerun()
            text = progress_text(job, label() if label else "")
            if not job.n:
                st.html(f'<div class="note" role="status">{text}</div>')
            else:
                with in_row(keys[0]):
                    st.progress(min(job.fraction, 1.0), text=text)
                    button(cancel, key=keys[1], on_click=job.cancel, disabled=job.is_cancelled())
            if draw:
                draw()

    draw_progress()


@st.fragment(run_every=JOB_POLL_SECONDS)
def follow_tasks(
    worker: StatisticsWorker,
    tasks: Sequence[Task],
    since: float,
    draw: Callable[[int], None] | None = None,
) -> None:
    """Redraw the page when all `tasks` are done, or after `BATCH_SECONDS` if only some are done.

    `since` is the `time.monotonic` at which the page was drawn. `draw` is called with the number of
    missing values.
    """
    with error_boundary():
        ready = [worker.memo.get(task.key) is not None for task in tasks]
        if all(ready) or (any(ready) and time.monotonic() - since > BATCH_SECONDS):
            st.rerun()
        for task in tasks:
            worker.ask(task)
        if draw:
            draw(ready.count(False))
