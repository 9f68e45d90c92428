"""A study and its results as one report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ccwsim.model.choices import Choices, Shown
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.parameters import parameter_table
from ccwsim.report import Block, Code, Document, Facts, Row, Section, Table, Text, surroundings
from ccwsim.sharing.link import left_out, said
from ccwsim.sharing.recipe import Recipe
from ccwsim.sharing.study_charts import (
    counted_charts,
    curve_charts,
    e_type_maps,
    image_map,
    realization_map,
    small_maps,
)

MAX_LISTED = 40
"""More data or realizations are summed up instead of listed."""
REVISED = (
    "These realizations were mended around edits of the hard data: link, script and command "
    "simulate the study anew, which honours the same data and differs in other cells."
)


def study_report(
    ensemble: Ensemble,
    choices: Choices,
    shown: Shown,
    colours: Sequence[str],
    facts: Sequence[str],
    link: str,
    how: Recipe,
) -> Document:
    """Return the report of a study.

    Parameters
    ----------
    ensemble : Ensemble
        The results.
    choices : Choices
        What they came from.
    shown : Shown
        The realization and the facies to show.
    colours : sequence of str
        One a facies.
    facts : sequence of str
        What came out, each a short phrase.
    link : str
        The address that opens the study.
    how : Again
        The script and the command.
    """
    image, grid = ensemble.training_image, ensemble.grid
    number = min(shown.realization, ensemble.n - 1)
    facies = min(shown.facies, image.n_facies - 1)
    name = image.name or "a training image"
    sections = (
        Section("Study", (_study(ensemble), _facies(ensemble), *_data(ensemble)),
                gist=f"{name}, {ensemble.hard_data.n} hard data"),
        Section("Realizations", (
            Row((image_map(ensemble, colours), realization_map(ensemble, colours, number))),
            small_maps(ensemble, colours),
        ), gist=f"{ensemble.n} of {grid.nx} × {grid.ny} cells"),
        Section("E-type", (e_type_maps(ensemble, facies),),
                gist=f"of {image.facies_names[facies]}, over {ensemble.n} realizations"),
        Section("Variograms and connection", curve_charts(ensemble, facies),
                gist=f"of {image.facies_names[facies]}, against the training image"),
        Section("CPU time and proportions",
                (counted_charts(ensemble, colours), *_each(ensemble)),
                gist=f"{1000 * float(ensemble.cpu_seconds.mean()):.3g} ms a realization"),
        Section("Parameters", (_parameters(ensemble),)),
        Section("The same again", _again(ensemble, choices, link, how)),
    )  # fmt: skip
    return Document(
        f"{ensemble.n} realizations of {name}", sections, "A study with CCWSIM",
        (Text(". ".join(fact[:1].upper() + fact[1:] for fact in facts) + "."),),
        Facts((*surroundings(), ("Seed", str(ensemble.seed)),
               ("Realizations", f"digest {ensemble.digest}"))),
    )  # fmt: skip


def _study(ensemble: Ensemble) -> Facts:
    image, grid = ensemble.training_image, ensemble.grid
    ny, nx = image.shape
    n = ensemble.hard_data.n
    return Facts(
        (
            ("Training image", f"{image.name or 'unnamed'}, {nx} × {ny} cells, "
                               f"{image.n_facies} facies, digest {image.digest}"),
            ("Grid", f"{grid.nx} × {grid.ny} cells of {grid.cell_size[0]:g} × "
                     f"{grid.cell_size[1]:g}, from ({grid.origin[0]:g}, {grid.origin[1]:g})"),
            ("Hard data", f"{n}, digest {ensemble.hard_data.digest}" if n else "none"),
            ("Realizations", f"{ensemble.n}, seed {ensemble.seed}"),
        )
    )  # fmt: skip


def _facies(ensemble: Ensemble) -> Table:
    image, mean = ensemble.training_image, ensemble.proportions.mean(axis=0)
    codes = ensemble.hard_data.facies
    rows = tuple(
        (image.facies_names[k], str(code), f"{100 * image.proportions[k]:.1f} %",
         f"{100 * mean[k]:.1f} %", str(np.count_nonzero(codes == code)))
        for k, code in enumerate(image.codes.tolist())
    )  # fmt: skip
    return Table(
        ("facies", "code", "in the training image", "in the realizations", "hard data"), rows
    )


def _data(ensemble: Ensemble) -> tuple[Block, ...]:
    data = ensemble.hard_data
    if not 0 < data.n <= MAX_LISTED:
        return ()
    centres = ensemble.grid.centers_of(data.cells).tolist()
    rows = tuple(
        (f"{x:g}", f"{y:g}", str(row), str(column), str(code))
        for (x, y), (row, column), code in zip(
            centres, data.cells.tolist(), data.facies.tolist(), strict=True
        )
    )
    return (Table(("x", "y", "row", "column", "facies"), rows, "Hard data"),)


def _each(ensemble: Ensemble) -> tuple[Block, ...]:
    n = min(ensemble.n, MAX_LISTED)
    names = ensemble.training_image.facies_names
    shares, wrong = ensemble.proportions, ensemble.n_mismatched
    rows = tuple(
        (str(r + 1), f"{1000 * ensemble.cpu_seconds[r]:.3g}", str(wrong[r]),
         *(f"{100 * share:.1f}" for share in shares[r]))
        for r in range(n)
    )  # fmt: skip
    head = ("realization", "CPU time (ms)", "data wrong", *(f"{name} (%)" for name in names))
    caption = "" if n == ensemble.n else f"The first {n} of {ensemble.n} realizations"
    return (Table(head, rows, caption),)


def _parameters(ensemble: Ensemble) -> Table:
    p = ensemble.parameters
    rows = tuple(
        (row["name"], row["symbol"], said(getattr(p, row["name"])),
         "" if str(getattr(p, row["name"])) == row["default"] else "changed")
        for row in parameter_table()
    )  # fmt: skip
    return Table(("parameter", "in the paper", "value", ""), rows)


def _again(ensemble: Ensemble, choices: Choices, link: str, how: Recipe) -> tuple[Block, ...]:
    blocks: list[Block] = [Text(REVISED)] if ensemble.revised else []
    blocks.append(Code(link, "The link"))
    missing = left_out(choices)
    if missing:
        blocks.append(
            Text(f"The link cannot carry {' and '.join(missing)}: take the project file.")
        )
    beside = "; it reads the project file, which has to lie beside it"
    blocks.append(Code(how.python, f"In Python{beside if how.python_needs_project else ''}"))
    blocks.append(
        Code(how.command, f"On the command line{beside if how.command_needs_project else ''}")
    )
    return tuple(blocks)
