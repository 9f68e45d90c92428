"""Names of downloaded files, made from the study."""

import re
from typing import Any

from ccwsim import Ensemble, Grid, TrainingImage


def image_part(image: TrainingImage) -> str:
    """Return the name of a training image in a form that is safe in file names."""
    name = re.sub(r"[^\w.-]+", "_", image.name, flags=re.ASCII).strip("._")
    return name[:40] or "study"


def grid_part(image: TrainingImage, grid: Grid) -> str:
    """Return the image and the grid as part of a file name."""
    return f"{image_part(image)}_{'x'.join(map(str, grid.shape[::-1]))}"


def study_part(ensemble: Ensemble) -> str:
    """Return a part of a file name with the image, grid, T, L and seed of an ensemble."""
    p = ensemble.parameters
    return (
        f"{grid_part(ensemble.training_image, ensemble.grid)}_T{_sizes(p.template_size)}"
        f"_L{_sizes(p.wavelet_level)}_seed{ensemble.seed}"
    )


def _sizes(value: Any) -> str:
    """Return a size as text; for a volume, the sizes along x, y and z."""
    return "x".join(map(str, value[::-1])) if isinstance(value, tuple) else str(value)
