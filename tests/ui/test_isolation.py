"""Test that each of many simultaneous users gets only results of that user's own study."""

from __future__ import annotations

import zlib
from base64 import b64decode
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from itertools import cycle, islice
from threading import Barrier
from urllib.parse import parse_qs

import numpy as np
import pytest

import ccwsim
from ccwsim import datasets
from ccwsim.sharing.link import read_link
from tests.ui.sessions import Session

N_SESSIONS, N_RUNS = 5, 2
SMALL = "grid=64x48&data=none&template=16&overlap=4&realizations=3"
PAGES = ("validate", "compare", "how_it_works", "data", "sweep", "benchmark", "import")


def expected(
    query: str, image: ccwsim.TrainingImage, grid: ccwsim.Grid | None = None
) -> list[bytes]:
    """Return the cells of all realizations of a study, computed by the engine."""
    choices, _, notes = read_link(parse_qs(query))
    assert not notes
    ensemble = ccwsim.simulate(
        image, grid or choices.grid, choices.parameters,
        n_realizations=choices.n_realizations, seed=choices.seed,
    )  # fmt: skip
    return [indices.tobytes() for indices in ensemble.indices]


def seen(session: Session) -> bytes:
    return zlib.decompress(b64decode(session.part("map_realization")["cells"]))


def a_user(address: str, query: str, seeds: list[int], start: Barrier) -> dict[int, bytes]:
    """Change the seed a few times and run; return the map of each seed."""
    found = {}
    with Session(address, "simulate", query) as session:
        start.wait(60)
        session.open()
        for seed in seeds:
            session.change(seed=seed)
            session.click("run")
            found[seed] = seen(session)
        assert session.errors == []
    return found


@pytest.mark.slow
def test_each_of_many_sessions_finds_its_own_results(address):
    images = list(islice(cycle(datasets.names()), N_SESSIONS))
    queries = [f"ti={name}&{SMALL}" for name in images]
    seeds = [[100 + 10 * k + i for i in range(N_RUNS)] for k in range(N_SESSIONS)]
    start = Barrier(N_SESSIONS)
    with ThreadPoolExecutor(N_SESSIONS) as pool:
        work = [pool.submit(a_user, address, *of, start) for of in zip(queries, seeds, strict=True)]
        found = [one.result(timeout=600) for one in work]
    digests = set()
    for query, name, pictures in zip(queries, images, found, strict=True):
        for seed, picture in pictures.items():
            assert picture == expected(f"{query}&seed={seed}", datasets.load(name))[0]
            digests.add(picture)
    assert len(digests) == N_RUNS * N_SESSIONS


def with_name(array: np.ndarray) -> bytes:
    file = BytesIO()
    np.save(file, array)
    return file.getvalue()


def a_curious_user(address: str, own: str, array: np.ndarray, start: Barrier) -> bytes:
    """Upload an image that other users have too, name it and its facies, and visit every page."""
    received: list[bytes] = []
    with Session(address, "simulate", f"{SMALL}&seed=4", received=received) as session:
        session.open()
        start.wait(60)
        session.upload("image_file", f"{own}.npy", with_name(array))
        session.open("import")
        session.change(image_name_0=f"{own} zero", image_name_5=f"{own} five", image_flip_ew=True)
        session.open("simulate")
        session.click("run")
        for page in PAGES:
            session.open(page)
        session.open("simulate")
        assert session.errors == []
        assert own in b"".join(received).decode(errors="replace")
    return b"".join(received)


@pytest.mark.slow
def test_no_session_is_sent_a_word_of_another(address):
    generator = np.random.default_rng(8)
    # with a trend, so that the advice contains the name of a facies
    blocks = generator.random((16, 16)) < np.linspace(0.02, 0.98, 16)
    array = 5 * np.kron(blocks, np.ones((6, 6), int))
    users = [f"secret{letter}word" for letter in "ab"]
    start = Barrier(len(users))
    with ThreadPoolExecutor(len(users)) as pool:
        work = [pool.submit(a_curious_user, address, own, array, start) for own in users]
        received = dict(zip(users, (one.result(timeout=600) for one in work), strict=True))
    for own, content in received.items():
        for other in set(users) - {own}:
            assert other.encode() not in content, f"{own} was sent {other}"


@pytest.mark.slow
def test_files_of_the_same_name_are_told_apart(address):
    generator = np.random.default_rng(3)
    arrays = [5 * np.kron(generator.integers(0, 2, (8, 8)), np.ones((12, 12), int)) for _ in "ab"]
    pictures = []
    for array in arrays:
        with Session(address, "simulate", f"{SMALL}&seed=4") as session:
            session.open().upload("image_file", "same.npy", with_name(array))
            session.click("run")
            pictures.append(seen(session))
    for array, picture in zip(arrays, pictures, strict=True):
        grid = ccwsim.Grid(*array.shape)  # an own image brings its grid
        assert picture == expected(f"{SMALL}&seed=4", ccwsim.TrainingImage(array), grid)[0]
    assert pictures[0] != pictures[1]


@pytest.mark.slow
def test_a_session_cannot_take_a_file_into_another(address):
    """Test that the address of an upload is useless in another session."""
    from urllib.error import HTTPError

    with Session(address, "simulate", SMALL) as session:
        session.open()
        session._cookie = "2|0|0|0"
        with pytest.raises(HTTPError, match="403"):
            session.upload("image_file", "a.npy", with_name(np.eye(20, dtype=int)))
