"""What the user chose; it lives in the core, so that links and files of it need no screen."""

from ccwsim.model.choices import (
    Answers,
    Choices,
    DataChoice,
    DataSource,
    EMap,
    ImageChoice,
    Shown,
    Upload,
)

__all__ = [
    "Answers",
    "Choices",
    "DataChoice",
    "DataSource",
    "EMap",
    "ImageChoice",
    "Shown",
    "Upload",
]
