"""Every public function that takes a study or its results, called with an ensemble.

`CONSUMERS` has one call for each function; `WITHOUT_STUDIES` names the functions that take neither.
`public_functions()` lists all public functions, so that a new function must be in one of them.
"""

from __future__ import annotations

import inspect
import pkgutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ccwsim import (
    Ensemble,
    HardData,
    TrainingImage,
    experiments,
    figures,
    flow,
    io,
    metrics,
)
from ccwsim.experiments import comparison, plan, timing, two_point
from ccwsim.experiments.sweep import sweep
from ccwsim.experiments.trials import Trial
from ccwsim.figures import LIGHT, Bundle, Dots, Group, LayerData, Strip
from ccwsim.io import training_image_as_bytes
from ccwsim.model.study import Study
from ccwsim.report.document import report_html
from ccwsim.report.pictures import bundle_of_curves, layer_data, layers_bundle
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice, Shown, Upload
from ccwsim.sharing.link import link_of, own_choices, read_link
from ccwsim.sharing.recipe import reproduction_recipe
from ccwsim.sharing.study_report import study_report


@dataclass(frozen=True)
class Case:
    """An ensemble, and arguments for the calls of functions."""

    study: Study
    ensemble: Ensemble
    folder: Path

    @property
    def image(self) -> TrainingImage:
        return self.study.training_image

    @property
    def data(self) -> HardData:
        return self.ensemble.hard_data

    @property
    def code(self) -> int:
        return int(self.image.codes[-1])

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.image.facies_names)

    @property
    def colours(self) -> list[str]:
        return figures.facies_colours(self.image)

    @property
    def conductivity(self) -> dict[int | str, float]:
        return {code: 10.0 ** -(4 + k) for k, code in enumerate(self.image.codes.tolist())}

    @property
    def truth(self) -> np.ndarray:
        """A field of the shape of the grid without unknown cells."""
        indices = np.asarray(self.ensemble.indices[0])
        return self.image.codes[np.minimum(indices, self.image.n_facies - 1)]

    @property
    def indices(self) -> np.ndarray:
        """Facies indices of the first realization, or of its middle layer."""
        first = np.asarray(self.ensemble.indices[0])
        return first if first.ndim == 2 else first[len(first) // 2]

    @cached_property
    def active_cell(self) -> tuple[int, ...]:
        active = self.ensemble.active
        shape = self.study.grid.shape
        cells = np.argwhere(np.ones(shape, bool) if active is None else active)
        return tuple(cells[len(cells) // 2].tolist())

    @cached_property
    def etype(self) -> metrics.EType:
        return metrics.etype(self.ensemble)

    @cached_property
    def flow(self) -> flow.Flow:
        conductivity = self.ensemble.property(self.conductivity)[0]
        return flow.darcy(conductivity, self.study.grid, west_east=(1.0, 0.0))

    @cached_property
    def curves(self) -> Bundle:
        of_image = metrics.variogram(self.image, self.code, "E-W", [1, 2])
        each = metrics.variogram(self.ensemble, self.code, "E-W", [1, 2])
        return bundle_of_curves(np.array([1.0, 2.0]), of_image.gamma[0], each.gamma)

    @cached_property
    def histogram(self) -> metrics.PatternHistogram:
        return metrics.pattern_histogram(self.ensemble.realizations[0], self.image.codes, 2)

    @cached_property
    def anodi(self) -> metrics.Anodi:
        return metrics.anodi({"a": self.ensemble, "b": self.ensemble}, self.image, factors=[1])

    @cached_property
    def calibration(self) -> metrics.Calibration:
        return metrics.calibration(self.etype, self.truth)

    @property
    def trial(self) -> Trial:
        return Trial(self.image, self.study.grid, self.study.parameters, self.data)

    @cached_property
    def comparison(self) -> comparison.Comparison:
        p, study = self.study.parameters, self.study
        inputs = self.image, study.grid, {"a": p, "b": p}, self.data, 2
        return comparison.compare(*inputs, secondary=study.secondary)

    @property
    def dots(self) -> Dots:
        known = np.searchsorted(self.image.codes, self.data.facies)
        return Dots(self.data.cells, [self.colours[k] for k in known], known < 0)

    @property
    def choices(self) -> Choices:
        """The study as the choices of the dashboard."""
        upload = Upload("image.npy", training_image_as_bytes(self.image, "npy"))
        volume = (("volume", True),) if self.image.n_dimensions == 3 else ()
        secondary, data = self.study.secondary, self.study.hard_data
        return Choices(
            ImageChoice(upload=upload, answers=volume),
            DataChoice("placed", placed=data) if data.n else DataChoice(),
            self.study.grid,
            self.study.parameters,
            self.ensemble.n,
            self.study.seed,
            GuideChoice(saved=secondary) if secondary else GuideChoice(),
        )


def written(write: Callable[..., Any], *values: Any, **options: Any) -> bytes:
    """Return the content that `write` writes to a file object."""
    file = BytesIO()
    write(file, *values, **options)
    return file.getvalue()


def in_formats(case: Case, write: Callable[[str], Any], formats: Iterable[str]) -> dict[str, Any]:
    """Return the results of all formats; pictures and GeoTIFF show maps only."""
    without = {"png", "tif"} if case.study.grid.nz else set()
    without |= {"png", "grdecl"} if case.image.values else set()
    return {name: write(name) for name in formats if name not in without}


def report_of(case: Case) -> str:
    """Return the report of a study."""
    choices, link = case.choices, "http://localhost:8501"
    how = reproduction_recipe(choices, case.study, "study.zip")
    shown = Shown(0, 0)
    return report_html(
        study_report(case.ensemble, choices, shown, case.colours, ("one fact",), link, how)
    )


def linked(case: Case) -> tuple[Choices, Shown, tuple[str, ...]]:
    """Return the choices in the link of a study."""
    own = own_choices(case.choices)
    choices, shown, notes = read_link(link_of(case.choices), own)
    assert (choices, notes) == (case.choices, ())
    return choices, shown, notes


def parameters_again(case: Case) -> Any:
    """Return the parameters, written as JSON and read again."""
    parameters = io.parameters_from_json(io.parameters_to_json(case.study.parameters))
    assert parameters == case.study.parameters
    return parameters


METRICS: dict[str, Callable[[Case], Any]] = {
    "anodi": lambda c: c.anodi,
    "band": lambda c: metrics.band(c.curves.each),
    "calibration": lambda c: c.calibration,
    "check_ensemble": lambda c: metrics.check_ensemble(c.ensemble),
    "classical_scaling": lambda c: metrics.classical_scaling(1 - np.eye(3)),
    "coarsened": lambda c: metrics.coarsened(c.ensemble.realizations[0], 2),
    "connected_geobodies": lambda c: metrics.connected_geobodies(
        c.ensemble[0], int(np.nanmin(c.ensemble[0]))
    ),
    "connectivity": lambda c: metrics.connectivity(c.ensemble, c.code),
    "copying": lambda c: metrics.copying(c.ensemble.sources[0], c.image.shape, c.ensemble.active),  # type: ignore[index]
    "crop_shape": lambda c: metrics.crop_shape(c.image.shape, c.study.grid.shape),
    "data_match": lambda c: metrics.data_match(c.ensemble, c.data),
    "default_parameters": lambda c: metrics.default_parameters(c.image),
    "diagnose": lambda c: metrics.diagnose(c.image),
    "differing_share": lambda c: metrics.differing_share(c.ensemble),
    "direction_error": lambda c: metrics.direction_error(c.ensemble),
    "divergences": lambda c: metrics.divergences([[c.histogram], [c.histogram]]),
    "entropy": lambda c: metrics.entropy(c.etype.probability),
    "etype": lambda c: c.etype,
    "facies_counts": lambda c: metrics.facies_counts(c.ensemble),
    "etype_of_counts": lambda c: metrics.etype_of_counts(
        metrics.facies_counts(c.ensemble), c.image.codes
    ),
    "feature_spacing": lambda c: metrics.feature_spacing(c.image),
    "fit_curve": lambda c: metrics.fit_curve(c.ensemble, "variogram", c.code),
    "fit_data": lambda c: metrics.fit_data(c.image, c.data, c.study.grid, n_null=10),
    "fit_flow": lambda c: metrics.fit_flow(c.ensemble, c.code),
    "fit_geobodies": lambda c: metrics.fit_geobodies(c.ensemble, c.code),
    "fit_joins": lambda c: metrics.fit_joins(c.ensemble, c.code),
    "fit_patterns": lambda c: metrics.fit_patterns(c.ensemble),
    "fit_proportions": lambda c: metrics.fit_proportions(c.ensemble),
    "geobody_statistics": lambda c: metrics.geobody_statistics(c.ensemble, c.code),
    "granulometry": lambda c: metrics.granulometry(c.image, c.code),
    "js_divergence": lambda c: metrics.js_divergence(c.histogram, c.histogram),
    "judge": lambda c: metrics.judge(c.ensemble),
    "leave_out": lambda c: metrics.leave_out(c.study, 2, 2),
    "local_direction": lambda c: metrics.local_direction(c.ensemble),
    "main_direction": lambda c: metrics.main_direction(c.image),
    "measure": lambda c: metrics.measure(c.ensemble, c.code),
    "metric_scaling": lambda c: metrics.metric_scaling(1 - np.eye(3)),
    "pattern_distance": lambda c: metrics.pattern_distance(c.ensemble, c.image),
    "pattern_histogram": lambda c: c.histogram,
    "proportions": lambda c: metrics.proportions(c.ensemble),
    "pyramid_histograms": lambda c: metrics.pyramid_histograms(c.ensemble, factors=[1, 2]),
    "rank_images": lambda c: metrics.rank_images([c.image, c.image], c.data),
    "rank_variants": lambda c: metrics.rank_variants(c.image, c.data),
    "recommended_parameters": lambda c: metrics.recommended_parameters(c.image, c.study.parameters),
    "reliability": lambda c: metrics.reliability(c.ensemble),
    "score_reference": lambda c: metrics.score_reference(c.etype, c.truth, c.ensemble.n),
    "stationarity": lambda c: metrics.stationarity(c.image),
    "templates_that_fit": lambda c: metrics.templates_that_fit(
        c.image.shape, c.study.parameters.template_size
    ),
    "transiograms": lambda c: metrics.transiograms(c.ensemble),
    "unseen_patterns": lambda c: metrics.unseen_patterns(c.ensemble, c.image),
    "variogram": lambda c: metrics.variogram(c.ensemble, c.code),
    "variogram_map": lambda c: metrics.variogram_map(c.ensemble, c.code, 2),
    "variogram_of_values": lambda c: (
        metrics.variogram_of_values(c.ensemble) if c.image.values else None
    ),
    "vertical_proportions": lambda c: metrics.vertical_proportions(c.ensemble),
    "warn_of_edges": lambda c: metrics.warn_of_edges(c.study.parameters, c.image),
    "warn_of_level": lambda c: metrics.warn_of_level(
        c.study.parameters, c.study.grid.shape, c.data.n
    ),
    "warn_of_probabilities": lambda c: (
        metrics.warn_of_probabilities(c.study.secondary, c.image, c.study.parameters)
        if c.study.secondary and c.study.secondary.probabilities is not None
        else None
    ),
    "warn_of_reliability": lambda c: metrics.warn_of_reliability(c.calibration, c.names[-1]),
}
FLOW: dict[str, Callable[[Case], Any]] = {
    "capture_probability": lambda c: flow.capture_probability(
        c.ensemble, c.conductivity, c.active_cell, 1e-9, west_east=(1.0, 0.0)
    ),
    "darcy": lambda c: c.flow,
    "effective_k": lambda c: flow.effective_k(c.ensemble, c.conductivity),
    "flow_efficiency": lambda c: flow.flow_efficiency(np.asarray(c.ensemble.indices[0]) == 0, 0),
    "over": lambda c: flow.over(c.ensemble, lambda cells: int(cells.indices.sum())),
    "starts_at_inflow": lambda c: flow.starts_at_inflow(c.flow, 3),
    "tracks": lambda c: flow.tracks(c.flow, flow.starts_at_inflow(c.flow, 3)),
    "travel_times": lambda c: flow.travel_times(c.ensemble, c.conductivity, n_particles=3),
}
FIGURES: dict[str, Callable[[Case], Any]] = {
    "breakthrough_chart": lambda c: figures.breakthrough_chart(
        flow.travel_times(c.ensemble, c.conductivity, n_particles=3),
        *(0, LIGHT),
        height=200,
        accent="#000000",
    ),
    "calibration_chart": lambda c: figures.calibration_chart(
        c.calibration.forecast, c.calibration.observed, c.calibration.count, LIGHT
    ),
    "compared_proportions_chart": lambda c: figures.compared_proportions_chart(
        c.names, c.image.proportions, {"a": c.ensemble.proportions}, LIGHT
    ),
    "compared_times_chart": lambda c: figures.compared_times_chart(
        {"a": c.ensemble.cpu_seconds}, c.ensemble.cpu_seconds[:1], ["a"], LIGHT
    ),
    "conductivity_chart": lambda c: figures.conductivity_chart(
        flow.effective_k(c.ensemble, c.conductivity).each, {}, LIGHT, unit="m/s", height=200
    ),
    "contact_sheet": lambda c: figures.contact_sheet(np.stack([c.indices, c.indices]), c.colours),
    "curves_chart": lambda c: figures.curves_chart(c.curves, LIGHT, y_title="γ"),
    "data_map_png": lambda c: figures.data_map_png(c.indices, c.colours),
    "data_png": lambda c: figures.data_png(
        c.data.cells[:, -2:],
        np.searchsorted(c.image.codes, c.data.facies),
        c.study.grid.shape[-2:],
        c.colours,
        longest=100,
    ),
    "data_status_chart": lambda c: figures.data_status_chart(
        ["a"], np.array([[0.2, 0.8, 0.0, 0.0]])[:, :4], LIGHT
    ),
    "divergence_chart": lambda c: figures.divergence_chart(
        c.anodi.factors, c.anodi.between[0], c.anodi.within[0], LIGHT
    ),
    "facies_colours": lambda c: c.colours,
    "geobody_sizes_chart": lambda c: figures.geobody_sizes_chart(c.curves, LIGHT, y_title="size"),
    "lag_map_chart": lambda c: figures.lag_map_chart(
        metrics.variogram_map(c.image, c.code, 2).lags,
        metrics.variogram_map(c.image, c.code, 2).gamma[0],
        LIGHT,
        name="γ",
        largest=1.0,
    ),
    "map_png": lambda c: figures.map_png(c.indices, c.colours),
    "mds_chart": lambda c: figures.mds_chart(
        np.zeros(2), [Group("a", np.ones((2, 2)), c.colours[0])], LIGHT
    ),
    "placement_svg": lambda c: figures.placement_svg(
        c.data.cells[:, -2:], [None] * c.data.n, c.study.grid.shape[-2:]
    ),
    "proportions_chart": lambda c: figures.proportions_chart(
        c.names, c.image.proportions, c.ensemble.proportions, c.colours, LIGHT
    ),
    "slices_of": lambda c: figures.slices_of(c.ensemble.indices[0], dots=c.dots),
    "slices_png": lambda c: figures.slices_png(c.ensemble.indices[0], c.colours, dots=c.dots),
    "sparkline": lambda c: figures.sparkline(c.curves.each, c.curves.reference, LIGHT),
    "steps_of": lambda c: figures.steps_of(c.ensemble.probability(c.code)),
    "strip_chart": lambda c: figures.strip_chart(
        Strip("share", c.ensemble.proportions[:, 0], 0.5), LIGHT, colour=c.colours[0]
    ),
    "tile_size": lambda c: figures.tile_size(c.study.grid.shape[-2:], 96),
    "times_chart": lambda c: figures.times_chart(c.ensemble.cpu_seconds, 0.1, LIGHT),
    "transiogram_chart": lambda c: figures.transiogram_chart(
        {(0, 0): c.curves}, [0], [0], c.names, LIGHT
    ),
    "vertical_proportions_chart": lambda c: figures.vertical_proportions_chart(
        layers_bundle(c.ensemble, 0),
        LIGHT,
        x_title="share",
        data=layer_data(c.data, c.study.grid, c.code) if c.study.grid.nz else _no_layers(),
    ),
}
IO: dict[str, Callable[[Case], Any]] = {
    "flopy_as_zip": lambda c: io.flopy_as_zip(c.ensemble, c.conductivity, west_east=(1.0, 0.0)),
    "grdecl_as_zip": lambda c: io.grdecl_as_zip("study", c.ensemble, c.conductivity),
    "hard_data_as_bytes": lambda c: in_formats(
        c, lambda name: io.hard_data_as_bytes(c.data, name, c.study.grid), ("csv", "gslib")
    ),
    "import_hard_data": lambda c: io.import_hard_data(
        BytesIO(io.hard_data_as_bytes(c.data, "csv", c.study.grid)), c.study.grid, c.image
    ),
    "maps_as_bytes": lambda c: in_formats(
        c,
        lambda name: io.maps_as_bytes({"E": c.ensemble.probability(c.code)}, c.study.grid, name),
        io.MAP_FORMATS,
    ),
    "parameters_from_json": parameters_again,
    "parameters_to_json": lambda c: io.parameters_to_json(c.study.parameters),
    "read_hard_data": lambda c: io.read_hard_data(
        BytesIO(io.hard_data_as_bytes(c.data, "csv", c.study.grid)), c.study.grid, c.image
    ),
    "read_realizations": lambda c: io.read_realizations(
        BytesIO(io.realizations_as_bytes(c.ensemble, "npz"))
    ),
    "read_training_image": lambda c: io.read_training_image(
        BytesIO(io.training_image_as_bytes(c.image, "npy")),
        volume=c.image.n_dimensions == 3,
        continuous=bool(c.image.values),
    ),
    "realizations_as_bytes": lambda c: in_formats(
        c,
        lambda name: io.realizations_as_bytes(c.ensemble, name, colours=c.colours),
        io.REALIZATION_FORMATS,
    ),
    "to_flopy": lambda c: io.to_flopy(
        c.ensemble, c.conductivity, c.folder / "modflow", west_east=(1.0, 0.0)
    ),
    "training_image_as_bytes": lambda c: in_formats(
        c,
        lambda name: io.training_image_as_bytes(c.image, name, colours=c.colours),
        ("npy", "gslib", "sgems", "dat", "grdecl", "png"),
    ),
    "write_grdecl": lambda c: io.write_grdecl(
        c.folder / "study.grdecl", c.ensemble, c.conductivity
    ),
    "write_hard_data": lambda c: written(io.write_hard_data, c.data, c.study.grid, format="csv"),
    "write_maps": lambda c: written(
        io.write_maps, {"E": c.etype.probability[0]}, c.study.grid, format="gslib"
    ),
    "write_realizations": lambda c: written(io.write_realizations, c.ensemble, format="npz"),
    "write_training_image": lambda c: written(io.write_training_image, c.image, format="npy"),
}
EXPERIMENTS: dict[str, Callable[[Case], Any]] = {
    "add_curves": lambda c: comparison.add_curves(c.comparison, c.code),
    "compare": lambda c: c.comparison,
    "describe_advice": lambda c: plan.describe_advice(c.image, c.study.parameters),
    "label": lambda c: plan.label(c.study.parameters, ["n_candidates"]),
    "plan_sweep": lambda c: plan.plan_sweep(
        c.study.parameters, {"n_candidates": [1, 2]}, c.image.shape
    ),
    "suggested_ranges": lambda c: plan.suggested_ranges(c.study.parameters, c.image),
    "expected_seconds": lambda c: timing.expected_seconds([c.trial]),
    "simulate_two_point": lambda c: two_point.simulate_two_point(c.image, c.study.grid, 2),
    "sweep": lambda c: sweep(
        *(c.image, c.study.grid, [c.study.parameters], c.data, 2), secondary=c.study.secondary
    ),
    "time_trial": lambda c: timing.time_trial(c.trial, 1),
    "time_trials": lambda c: list(timing.time_trials([c.trial], 1)),
    "typical": lambda c: timing.typical(c.trial),
    "typical_seconds": lambda c: timing.typical_seconds(
        c.study.parameters, c.image.shape, c.study.grid.shape
    ),
    "value_of": lambda c: plan.value_of(c.study.parameters, "template_size"),
    "varied": lambda c: plan.varied([c.study.parameters]),
}
OTHERS: dict[str, Callable[[Case], Any]] = {
    "link": linked,
    "report": report_of,
    "Ensemble.plot": lambda c: c.ensemble.plot(),
    "Ensemble.to_xarray": lambda c: c.ensemble.to_xarray(),
    "Ensemble._repr_html_": lambda c: c.ensemble._repr_html_(),
    "TrainingImage.plot": lambda c: c.image.plot(),
    "TrainingImage._repr_html_": lambda c: c.image._repr_html_(),
    "HardData.plot": lambda c: c.data.plot(),
    "HardData._repr_html_": lambda c: c.data._repr_html_(),
    "Secondary.describe": lambda c: c.study.secondary and c.study.secondary.describe(),
}
CONSUMERS = {
    f"{folder}.{name}": function
    for folder, functions in (
        ("metrics", METRICS),
        ("flow", FLOW),
        ("figures", FIGURES),
        ("io", IO),
        ("experiments", EXPERIMENTS),
        ("others", OTHERS),
    )
    for name, function in functions.items()
}
WITHOUT_STUDIES = {
    "metrics": {"axes_of"},
    "flow": {"at_percentiles"},
    "figures": {
        *("figure_json", "lines_chart", "mds_title", "mixed", "packed_plotly", "ramp"),
        *("repetition_chart", "sweep_chart", "timings_chart"),
    },
    "io": {
        *("angles_along", "can_write", "fit_grid", "guess_answers"),
        *("import_wells", "inspect", "limited", "millidarcy", "place_points", "preview_points"),
        *("preview_wells", "read_active", "read_colours", "read_geometry", "read_grid"),
        *("read_lines", "read_points", "read_probabilities", "read_values", "read_well_points"),
        *("read_wells", "resolve_points", "upload_limits"),
    },
    "experiments": {
        *("compile_in_background", "data_trials", "growth"),
        *("nearest_on_front", "pareto_front", "recommended", "run_trials", "usual_work"),
    },
}
"""Functions that take files, settings or numbers, but neither a study nor its results."""


def public_functions() -> set[str]:
    """Return all public functions of the folders in `WITHOUT_STUDIES`, as "folder.name"."""
    modules = [(name, import_module(f"ccwsim.{name}")) for name in WITHOUT_STUDIES]
    files = pkgutil.iter_modules(experiments.__path__)
    modules += [("experiments", import_module(f"ccwsim.experiments.{file.name}")) for file in files]
    names = set()
    for folder, module in modules:
        for name, value in vars(module).items():
            function = inspect.unwrap(value) if callable(value) else None
            if not inspect.isfunction(function) or name.startswith("_"):
                continue
            home = module.__name__ if folder == "experiments" else f"ccwsim.{folder}."
            if function.__module__.startswith(home):
                names.add(f"{folder}.{name}")
    return names


def _no_layers() -> LayerData:
    return LayerData(np.zeros(0), np.zeros(0), np.zeros(0, int))
