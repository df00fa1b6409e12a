"""``thermaxis field``: thermal fields of a surface before and after, compared in plan view."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermaxis import __version__, report
from thermaxis.cli._arguments import add_figures, add_json, adder
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli.axis._field_drift import DriftAtImages, drift_at_images
from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_field_csv, read_flir, read_regions
from thermaxis.files.images import is_jpeg
from thermaxis.report.tables import Part, Section, Table, Value, rows_of
from thermaxis.thermal import (
    FloatArray,
    RegionDrift,
    ThermalField,
    ThermalFieldsResult,
    correct_emissivity,
    evaluate_thermal_fields,
)

_DESCRIPTION = """\
Read two or more images of one surface, taken from one place: matrices of degrees Celsius as CSV, or
radiometric JPEG (extra 'flir', not verified on a real file). Show the difference of the last to the
first, the means of regions over time, and on request what they have to do with the drift of a run.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
    add = adder(parser)
    add(
        "images IMAGE",
        "two images or more, in the order of time: CSV or radiometric JPEG",
        Path,
        nargs="+",
    )
    add_json(parser)
    add_figures(parser)
    add(
        "--emissivity E",
        "emissivity of the surface, above 0, at most 1; for CSV of a camera that was set to 1"
        " (default: no correction; JPEG: what the camera was set to)",
        float,
    )
    add(
        "--reflected-temperature C",
        "temperature of the surroundings that the surface reflects, in degrees Celsius",
        float,
    )
    add(
        "--regions FILE",
        "rectangles whose means are shown, TOML (default: the whole image and its quarters)",
        Path,
    )
    add("--scale MM", "millimetres of one pixel (default: pixels)", float)
    add(
        "--times H",
        "one number of hours for each image, named after the images; with --run from its"
        " first reading",
        nargs="+",
    )
    add(
        "--run FILE",
        "positioning run whose drift is set beside the images; with three images or more"
        " within the run, correlations",
        Path,
    )


def run(arguments: argparse.Namespace) -> int:
    """Compare the images and show the result."""
    _check(arguments)
    fields = [_read(path, arguments) for path in arguments.images]
    time_s = _times_s(arguments.times)
    regions = None
    if arguments.regions is not None:
        regions = read_regions(arguments.regions, mm_per_pixel=arguments.scale)
    result = evaluate_thermal_fields(fields, regions=regions, time_s=time_s)
    drift = None if arguments.run is None else drift_at_images(arguments.run, result)
    warnings = [*_emissivity_warnings(arguments), *result.warnings]
    if drift is not None:
        warnings += drift.warnings
    if arguments.figures is not None:
        report.write_field_figures(result, arguments.figures, mm_per_pixel=arguments.scale)
    options = {
        "mm_per_pixel": arguments.scale,
        "emissivity": arguments.emissivity,
        "reflected_temperature_c": arguments.reflected_temperature,
    }
    written = [] if arguments.figures is None else [arguments.figures]
    show(described(result, drift, warnings, options), arguments.json, written)
    return 0


def _check(arguments: argparse.Namespace) -> None:
    """Refuse options that cannot be, before anything is read or written."""
    if len(arguments.images) < 2:
        raise ConfigurationError(
            "too_few_images", place=Place(key="IMAGE"), images=len(arguments.images)
        )
    emissivity, reflected = arguments.emissivity, arguments.reflected_temperature
    if emissivity is not None and not 0.0 < emissivity <= 1.0:
        raise ConfigurationError(
            "no_emissivity", place=Place(key="--emissivity"), emissivity=emissivity
        )
    if reflected is not None and not -273.15 <= reflected < 5000.0:
        raise ConfigurationError(
            "outside_range",
            place=Place(key="--reflected-temperature"),
            value=reflected,
            least=-273.15,
            most=5000.0,
        )
    if arguments.scale is not None and not 1e-6 < arguments.scale < 1e6:
        raise ConfigurationError(
            "outside_range", place=Place(key="--scale"), value=arguments.scale, least=1e-6, most=1e6
        )
    check_outputs([("--json", arguments.json)], arguments.images, charts=arguments.figures)


def _times_s(words: Sequence[str] | None) -> list[float] | None:
    if words is None:
        return None
    hours: list[float] = []
    for word in ",".join(words).split(","):
        try:
            hours.append(float(word))
        except ValueError:
            raise ConfigurationError("not_hours", place=Place(key="--times"), text=word) from None
        if not abs(hours[-1]) < 1e6:
            raise ConfigurationError("not_hours", place=Place(key="--times"), text=word)
    return [3600.0 * hour for hour in hours]


def _read(path: Path, arguments: argparse.Namespace) -> ThermalField:
    emissivity, reflected = arguments.emissivity, arguments.reflected_temperature
    if _starts_as_jpeg(path):
        return read_flir(path, emissivity=emissivity, reflected_c=reflected)
    if (emissivity is None) != (reflected is None):
        raise ConfigurationError(
            "option_needs",
            place=Place(key="--emissivity" if reflected is None else "--reflected-temperature"),
            option="--emissivity",
            needed="--reflected-temperature",
        )
    field = read_field_csv(path)
    if emissivity is None or emissivity == 1.0:
        return field
    values = correct_emissivity(field.temperature_c, emissivity=emissivity, reflected_c=reflected)
    return replace(field, temperature_c=values)


