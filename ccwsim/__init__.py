"""CCWSIM: wavelet-based cross-correlation simulation of categorical fields.

After Bavandsavadkoohi, Gloaguen, Tokhmechi, Arab-Amiri and Giroux (2024).
"""

from ccwsim.engine.revision import revise
from ccwsim.io import (
    Project,
    read_hard_data,
    read_project,
    read_training_image,
    save_project,
    write_realizations,
)
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate

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
