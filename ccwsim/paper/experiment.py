"""Experiments of the paper: texts, inputs (the authors' or bundled files), runs and outcomes."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ccwsim import (
    Ensemble,
    Grid,
    HardData,
    Parameters,
    TrainingImage,
    datasets,
    read_hard_data,
    read_training_image,
)
from ccwsim.datasets.sampling import sample_random
from ccwsim.experiments.trials import Trial
from ccwsim.model import UNWATCHED, Bytes, CCWSIMError, Integers, Watch, read_toml, refused
from ccwsim.report.document import Block, Judgement

PAPER_TEXTS = read_toml("paper/texts.toml")
"""Texts of the report and its experiments, and images."""
PAPER_IMAGES = PAPER_TEXTS[
    "images"
]  # files, hard data and published results of each image of the paper
FILES_VARIABLE = "CCWSIM_DATA"
"""Environment variable with the path of the authors' files."""


def said(text: str, /, **values: object) -> str:
    """Return a sentence of the report, with `values` filled in."""
    return PAPER_TEXTS["said"][text].format(**values)


@dataclass(frozen=True)
class PaperInputs:
    """Training images, hard data and published realizations in a folder."""

    folder: Path | None = None  # folder with `paper` and `reference`; None for bundled images

    def image(self, name: str) -> TrainingImage:
        """Return one of the training images in the texts, such as "channel"."""
        about = PAPER_IMAGES[name]
        path = self._file(f"paper/{about['file']}.npy") if self.is_own(name) else None
        if path is None:
            return datasets.load(about["bundled"])
        image = read_training_image(path)
        names = about["facies"] if len(about["facies"]) == image.n_facies else None
        return TrainingImage(image.array, name=f"{name} (authors')", facies_names=names)

    def describe(self, name: str) -> str:
        """Return a phrase that says which image is used for one of the paper's images."""
        text = "own_image" if self.is_own(name) else "bundled_image"
        return said(text, name=name, bundled=PAPER_IMAGES[name]["bundled"])

    def is_own(self, name: str) -> bool:
        """Return whether the authors' file of this image is available."""
        file = PAPER_IMAGES[name]["file"]
        return bool(file) and self._file(f"paper/{file}.npy") is not None

    def data(self, name: str, n: int, shape: tuple[int, int]) -> HardData | None:
        """Return the authors' `n` data inside the grid, or None if they are not available."""
        stem = PAPER_IMAGES[name]["data"].get(str(n))
        path = self._file(f"{stem}.csv") if stem and self.is_own(name) else None
        if path is None:
            return None
        ny, nx = map(int, path.stem.rsplit("grid", 1)[1].split("x"))
        return inside(read_hard_data(path, Grid(ny, nx)), shape)

    def reference(self, name: str, n: int, shape: tuple[int, int]) -> Integers | None:
        """Return the field from which the authors' `n` data are, or None if it is not available."""
        stem = PAPER_IMAGES[name].get("reference", {}).get(str(n))
        path = self._file(f"{stem}.npy") if stem and self.is_own(name) else None
        return None if path is None else read_training_image(path).array[: shape[0], : shape[1]]

    def published(self, name: str, image: TrainingImage) -> Bytes | None:
        """Return the realizations of a published code as facies indices, or None if unavailable."""
        path = self._file(f"reference/{name}.npz")
        if path is None:
            return None
        try:
            with np.load(path, allow_pickle=False) as saved:
                codes = saved["r"]
        except (OSError, ValueError, KeyError) as error:
            raise refused("paper_realizations", path=path, error=error) from error
        if codes.ndim != 3 or not np.isin(codes, image.codes).all():
            raise refused("paper_image", path=path)
        return np.searchsorted(image.codes, codes).astype(np.uint8)

    def _file(self, relative: str) -> Path | None:
        if self.folder is None:
            return None
        path = self.folder / relative
        return path if path.is_file() else None


def inputs_in(folder: str | Path | None) -> PaperInputs:
    """Return the inputs of a folder (also of its folder `paper`), or the bundled inputs."""
    if folder is None:
        return PaperInputs()
    path = Path(folder)
    if not path.is_dir():
        raise CCWSIMError(f"{folder}: no such folder; give none to use the bundled images")
    for candidate in (path, path.parent):
        inputs = PaperInputs(candidate.resolve())
        if any(inputs.is_own(name) for name in PAPER_IMAGES):
            return inputs
    raise refused("no_paper_images", folder=folder, file=PAPER_IMAGES["channel"]["file"])


