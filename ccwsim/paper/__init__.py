"""Reproduction of the paper's experiments, and the report of the results."""

from ccwsim.paper.experiment import FULL, QUICK, Experiment, ExperimentRun, Extent, Outcome
from ccwsim.paper.inputs import PaperInputs, inputs_in
from ccwsim.paper.reproduction import (
    EXPERIMENTS,
    Finished,
    Reproduction,
    document_of,
    reproduce,
    summary,
    verdict_of,
    with_largest_grid,
)

__all__ = [
    "EXPERIMENTS",
    "FULL",
    "QUICK",
    "Experiment",
    "ExperimentRun",
    "Extent",
    "Finished",
    "Outcome",
    "PaperInputs",
    "Reproduction",
    "document_of",
    "inputs_in",
    "reproduce",
    "summary",
    "verdict_of",
    "with_largest_grid",
]
