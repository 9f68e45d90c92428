"""The limits of uploads, as the owner of a server sets them by environment variables."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import fields, replace

from ccwsim.io.limits import OF_UPLOADS, Limits
from ccwsim.model.errors import CCWSIMError, shown

VARIABLES = {
    "bytes": "CCWSIM_MAX_UPLOAD_BYTES",
    "unpacked": "CCWSIM_MAX_UPLOAD_UNPACKED_BYTES",
    "cells": "CCWSIM_MAX_UPLOAD_CELLS",
    "points": "CCWSIM_MAX_UPLOAD_POINTS",
    "lines": "CCWSIM_MAX_UPLOAD_LINES",
    "seconds": "CCWSIM_MAX_UPLOAD_SECONDS",
}
"""The environment variables by which the owner of a server sets limits of uploads."""


def upload_limits(environment: Mapping[str, str] | None = None) -> Limits:
    """Return the limits of uploads, as the owner of the server set them.

    Raises
    ------
    CCWSIMError
        For a variable that is no number above 0.

    Examples
    --------
    >>> upload_limits({"CCWSIM_MAX_UPLOAD_CELLS": "1000000"}).cells
    1000000
    """
    given = os.environ if environment is None else environment
    kinds = {field.name: type(getattr(OF_UPLOADS, field.name)) for field in fields(Limits)}
    own = {}
    for name, variable in VARIABLES.items():
        said = given.get(variable, "").strip()
        if said:
            own[name] = _number(variable, said, kinds[name])
    return replace(OF_UPLOADS, **own)


def _number(variable: str, said: str, kind: type) -> float:
    try:
        value = kind(float(said))  # 4e6 is easier to read than 4000000
    except (ValueError, OverflowError):
        value = 0
    if not value > 0:
        raise CCWSIMError(f"{variable} = {shown(said)} must be a number above 0; correct it")
    return value
