"""Import modules of higher folders when a noun first needs them."""

from importlib import import_module
from typing import Any

drawing = ""
"""Name of the drawing module, set by `ccwsim` so that `model` does not depend on `figures`."""
reading = ""
"""Name of the module that reads tables, set by `ccwsim` so that `model` does not depend on `io`."""


def notebook() -> Any:
    """Import and return the drawing module; scripts that draw nothing do not load plotly."""
    return import_module(drawing)


def reader() -> Any:
    """Import and return the module that reads tables like files."""
    return import_module(reading)
