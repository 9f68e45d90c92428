"""Report of a study and of its results."""

from collections.abc import Sequence

import numpy as np

from ccwsim import Ensemble
from ccwsim.figures import LIGHT, map_png, proportions_chart, times_chart
from ccwsim.io.hard_data.files import names_of_data
from ccwsim.metrics import check_ensemble, etype, fit_curve, fit_flow, measure
from ccwsim.metrics.bands import STATISTICS
from ccwsim.metrics.lags import axes_of
from ccwsim.model import coordinate, describe_shape, duration, parameter_table, three_digits
from ccwsim.report import document, verdicts
from ccwsim.report.pictures import bundle_chart, bundle_of, map_picture, share_picture
from ccwsim.report.settings import caption_of
from ccwsim.sharing.choices import CellsOfWells, Choices, Shown
from ccwsim.sharing.codec import fields_of
from ccwsim.sharing.link import parts_left_out
from ccwsim.sharing.recipe import Recipe

MAX_REPORTED = 100  # maximum number of data or realizations in a list; longer lists are summarized
MAX_MAPS = 24
MAX_FLOW_CELLS = 2e6  # limit of the cells in solutions of flow, for a few seconds of work
REVISED = (
    "These realizations were re-simulated locally around edits of the hard data. Link, script and "
    "command simulate the entire study again; the same data are honoured, but other cells differ."
)


def study_report(
    ensemble: Ensemble,
    choices: Choices,
    shown: Shown,
    colours: Sequence[str],
    facts: Sequence[str],
    link: str,
    recipe: Recipe,
    wells: CellsOfWells = (),
) -> document.Document:
    """Return the report of a study and of its results.

    `shown` selects the realization and the facies; `colours` has one colour per facies. `facts` are
    short phrases on the results. `link` opens the study, and `recipe` reproduces the study.
    `wells` are the named wells of the hard data.
    """
    image, grid = ensemble.training_image, ensemble.grid
    chosen = image.facies_of_interest if shown.facies is None else shown.facies
    facies = min(chosen, image.n_facies - 1)
    name, of_facies = image.name or "a training image", f"of {image.facies_names[facies]}"
    first_maps = _first_maps(ensemble, colours, min(shown.realization, ensemble.n - 1))
    maps = first_maps, _small_maps(ensemble, colours)
    e_type, curves = (_e_type_maps(ensemble, facies),), _curve_charts(ensemble, facies)
    counts = (_times_and_proportions(ensemble, colours), _table_of_realizations(ensemble))
    study_blocks = (_study(ensemble), _facies(ensemble), *_data(ensemble, wells))
    mean = float(ensemble.cpu_seconds.mean())
    sections = (
        ("Study", study_blocks, f"{name}, {ensemble.hard_data.n} hard data"),
        ("Realizations", maps, f"{ensemble.n} of {describe_shape(grid.shape)} cells"),
        ("E-type", e_type, f"{of_facies}, in {ensemble.n} realizations"),
        ("Checks", (_checks(ensemble),), "each beside crops of the training image"),
        ("Variograms and connectivity", curves, f"{of_facies}, compared with the training image"),
        ("Measures", (_measures(ensemble, facies),), f"{of_facies}, beside crops of the image"),
        ("Flow", (_flow(ensemble, facies),), f"{of_facies}, beside crops of the image"),
        ("CPU time and proportions", counts, f"{duration(mean)} a realization"),
        ("Parameters", (_parameters(ensemble),), ""),
        ("Reproduction", _reproduction(ensemble, choices, link, recipe), ""),
    )
    opening = document.Text(". ".join(fact[:1].upper() + fact[1:] for fact in facts) + ".")
    digest = ("Realizations", f"digest {ensemble.digest}")
    return document.Document(
        f"{ensemble.n} realizations of {name}",
        tuple(document.Section(title, blocks, gist=gist) for title, blocks, gist in sections),
        "A study with CCWSIM",
        (opening,),
        document.Facts((*document.surroundings(), ("Seed", str(ensemble.seed)), digest)),
    )


def _study(ensemble: Ensemble) -> document.Facts:
    image, grid, n = ensemble.training_image, ensemble.grid, ensemble.hard_data.n
    ti = f"{image.name or 'unnamed'}, {describe_shape(image.shape)} cells"
    ti += f", {image.n_facies} facies"
    rows: tuple[tuple[str, str], ...] = (
        ("Training image", f"{ti}, digest {image.digest}"),
        ("Grid", f"{grid.describe()}; lengths in units of the coordinates"),
        ("Hard data", f"{n}, digest {ensemble.hard_data.digest}" if n else "none"),
        ("Realizations", f"{ensemble.n}, seed {ensemble.seed}"),
    )
    if (secondary := ensemble.secondary) is not None:
        rows += (("Secondary information", f"{secondary.describe()}, digest {secondary.digest}"),)
    return document.Facts(rows)


