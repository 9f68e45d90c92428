"""Simulated users of the dashboard, who act at random and check the pictures."""

from __future__ import annotations

import time
import zlib
from base64 import b64decode
from functools import cache
from io import BytesIO
from typing import Any
from urllib.parse import parse_qs

import numpy as np

from ccwsim import TrainingImage, datasets, simulate
from ccwsim.sharing.choices import Choices
from ccwsim.sharing.link import read_link
from tests.fuzz.evil import EVIL
from tests.ui.sessions import Session, Stuck

IMAGES = tuple(datasets.names())
SIDES = (48, 64, 96, 128)
HOSTILE = (
    "candidates=20000&grid=64x64&data=none",
    "cell=0.0000000001x0.0000000001&grid=64x64&data=none",
    "grid=1x1&data=none",
    "grid=1x10000&data=none&realizations=2",
    "grid=10000x1&data=none&realizations=2",
    "grid=4000x4000&data=none&realizations=1000",
    "grid=10000x10000&realizations=1&data=sampled",
    "ti=nowhere&grid=0x-1&template=1e9&seed=-1&data=%00",
)
"""Links with extreme values (bounds, long runs, large grids), and one malformed link."""
SENT_BYTES = 60 * 10**6
"""Size in bytes of the unrequested file that each visit to an extreme link leaves on the server."""
THINKING = 0.5
"""Mean number of seconds between an answer and the next request."""


class Visitor:
    """One user, who opens one tab after another.

    Parameters
    ----------
    address : str
        Address of the server.
    tally : Tally
        Observations of all visitors.
    generator : numpy.random.Generator
    end : float
        End of the visit, on the monotonic clock.
    number : int
        Number of this visitor.
    whole : bool
        Whether to visit every page at least once, regardless of the time.
    """

    def __init__(
        self,
        address: str,
        tally: Any,
        generator: np.random.Generator,
        end: float,
        number: int,
        whole: bool = False,
    ) -> None:
        self._address, self._tally, self._generator = address, tally, generator
        self._end, self._number, self._whole = end, number, whole
        self._own: TrainingImage | None = None

    def stay(self) -> None:
        """Open one tab after another until the end of the visit."""
        while self._whole or time.monotonic() < self._end:
            try:
                with Session(self._address, "simulate", self._query()) as tab:
                    self._tally.opened()
                    self._work(tab)
            except Exception as error:
                self._tally.failed(f"{type(error).__name__}: {str(error)[:200]}")
                time.sleep(1.0)
            self._whole = False

    def _work(self, tab: Session) -> None:
        """Do some actions in one tab, then close it."""
        self._own = None
        self._timed("open", tab, tab.open)
        self._look(tab)
        acts = [
            self._seed,
            self._seed,
            self._level,
            self._size,
            self._live,
            self._upload,
            self._validate,
            self._compare,
            self._how,
            self._data,
        ]
        order = self._generator.permutation(len(acts))
        n = len(acts) if self._whole else int(self._generator.integers(2, len(acts)))
        for k in order[:n]:
            if time.monotonic() > self._end and not self._whole:
                return
            acts[k](tab)
            if tab.errors or self._trouble(tab):
                self._tally.failed(f"{acts[k].__name__}: {(tab.errors or self._trouble(tab))[0]}")
                tab.errors.clear()
            time.sleep(float(self._generator.exponential(THINKING)))

    # actions

    def _seed(self, tab: Session) -> None:
        self._simulate(tab)
        tab.change(seed=self._any(1000) + 1000 * self._number)
        self._run("seed", tab)

    def _level(self, tab: Session) -> None:
        self._simulate(tab)
        tab.change(wavelet_level=self._any(2) + 1)
        self._run("level", tab)

    def _size(self, tab: Session) -> None:
        self._simulate(tab)
        tab.change(grid_nx=int(self._generator.choice(SIDES)))
        self._run("size", tab)

    def _live(self, tab: Session) -> None:
        self._simulate(tab)
        tab.change(live=True)
        seed = self._any(1000) + 1000 * self._number
        self._timed("Live", tab, lambda: tab.change(seed=seed))
        self._look(tab)
        tab.change(live=False)

    def _upload(self, tab: Session) -> None:
        self._simulate(tab)
        cells = self._generator.integers(0, 2, (10, 10)) * 7
        array = np.kron(cells, np.ones((8, 8), int))
        file = BytesIO()
        np.save(file, array)
        self._timed("upload", tab, lambda: tab.upload("image_file", "own.npy", file.getvalue()))
        self._own = TrainingImage(array)
        self._run("own image", tab)

    def _validate(self, tab: Session) -> None:
        self._timed("Validate", tab, lambda: tab.open("validate"))

    def _compare(self, tab: Session) -> None:
        self._timed("Compare", tab, lambda: tab.open("compare"))

    def _how(self, tab: Session) -> None:
        self._timed("How it works", tab, lambda: tab.open("how_it_works"))

    def _data(self, tab: Session) -> None:
        self._timed("Hard data", tab, lambda: tab.open("data"))

    # helpers of actions

    def _query(self) -> str:
        name = self._generator.choice(IMAGES)
        side = self._generator.choice(SIDES)
        seed = self._any(1000) + 1000 * self._number
        return (
            f"ti={name}&grid={side}x64&data=none&template=16&overlap=4&realizations=4&seed={seed}"
        )

    def _any(self, n: int) -> int:
        return int(self._generator.integers(n))

    def _simulate(self, tab: Session) -> None:
        if tab.page != "simulate":
            tab.open("simulate")

    def _run(self, what: str, tab: Session) -> None:
        self._timed(what, tab, lambda: tab.click("run"))
        self._look(tab)

    def _timed(self, what: str, tab: Session, act: Any) -> None:
        start = time.monotonic()
        act()
        self._tally.took(what, time.monotonic() - start)

    def _look(self, tab: Session) -> None:
        """Compare the large picture with that of the engine."""
        try:
            shown = zlib.decompress(b64decode(tab.part("map_realization")["cells"]))
        except Stuck:
            return
        image = self._own
        self._tally.looked(shown == expected(choices_of(tab.query), image))

    def _trouble(self, tab: Session) -> list[str]:
        return [text for text in tab.alerts() if "could not be" in text or "log" in text]


