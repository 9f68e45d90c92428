"""Uploads of files, limited so that uploaded files cannot fill the memory of the server.

Without such a limit, Streamlit keeps every file of a session until the session ends.
"""

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
from ccwsim.model import refused
from ccwsim.sharing.choices import Upload
from ccwsim.ui.session.server import current_session
from ccwsim.ui.widgets import catch_callback_errors

MAX_OF_SESSION = 4
"""Maximum total size of a session's files, as a multiple of the maximum size of one file."""
NO_ROOM = "application/x-no-room"
"""MIME type of a file whose content was dropped because the server had too little memory."""

_taken: WeakValueDictionary[tuple[str, int], Upload] = WeakValueDictionary()
"""Files in the studies of all sessions, by session and `id`."""


def file_uploader(
    label: str,
    *,
    key: str,
    take: Callable[[Any], object],
    removed: Callable[[], None] = lambda: None,
    **options: Any,
) -> None:
    """Draw a file uploader; call `take` with a chosen file, and `removed` after its removal.

    With the option `accept_multiple_files`, `take` is called with a tuple of files.
    """

    def changed() -> None:
        file = st.session_state[key]
        if not file:
            removed()
        else:
            take(tuple(map(upload_of, file)) if isinstance(file, list) else upload_of(file))

    st.file_uploader(label, key=key, on_change=catch_callback_errors(changed), **options)


def upload_of(file: UploadedFile) -> Upload:
    """Return an uploaded file for use in a study; raise `CCWSIMError` if memory is full."""
    if file.type == NO_ROOM:
        raise refused("no_memory_for_files", name=file.name)
    upload = Upload(file.name, file.getvalue())
    _taken[current_session(), id(upload)] = upload
    return upload


@cache
def bound_uploads() -> None:
    """Limit the memory that uploads use on this server from now on."""
    if not Runtime.exists():
        return
    manager = Runtime.instance().uploaded_file_mgr
    if isinstance(manager, MemoryUploadedFileManager):
        # Streamlit has no public access to the manager of uploaded files
        manager.add_file = BoundedUploads(manager).add_file  # type: ignore[method-assign]


class BoundedUploads:
    """Adds files to Streamlit's file manager as long as there is memory for the files.

    If the total size of a session's files is too large, the oldest files are dropped; the study
    stores the files that it uses. If the server has no memory for a file, the file's content is
    dropped. The files of one session may use at most half of the memory that other sessions leave,
    so that no session can use all of it.
    """

    def __init__(self, manager: MemoryUploadedFileManager) -> None:
        self._manager, self._add, self._lock = manager, manager.add_file, Lock()

    def add_file(self, session_id: str, file: UploadedFileRec) -> None:
        """Store a file; if the files of the session are too large in total, drop the oldest."""
        with self._lock:
            n = len(file.data)
            older = dict(self._manager.file_storage.get(session_id, {}))
            older.pop(file.file_id, None)
            too_much = sum(len(old.data) for old in older.values()) + n - max_of_session()
            for name, old in older.items():
                if too_much <= 0:
                    break
                self._manager.remove_file(session_id, name)
                too_much -= len(old.data)
            if not self._has_room(session_id, n):
                file = file._replace(data=b"", type=NO_ROOM)
            self._add(session_id, file)

    def held(self, session: str | None = None) -> int:
        """Return the bytes of all files, or of one session, including the files in studies."""
        storage = dict(self._manager.file_storage)
        sessions = storage.values() if session is None else [storage.get(session, {})]
        records = [record.data for files in sessions for record in list(files.values())]
        taken = [up.content for (user, _), up in list(_taken.items()) if session in (None, user)]
        return size_of_all([*records, *taken])

    def _has_room(self, session: str, n: int) -> bool:
        limits = limits_of_environment()
        if self.held(session) + n > limits.uploads - self.held() - n:
            return False
        free = free_bytes(limits)  # reading a file needs additional memory of the file's size
        return free is None or n <= free - server_queue().still_to_take


def max_of_session() -> int:
    """Return the maximum total bytes of the files of a session."""
    return MAX_OF_SESSION * config.get_option("server.maxUploadSize") * 2**20


def size_of_all(contents: Iterable[bytes]) -> int:
    """Return the total bytes of the contents; an object that occurs twice counts once."""
    return sum({id(content): len(content) for content in contents}.values())