def _facies(ensemble: Ensemble) -> document.Table:
    image, mean = ensemble.training_image, ensemble.proportions.mean(axis=0)
    rows = []
    for k, code in enumerate(image.codes.tolist()):
        shares = (f"{100 * share:.1f} %" for share in (image.proportions[k], mean[k]))
        n = np.count_nonzero(ensemble.hard_data.facies == code)
        off = verdicts.relative_text(float(mean[k]), float(image.proportions[k]))
        rows.append((image.facies_names[k], str(code), *shares, off, str(n)))
    header = ("facies", "code", "in the training image", "in the realizations", "off", "hard data")
    return document.Table(header, tuple(rows))


def _data(ensemble: Ensemble, wells: CellsOfWells) -> tuple[document.Block, ...]:
    hard_data = ensemble.hard_data
    if not 0 < hard_data.n <= MAX_REPORTED:
        return ()
    names = names_of_data(hard_data, ensemble.training_image, wells)
    places = ensemble.grid.centers_of(hard_data.cells).tolist()
    rows = [
        (well, *map(coordinate, place), *map(str, cell), facies)
        for well, place, cell, facies in zip(
            names["well"], places, hard_data.cells.tolist(), names["facies_name"], strict=True
        )
    ]
    n = ensemble.grid.n_dimensions
    header = ("well", *("x", "y", "z")[:n], *("layer", "row", "column")[-n:], "facies")
    return (document.Table(header, tuple(rows), "Hard data"),)


def _first_maps(ensemble: Ensemble, colours: Sequence[str], number: int) -> document.PictureRow:
    """Return pictures of the training image and of a realization, with equal scales if possible."""
    image, hard_data = ensemble.training_image, ensemble.hard_data
    share = min(max(image.shape[-1] / ensemble.grid.nx, 0.5), 2.0)
    caption = f"Training image {image.name or ''}, {describe_shape(image.shape)} cells"
    ti = map_picture(image.indices, image, colours, caption, share=share)
    caption = f"Realization {number + 1} of {ensemble.n}"
    caption += f", with {hard_data.n} hard data" if hard_data.n else ""
    return document.PictureRow(
        (ti, map_picture(ensemble.indices[number], image, colours, caption, hard_data))
    )


def _small_maps(ensemble: Ensemble, colours: Sequence[str]) -> document.PictureRow:
    realizations = ensemble.indices[:MAX_MAPS]
    layer, layer_note = "", ""
    if ensemble.grid.nz is not None:
        middle = ensemble.grid.nz // 2
        realizations, layer_note = realizations[:, middle], f"layer {middle}, from the bottom"
        layer = f", {layer_note}"
    items = tuple(
        document.Picture(
            map_png(one, colours), str(r), f"Realization {r}{layer}", 0.6, pixelated=True
        )
        for r, one in enumerate(realizations, start=1)
    )
    words = "; ".join(filter(None, [_first(len(realizations), ensemble), layer_note]))
    return document.PictureRow(items, words[:1].upper() + words[1:], columns=6)


def _first(n: int, ensemble: Ensemble) -> str:
    return "" if n == ensemble.n else f"The first {n} of {ensemble.n} realizations"


def _e_type_maps(ensemble: Ensemble, facies: int) -> document.PictureRow:
    """Return pictures of a facies' probability and of the entropy in each cell."""
    image = ensemble.training_image
    e_type = etype(ensemble)
    probability = f"Probability of {image.facies_names[facies]}: dark blue 0, yellow 1"
    entropy = "Entropy: dark blue 0 (all realizations agree), yellow maximum"
    likely = share_picture(e_type.probability[facies], probability)
    return document.PictureRow((likely, share_picture(e_type.entropy, entropy)))


def _checks(ensemble: Ensemble) -> document.Table:
    """Return a table with a line on each check, below the headline."""
    headline, lines = verdicts.describe_checks(
        check_ensemble(ensemble), ensemble.training_image.facies_names
    )
    rows = [(what, verdict.words, verdict.numbers) for _, what, verdict in lines]
    return document.Table(("check", "verdict", "largest difference"), tuple(rows), str(headline))


def _curve_charts(ensemble: Ensemble, facies: int) -> tuple[document.PictureRow, ...]:
    """Return charts of the variograms and connectivity functions of a facies along each axis."""
    image = ensemble.training_image
    name, code, rows = image.facies_names[facies], int(image.codes[facies]), []
    for statistic in STATISTICS:
        bundles, notes = {}, []
        for way in axes_of(ensemble.grid.shape):
            bundles[way] = bundle_of(ensemble, statistic, facies, way)
            fit = fit_curve(ensemble, statistic, code, way)
            notes.append(f"{verdicts.way_name(way)}: {verdicts.describe_curve(fit, statistic)}")
        each = [curves for b in bundles.values() for curves in (b.each.max(), b.reference.max())]
        top = 1.1 * float(np.nanmax(each)) or 1.0
        charts = [
            bundle_chart(b, statistic, way, name, top=top, height=240) for way, b in bundles.items()
        ]
        caption = f"{statistic.capitalize()} of {name}. {'. '.join(notes)}. {caption_of(ensemble)}."
        rows.append(document.PictureRow(tuple(charts), caption))
    return tuple(rows)


