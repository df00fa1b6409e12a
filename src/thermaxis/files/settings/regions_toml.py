"""Regions of a thermal field, from a file."""

from collections.abc import Mapping
from pathlib import Path

from thermaxis.codes import printable
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
            f"the file has {len(tables)} regions, not 1 to {MOST_REGIONS}",
            where=str(path),
            remedy="Write a table such as [regions.left] with x_px = [0, 20] and y_px = [0, 60]",
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
        raise ConfigurationError(
            f"{shown} states {axis} {'twice' if stated else 'not at all'}",
            where=str(path),
            remedy=f"Write either {axis}_px = [from, to] or {axis}_mm = [from, to]",
        )
    key = stated[0]
    low, high = _pair(path, f"{shown}.{key}", table[key])
    if key.endswith("_px"):
        return low, high
    if mm_per_pixel is None:
        raise ConfigurationError(
            f"{shown}.{key} needs the scale of the image",
            where=str(path),
            remedy="Give --scale with the millimetres of one pixel, or state the region in pixels",
        )
    return low / mm_per_pixel, high / mm_per_pixel


def _pair(path: Path, shown: str, value: object) -> tuple[float, float]:
    numbers = [
        float(v)
        for v in (value if isinstance(value, list) else [])  # pyright: ignore[reportUnknownVariableType] - TOML
        if isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < 1e9
    ]
    if not isinstance(value, list) or len(value) != 2 or len(numbers) != 2:  # pyright: ignore[reportUnknownArgumentType] - TOML
        raise ConfigurationError(
            f"{shown} is not a pair of numbers",
            where=str(path),
            remedy="Write it as [from, to], such as [0, 20]",
        )
    if not numbers[0] < numbers[1]:
        raise ConfigurationError(
            f"the edges of {shown} do not ascend",
            where=str(path),
            remedy="Write the smaller edge first; x counts from the left, y from the top",
        )
    return numbers[0], numbers[1]
