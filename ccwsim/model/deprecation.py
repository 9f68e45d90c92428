"""Names that changed: the old ones work for one more release, with a warning."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from importlib import import_module
from typing import Any


def renamed(module: str, names: dict[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a module under which old names still find the new ones.

    Parameters
    ----------
    module : str
        The module that had the old names.
    names : dict of str
        The full new name, such as "ccwsim.metrics.copying", by the old one.
    """

    def find(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        new = names[name]
        warnings.warn(f"{module}.{name} is now {new}", DeprecationWarning, stacklevel=2)
        home, _, last = new.rpartition(".")
        found = import_module(home)
        return getattr(found, last) if hasattr(found, last) else import_module(new)

    return find
