"""What is timed: one setting on one grid with so many data, and how long it should take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage

SECONDS_A_CELL = 3.5e-8
"""Of the cut, the paste and the choice of candidates, on a usual core."""
SECONDS_A_PRODUCT = 2.2e-11
"""Of a product of the search."""
SECONDS_AN_IMAGE_CELL = 3e-8
"""Of turning a cell of the training image and preparing it."""
SECONDS_A_DATUM = 1.5e-9
"""Of a datum for each cell of the training image, which mending searches."""


@dataclass(frozen=True)
class TimingCase:
    """One setting to time.

    Attributes
    ----------
    parameters : Parameters
    grid_shape : tuple of int
        Rows and columns.
    n_data : int
        Hard data; 0 for an unconditional run.
    """

    parameters: Parameters
    grid_shape: tuple[int, int]
    n_data: int = 0

    @property
    def n_cells(self) -> int:
        """Cells of the grid."""
        return self.grid_shape[0] * self.grid_shape[1]


def grid_cases(sides: Sequence[int], parameters: Sequence[Parameters]) -> list[TimingCase]:
    """Return square grids × parameters, the small grids first.

    Examples
    --------
    >>> cases = grid_cases([256, 64], [Parameters(wavelet_level=1), Parameters(wavelet_level=2)])
    >>> [(c.grid_shape[0], c.parameters.level) for c in cases]
    [(64, 1), (64, 2), (256, 1), (256, 2)]
    """
    return [TimingCase(p, (side, side)) for side in sorted(sides) for p in parameters]


def data_cases(
    numbers: Sequence[int], parameters: Sequence[Parameters], grid_shape: tuple[int, int]
) -> list[TimingCase]:
    """Return numbers of data × parameters on one grid, the small numbers first.

    Examples
    --------
    >>> [c.n_data for c in data_cases([1000, 0], [Parameters()], (512, 512))]
    [0, 1000]
    """
    return [TimingCase(p, grid_shape, n) for n in sorted(numbers) for p in parameters]


def usual_seconds(training_image: TrainingImage, case: TimingCase) -> float:
    """Return about how long one realization takes on a usual core, from a count of operations.

    Good to a factor of about two or three; `expected_seconds` corrects it by what was measured.

    Examples
    --------
    >>> ti = TrainingImage([[0, 1]] * 256)
    >>> small, large = (TimingCase(Parameters(), (n, 512)) for n in (512, 1024))
    >>> usual_seconds(ti, large) < 2 * usual_seconds(ti, small)
    True
    """
    p, (ny, nx) = case.parameters, training_image.shape
    unit = 2**p.level
    places = max((ny - p.template_size) // unit + 1, 1) * max((nx - p.template_size) // unit + 1, 1)
    overlap = p.overlap_size * (2 * p.template_size - p.overlap_size) // unit**2
    planes = 1 if training_image.n_facies <= 2 else training_image.n_facies
    tiles = max(case.n_cells / p.step**2, 1.0)
    return (
        case.n_cells * SECONDS_A_CELL
        + tiles * places * overlap * planes * SECONDS_A_PRODUCT
        + ny * nx * (SECONDS_AN_IMAGE_CELL + case.n_data * SECONDS_A_DATUM)
    )
