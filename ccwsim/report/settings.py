"""Short descriptions of parameters, and captions that state the inputs of charts."""

from dataclasses import replace
from typing import Any

from ccwsim import Ensemble
from ccwsim.model import Parameters, describe_shape, describe_weight, plural

SHORT_NAMES = {
    "template_size": "template",
    "overlap_size": "overlap",
    "wavelet_level": "level",
    "n_candidates": "K",
    "search_fraction": "search",
    "co_template": "look-ahead",
    "exact_data": "exact honouring",
    "method": "",
}
VALUES = {
    "ccwsim": "CCWSIM",
    "ccsim": "CCSIM",
    "ms-ccsim": "MS-CCSIM",
    "ssd": "squared difference",
    "ours": "ours",
    "paper": "as in the paper",
    "code": "as in the authors' code",
}
"""Names, on the screen, of parameter values that have other names in code."""
USUAL = ("method", "wavelet_level", "template_size", "overlap_size", "n_candidates")
"""Parameters that every caption states; others are stated if they differ from the default."""


def caption_of(ensemble: Ensemble) -> str:
    """Return the image, data, grid, setting, number of realizations and seed of an ensemble."""
    p = ensemble.parameters
    differences = describe_setting(p, replace(Parameters(), **{n: getattr(p, n) for n in USUAL}))
    setting = describe_parameters(p) + (f", {differences}" if differences != "the same" else "")
    count = plural(ensemble.n, "realization")
    edited = ", re-simulated locally around edited data" if ensemble.revised else ""
    return f"{describe_inputs(ensemble)}; {setting}; {count}, seed {ensemble.seed}{edited}"


def describe_inputs(study: Any) -> str:
    """Return the training image, number of hard data and grid of a study, run or ensemble."""
    image, n = study.training_image, study.hard_data.n
    data_text = f"{n} hard data" if n else "no hard data"
    data_text += ", secondary information" if study.secondary else ""
    return f"{image.name or 'unnamed image'}, {data_text}, grid {describe_shape(study.grid.shape)}"


def describe_setting(p: Parameters, study_setting: Parameters) -> str:
    """Describe how a setting differs from the setting of the study.

    The name of a variant describes all parameters that the variant sets.
    """
    usual = vars(study_setting.as_in(p.variant)) | {"variant": study_setting.variant}
    names = [name for name, value in vars(p).items() if value != usual[name]]
    if p.method == "ccsim":  # CCSIM has no level
        names = [name for name in names if name != "wavelet_level"]
    names.sort(key=lambda name: name != "method")
    return ", ".join(_describe(name, getattr(p, name)) for name in names) or "the same"


def describe_parameters(p: Parameters) -> str:
    """Describe a setting in one line."""
    names = ["wavelet_level", "template_size", "overlap_size", "n_candidates"]
    texts = [_describe(name, getattr(p, name)) for name in names[p.method == "ccsim" :]]
    return ", ".join([p.method.upper(), *texts])


def _describe(name: str, value: object) -> str:
    short, text = short_parameter_name(name), describe_value(name, value)
    if isinstance(value, bool):
        return short if value else f"no {short}"
    return text if name in ("method", "similarity", "variant") else f"{short} {text}"


def short_parameter_name(name: str) -> str:
    """Return a short name of a parameter."""
    return SHORT_NAMES.get(name, name.replace("_", " "))


def describe_value(name: str, value: Any) -> str:
    """Return the value of a parameter as text; sizes of a volume are in the order x, y, z."""
    if name == "location_weight":
        return describe_weight(value)
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, tuple):
        return describe_shape(value)
    return f"{value:g}" if isinstance(value, float) else VALUES.get(str(value), str(value))
