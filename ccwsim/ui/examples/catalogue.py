"""The studies of the lecture plan, as data: what each one is, and what to look at in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from ccwsim.model.choices import Choices, DataChoice, ImageChoice
from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters

Shows = Literal["realization", "second", "data", "probability", "variogram"]


@dataclass(frozen=True)
class Example:
    """A study that shows one thing.

    `name` is a word for keys and addresses, `text` what to look at, `others` the settings that the
    study's own is compared with, `source` where the paper has it, where it has. `shows` are the
    pictures beside the training image; where there are others, one realization of each.
    """

    name: str
    title: str
    text: str
    choices: Choices
    others: tuple[Parameters, ...] = ()
    source: str = ""
    shows: tuple[Shows, ...] = ("realization", "second")


@dataclass(frozen=True)
class Part:
    """A part of the lecture."""

    title: str
    examples: tuple[Example, ...]


def _study(
    image: str, data: str = "", side: int = 512, n: int = 12, **parameters: object
) -> Choices:
    hard_data = DataChoice("bundled", data) if data else DataChoice()
    p = Parameters(**parameters)  # type: ignore[arg-type]
    return Choices(ImageChoice(image), hard_data, Grid(side, side), p, n)


DEFAULT = Parameters()

PARTS = (Part("The paper’s figures, on our images", (
    Example(
        "unconditional", "Realizations without data",
        "Every realization is put together from patches of the training image. Look for sand that "
        "stays connected from patch to patch, and for pieces that you have seen in the image.",
        _study("channels"), source="Section 5.1, Fig. 6",
    ),
    Example(
        "conditional", "400 hard data, all honoured",
        "The dots are cells whose facies is known. No channel stops at one: patches are chosen so "
        "that they honour the data, and what they miss is corrected by local re-simulation.",
        _study("channels", "channels_400_data"), source="Section 5.2, Fig. 7",
    ),
    Example(
        "e-type", "The E-type: probability of sand",
        "The share of 50 realizations that have sand in a cell. It is near 0 or 1 around data and "
        "in between far from them; single channels are seen in the realizations only.",
        _study("channels", "channels_400_data", n=50), source="Section 5.2, Fig. 7",
        shows=("realization", "probability"),
    ),
    Example(
        "variograms", "Variograms and connectivity",
        "The curves of the realizations (grey) should be around that of the training image "
        "(red). Below the maps: does the connectivity of the sand reach as far?",
        _study("channels", "channels_400_data", n=50), source="Section 5.3, Fig. 9",
        shows=("realization", "variogram"),
    ),
    Example(
        "levels", "Wavelet levels 1, 2 and 3",
        "Each level compares a quarter of the numbers of the one before. Compare the CPU times, "
        "then the channels: at which level do they begin to break?",
        _study("channels", "channels_400_data", wavelet_level=1),
        (DEFAULT, Parameters(wavelet_level=3)), "Section 5.6, Fig. 13",
    ),
    Example(
        "methods", "MS-CCSIM against CCWSIM",
        "Both search a coarse image. MS-CCSIM then refines the location scale by scale, CCWSIM "
        "needs one step. Compare variety and distance to the training image.",
        _study("channels", "channels_400_data"), (Parameters(method="ms-ccsim"),),
        "Section 5.5, Table 1",
    ),
    Example(
        "stone-wall", "The stone wall",
        "Closed shapes: a stone must not break and a joint must not end. Larger templates keep "
        "more stones whole.",
        _study("stone_wall", "stone_wall_300_data", template_size=48, overlap_size=12),
        source="Section 5.4, Fig. 11",
    ),
    Example(
        "three-facies", "Three facies",
        "The slip face (green) is on the north-eastern side of a sand body, never alone. "
        "Uncertainty is now one probability map a facies, or their entropy.",
        _study("barchans", "barchans_200_data", template_size=48, overlap_size=12),
        source="Section 5.8, Fig. 16",
    ),
)), Part("From few data to dense data", (
    Example(
        "wells", "60 wells",
        "Between the wells realizations differ freely: the E-type is nearly the share of sand "
        "everywhere. Add a well on the page Hard data and see how far it reaches.",
        _study("channels", "channels_60_wells", n=50), shows=("realization", "probability"),
    ),
    Example(
        "dense", "4000 data on 256 × 256 cells",
        "One cell in sixteen is known, 60 in each template: no location of the training image "
        "fits them all, yet all are honoured and the channels hold. Realizations differ little.",
        replace(_study("channels", side=256), data=DataChoice("sampled", n_sampled=4000)),
        source="Section 5.7, Fig. 14", shows=("data", "realization"),
    ),
)), Part("Nonstationary training images", (
    Example(
        "delta", "A delta with and without location weight",
        "A patch may come from anywhere, so the trunk ends up in the sea (A). A location weight of "
        "2 keeps patches near their position in the image: one trunk in the west, mouth bars in "
        "the east (B).",
        _study("delta", side=300), (Parameters(location_weight=2.0),), "Section 5.9",
    ),
    Example(
        "bend", "Channels that turn",
        "Channels sweep from north to east, thin and dense inside the bend, wide and sparse "
        "outside. Without a location weight all is mixed (A); with 2 the bend is back (B).",
        _study("bend", side=300), (Parameters(location_weight=2.0),), "Section 5.9",
    ),
)), Part("Bad parameters, and why they are bad", (
    Example(
        "small-template", "A template that is too small",
        "A patch of 8 cells never sees a whole channel (A): it cannot know how wide one is, or "
        "that it goes on. The template must be larger than the shapes (B).",
        _study("channels", side=256, template_size=8, overlap_size=4), (DEFAULT,),
    ),
    Example(
        "thin-overlap", "An overlap that is too thin",
        "2 cells at level 1 are a single number across (A): a channel that leaves a patch is "
        "hardly seen by the next and breaks. With 8 cells it is carried on (B).",
        _study("channels", side=256, overlap_size=2, wavelet_level=1, refine=False),
        (Parameters(wavelet_level=1, refine=False),),
    ),
    Example(
        "high-level", "A level too high for thin features",
        "At level 4 the search sees means of 16 × 16 cells, in which a fracture of 3 cells is "
        "next to nothing: they break (A). Level 1 keeps them (B).",
        _study("fractures", side=256, overlap_size=16, wavelet_level=4, refine=False),
        (Parameters(overlap_size=16, wavelet_level=1, refine=False),),
    ),
    Example(
        "candidates", "One candidate, or 500",
        "K = 1 always takes the best location: long pieces of the image are copied (A). K = 500 "
        "draws among locations that hardly fit, and channels break (C). 20 is between (B).",
        _study("channels", side=256, n_candidates=1), (DEFAULT, Parameters(n_candidates=500)),
    ),
    Example(
        "no-refine", "Level 3 without refinement",
        "Locations are known to 8 cells only, so banks meet with steps (A). `refine` shifts each "
        "patch by up to 7 cells to where it fits best (B); what level 3 did not see stays broken.",
        _study("channels", side=256, wavelet_level=3, refine=False),
        (Parameters(wavelet_level=3),),
    ),
    Example(
        "wrong-data", "Data that are not honoured",
        "With `exact_data` off, data condition the search only, as in the published code: those "
        "ringed red are not honoured (A). On, all are (B), and the channels are no worse.",
        _study("channels", "channels_400_data", exact_data=False), (DEFAULT,),
    ),
)))  # fmt: skip
EXAMPLES = tuple(example for part in PARTS for example in part.examples)


def settings_of(example: Example) -> tuple[Parameters, ...]:
    """Return the study's own setting and those it is compared with.

    Examples
    --------
    >>> [p.wavelet_level for p in settings_of(EXAMPLES[4])]
    [1, 2, 3]
    """
    return example.choices.parameters, *example.others
