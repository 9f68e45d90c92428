"""The module that draws the nouns, which stands above them and is loaded when one is drawn."""

from __future__ import annotations

from importlib import import_module
from typing import Any

backend = ""
"""Name of that module; `ccwsim` sets it, so that nothing here knows the folders above."""


def notebook() -> Any:
    """Return the module that draws nouns; a script that draws none does not load plotly."""
    return import_module(backend)