def _measures(ensemble: Ensemble, facies: int) -> document.Table:
    measured = measure(ensemble, int(ensemble.training_image.codes[facies]))
    rows = [
        (row.title, row.image, row.realizations, row.verdict)
        for row in verdicts.describe_measures(measured)
    ]
    return document.Table(verdicts.MEASURES_HEAD, tuple(rows), verdicts.HOW_MEASURED)


def _flow(ensemble: Ensemble, facies: int) -> document.Table:
    """Return a table of the flow efficiency of a facies along each axis."""
    code = int(ensemble.training_image.codes[facies])
    flow_fit = fit_flow(ensemble, code, max_cells=MAX_FLOW_CELLS)
    rows = []
    for axis, way in enumerate(axes_of(ensemble.grid.shape)):
        each = flow_fit.each[:, axis]
        reference = f"{flow_fit.reference[axis]:.3f}".replace("nan", "–")
        spread = f"{each.mean():.3f} ({each.min():.3f} to {each.max():.3f})" if len(each) else "–"
        verdict = str(verdicts.describe_flow(flow_fit, axis))
        rows.append((verdicts.way_name(way), reference, spread, verdict))
    words = (
        "E is the effective conductivity divided by the arithmetic mean if the facies conducts "
        f"10 000 times as well as all others: 1 for layers along the flow. {len(flow_fit.each)} of "
        f"{ensemble.n} realizations were solved as a whole, or in their "
        "largest square without inactive cells; mean (minimum to maximum). Images, "
        "grids and crops that need more than seconds are not solved here, but on the page Validate."
    )
    head = ("axis", "E of the TI", "E of realizations", "beside crops of the TI")
    return document.Table(head, tuple(rows), words)


def _times_and_proportions(ensemble: Ensemble, colours: Sequence[str]) -> document.PictureRow:
    image, milliseconds = ensemble.training_image, 1000 * ensemble.cpu_seconds
    times = times_chart(milliseconds, float(milliseconds.mean()), LIGHT, height=240)
    shares = proportions_chart(
        image.facies_names, image.proportions, ensemble.proportions, colours, LIGHT
    )
    title, alt = "Facies proportions", "Facies proportions of image and realizations"
    legend = (("training image", LIGHT.reference),)
    time = "CPU time of each realization"
    charts = document.Chart(times, time, time), document.Chart(shares, title, alt, legend)
    return document.PictureRow(charts, f"{caption_of(ensemble)}.")


def _table_of_realizations(ensemble: Ensemble) -> document.Table:
    shares, wrong = 100 * ensemble.proportions[:MAX_REPORTED], ensemble.n_mismatched
    rows = []
    for r, row in enumerate(shares):
        milliseconds = three_digits(1000 * ensemble.cpu_seconds[r])
        rows.append((str(r + 1), milliseconds, str(wrong[r]), *(f"{share:.1f}" for share in row)))
    names = (f"{name} (%)" for name in ensemble.training_image.facies_names)
    header = ("realization", "CPU time (ms)", "data wrong", *names)
    return document.Table(header, tuple(rows), _first(len(rows), ensemble))


def _parameters(ensemble: Ensemble) -> document.Table:
    rows = []
    for row, setting in zip(parameter_table(), fields_of("parameters"), strict=True):
        value = setting.value_in({"parameters": ensemble.parameters})
        changed = "" if str(value) == row["default"] else "changed"
        rows.append((row["name"], row["symbol"], setting.write(value), changed))
    return document.Table(("parameter", "in the paper", "value", ""), tuple(rows))


def _reproduction(
    ensemble: Ensemble, choices: Choices, link: str, recipe: Recipe
) -> tuple[document.Block, ...]:
    blocks: list[document.Block] = [document.Text(REVISED)] if ensemble.revised else []
    blocks.append(document.Code(link, "The link"))
    missing = parts_left_out(choices)
    if missing:
        words = f"The link does not contain {' and '.join(missing)}. Use the project file instead."
        blocks.append(document.Text(words))
    beside = "; the project file must be in the same folder"
    python = f"In Python{beside if recipe.python_needs_project else ''}"
    command = f"On the command line{beside if recipe.command_needs_project else ''}"
    return (*blocks, document.Code(recipe.python, python), document.Code(recipe.command, command))
