"""A study to give away: as a link, as Python, as a command, as a report."""

from ccwsim.sharing.link import left_out, link_of, meant, read_link, short_name
from ccwsim.sharing.packed_data import MAX_DATA, packed, unpacked
from ccwsim.sharing.recipe import Recipe, reproduction_recipe
from ccwsim.sharing.study_report import REVISED, study_report

__all__ = [
    "MAX_DATA",
    "REVISED",
    "Recipe",
    "left_out",
    "link_of",
    "meant",
    "packed",
    "read_link",
    "reproduction_recipe",
    "short_name",
    "study_report",
    "unpacked",
]
