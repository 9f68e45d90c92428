"""Choices as JSON, for project files and links; the types of fields describe the format.

An object is written as its fields without default values, a tuple as a list, hard data as triples
(after the name of a variable if they have values), and the content of a file as a number; the
caller stores the files, and the arrays of guides.
"""

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass
from sys import float_info
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from ccwsim import CCWSIMError, HardData

LARGEST = {int: 2**63 - 1, float: float_info.max}


def as_json(value: Any, files: list[bytes]) -> Any:
    """Return a value for `json.dumps`; the contents of files are added to `files`."""
    if isinstance(value, bytes):
        files.append(value)
        return len(files) - 1
    if isinstance(value, HardData):
        value = (*value.values, *value.triples)
    if isinstance(value, tuple):
        return [as_json(item, files) for item in value]
    if not is_dataclass(value):
        return value
    parts = {field.name: getattr(value, field.name) for field in fields(value)}
    usual = {field.name: field.default for field in fields(value)}
    changed = [name for name in parts if name != "saved" and parts[name] != usual[name]]
    return {name: as_json(parts[name], files) for name in changed}


def json_text(value: Any) -> str:
    """Return a value without files as a short text."""
    return json.dumps(as_json(value, []), separators=(",", ":"))


def from_json(value: Any, hint: Any, files: Sequence[bytes] = ()) -> Any:
    """Return the value of type `hint` that `as_json` wrote; raise `CCWSIMError` for another.

    A text is that of `json_text`.
    """
    try:
        value = json.loads(value) if isinstance(value, str) else value
        return _of_type(value, hint, files)
    except (ValueError, TypeError, LookupError, RecursionError) as error:
        reason = (
            str(error) if isinstance(error, CCWSIMError) else "is changed; save or copy it again"
        )
        raise CCWSIMError(reason) from error


def _of_type(value: Any, hint: Any, files: Sequence[bytes]) -> Any:
    kind, options = get_origin(hint), get_args(hint)
    for option in options if kind in (Union, UnionType) else ():
        with suppress(ValueError, TypeError, LookupError):
            return _of_type(value, option, files)
    if hint is Any:
        return tuple(_of_type(item, Any, ()) for item in value) if type(value) is list else value
    if kind is tuple and type(value) is list:
        hints = options[:1] * len(value) if options[-1] is Ellipsis else options
        return tuple(_of_type(v, h, files) for v, h in zip(value, hints, strict=True))
    if isinstance(hint, type) and is_dataclass(hint) and type(value) is dict:
        hints = get_type_hints(hint)
        hints.pop("saved", None)
        return hint(**{name: _of_type(v, hints[name], files) for name, v in value.items()})
    if hint is HardData:
        names = [item for item in value if isinstance(item, str)]
        cells = [item[:-1] for item in value[len(names) :]]
        measured = [item[-1] for item in value[len(names) :]]
        return (
            HardData(cells, values=dict.fromkeys(names, measured))
            if names
            else HardData(cells, measured)
        )
    if hint is bytes:
        return files[value]
    if hint in LARGEST and type(value) in (int, hint) and abs(value) <= LARGEST[type(value)]:
        return float(value) if hint is float else value
    if (kind is Literal and value in options) or (hint not in LARGEST and type(value) is hint):
        return value
    raise ValueError(hint)
