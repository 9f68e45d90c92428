"""Names that changed: the old ones work for one more release, with a warning."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any


def renamed(module: str, names: dict[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a module under which old names still find the new ones."""

    def find(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        new = names[name]
        warnings.warn(f"{module}.{name} is now {new}", DeprecationWarning, stacklevel=2)
        home, _, last = new.rpartition(".")
        found = import_module(home)
        return getattr(found, last) if hasattr(found, last) else import_module(new)

    return find


class MovedModules(MetaPathFinder, Loader):
    """Finds modules under their old names."""

    def __init__(self, moved: dict[str, str]) -> None:
        self._moved = moved

    @classmethod
    def install(cls, moved: dict[str, str]) -> None:
        """Find modules under their old names from now on."""
        sys.meta_path.append(cls(moved))

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return a specification for an old name, None for any other."""
        return ModuleSpec(fullname, self) if fullname in self._moved else None

    def exec_module(self, module: ModuleType) -> None:
        """Let a module under its old name hand out what the new one has."""
        old = module.__name__
        new = self._moved[old]
        warnings.warn(f"{old} is now {new}", DeprecationWarning, stacklevel=2)
        found = import_module(new)
        module.__dict__.update({k: v for k, v in vars(found).items() if not k.startswith("__")})
