"""What became of the locations that fitted the overlap best, and why."""

from __future__ import annotations

from typing import Literal, NamedTuple

from ccwsim.engine.trace.patch import TracedPatch

Fate = Literal["drawn", "candidate", "fraction", "slack", "data", "location", "tie"]


class PlaceFate(NamedTuple):
    """What became of one location.

    Attributes
    ----------
    row, column : int
        In blocks, in path coordinates.
    ccw : float
        Its CCW score.
    missed, held, ahead : int
        Data that its patch would miss: in the template, there but right in the overlap already,
        and in the co-template.
    fate : str
        "drawn"; "candidate", that was not drawn; out as the overlap is not among the share that is
        looked at ("fraction"), as it is too much worse than the best ("slack"), as others honour
        more "data", as it is too far from the patch's own ("location"), or at random among equals
        ("tie").
    """

    row: int
    column: int
    ccw: float
    missed: int
    held: int
    ahead: int
    fate: Fate


def fates(step: TracedPatch) -> list[PlaceFate]:
    """Return what became of the K places chosen and of the K with the best overlaps.

    The drawn one comes first, then the other candidates, then the rejected ones; each by score.
    """
    chosen = [tuple(place) for place in step.places.tolist()]
    found: dict[tuple[int, ...], Fate]
    found = {place: _of_chosen(step, k) for k, place in enumerate(chosen)}
    if step.totals is not None and step.patch.shape:  # without an overlap none fits best
        for row, column in step.best_overlaps().tolist():
            found.setdefault((row, column), _of_rejected(step, row, column))
    sign = -1 if step.correlation else 1
    places = [_place(step, row, column, fate) for (row, column), fate in found.items()]
    order = {"drawn": 0, "candidate": 1}
    return sorted(places, key=lambda p: (order.get(p.fate, 2), sign * p.ccw, p.row, p.column))


def _of_chosen(step: TracedPatch, k: int) -> Fate:
    if k == step.drawn:
        return "drawn"
    return "candidate" if k < step.n_candidates else "slack"


def _of_rejected(step: TracedPatch, row: int, column: int) -> Fate:
    assert step.totals is not None
    if step.data is not None and step.data.ruled_out[row, column]:
        return "fraction"
    if step.totals[row, column] <= step.totals[tuple(step.places.T)].max():
        return "tie"
    return "data" if step.data is not None else "location"


def _place(step: TracedPatch, row: int, column: int, fate: Fate) -> PlaceFate:
    d, at = step.data, (row, column)
    missed, held, ahead = (
        (0, 0, 0) if d is None else (int(d.missed[at]), int(d.held[at]), int(d.ahead[at]))
    )
    return PlaceFate(row, column, float(step.ccw[at]), missed, held, ahead, fate)
