"""With what and on what a report was made."""

from __future__ import annotations

from datetime import datetime
from importlib.metadata import PackageNotFoundError, version

import ccwsim
from ccwsim.system.machine import this_machine

PACKAGES = ("SciPy", "PyWavelets", "plotly")


def surroundings() -> tuple[tuple[str, str], ...]:
    """Return versions, machine and date as (name, value).

    Examples
    --------
    >>> [name for name, value in surroundings()]
    ['Program', 'Machine', 'Libraries', 'Made on']
    """
    return (
        ("Program", f"ccwsim {ccwsim.__version__}"),
        ("Machine", str(this_machine())),
        ("Libraries", ", ".join(f"{name} {_version(name)}" for name in PACKAGES)),
        ("Made on", datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")),
    )


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "(version unknown)"
