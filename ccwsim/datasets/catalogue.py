"""Which training images and hard data are bundled, and how each one was made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from ccwsim.datasets.barchans import barchans
from ccwsim.datasets.bend import bend
from ccwsim.datasets.channels import channels
from ccwsim.datasets.delta import delta
from ccwsim.datasets.dunes import dunes
from ccwsim.datasets.fractures import fractures
from ccwsim.datasets.lenses import lenses
from ccwsim.datasets.levees import levees
from ccwsim.datasets.stone_wall import stone_wall


@dataclass(frozen=True)
class Dataset:
    """A bundled training image: how to draw it, its size and seed, and what to say of it."""

    draw: Callable[[tuple[int, int], RandomState], NDArray[np.uint8]]
    shape: tuple[int, int]
    seed: int
    facies_names: tuple[str, ...]
    picture: str
    good_for: str


@dataclass(frozen=True)
class Survey:
    """Bundled hard data: read off an image of the same kind as a TI, drawn with another seed."""

    training_image: str
    grid_shape: tuple[int, int]
    truth_seed: int
    seed: int
    n: int
    min_spacing: float
    picture: str


DATASETS = {
    "channels": Dataset(
        channels,
        (256, 256),
        10,
        ("mud", "sand"),
        "Anastomosing sand channels that wind from west to east, split and join again",
        "the usual first test: whether the sand stays connected",
    ),
    "stone_wall": Dataset(
        stone_wall,
        (200, 200),
        11,
        ("stone", "mortar"),
        "Rounded stones of many sizes in mortar that is connected everywhere",
        "closed shapes: stones must not break, joints must not stop",
    ),
    "barchans": Dataset(
        barchans,
        (400, 400),
        5,
        ("interdune", "slip face", "sand body"),
        "Irregular sand bodies, each with a slip face on its north-eastern side",
        "three facies of which two always go together",
    ),
    "dunes": Dataset(
        dunes,
        (256, 256),
        1,
        ("interdune", "dune sand", "slip face"),
        "Long dunes whose crests fork and end, with a slip face to the south",
        "strong anisotropy and thin bands",
    ),
    "levees": Dataset(
        levees,
        (320, 400),
        11,
        ("flood plain", "levee", "crevasse splay", "channel"),
        "Meandering rivers between levees, broken by crevasse splays at outer bends",
        "four facies, long bends, large templates",
    ),
    "delta": Dataset(
        delta,
        (300, 300),
        11,
        ("mud", "channel", "mouth bar"),
        "A delta: one trunk in the west that divides into many channels with mouth bars",
        "a nonstationary image: every part of it differs",
    ),
    "bend": Dataset(
        bend,
        (300, 300),
        3,
        ("mud", "sand"),
        "Channels that sweep from north to east, thin and dense inside, wide and sparse outside",
        "direction, width and spacing that change across the image",
    ),
    "fractures": Dataset(
        fractures,
        (256, 256),
        2,
        ("rock", "fracture"),
        "Two sets of fractures, where the younger set stops at the older one",
        "thin lines with ends, which coarse wavelet levels may lose",
    ),
    "lenses": Dataset(
        lenses,
        (200, 320),
        5,
        ("shale", "sand", "gravel"),
        "A vertical section: sand lenses stacked in shale, with gravel at their bases",
        "bodies much wider than high, on a grid that is not square",
    ),
}

SURVEYS = {
    "channels_60_wells": Survey(
        "channels", (512, 512), 2024, 1, 60, 40.0, "60 wells, none close to another"
    ),
    "channels_400_data": Survey("channels", (512, 512), 2024, 2, 400, 0.0, "400 scattered data"),
    "stone_wall_300_data": Survey(
        "stone_wall", (512, 512), 2024, 3, 300, 0.0, "300 scattered data"
    ),
    "barchans_200_data": Survey(
        "barchans", (512, 512), 2024, 4, 200, 12.0, "200 scattered data of three facies"
    ),
}
