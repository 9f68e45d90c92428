"""Convert parameters to JSON and back."""

from __future__ import annotations

import json
from dataclasses import asdict, fields

from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.parameters import Parameters

MAX_LENGTH = 100_000


def parameters_to_json(parameters: Parameters) -> str:
    """Return parameters as a JSON object of all their names and values.

    Examples
    --------
    >>> parameters_to_json(Parameters(template_size=48))[:23]
    '{"template_size": 48, "'
    """
    return json.dumps(asdict(parameters))


def parameters_from_json(text: str | bytes) -> Parameters:
    """Return the parameters in a JSON object; missing names keep their defaults.

    Raises `CCWSIMError` if the text is not a JSON object or has an unknown name or invalid value.

    Examples
    --------
    >>> parameters_from_json('{"template_size": 48}').template_size
    48
    """
    if len(text) > MAX_LENGTH:
        raise CCWSIMError(f"parameters: {len(text)} characters exceed the limit")
    try:
        given = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise CCWSIMError(f"parameters are not JSON ({error}); save them again") from error
    if not isinstance(given, dict):
        raise CCWSIMError('parameters: a JSON object is needed, such as {"template_size": 32}')
    known = [f.name for f in fields(Parameters)]
    unknown = [name for name in given if name not in known]
    if unknown:
        raise CCWSIMError(
            f"parameters: {shown(unknown[0])} is not a parameter; choose from {', '.join(known)}"
        )
    return Parameters(**given)
