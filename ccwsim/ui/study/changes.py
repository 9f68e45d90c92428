"""Short descriptions of the differences between two studies."""

from dataclasses import fields

from ccwsim import Parameters
from ccwsim.model import describe_shape
from ccwsim.report.settings import describe_value, short_parameter_name
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.results.maps import pretty


def changes_between(before: Choices, after: Choices) -> list[str]:
    """Return each difference between two studies as a short phrase."""
    phrases = []
    if before.image != after.image:
        phrases.append(_image(before.image, after.image))
    if before.data != after.data:
        old, new = _data_name(before.data), _data_name(after.data)
        phrases.append(f"{old} → {new}" if old != new else f"other {new}")
    if before.guides != after.guides:
        phrases.append("other guides")
    if before.grid != after.grid:
        old, new = describe_shape(before.grid.shape), describe_shape(after.grid.shape)
        phrases.append(f"grid {old} → {new}" if old != new else "other world coordinates")
    for field in fields(Parameters):
        name = "level" if field.name == "wavelet_level" else field.name  # 0 for CCSIM
        old, new = getattr(before.parameters, name), getattr(after.parameters, name)
        if old != new:
            values = (describe_value(field.name, value) for value in (old, new))
            phrases.append(f"{short_parameter_name(field.name)} {' → '.join(values)}".strip())
    if before.n_realizations != after.n_realizations:
        phrases.append(f"{before.n_realizations} → {after.n_realizations} realizations")
    if before.seed != after.seed:
        phrases.append(f"seed {before.seed} → {after.seed}")
    return phrases


def study_name(choices: Choices) -> str:
    """Return a short name of a study: image, level and seed."""
    level = describe_value("wavelet_level", choices.parameters.level)
    return f"{image_name(choices.image)}, level {level}, seed {choices.seed}"


def image_name(choice: ImageChoice) -> str:
    """Return the name of a training image."""
    return choice.upload.name if choice.upload else pretty(choice.bundled)


def _image(before: ImageChoice, after: ImageChoice) -> str:
    old, new = image_name(before), image_name(after)
    if old != new:
        return f"{old} → {new}"
    return f"{new}, other colours" if before.digest == after.digest else f"{new}, read otherwise"


def _data_name(choice: DataChoice) -> str:
    if choice.source == "bundled":
        return pretty(choice.bundled)
    if choice.source == "file":
        return choice.upload.name if choice.upload else "a file"
    if choice.source == "sampled":
        return f"{choice.n_sampled} sampled data"
    if choice.source == "placed":
        n = choice.placed.n if choice.placed is not None else 0
        return f"{n} placed data"
    return "no data"
