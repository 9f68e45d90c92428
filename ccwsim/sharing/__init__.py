"""A study to give away: as a link, as Python, as a command, as a report."""

from ccwsim.sharing.link import (
    left_out,
    link_of,
    meant,
    own_choices,
    packed,
    read_link,
    unpacked,
)
from ccwsim.sharing.recipe import Recipe, reproduction_recipe
from ccwsim.sharing.study_report import REVISED, study_report

__all__ = [
    "REVISED",
    "Recipe",
    "left_out",
    "link_of",
    "meant",
    "own_choices",
    "packed",
    "read_link",
    "reproduction_recipe",
    "study_report",
    "unpacked",
]
