"""How kernels are compiled: one decorator, and a cache that a changed source makes anew.

Numba keeps compiled functions by the date of their own file. A kernel that calls another one from
another file has that one compiled into it, so that after an update of the other file alone the old
code would still run. The cache therefore lies in a folder named after the content of all files
with kernels.
"""

from __future__ import annotations

import atexit
import logging
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from hashlib import blake2b
from pathlib import Path
from typing import Any, ClassVar

from numba import config, njit
from numba.core import event

_PACKAGE = Path(__file__).parents[1]
_log = logging.getLogger(__name__)


def _digest_of_sources() -> str:
    sums = blake2b(digest_size=8)
    for source in sorted(_PACKAGE.rglob("*.py")):
        text = source.read_bytes()
        has_kernel = b"kernel\n" in text
        sums.update(text if has_kernel or source.parent.name in ("stages", "corrections") else b"")
    return sums.hexdigest()


SOURCE = _digest_of_sources()
"""A short name of the content of all files with kernels."""


def _cache_folder() -> str:
    """Return where compiled kernels are kept: beside the package, or where the user may write.

    Where nothing can be written, as in a container whose files are read-only, kernels that were
    compiled beforehand are copied to a temporary folder, which Numba wants to write to; empty where
    there is not even that.
    """
    name = f"kernels-{SOURCE}"
    places = [_PACKAGE / "__pycache__" / name]
    with suppress(RuntimeError):  # a user without a home, as in some containers
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        places.append(home / "ccwsim" / name)
    for place in places:
        if _is_writable(place):
            return str(place)
    warm = [place for place in places if place.is_dir()]
    try:
        temporary = tempfile.mkdtemp(prefix="ccwsim-")
    except OSError:
        return ""
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    for file in warm[0].rglob("*.nb[ic]") if warm else ():  # not shutil.copytree: it copies modes
        own = Path(temporary) / file.relative_to(warm[0])
        own.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, own)
    return temporary


def _is_writable(place: Path) -> bool:
    """Return whether a folder can be written to, or made."""
    there = next(folder for folder in (place, *place.parents) if folder.exists())
    return os.access(there, os.W_OK | os.X_OK)


