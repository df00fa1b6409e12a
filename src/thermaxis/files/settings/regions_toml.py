"""Regions of a thermal field, from a file."""

from collections.abc import Mapping
from pathlib import Path

from thermaxis.codes import Place, printable
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import as_table, read_toml, unknown_key
from thermaxis.thermal import Region

MOST_REGIONS = 100
"""More would be no table that a person reads. [1]"""
_KEYS = ("x_px", "y_px", "x_mm", "y_mm")


def read_regions(path: Path, *, mm_per_pixel: float | None) -> tuple[Region, ...]:
    """Read a file of regions.

    Parameters
    ----------
    path : Path
        TOML with a table ``[regions.NAME]`` for each rectangle: ``x_px = [from, to]`` and
        ``y_px = [from, to]`` from the upper left corner, y downwards, or ``x_mm`` and ``y_mm``.
    mm_per_pixel : float, optional
        Scale of the image; regions in mm need it. [mm]

    Returns
    -------
    tuple of Region
        In the order of the file.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a key is unknown or missing, an edge is not a number, edges are
        not ascending, there are no regions or more than 100, or mm are used without a scale.
    """
    example = "Write [regions.motor] on a line, x_px = [0, 20] and y_px = [0, 40] below it"
    content = read_toml(path, remedy=example)
    for key in content:
        if key != "regions":
            raise unknown_key(path, key, ("regions",))
    tables = as_table(path, "regions", content.get("regions", {}))
    if not 0 < len(tables) <= MOST_REGIONS:
        raise ConfigurationError(
            "wrong_number_of_regions",
            place=Place(file=str(path), key="regions"),
            regions=len(tables),
            most=MOST_REGIONS,
        )
    return tuple(_region(path, name, table, mm_per_pixel) for name, table in tables.items())


def _region(path: Path, name: str, value: object, mm_per_pixel: float | None) -> Region:
    shown = f"regions.{printable(name, 40)}"
    table = as_table(path, shown, value)
    for key in table:
        if key not in _KEYS:
            raise unknown_key(path, f"{shown}.{key}", [f"{shown}.{k}" for k in _KEYS])
    left, right = _edges(path, shown, table, "x", mm_per_pixel)
    top, bottom = _edges(path, shown, table, "y", mm_per_pixel)
    return Region(printable(name, 40), left, right, top, bottom)


def _edges(
    path: Path, shown: str, table: Mapping[str, object], axis: str, mm_per_pixel: float | None
) -> tuple[float, float]:
    """Return the edges along one axis in pixels."""
    stated = [key for key in (f"{axis}_px", f"{axis}_mm") if key in table]
    if len(stated) != 1:
        raise ConfigurationError("region_edges", place=Place(file=str(path), key=shown), axis=axis)
    key = stated[0]
    low, high = _pair(path, f"{shown}.{key}", table[key])
    if key.endswith("_px"):
        return low, high
    if mm_per_pixel is None:
        raise ConfigurationError("scale_needed", place=Place(file=str(path), key=f"{shown}.{key}"))
    return low / mm_per_pixel, high / mm_per_pixel


def _pair(path: Path, shown: str, value: object) -> tuple[float, float]:
    numbers = [
        float(v)
        for v in (value if isinstance(value, list) else [])  # pyright: ignore[reportUnknownVariableType] - TOML
        if isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < 1e9
    ]
    if not isinstance(value, list) or len(value) != 2 or len(numbers) != 2:  # pyright: ignore[reportUnknownArgumentType] - TOML
        raise ConfigurationError("not_a_pair", place=Place(file=str(path), key=shown))
    if not numbers[0] < numbers[1]:
        raise ConfigurationError("not_rising", place=Place(file=str(path), key=shown))
    return numbers[0], numbers[1]
