"""Compare images of one surface, taken from one place, in the order of time.

They are matrices of degrees Celsius as CSV, or radiometric JPEG (extra 'flir', not verified on a
real file). Shown are the difference of the last to the first, the means of regions over time, and
on request what they have to do with the drift of a run.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermaxis import __version__, report, thermal
from thermaxis.cli._arguments import add_figures, add_json, adder, number, refuse_alone
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._reading import ABOUT_TABLES, add_reading, reading_of
from thermaxis.cli.axis._field_drift import DriftAtImages, drift_at_images
from thermaxis.codes import Message, remark
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_field_csv, read_flir, read_regions
from thermaxis.files.images import is_jpeg
from thermaxis.report.tables import Part, Section, Table, Value, messages_of, rows_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
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
        number("emissivity above 0 and at most 1", 1e-9, 1.0),
    )
    add(
        "--reflected-temperature C",
        "temperature of the surroundings that the surface reflects, in degrees Celsius",
        number("temperature in degrees Celsius", -273.15, 5000.0),
    )
    add(
        "--regions FILE",
        "rectangles whose means are shown, TOML (default: the whole image and its quarters)",
        Path,
    )
    millimetres = number("number of millimetres", 1e-6, 1e6)
    add("--scale MM", "millimetres of one pixel (default: pixels)", millimetres)
    add(
        "--times H",
        "one number of hours for each image, named after the images; with --run from its"
        " first reading",
        number("number of hours", -1e6, 1e6),
        nargs="+",
    )
    add(
        "--run FILE",
        "positioning run whose drift is set beside the images; with three images or more"
        " within the run, correlations",
        Path,
    )
    add_reading(parser)


def run(arguments: argparse.Namespace) -> int:
    """Compare the images and show the result."""
    _check(arguments)
    fields = [_read(path, arguments) for path in arguments.images]
    time_s = None if arguments.times is None else [3600.0 * hours for hours in arguments.times]
    regions = None
    if arguments.regions is not None:
        regions = read_regions(arguments.regions, mm_per_pixel=arguments.scale)
    result = thermal.evaluate_thermal_fields(fields, regions=regions, time_s=time_s)
    drift = None
    if arguments.run is not None:
        drift = drift_at_images(arguments.run, result, reading_of(arguments))
    warnings = [*_emissivity_warnings(arguments), *result.warnings]
    warnings += () if drift is None else drift.warnings
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
    """Refuse what cannot be, before anything is read or written."""
    if len(arguments.images) < 2:
        raise ConfigurationError("too_few_images", key="IMAGE", images=len(arguments.images))
    refuse_alone(arguments, "--run", *ABOUT_TABLES)
    check_outputs([("--json", arguments.json)], arguments.images, charts=arguments.figures)


def _read(path: Path, arguments: argparse.Namespace) -> thermal.ThermalField:
    emissivity, reflected = arguments.emissivity, arguments.reflected_temperature
    if _starts_as_jpeg(path):
        return read_flir(path, emissivity=emissivity, reflected_c=reflected)
    refuse_alone(arguments, "--reflected-temperature", "--emissivity")
    refuse_alone(arguments, "--emissivity", "--reflected-temperature")
    field = read_field_csv(path)
    if emissivity is None or emissivity == 1.0:
        return field
    values = thermal.correct_emissivity(
        field.temperature_c, emissivity=emissivity, reflected_c=reflected
    )
    return replace(field, temperature_c=values)


def _starts_as_jpeg(path: Path) -> bool:
    if not path.is_file():  # reading says what is wrong
        return False
    with path.open("rb") as stream:
        return is_jpeg(stream.read(3))


def _emissivity_warnings(arguments: argparse.Namespace) -> Iterator[Message]:
    emissivity, reflected = arguments.emissivity, arguments.reflected_temperature
    if emissivity is None or reflected is None or emissivity == 1.0:
        return
    yield remark("emissivity_corrected", emissivity=emissivity, reflected_c=reflected)
    if emissivity < 0.6:
        yield remark("emissivity_low")


def described(
    result: thermal.ThermalFieldsResult,
    drift: DriftAtImages | None,
    warnings: Sequence[Message],
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
        *messages_of("warnings", warnings, "warning"),
    ]


def _spread(values: thermal.FloatArray, unit: str, sign: str = "") -> list[Value]:
    return [
        Value(f"min_{unit}", np.nanmin(values), "lowest", f"{sign}.2f"),
        Value(f"mean_{unit}", np.nanmean(values), "mean", f"{sign}.2f"),
        Value(f"max_{unit}", np.nanmax(values), "highest", f"{sign}.2f"),
        Value("missing", int(np.count_nonzero(np.isnan(values))), "missing"),
    ]


def _images(result: thermal.ThermalFieldsResult, title: str) -> Iterator[Part]:
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


def _regions(result: thermal.ThermalFieldsResult) -> Table:
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


def _correlation(one: thermal.RegionDrift, unit: str) -> list[Value]:
    return [
        Value("region", one.region, "region"),
        Value("correlation", one.correlation, "correlation", "+.3f"),
        Value("p_value", one.p_value, "p", ".2g"),
        Value("per_k", one.per_k, f"{unit} per K", "+.2f"),
    ]
