"""Which settings are compared: the study's own, and others that usually tell something."""

from __future__ import annotations

from dataclasses import fields

from ccwsim.experiments.comparison import FEWEST, MOST
from ccwsim.model.parameters import METHODS, Parameters
from ccwsim.ui.compare.state import LETTERS, Comparing
from ccwsim.ui.session.fitting import fitted, levels
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.method_step import set_parameters

SHORT = {
    "template_size": "template", "overlap_size": "overlap", "wavelet_level": "level",
    "n_candidates": "K", "search_fraction": "search",
}  # fmt: skip
"""How a parameter is called where there is little room."""


def settings_of(state: State) -> tuple[Parameters, ...]:
    """Return all settings as they can be simulated: sizes that do not fit go to the nearest."""
    shape = image_of(state.choices.image).shape
    own = fitted(state.choices.parameters, shape)
    usual = usual_others(own, shape)
    others = [usual[k] if p is None else p for k, p in enumerate(state.page(Comparing).others)]
    return own, *(fitted(p, shape) for p in others)


def usual_others(own: Parameters, shape: tuple[int, int]) -> list[Parameters]:
    """Return settings that are worth comparing with one's own, all of them different.

    Examples
    --------
    >>> [said_setting(p, Parameters()) for p in usual_others(Parameters(), (256, 256))][:2]
    ['ccsim', 'level 3']
    """
    tries: list[dict] = [{"method": "ccsim"}]
    tries += [{"method": "ccwsim", "wavelet_level": k} for k in (3, 1, 2) if k in levels(shape)]
    tries += [{"method": method} for method in METHODS]
    tries += [{"n_candidates": 5}, {"n_candidates": 50}, {"refine": not own.refine}]
    tries += [{"random_path": not own.random_path}]
    found: list[Parameters] = []
    for changes in tries:
        p = fitted(own, shape, **changes)
        if p != own and p not in found:
            found.append(p)
    return found


def said_setting(p: Parameters, own: Parameters) -> str:
    """Say in what a setting differs from another.

    Examples
    --------
    >>> said_setting(Parameters(48, 8, refine=False), Parameters())
    'template 48, no refine'
    """
    names = [f.name for f in fields(Parameters) if getattr(p, f.name) != getattr(own, f.name)]
    if p.method == "ccsim":  # it has no level
        names = [name for name in names if name != "wavelet_level"]
    names.sort(key=lambda name: name != "method")
    return ", ".join(_said(name, getattr(p, name)) for name in names) or "the same"


def said_whole(p: Parameters) -> str:
    """Say the most of a setting in a line.

    Examples
    --------
    >>> said_whole(Parameters())
    'ccwsim, level 2, template 32, overlap 8, K 20'
    """
    level = [] if p.method == "ccsim" else [f"level {p.level}"]
    sizes = [f"template {p.template_size}", f"overlap {p.overlap_size}", f"K {p.n_candidates}"]
    return ", ".join([p.method, *level, *sizes])


def change_setting(state: State, k: int, **changes: object) -> None:
    """Change setting `k`; the first one is the study's own."""
    if k == 0:
        set_parameters(state, **changes)
        return
    shape = image_of(state.choices.image).shape
    state.page(Comparing).others[k - 1] = fitted(settings_of(state)[k], shape, **changes)


def copy_setting(state: State, k: int, source: int) -> None:
    """Let setting `k` be what setting `source` is."""
    p = settings_of(state)[source]
    change_setting(state, k, **{f.name: getattr(p, f.name) for f in fields(Parameters)})


def add_setting(state: State) -> None:
    """Add a usual setting that is not there yet."""
    there = settings_of(state)
    if len(there) < MOST:
        usual = usual_others(there[0], image_of(state.choices.image).shape)
        new = next((p for p in usual if p not in there), there[0])
        state.page(Comparing).others.append(new)


def remove_setting(state: State, k: int) -> None:
    """Remove setting `k`; those after it move up and stay what they are."""
    there = list(settings_of(state))
    if 0 < k < len(there) and len(there) > FEWEST:
        del there[k]
        state.page(Comparing).others[:] = there[1:]


def use_setting(state: State, k: int) -> None:
    """Make setting `k` the study's own; what the study had takes its place, so nothing is lost."""
    there = list(settings_of(state))
    there[0], there[k] = there[k], there[0]
    state.change(parameters=there[0])
    if k:
        state.page(Comparing).others[:] = there[1:]


def called(n: int) -> tuple[str, ...]:
    """Return the letters of `n` settings."""
    return LETTERS[:n]


def _said(name: str, value: object) -> str:
    short = SHORT.get(name, name.replace("_", " "))
    if name in ("method", "similarity"):
        return str(value)
    if isinstance(value, bool):
        return short if value else f"no {short}"
    return f"{short} {value:g}" if isinstance(value, float) else f"{short} {value}"