def inside(data: HardData, shape: tuple[int, int]) -> HardData:
    """Return the data whose cells are inside a grid of this shape."""
    kept = (data.cells < shape).all(axis=1)
    return data.part(kept)


def sample_as_dense(truth: Integers, n_data: int, n_cells: int, seed: int) -> HardData:
    """Return data from a field, as dense as `n_data` data on a grid of `n_cells` cells."""
    return sample_random(truth, max(round(n_data * truth.size / n_cells), 1), seed)


@dataclass(frozen=True)
class Extent:
    """Size of the experiments, which is full (takes minutes) or quick (takes seconds)."""

    name: str  # "full" or "quick"
    n_many: int  # number of realizations if the paper has 100
    n_few: int  # number of realizations for comparing methods in pictures and curves
    n_anodi: int  # number of realizations per method for the analysis of distances
    n_timed: int  # number of realizations that are timed
    largest_side: int  # maximum side in cells of grids that are not timed
    timed_sides: tuple[int, ...]  # sides in cells of the timed square grids
    largest_lag: int  # largest lag of variograms and connectivity, in cells

    @property
    def is_full(self) -> bool:
        """Whether grids are as large as in the paper; only then can times be compared."""
        return self.name != "quick"

    def side(self, paper_side: int) -> int:
        """Return the side of one of the paper's grids, but at most `largest_side`."""
        return min(paper_side, self.largest_side)


FULL = Extent(
    "full",
    n_many=100,
    n_few=10,
    n_anodi=50,
    n_timed=9,
    largest_side=1000,
    timed_sides=(500, 1000, 1500, 2000, 2500),
    largest_lag=100,
)
QUICK = Extent(
    "quick",
    n_many=6,
    n_few=3,
    n_anodi=4,
    n_timed=2,
    largest_side=144,
    timed_sides=(64, 128, 192),
    largest_lag=40,
)


@dataclass
class ExperimentRun:
    """Inputs, extent, seed and watch of an experiment."""

    inputs: PaperInputs
    extent: Extent
    seed: int
    watch: Watch = UNWATCHED
    _steps: int = field(default=1, init=False)
    _done: int = field(default=0, init=False)

    def expect(self, steps: int) -> None:
        """Set the number of steps of the experiment; each simulation counts as one step."""
        self._steps, self._done = max(steps, 1), 0

    def step(self) -> None:
        """Count a step as done; raise `Cancelled` if the experiment should stop."""
        self._done += 1
        self.watch.tell(min(self._done / self._steps, 1.0))

    def data(
        self, name: str, image: TrainingImage, n: int, shape: tuple[int, int], side: int
    ) -> tuple[HardData, Integers | None]:
        """Return data and the field that they are from: the authors', or sampled (section 5.2).

        `n` data are as dense on a square grid with this `side` as the data on a grid of this shape.
        They are sampled from an unconditional realization of another seed.
        """
        data = self.inputs.data(name, n, shape)
        if data is not None:
            return data, self.inputs.reference(name, n, shape)
        other = ExperimentRun(
            self.inputs, self.extent, self.seed + 1, Watch(cancel=self.watch.cancel)
        )
        truth = other.simulate(image, shape, Parameters()).realizations[0]
        return sample_as_dense(truth, n, side**2, self.seed), truth

    def simulate(
        self,
        image: TrainingImage,
        shape: tuple[int, int],
        parameters: Parameters,
        data: HardData | None = None,
        n: int = 1,
        workers: int | None = None,
    ) -> Ensemble:
        """Simulate realizations and count the simulation as one step of the experiment."""
        low, high = (min(done / self._steps, 1.0) for done in (self._done, self._done + 1))
        part = self.watch.part(low, high)
        trial = Trial.of(image, shape, parameters, data, seed=self.seed)
        ensemble = trial.simulate(n, n_workers=workers, progress=part.progress, cancel=part.cancel)
        self.step()
        return ensemble


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of an experiment: blocks for the report, and judgements of the paper's statements."""

    blocks: tuple[Block, ...]
    judgements: tuple[Judgement, ...]


@dataclass(frozen=True)
class Experiment:
    """One experiment of the paper, with the function that runs it."""

    title: str
    place: str  # the section, figure or table of the paper
    shows: str  # the results that the paper shows there
    run: Callable[[ExperimentRun], Outcome]
    weight: float = 1.0  # duration relative to a typical experiment, used for progress
