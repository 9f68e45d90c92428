"""CCWSIM: wavelet-based cross-correlation simulation of categorical fields.

After Bavandsavadkoohi, Gloaguen, Tokhmechi, Arab-Amiri and Giroux (2024).
"""

from ccwsim.ensemble import Ensemble
from ccwsim.errors import Cancelled, CCWSIMError
from ccwsim.grid import Grid
from ccwsim.hard_data import HardData
from ccwsim.io import (
    Project,
    read_hard_data,
    read_project,
    read_training_image,
    save_project,
    write_realizations,
)
from ccwsim.parameters import Parameters
from ccwsim.revision import revise
from ccwsim.simulation import simulate
from ccwsim.training_image import TrainingImage

__version__ = "0.1.0"

__all__ = [
    "CCWSIMError",
    "Cancelled",
    "Ensemble",
    "Grid",
    "HardData",
    "Parameters",
    "Project",
    "TrainingImage",
    "read_hard_data",
    "read_project",
    "read_training_image",
    "revise",
    "save_project",
    "simulate",
    "write_realizations",
]
