"""A cache of results that all sessions share, with the contents of arguments as keys."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import streamlit as st

from ccwsim.model.ensemble import Ensemble
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.sharing.choices import DataChoice, ImageChoice, Upload, WellTables


def _of_ensemble(e: Ensemble) -> tuple[object, ...]:
    run = e.parameters.digest, e.hard_data.digest, e.seed, e.sources is None
    return e.digest, e.training_image.digest, repr(e.grid), *run


CONTENT: dict[str | type[Any], Callable[[Any], Any]] = {
    Upload: lambda upload: upload.digest,
    ImageChoice: lambda choice: choice.digest,
    DataChoice: lambda choice: [choice.upload, choice.tables, choice.answers],
    WellTables: vars,
    TrainingImage: lambda image: (image.digest, image.facies_names),
    Grid: repr,
    HardData: lambda data: data.digest,
    Parameters: lambda parameters: parameters.digest,
    Ensemble: _of_ensemble,
}
"""Functions that return the content of an argument, by type of the argument."""
cached = partial(st.cache_resource, show_spinner=False, hash_funcs=CONTENT)