class HostileVisitor(Visitor):
    """A user who opens links with extreme values and offers hostile files."""

    def stay(self) -> None:
        """Open one link after another until the end of the visit."""
        turn = 0
        while time.monotonic() < self._end:
            query = HOSTILE[turn % len(HOSTILE)]
            turn += 1
            try:
                with Session(self._address, "simulate", query) as tab:
                    self._tally.opened()
                    self._timed("unkind link", tab, tab.open)
                    if tab.errors or self._trouble(tab):
                        raise Stuck(str(tab.errors or self._trouble(tab)))
                    tab.widget("seed")  # the page shows the study, which can be changed
                    tab.send("unasked.dat", bytes(SENT_BYTES))
                    name = list(EVIL)[turn % len(EVIL)]
                    self._timed("unkind file", tab, lambda file=EVIL[name]: _offer(tab, file()))
            except Exception as error:
                self._tally.failed(f"{query}: {type(error).__name__}: {str(error)[:200]}")
                time.sleep(1.0)


def _offer(tab: Session, content: bytes) -> None:
    """Upload a hostile file as a training image; the page reads the file or refuses it."""
    tab.upload("image_file", "evil", content)


def choices_of(query: str) -> Choices:
    """Return the study in the query of an address."""
    return read_link(parse_qs(query))[0]


def expected(choices: Choices, image: TrainingImage | None = None) -> bytes:
    """Return the cells of the first realization of a study as the engine computes them."""
    image = image or loaded(choices.image.bundled)
    ensemble = simulate(
        image, choices.grid, choices.parameters, n_realizations=1, seed=choices.seed, n_workers=1
    )
    return ensemble.indices[0].tobytes()


@cache
def loaded(name: str) -> TrainingImage:
    """Return a bundled image; each image is read only once."""
    return datasets.load(name)