def _starts_as_jpeg(path: Path) -> bool:
    if not path.is_file():  # reading says what is wrong
        return False
    with path.open("rb") as stream:
        return is_jpeg(stream.read(3))


def _emissivity_warnings(arguments: argparse.Namespace) -> list[str]:
    emissivity, reflected = arguments.emissivity, arguments.reflected_temperature
    if emissivity is None or reflected is None or emissivity == 1.0:
        return []
    said = [
        (
            f"apparent temperatures were corrected for an emissivity of {emissivity:g} and"
            f" surroundings at {reflected:g} °C; in CSV by fourth powers of the temperature (total"
            " radiation), an approximation of what a camera sees"
        )
    ]
    if emissivity < 0.6:
        said.append(
            "with an emissivity below 0.6 the result depends on the surroundings as much as on the"
            " surface: paint or tape it"
        )
    return said


def described(
    result: ThermalFieldsResult,
    drift: DriftAtImages | None,
    warnings: Sequence[str],
    options: Mapping[str, object],
) -> list[Part]:
    """Return the comparison of images for terminal and JSON."""
    down, across = result.fields[0].shape
    return [
        Value("version", __version__),
        Value("rows", down),
        Value("columns", across),
        *(Value(key, value) for key, value in options.items()),
        *_images(result, f"Thermal fields of {across} x {down} pixels, °C"),
        _regions(result),
        Value("drift", None) if drift is None else Section("drift", list(_drift(drift))),
        Value("warnings", warnings, "warning"),
    ]


def _spread(values: FloatArray, unit: str, sign: str = "") -> list[Value]:
    return [
        Value(f"min_{unit}", np.nanmin(values), "lowest", f"{sign}.2f"),
        Value(f"mean_{unit}", np.nanmean(values), "mean", f"{sign}.2f"),
        Value(f"max_{unit}", np.nanmax(values), "highest", f"{sign}.2f"),
        Value("missing", int(np.count_nonzero(np.isnan(values))), "missing"),
    ]


def _images(result: ThermalFieldsResult, title: str) -> Iterator[Part]:
    rows: list[list[Value]] = []
    for k, field in enumerate(result.fields):
        time_s = None if result.time_s is None else float(result.time_s[k])
        rows.append(
            [
                Value("", f"{k + 1}", ""),
                Value("name", field.name, "image"),
                Value("time_s", time_s),
                Value("", "" if time_s is None else f"{time_s / 3600.0:.2f}", "h"),
                *_spread(field.temperature_c, "c"),
            ]
        )
    change = _spread(result.difference_k, "k", "+")
    last = [Value("", "", ""), Value("", "last minus first, K", "image"), Value("", None)]
    yield Table(title, [*rows, [*last, Value("", "", "h"), *change]], words=2)
    yield Table("", [*rows], key="images")
    yield Section("difference", [value._replace(head=None) for value in change])


def _regions(result: ThermalFieldsResult) -> Table:
    shown = range(len(result.fields)) if len(result.fields) <= 8 else (0, len(result.fields) - 1)
    rows = [
        [
            Value("name", region.name, "region"),
            Value("x_px", [region.left_px, region.right_px]),
            Value("y_px", [region.top_px, region.bottom_px]),
            Value("pixels", int(result.region_pixels[r]), "pixels"),
            Value("mean_c", result.region_mean_c[:, r]),
            *(Value("", result.region_mean_c[k, r], f"image {k + 1}", ".3f") for k in shown),
            Value("change_k", result.region_change_k[r], "change, K", "+.3f"),
        ]
        for r, region in enumerate(result.regions)
    ]
    return Table("Mean temperature of regions, °C", rows, key="regions", words=1)


def _drift(drift: DriftAtImages) -> Iterator[Part]:
    common, slope = drift.common, drift.slope
    places = [*(str(k + 1) for k in range(common.size)), "change"]
    yield Table(
        f"Drift of {drift.name[:60]} (model: {drift.model})",
        rows_of(
            Value("", places, "at image"),
            Value("", [*common, common[-1] - common[0]], f"a(t), {drift.unit}", "+.2f"),
            Value("", [*slope, slope[-1] - slope[0]], f"b(t), {drift.slope_unit}", "+.2f"),
        ),
        words=1,
    )
    yield Value("run", drift.name)
    for key in ("model", "significant", "unit", "slope_unit", "common", "slope"):
        yield Value(key, getattr(drift, key))
    images = drift.relation.images
    yield Value("images", images)
    for key, what, unit, found in (
        ("common", "common drift a(t)", drift.unit, drift.relation.common),
        ("slope", "growth of the axis b(t)", drift.slope_unit, drift.relation.slope),
    ):
        rows = [_correlation(one, unit) for one in found]
        title = f"Region and {what}, {images} images"
        yield Table(title, rows, key=f"correlation_{key}", words=1)


def _correlation(one: RegionDrift, unit: str) -> list[Value]:
    return [
        Value("region", one.region, "region"),
        Value("correlation", one.correlation, "correlation", "+.3f"),
        Value("p_value", one.p_value, "p", ".2g"),
        Value("per_k", one.per_k, f"{unit} per K", "+.2f"),
    ]
