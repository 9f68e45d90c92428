"""Runs of several settings, which the pages Compare, Sweep and Benchmark start and follow."""

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from ccwsim import CCWSIMError, Grid, HardData, Parameters, Secondary, TrainingImage
from ccwsim.jobs.limits import Demand
from ccwsim.model.study import Study
from ccwsim.run.footprint import demand_of
from ccwsim.sharing.choices import Choices
from ccwsim.ui.results.maps import colours_of
from ccwsim.ui.session.address import go_to
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.resolve import data_of, image_of, secondary_of, what_decides
from ccwsim.ui.session.state import PageRun, State
from ccwsim.ui.widgets.fields import button

Setting = TypeVar("Setting")
Row = TypeVar("Row")
Result = TypeVar("Result")


@dataclass
class TrialsRun(PageRun[Result], Generic[Setting, Row, Result]):
    """Realizations of several settings; `rows` has the results so far."""

    training_image: TrainingImage
    settings: Sequence[Setting]
    n_realizations: int
    seed: int
    rows: list[Row] = field(default_factory=list)
    unit = "settings"

    @property
    def n_pieces(self) -> int:
        """Number of settings."""
        return len(self.settings)

    @property
    def n_finished(self) -> str:
        """Number of finished settings as text, such as "2 of 5 settings"."""
        return f"{len(self.rows)} of {len(self.settings)} settings"

    def study_of(self, setting: Setting) -> Study:
        """Return the study with a setting; raise `CCWSIMError` if the setting does not fit."""
        raise NotImplementedError

    def n_kept(self, setting: Setting) -> int:
        """Return the number of realizations of a setting that are in memory at a time."""
        return self.n_realizations

    def demands(self, n_workers: int | None = None) -> list[Demand]:
        """Return the resources of each setting that fits; the run reports the other settings."""
        each = []
        for setting in self.settings:
            with suppress(CCWSIMError):
                study, n_kept = self.study_of(setting), self.n_kept(setting)
                each.append(demand_of(study, self.n_realizations, n_kept, n_workers))
        return each


@dataclass(kw_only=True)
class SettingsRun(TrialsRun[Parameters, Row, Result]):
    """Realizations of several parameters with the same image, data, grid and seed.

    `facies` is the index of the facies whose curves are shown. Results are out of date if the
    page's present key differs from `key`.
    """

    key: tuple
    grid: Grid
    hard_data: HardData
    secondary: Secondary | None = None
    facies: int
    colours: list[str]

    def study_of(self, setting: Parameters) -> Study:
        return Study(
            training_image=self.training_image,
            grid=self.grid,
            parameters=setting,
            hard_data=self.hard_data,
            seed=self.seed,
            secondary=self.secondary,
        )


def study_key(choices: Choices) -> tuple:
    """Return a key of image, data, grid and guides; raise `CCWSIMError` if they do not fit."""
    image, data, grid, *_, secondary = what_decides(choices)
    return image, data, grid, secondary


def inputs_of(state: State) -> dict[str, Any]:
    """Return the inputs of a `SettingsRun` that all settings share, from the present study."""
    choices, image = state.choices, image_of(state.choices.image)
    return {
        "training_image": image,
        "grid": choices.grid,
        "hard_data": data_of(choices),
        "seed": choices.seed,
        "secondary": secondary_of(choices),
        "facies": min(state.facies, image.n_facies - 1),
        "colours": colours_of(state),
    }


def follow_trials(run: TrialsRun, redraw_seconds: float = 0.0, **options: Any) -> None:
    """Show the progress of a run; redraw the page for new rows and at the end.

    At least `redraw_seconds` are between two redraws for new rows.
    """
    n_drawn, drawn_at = len(run.rows), time.monotonic()

    def has_news() -> bool:
        return len(run.rows) > n_drawn and time.monotonic() - drawn_at > redraw_seconds

    if run.job is not None:
        follow(run.job, has_news=has_news, **options)


def use_button(label: str, key: str, **options: Any) -> None:
    """Draw a button that applies a setting to the study and opens Simulate."""
    if button(label, key=key, **options):
        go_to("pages/simulate.py", "The study has this setting now.")
