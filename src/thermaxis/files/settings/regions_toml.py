"""Regions of a thermal field, from a file."""

from dataclasses import dataclass, field
from pathlib import Path

from thermaxis.codes import Place, printable
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._reading import read_toml, settings_of
from thermaxis.thermal import Region

MOST_REGIONS = 100
"""More would be no table that a person reads. [1]"""
_LARGEST = 1e9
_Edges = tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Rectangle:
    x_px: _Edges | None = None
    y_px: _Edges | None = None
    x_mm: _Edges | None = None
    y_mm: _Edges | None = None


@dataclass(frozen=True, slots=True)
class _Regions:
    regions: dict[str, _Rectangle] = field(default_factory=dict[str, _Rectangle])


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
    file = str(path)
    tables = settings_of(_Regions, read_toml(path), file=file).regions
    if not 0 < len(tables) <= MOST_REGIONS:
        raise ConfigurationError(
            "number_of_regions", regions=len(tables), most=MOST_REGIONS, file=file, key="regions"
        )
    return tuple(_region(file, name, table, mm_per_pixel) for name, table in tables.items())


def _region(file: str, name: str, stated: _Rectangle, mm_per_pixel: float | None) -> Region:
    shown = printable(name, 40)
    x, y = (Place(file, key=f"regions.{shown}.{axis}") for axis in "xy")
    x_px = _edges(x, stated.x_px, stated.x_mm, mm_per_pixel)
    y_px = _edges(y, stated.y_px, stated.y_mm, mm_per_pixel)
    return Region(shown, *x_px, *y_px)


def _edges(
    place: Place, in_px: _Edges | None, in_mm: _Edges | None, mm_per_pixel: float | None
) -> _Edges:
    """Return the edges along one axis in pixels."""
    stated = in_px or in_mm
    place = place._replace(key=f"{place.key}_{'mm' if in_px is None and in_mm else 'px'}")
    if stated is None:
        raise ConfigurationError("edges_missing", place=place)
    if in_px is not None and in_mm is not None:
        raise ConfigurationError("edges_stated_twice", place=place)
    if max(map(abs, stated)) >= _LARGEST or not stated[0] < stated[1]:
        raise ConfigurationError("edges_not_rising", place=place)
    if in_px is not None:
        return in_px
    if mm_per_pixel is None:
        raise ConfigurationError("scale_missing", place=place)
    return stated[0] / mm_per_pixel, stated[1] / mm_per_pixel
