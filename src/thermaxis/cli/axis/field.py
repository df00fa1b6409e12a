"""``thermaxis field``: thermal fields of a surface before and after, compared in plan view."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from thermaxis import report
from thermaxis.cli._json import show
from thermaxis.cli.axis._field_drift import drift_at_images
from thermaxis.cli.axis._field_results import described
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_field_csv, read_flir, read_regions
from thermaxis.files.images import is_jpeg
from thermaxis.thermal import ThermalField, correct_emissivity, evaluate_thermal_fields

_DESCRIPTION = """\
Read two or more images of one surface, taken from one place: matrices of degrees Celsius as CSV, or
radiometric JPEG (extra 'flir', not verified on a real file). Show the difference of the last to the
first, the means of regions over time, and on request what they have to do with the drift of a run.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
    add = parser.add_argument
    add(
        "images",
        metavar="IMAGE",
        type=Path,
        nargs="+",
        help="two images or more, in the order of time: CSV or radiometric JPEG",
    )
    add("--json", metavar="FILE|-", help="write the result as JSON; - for standard output alone")
    add("--figures", metavar="DIR", type=Path, help="write the charts as PNG and SVG, and CSV")
    add(
        "--emissivity",
        metavar="E",
        type=float,
        help="emissivity of the surface, for images taken with an emissivity of 1",
    )
    add(
        "--reflected-temperature",
        metavar="C",
        type=float,
        help="temperature of the surroundings that the surface reflects, in degrees Celsius",
    )
    add("--regions", metavar="FILE", type=Path, help="rectangles whose means are shown (TOML)")
    add("--scale", metavar="MM", type=float, help="millimetres of one pixel (default: pixels)")
    add(
        "--times",
        metavar="H",
        nargs="+",
        help="time of each image in hours; with --run, from its first reading",
    )
    add("--run", metavar="FILE", type=Path, help="positioning run whose drift is set beside them")


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


def _refused(what: str, where: str, remedy: str) -> ConfigurationError:
    return ConfigurationError(what, where=where, remedy=remedy)


def _check(arguments: argparse.Namespace) -> None:
    """Refuse options that cannot be, before anything is read or written."""
    if len(arguments.images) < 2:
        raise _refused("one image has no difference", "field", "Name an image before and one after")
    emissivity, reflected = arguments.emissivity, arguments.reflected_temperature
    if emissivity is not None and not 0.0 < emissivity <= 1.0:
        raise _refused(
            f"{emissivity:g} is no emissivity", "--emissivity", "Give a number above 0, at most 1"
        )
    if reflected is not None and not -273.15 <= reflected < 5000.0:
        raise _refused(
            f"{reflected:g} °C is no temperature", "--reflected-temperature", "Give it in °C"
        )
    if arguments.scale is not None and not 1e-6 < arguments.scale < 1e6:
        raise _refused(
            f"{arguments.scale:g} mm is no size of a pixel",
            "--scale",
            "Give the millimetres of the surface that one pixel shows",
        )
    outputs = [] if arguments.json in (None, "-") else [Path(arguments.json)]
    for path in outputs:
        if any(path.exists() and s.exists() and path.samefile(s) for s in arguments.images):
            raise _refused("this output would overwrite an image", str(path), "Name another file")
    if arguments.figures is not None and arguments.figures.is_file():
        raise _refused(
            "the charts need a folder, and this is a file",
            str(arguments.figures),
            "Name a folder; it is made if it does not exist",
        )


def _times_s(words: Sequence[str] | None) -> list[float] | None:
    if words is None:
        return None
    hours: list[float] = []
    for word in ",".join(words).split(","):
        try:
            hours.append(float(word))
        except ValueError:
            raise _refused(
                f"'{word}' is not a number of hours",
                "--times",
                "Name the images first, then --times 0 3.5 7",
            ) from None
        if not abs(hours[-1]) < 1e6:
            raise _refused(f"{word} h is no time", "--times", "Give hours from the first reading")
    return [3600.0 * hour for hour in hours]


def _read(path: Path, arguments: argparse.Namespace) -> ThermalField:
    emissivity, reflected = arguments.emissivity, arguments.reflected_temperature
    if _starts_as_jpeg(path):
        return read_flir(path, emissivity=emissivity, reflected_c=reflected)
    if (emissivity is None) != (reflected is None):
        raise _refused(
            "emissivity and reflected temperature belong together",
            "--emissivity" if reflected is None else "--reflected-temperature",
            "Give both, or neither if the camera's software has corrected the image",
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
