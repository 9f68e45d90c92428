"""CCWSIM: wavelet-based cross-correlation simulation of categorical fields.

The method follows Bavandsavadkoohi, Gloaguen, Tokhmechi, Arab-Amiri and Giroux (2024).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ccwsim import (
        datasets as datasets,
        experiments as experiments,
        figures as figures,
        flow as flow,
        io as io,
        metrics as metrics,
    )
    from ccwsim.engine.revision import revise as revise
    from ccwsim.io import (
        read_hard_data as read_hard_data,
        read_realizations as read_realizations,
        read_training_image as read_training_image,
        write_realizations as write_realizations,
    )
    from ccwsim.model import (
        Auxiliary as Auxiliary,
        Cancelled as Cancelled,
        CCWSIMError as CCWSIMError,
        Ensemble as Ensemble,
        Grid as Grid,
        HardData as HardData,
        Parameters as Parameters,
        Secondary as Secondary,
        TrainingImage as TrainingImage,
        concatenate as concatenate,
    )
    from ccwsim.run.simulation import simulate as simulate
    from ccwsim.sharing.project import (
        Project as Project,
        read_project as read_project,
        save_project as save_project,
    )

__version__ = "0.1.0"

_NAMES = {  # imported on first use, so that the command line starts quickly
    "engine.revision": ("revise",),
    "io": ("read_hard_data", "read_realizations", "read_training_image", "write_realizations"),
    "model": (
        "Auxiliary",
        "CCWSIMError",
        "Cancelled",
        "Ensemble",
        "Grid",
        "HardData",
        "Parameters",
        "Secondary",
        "TrainingImage",
        "concatenate",
    ),
    "run.simulation": ("simulate",),
    "sharing.project": ("Project", "read_project", "save_project"),
}
_HOMES = {name: home for home, names in _NAMES.items() for name in names}
"""Module that defines each public name."""
_FOLDERS = ("datasets", "experiments", "figures", "flow", "io", "metrics")
"""Subpackages that are available after `import ccwsim`."""


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(import_module(f"ccwsim.{_HOMES[name]}"), name)
    elif name in _FOLDERS:
        value = import_module(f"ccwsim.{name}")
    elif name == "__all__":
        value = list(_HOMES)
    else:
        raise AttributeError(f"module 'ccwsim' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*_HOMES, *_FOLDERS, "__all__", "__doc__", "__version__"])
