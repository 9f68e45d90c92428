"""Test that uploads never fill the memory of the server, and that refusals are reported."""

from __future__ import annotations

import gc
from contextlib import ExitStack

import numpy as np
import pytest
from streamlit.proto.Common_pb2 import FileURLs
from streamlit.runtime.memory_uploaded_file_manager import MemoryUploadedFileManager
from streamlit.runtime.uploaded_file_manager import UploadedFile, UploadedFileRec

from ccwsim import datasets, simulate
from ccwsim.jobs.job import Queue
from ccwsim.model.errors import CCWSIMError
from ccwsim.sharing.choices import Choices, ImageChoice, Upload
from ccwsim.ui.session import uploads
from ccwsim.ui.session.state import KEY, PastRun, PastRuns, State
from ccwsim.ui.session.uploads import NO_ROOM, BoundedUploads, max_of_session, upload_of
from tests.browser.served import started
from tests.ui.sessions import Session, resident
from tests.ui.test_pages import SMALL, a_file
from tests.ui.widgets import opened, texts

MB = 10**6


@pytest.fixture
def manager(monkeypatch):
    """Return a file manager of Streamlit that stores 20 MB for all sessions, and 8 MB for each."""
    monkeypatch.setenv("CCWSIM_UPLOADS_MB", "20")
    monkeypatch.setattr(uploads, "max_of_session", lambda: 8 * MB)
    uploads._taken.clear()
    return MemoryUploadedFileManager("/upload")


def record(name: str, size: int) -> UploadedFileRec:
    return UploadedFileRec(name, f"{name}.dat", "text/plain", bytes(size))


def sent(manager, session: str, *names: str, size: int = 3 * MB) -> list[UploadedFileRec]:
    bounded = BoundedUploads(manager)
    for name in names:
        bounded.add_file(session, record(name, size))
    return manager.get_files(session, names)


def test_a_session_that_sends_on_and_on_holds_its_latest_files(manager):
    files = sent(manager, "ann", *map(str, range(20)))
    assert [file.file_id for file in files] == ["18", "19"]
    assert sum(len(file.data) for file in files) == 6 * MB


def test_a_session_takes_no_more_room_than_it_leaves(manager):
    sizes = [
        sum(len(file.data) for file in sent(manager, f"reader {k}", *"abcdefgh", size=MB))
        for k in range(5)
    ]
    assert sizes == [8 * MB, 6 * MB, 3 * MB, MB, MB]  # 20 MB in total; at most 8 MB per session
    manager.remove_session_files("reader 0")
    (again,) = sent(manager, "reader 4", "i", size=3 * MB)
    assert len(again.data) == 3 * MB


def test_all_sessions_together_hold_what_the_server_allows(manager):
    for k in range(50):
        sent(manager, f"reader {k}", "a", "b", size=500_000)
    files = [f for k in range(50) for f in manager.get_files(f"reader {k}", ["a", "b"])]
    taken = [file for file in files if file.type == "text/plain"]
    assert files[:36] == taken[:36]
    assert BoundedUploads(manager).held() == len(taken) * 500_000 <= 20 * MB
    assert not any(file.data for file in files if file.type == NO_ROOM)


def test_files_in_the_study_of_a_session_are_its_own(manager, monkeypatch):
    bounded = BoundedUploads(manager)
    (file,) = sent(manager, "ann", "image", size=5 * MB)
    monkeypatch.setattr(uploads, "current_session", lambda: "ann")
    study = upload_of(UploadedFile(file, FileURLs()))
    manager.remove_session_files("ann")
    assert bounded.held("ann") == len(study.content) == 5 * MB
    (more,) = sent(manager, "ann", "more", size=6 * MB)
    assert more.type == NO_ROOM
    assert len(sent(manager, "bob", "image", size=6 * MB)[0].data) == 6 * MB


def test_files_of_studies_count_until_nothing_has_them(manager):
    bounded = BoundedUploads(manager)
    (file,) = sent(manager, "ann", "image", size=7 * MB)
    upload = upload_of(UploadedFile(file, FileURLs()))
    assert bounded.held() == 7 * MB  # counted once, although manager and study hold the file
    manager.remove_session_files("ann")
    del file
    assert bounded.held() == 7 * MB
    del upload
    gc.collect()
    assert bounded.held() == 0


def test_none_is_taken_that_the_memory_has_no_room_for(manager, monkeypatch):
    monkeypatch.setattr(uploads, "free_bytes", lambda limits: 2 * MB)
    monkeypatch.setattr(uploads, "server_queue", lambda: Queue(1))  # without runs of other tests
    large, small = sent(manager, "ann", "large")[0], sent(manager, "ann", "small", size=MB)[0]
    assert (large.type, len(large.data)) == (NO_ROOM, 0)
    assert len(small.data) == MB
    with pytest.raises(CCWSIMError, match=r"large.dat was not accepted.*a smaller file"):
        upload_of(UploadedFile(large, FileURLs()))


def test_a_session_has_room_for_each_of_its_uploaders():
    assert max_of_session() == 4 * 64 * 2**20


@pytest.mark.parametrize("key", ["image_file", "share_open"])
def test_the_page_says_that_there_was_no_room(key):
    app = opened("simulate", State(choices=SMALL))
    app.run()
    name = "mine.ccwsim" if key == "share_open" else "mine.dat"
    app.file_uploader(key=key).upload(name, b"", NO_ROOM).run()
    assert not app.exception
    assert f"{name} was not accepted" in texts(app)
    assert app.session_state[KEY].choices == SMALL


def test_the_files_of_earlier_runs_count_as_their_memory():
    ensemble = simulate(datasets.load("channels"), (32, 32), n_realizations=1, seed=1)
    runs = PastRuns(max_bytes=3 * MB)
    for k in range(4):
        content = a_file(np.arange(900).reshape(30, 30) % 2) + bytes(MB)
        image = ImageChoice(upload=Upload(f"{k}.dat", content))
        for seed in range(2):  # runs with the same image share the image
            runs.remember(PastRun(Choices(image=image, seed=seed), ensemble))
    assert [run.choices.seed for run in runs.runs] == [1, 0, 1, 0]


@pytest.mark.slow
def test_a_server_does_not_grow_with_what_it_never_asked_for(monkeypatch):
    monkeypatch.setenv("CCWSIM_UPLOADS_MB", "100")
    with started() as server, ExitStack() as opened_sessions:
        readers = [opened_sessions.enter_context(Session(server.address)) for _ in range(3)]
        for reader in readers:
            reader.open(query="grid=64x48&data=none&template=16&overlap=4&realizations=1")
        before = resident(server.process.pid)
        for k in range(8):
            for reader in readers:
                reader.send(f"{k}.dat", np.random.default_rng(k).bytes(30 * MB))
        grown = resident(server.process.pid) - before
        assert grown < 100 * MB + 3 * 32 * MB  # 720 MB were sent; buffers hold a part
        ann = readers[0]
        ann.upload("image_file", "mine.dat", bytes(20 * MB))
        assert any("mine.dat was not accepted" in said for said in ann.alerts())
        assert ann.errors == []
