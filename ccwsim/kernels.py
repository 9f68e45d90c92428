"""How kernels are compiled: one decorator, and a cache that a changed source makes anew.

Numba keeps compiled functions by the date of their own file. A kernel that calls another one from
another file has that one compiled into it, so that after an update of the other file alone the old
code would still run. The cache therefore lies in a folder named after the content of all files
with kernels.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from hashlib import blake2b
from pathlib import Path
from typing import Any

from numba import config, njit

_PACKAGE = Path(__file__).parent


def _digest_of_sources() -> str:
    sums = blake2b(digest_size=8)
    for source in sorted(_PACKAGE.rglob("*.py")):
        text = source.read_bytes()
        sums.update(text if b"\n@kernel\n" in text else b"")
    return sums.hexdigest()


SOURCE = _digest_of_sources()
"""A short name of the content of all files with kernels."""


def _cache_folder() -> Path:
    """Return where compiled kernels are kept: beside the package, or where the user may write."""
    beside = _PACKAGE / "__pycache__"
    if os.access(_PACKAGE if not beside.exists() else beside, os.W_OK):
        return beside / f"kernels-{SOURCE}"
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "ccwsim" / f"kernels-{SOURCE}"


FOLDER = str(_cache_folder())
"""Where compiled kernels are kept."""


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function without the interpreter lock; the result is kept between runs.

    Examples
    --------
    >>> from ccwsim.stages.cut import KEEP_OLD, wanted
    >>> wanted(old=1, new=0, datum=1) == KEEP_OLD
    True
    """
    others = getattr(config, "CACHE_DIR")  # noqa: B009 - made at run time, unknown to checkers
    # Read when a function is decorated; other packages keep their own.
    setattr(config, "CACHE_DIR", FOLDER)  # noqa: B010
    try:
        return njit(nogil=True, cache=True)(function)
    finally:
        setattr(config, "CACHE_DIR", others)  # noqa: B010