FOLDER = _cache_folder()
"""Where compiled kernels are kept; empty where nothing can be written."""


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function without the interpreter lock; the result is kept between runs.

    It makes no arrays, and neither do its parts: then Numba need not count at each call who holds
    the arrays that are handed over, which takes a third of the time of a patch. Of arrays it may
    take views by slices and `reshape`; `ravel` is a call itself.
    """
    return _compiled(function, FOLDER, _nrt=False)


def allocating_kernel(function: Callable[..., Any]) -> Any:
    """As `kernel`, for what makes arrays of its own."""
    return _compiled(function, FOLDER)


class part_of_kernel:  # noqa: N801 - a decorator
    """As `kernel`, for what only other kernels call: compiled into them, not callable by itself.

    Leaving out what a call from Python needs halves the time it takes to compile. A call from
    Python, as tests make it, compiles the function by itself.

    Examples
    --------
    >>> from ccwsim.engine.stages.candidates import n_up_to
    >>> import numpy as np
    >>> n_up_to(np.array([3, 1, 2]), 2)
    2
    """

    options: ClassVar[dict[str, Any]] = {}

    def __init__(self, function: Callable[..., Any]) -> None:
        self._part = _compiled(function, FOLDER, no_cpython_wrapper=True, **self.options)
        self.__doc__, self.__name__, self.__wrapped__ = (
            function.__doc__,
            function.__name__,
            function,
        )
        self._alone: Any = None

    @property
    def _numba_type_(self) -> Any:
        return self._part._numba_type_

    def __call__(self, *values: Any, **named: Any) -> Any:
        if self._alone is None:  # in a folder of its own: the cache does not know the difference
            self._alone = _compiled(self.__wrapped__, FOLDER and os.path.join(FOLDER, "alone"))
        return self._alone(*values, **named)


class inlined_part_of_kernel(part_of_kernel):  # noqa: N801 - a decorator
    """As `part_of_kernel`, for what is called most: put in the place of each call.

    A call that hands over a few arrays takes longer than to compare a hundred cells.
    """

    options: ClassVar[dict[str, Any]] = {"inline": "always"}

    @property
    def targetoptions(self) -> dict[str, Any]:
        """What Numba asks a function for, to see that it wants to be in the place of a call."""
        return self._part.targetoptions

    @property
    def py_func(self) -> Callable[..., Any]:
        """What Numba puts there."""
        return self.__wrapped__


COMPILE_TIME = "about half a minute"
"""What the kernels of a first run take to compile on two slow cores that also draw the page."""
OUTERMOST = {"simulate_patches", "resimulate_windows", "repair_windows", "change_cells"}
"""Kernels of a run that call all others, and are therefore the last to be compiled."""
COUNT_SECONDS = 0.2
"""Time between two counts of the kernels on disk."""
_apart: subprocess.Popen | None = None
_apart_lock = threading.Lock()
_engine_kernels: set[str] = set()
_compilation: tuple[int, int, str] | None = None
_ready = False


def compilation() -> tuple[int, int, str] | None:
    """Return how many of how many engine kernels are compiled, and the one in work; else None."""
    return _compilation


def is_ready() -> bool:
    """Return whether this process has compiled, or read from the cache, the kernels of a study."""
    return _ready


def must_compile() -> bool:
    """Return whether the next run has to wait for the compiler."""
    return not _ready and not kernels_on_disk() >= OUTERMOST


def kernels_on_disk() -> set[str]:
    """Return the names of the engine kernels in the cache."""
    files = Path(FOLDER).rglob("*.nbc") if FOLDER else ()
    return {file.name.split(".")[1].rsplit("-", 1)[0] for file in files} & _engine_kernels


def compile_apart(is_cancelled: Callable[[], bool]) -> None:
    """Compile the kernels of a run in another process, where they are not on disk, and wait.

    The compiler holds the interpreter lock: a server that compiles in a thread sends no page
    meanwhile. The process goes on with the kernels of other runs when those of the first are there;
    all who call this meanwhile wait for the same one.
    """
    global _compilation, _apart
    if not FOLDER or kernels_on_disk() >= OUTERMOST:
        return
    with _apart_lock:
        if _apart is None or _apart.poll() is not None:
            _apart = _warm_up_apart()
        process = _apart
    try:
        while process.poll() is None and not is_cancelled():
            done = kernels_on_disk()
            if done >= OUTERMOST:
                return
            _compilation = len(done), len(_engine_kernels), ""
            time.sleep(COUNT_SECONDS)
    finally:
        _compilation = None


def _warm_up_apart() -> subprocess.Popen:
    """Start `ccwsim warm-up` in another process; the page and its browser go first."""
    paths = [str(_PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    process = subprocess.Popen(
        [sys.executable, "-m", "ccwsim", "warm-up", "--quiet"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    threading.Thread(target=process.wait, daemon=True).start()  # leaves no defunct process
    if hasattr(os, "setpriority"):
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, process.pid, 10)
    return process


@contextmanager
def reported_compilation(on_kernel: Callable[[int, int, str], None] | None) -> Iterator[None]:
    """Call `on_kernel(n_done, n_total, name)` before each engine kernel this thread compiles.

    Nothing is called where all kernels are read from the cache; else once more at the end, with
    n_done = n_total. `compilation` says the same to other threads meanwhile.
    """
    global _compilation, _ready

    def report(n_done: int, n_total: int, name: str) -> None:
        global _compilation
        _compilation = n_done, n_total, name
        if on_kernel is not None:
            on_kernel(n_done, n_total, name)

    listener = _Listener(report)
    try:
        with event.install_listener("numba:compile", listener):
            yield
        if listener.seen:
            report(len(_engine_kernels), len(_engine_kernels), "")
        _ready = True
    finally:
        _compilation = None


class _Listener(event.Listener):
    def __init__(self, on_kernel: Callable[[int, int, str], None]) -> None:
        self.on_kernel, self.thread = on_kernel, threading.get_ident()
        self.seen: set[str] = set()

    def on_start(self, event: event.Event) -> None:
        name = (event.data or {})["dispatcher"].py_func.__name__
        if threading.get_ident() == self.thread and name in _engine_kernels - self.seen:
            self.on_kernel(len(self.seen), len(_engine_kernels), name)
            self.seen.add(name)

    def on_end(self, event: event.Event) -> None:
        pass


def _with_robust_cache(dispatcher: Any) -> Any:
    """Let a kernel whose files are damaged be compiled anew: Numba fails for ever on them."""
    cache = getattr(dispatcher, "_cache", None)  # none where NUMBA_DISABLE_JIT is set
    if cache is None:
        return dispatcher
    load = cache.load_overload

    def load_or_compile(*arguments: Any) -> Any:
        try:
            return load(*arguments)
        except Exception as error:  # whatever cut or overwritten pickles raise
            name = dispatcher.py_func.__name__
            _log.warning("Compiled kernel %s on disk is damaged (%r): compiled anew.", name, error)
            with suppress(OSError):
                cache.flush()
            return None

    cache.load_overload = load_or_compile
    return dispatcher


def _compiled(function: Callable[..., Any], folder: str, **options: Any) -> Any:
    if function.__module__.startswith("ccwsim.engine."):
        _engine_kernels.add(function.__name__)
    others = getattr(config, "CACHE_DIR")  # noqa: B009 - made at run time, unknown to checkers
    # Read when a function is decorated; other packages keep their own.
    setattr(config, "CACHE_DIR", folder)  # noqa: B010
    try:
        options |= {"cache": bool(folder), "no_cfunc_wrapper": True, "error_model": "numpy"}
        return _with_robust_cache(njit(nogil=True, **options)(function))
    finally:
        setattr(config, "CACHE_DIR", others)  # noqa: B010
