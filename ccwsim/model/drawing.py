"""Import the module that draws images, data and ensembles when it is first needed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

backend = ""
"""Name of the drawing module, set by `ccwsim` so that `model` does not depend on `figures`."""


def notebook() -> Any:
    """Import and return the drawing module; scripts that draw nothing do not load plotly."""
    return import_module(backend)
