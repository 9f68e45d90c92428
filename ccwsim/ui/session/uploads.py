"""Files that readers send: the memory of the server is not theirs to fill.

Streamlit keeps whatever a browser sends for as long as its session lives, asked for or not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from threading import Lock
from typing import Any
from weakref import WeakValueDictionary

import streamlit as st
from streamlit import config
from streamlit.runtime import Runtime
from streamlit.runtime.memory_uploaded_file_manager import MemoryUploadedFileManager
from streamlit.runtime.uploaded_file_manager import UploadedFile, UploadedFileRec

from ccwsim.jobs.job import server_queue
from ccwsim.jobs.limits import free_bytes, limits_of_environment
from ccwsim.model.errors import CCWSIMError
from ccwsim.sharing.choices import Upload
from ccwsim.ui.widgets.errors import catch_callback_errors

MAX_OF_SESSION = 4
"""Files of the largest size that a session may have: an image, data, a reference, a project."""
NO_ROOM = "application/x-no-room"
"""The type of a file that came when there was no room for it; its content is dropped."""

_taken: WeakValueDictionary[int, Upload] = WeakValueDictionary()
"""Files that studies have, of all sessions, by identity."""


def file_uploader(
    label: str,
    *,
    key: str,
    take: Callable[[Upload], None],
    removed: Callable[[], None] = lambda: None,
    **options: Any,
) -> None:
    """Draw a file uploader; `take` gets the chosen file, `removed` is called if it is removed."""

    def changed() -> None:
        file = st.session_state[key]
        if file is None:
            removed()
        else:
            take(upload_of(file))

    st.file_uploader(label, key=key, on_change=catch_callback_errors(changed), **options)


def upload_of(file: UploadedFile) -> Upload:
    """Return a file of the reader's for a study; an error if the server has no room for it."""
    if file.type == NO_ROOM:
        raise CCWSIMError(
            f"{file.name} was not taken: this server holds as many files of all its readers as it "
            "has memory for; use a smaller file, or try again later"
        )
    upload = Upload(file.name, file.getvalue())
    _taken[id(upload)] = upload
    return upload


@cache
def bound_uploads() -> None:
    """Bound what browsers may leave in the memory of this server, from now on."""
    if not Runtime.exists():
        return
    manager = Runtime.instance().uploaded_file_mgr
    if isinstance(manager, MemoryUploadedFileManager):
        # no public way leads between a browser and what keeps its files
        manager.add_file = BoundedUploads(manager).add_file  # type: ignore[method-assign]


class BoundedUploads:
    """Lets files into a manager of Streamlit while there is room for them.

    If a session has too many the oldest go, which the study has by then or nothing uses; a file
    for which the server has no room comes without its content.
    """

    def __init__(self, manager: MemoryUploadedFileManager) -> None:
        self._manager, self._add, self._lock = manager, manager.add_file, Lock()

    def add_file(self, session_id: str, file: UploadedFileRec) -> None:
        """Keep a file of a session, in place of its oldest ones if these are too large."""
        with self._lock:
            n = len(file.data)
            own = dict(self._manager.file_storage.get(session_id, {}))
            own.pop(file.file_id, None)
            too_much = sum(len(old.data) for old in own.values()) + n - max_of_session()
            for name, old in own.items():
                if too_much <= 0:
                    break
                self._manager.remove_file(session_id, name)
                too_much -= len(old.data)
            if not self._has_room(n):
                file = file._replace(data=b"", type=NO_ROOM)
            self._add(session_id, file)

    def held(self) -> int:
        """Return how many bytes files of all sessions take, those in studies included."""
        sessions = list(self._manager.file_storage.values())
        records = [record.data for files in sessions for record in list(files.values())]
        return size_of_all([*records, *(upload.content for upload in _taken.values())])

    def _has_room(self, n: int) -> bool:
        limits = limits_of_environment()
        if self.held() + n > limits.uploads:
            return False
        free = free_bytes(limits)  # less the file, which has arrived; reading it takes as much
        return free is None or n <= free - server_queue().still_to_take


def max_of_session() -> int:
    """Return how many bytes the files of a session may have together."""
    return MAX_OF_SESSION * config.get_option("server.maxUploadSize") * 2**20


def size_of_all(contents: Iterable[bytes]) -> int:
    """Return how many bytes contents take; one that is held twice counts once.

    Examples
    --------
    >>> content = bytes(1000)
    >>> size_of_all([content, content, bytes(10)])
    1010
    """
    return sum({id(content): len(content) for content in contents}.values())
