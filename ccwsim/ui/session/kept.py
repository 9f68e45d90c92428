"""Images and data that the server stores for some time, so that a page can be reloaded.

A reload starts a new session, and its address contains only digests of images and data. A cookie
identifies the browser, and the digests identify images and data of this browser. Drafts, which the
address does not contain, are stored under the study that was on the page with them.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from secrets import token_urlsafe
from threading import Lock

import streamlit as st

from ccwsim.jobs.limits import limits_of_environment
from ccwsim.jobs.memo import n_bytes
from ccwsim.model import digest
from ccwsim.sharing.choices import Choices
from ccwsim.sharing.link import Own, link_of, own_choices

COOKIE = "ccwsim_browser"
USED = "ccwsim_used"  # cookie of a browser in which the program has been used
COOKIE_SECONDS = {COOKIE: 24 * 3600, USED: 365 * 24 * 3600}
DRAFTS = "ccwsim_drafts"  # key in the session of the names of stored drafts
KEPT_SECONDS = 4 * 3600
"""Number of seconds for which images and data are stored after they were last on a page."""
SHARE_OF_UPLOADS = 4
"""Stored images and data use at most 1 / `SHARE_OF_UPLOADS` of the server's memory for files."""
MAX_OF_BROWSER = 8  # maximum number of images and data sets that are stored for a browser


class KeptChoices:
    """Images and data, by browser and name; the least recently used images and data come first.

    If a browser has too many entries, its oldest entries are dropped; expired entries are dropped
    too. If the total size is too large, the browser that uses the most bytes loses its oldest
    entries, so that no browser can displace the entries of others.
    """

    def __init__(
        self, max_bytes: int, seconds: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._max_bytes, self._seconds, self._clock = max_bytes, seconds, clock
        self._kept: dict[tuple[str, str], tuple[float, int, Own]] = {}  # time, bytes and content
        self._lock = Lock()

    def keep(self, browser: str, choices: Mapping[str, Own]) -> None:
        """Store images and data of a page; they become the newest entries of the browser."""
        with self._lock:
            for name, choice in choices.items():
                self._kept.pop((browser, name), None)
                self._kept[browser, name] = self._clock(), bytes_of_choice(choice), choice
            for key in self._of(browser)[:-MAX_OF_BROWSER]:
                del self._kept[key]
            self._forget()

    def drop(self, browser: str, names: Iterable[str]) -> None:
        """Remove images and data of a browser."""
        with self._lock:
            for name in names:
                self._kept.pop((browser, name), None)

    def of(self, browser: str) -> dict[str, Own]:
        """Return the stored images and data of a browser, by name."""
        with self._lock:
            self._forget()
            return {key[1]: self._kept[key][2] for key in self._of(browser)}

    def _of(self, browser: str) -> list[tuple[str, str]]:
        return [key for key in self._kept if key[0] == browser]

    def _forget(self) -> None:
        expired, sizes = self._clock() - self._seconds, Counter[str]()
        for key, (time_kept, size, _) in list(self._kept.items()):
            if time_kept < expired:
                del self._kept[key]
            else:
                sizes[key[0]] += size
        while sizes.total() > self._max_bytes:
            largest = max(sizes, key=sizes.__getitem__)  # the least recently used in case of a tie
            oldest = self._of(largest)[0]
            sizes[largest] -= self._kept.pop(oldest)[1]


def bytes_of_choice(choice: Own) -> int:
    """Return the approximate bytes of an image, of data or of secondary information."""
    holder = getattr(choice, "placed", None) or getattr(choice, "saved", None)
    values = [] if holder is None else list(vars(holder).values())
    return n_bytes([choice.files, [value for value in values if not isinstance(value, str)]])


@cache
def kept_choices() -> KeptChoices:
    """Return the only store of images and data in this process."""
    return KeptChoices(limits_of_environment().uploads // SHARE_OF_UPLOADS, KEPT_SECONDS)


def browser() -> str:
    """Return the secret name of the browser; the page stores this name in a cookie."""
    if COOKIE not in st.session_state:
        st.session_state[COOKIE] = st.context.cookies.get(COOKIE) or token_urlsafe(24)
    return st.session_state[COOKIE]


def is_new() -> bool:
    """Whether the program has not been used in this browser."""
    return USED not in st.context.cookies


def cookies(used: bool) -> dict[str, tuple[str, int]]:
    """Return the values of the cookies of the browser, and for how many seconds they last."""
    values = {COOKIE: browser(), **({USED: "1"} if used else {})}
    return {name: (value, COOKIE_SECONDS[name]) for name, value in values.items()}


def kept_for_reload() -> dict[str, Own]:
    """Return the stored images and data of the current browser."""
    return kept_choices().of(browser())


def keep_for_reload(choices: Choices, *drafts: Own | None) -> None:
    """Store images and data that the address of the page does not contain.

    Such images and data are parts of the study or `drafts` of an image and of data. Earlier drafts
    of the session are removed.
    """
    named = zip(_names_of_drafts(choices), drafts, strict=False)
    waiting = {name: draft for name, draft in named if draft is not None}
    earlier = st.session_state.get(DRAFTS, ())
    st.session_state[DRAFTS] = (*waiting,)
    kept_choices().drop(browser(), {*earlier} - waiting.keys())
    if unlinked := own_choices(choices) | waiting:
        kept_choices().keep(browser(), unlinked)


def drafts_for_reload(choices: Choices) -> list[Own | None]:
    """Return the stored drafts of an image and of data beside a study, or None for each."""
    kept = kept_for_reload()
    return [kept.get(name) for name in _names_of_drafts(choices)]


def _names_of_drafts(choices: Choices) -> tuple[str, str]:
    study_digest = digest(sorted(link_of(choices).items()))
    return f"image beside {study_digest}", f"data beside {study_digest}"
