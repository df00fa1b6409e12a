"""Temperatures of a surface in plan view, before and after, and what they have to do with drift."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray

ABSOLUTE_ZERO_C = -273.15
"""Zero of the kelvin scale. [°C]"""
MOST_PIXELS = 100_000_000
"""Largest image that is evaluated. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class ThermalField:
    """Temperatures of a surface, as an image: row 0 at the top, column 0 at the left.

    Raises
    ------
    DataError
        If the shape is not (rows, columns) with at least two of each, the image is larger than
        100 Mpixel, no pixel is present, or a pixel is infinite or below absolute zero.
    """

    temperature_c: FloatArray
    """Temperatures, (rows, columns); NaN where a pixel is missing. [°C]"""
    name: str = ""
    """Name of the image, for tables and charts."""
    remarks: tuple[Message, ...] = ()

    def __post_init__(self) -> None:
        """Check the shape and freeze the image."""
        values = np.asarray(self.temperature_c, dtype=np.float64)
        named = self.name or "thermal field"
        if values.ndim != 2 or min(values.shape) < 2:
            raise DataError(
                "wrong_shape", shape=str(values.shape), expected="(rows, columns)", file=named
            )
        if values.size > MOST_PIXELS:
            raise DataError(
                "too_many_pixels",
                rows=values.shape[0],
                columns=values.shape[1],
                most_million=MOST_PIXELS // 1_000_000,
                file=named,
            )
        lowest, highest = np.fmin.reduce(values, axis=None), np.fmax.reduce(values, axis=None)
        if bool(np.isnan(lowest)):
            raise DataError("image_empty", file=named)
        if bool(np.isinf(highest)) or float(lowest) < ABSOLUTE_ZERO_C:
            raise DataError(
                "pixel_out_of_range", lowest_c=float(lowest), highest_c=float(highest), file=named
            )
        if values.flags.writeable:
            values = values.copy() if values is self.temperature_c else values
            values.setflags(write=False)
        object.__setattr__(self, "temperature_c", values)

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns. [1]"""
        rows, columns = self.temperature_c.shape
        return int(rows), int(columns)


@final
@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle of an image; a pixel belongs to it if its centre lies inside.

    Pixel centres lie at half numbers: the first pixel from 0 to 1 has its centre at 0.5.
    """

    name: str
    left_px: float
    """Left edge, from the left edge of the image. [px]"""
    right_px: float
    """Right edge. [px]"""
    top_px: float
    """Upper edge, from the upper edge of the image downwards. [px]"""
    bottom_px: float
    """Lower edge. [px]"""

    def slices(self, shape: tuple[int, int]) -> tuple[slice, slice]:
        """Return the rows and columns of the region in an image.

        Parameters
        ----------
        shape : tuple of int
            Rows and columns of the image. [1]

        Raises
        ------
        DataError
            If the region reaches beyond the image or holds the centre of no pixel.
        """
        rows, columns = shape
        inside = (
            0.0 <= self.left_px < self.right_px <= columns + 1e-9
            and 0.0 <= self.top_px < self.bottom_px <= rows + 1e-9
        )
        first_column, last_column = _centres(self.left_px, self.right_px)
        first_row, last_row = _centres(self.top_px, self.bottom_px)
        if not inside:
            raise DataError(
                "region_outside",
                left_px=self.left_px,
                right_px=self.right_px,
                top_px=self.top_px,
                bottom_px=self.bottom_px,
                columns=columns,
                rows=rows,
                key=f"region {self.name}",
            )
        if first_column == last_column or first_row == last_row:
            raise DataError("region_empty", key=f"region {self.name}")
        return slice(first_row, last_row), slice(first_column, last_column)


def _centres(low: float, high: float) -> tuple[int, int]:
    """Return the range of the pixels whose centres lie in [low, high)."""
    return int(np.ceil(low - 0.5 - 1e-9)), int(np.ceil(high - 0.5 - 1e-9))


@final
@dataclass(frozen=True, slots=True, eq=False)
class ThermalFieldsResult:
    """Thermal fields of one surface, compared."""

    fields: tuple[ThermalField, ...]
    """The images in the order of time, k of them."""
    time_s: FloatArray | None
    """Times of the images, (k,); None if not stated. [s]"""
    difference_k: FloatArray
    """Last image minus the first one, (rows, columns); NaN where a pixel is missing in one. [K]"""
    regions: tuple[Region, ...]
    """The regions, r of them."""
    region_pixels: NDArray[np.int64]
    """Number of pixels of each region that no image misses, (r,). [1]"""
    region_mean_c: FloatArray
    """Mean temperature of each image in each region over these pixels, (k, r); NaN where there are
    none. [°C]"""
    warnings: tuple[Message, ...]
    """What the reader of the result must know."""

    @property
    def region_change_k(self) -> FloatArray:
        """Change of each region from the first image to the last, (r,). [K]"""
        return np.asarray(self.region_mean_c[-1] - self.region_mean_c[0], dtype=np.float64)


@final
@dataclass(frozen=True, slots=True)
class RegionDrift:
    """How the mean temperature of a region goes with a function of the drift."""

    region: str
    correlation: float
    """Pearson's coefficient; NaN if either does not change. [1]"""
    per_k: float
    """Slope of the straight line of the drift over the temperature. [unit of the drift/K]"""
    p_value: float
    """Probability of such a correlation between unrelated, independent values; NaN as above.
    Images of one warming are neither, so it is no proof. [1]"""


@final
@dataclass(frozen=True, slots=True)
class DriftRelation:
    """Temperatures of regions beside the drift of a run."""

    images: int
    """Number of images that the relation uses. [1]"""
    common: tuple[RegionDrift, ...]
    """Regions with the common drift a(t); per K in µm or arcsec. Empty with two images."""
    slope: tuple[RegionDrift, ...]
    """Regions with the growth of the axis b(t); per K in µm/m or arcsec per 1000 deg. Empty with
    two images."""


def correct_emissivity(
    temperature_c: FloatArray, *, emissivity: float, reflected_c: float
) -> FloatArray:
    """Return the temperature of a grey surface from the one that a camera set to 1 shows.

    The surface emits e T^4 and reflects (1 - e) T_refl^4, in kelvin. A camera sees a band of
    wavelengths, not all radiation: the fourth power is an approximation. From 15 °C to 60 °C, with
    surroundings of 24 °C, it differs from Planck's law in the band of 7.5 µm to 13 µm by at most
    0.013 K for e = 0.97 and 0.12 K for e = 0.7. Air, window and the dependence of e on angle and
    wavelength are left out.

    Parameters
    ----------
    temperature_c : FloatArray
        Apparent temperatures, of any shape; NaN stays. [°C]
    emissivity : float
        Emissivity e of the surface, above 0 to 1. [1]
    reflected_c : float
        Apparent temperature of the surroundings that the surface reflects. [°C]

    Returns
    -------
    FloatArray
        Temperatures of the surface. [°C]

    Raises
    ------
    DataError
        If the emissivity is not in (0, 1], the reflected temperature is below absolute zero, or
        the reflection alone exceeds what the camera saw in some pixel.

    References
    ----------
    Stefan-Boltzmann law; M. Vollmer and K.-P. Möllmann, Infrared Thermal Imaging (measurement
    equation of a camera), from memory.
    """
    if not 0.0 < emissivity <= 1.0:
        raise DataError("no_emissivity", emissivity=emissivity, key="emissivity")
    if not ABSOLUTE_ZERO_C <= reflected_c < 5000.0:
        raise DataError(
            "outside_range",
            value=reflected_c,
            least=ABSOLUTE_ZERO_C,
            most=5000.0,
            key="reflected_c",
        )
    if emissivity == 1.0:
        return np.array(temperature_c, dtype=np.float64)
    radiated = (temperature_c - ABSOLUTE_ZERO_C) ** 4
    radiated -= (1.0 - emissivity) * (reflected_c - ABSOLUTE_ZERO_C) ** 4
    lowest = np.fmin.reduce(radiated, axis=None)
    if float(lowest) < 0.0:
        raise DataError("reflection_exceeds", reflected_c=reflected_c, key="emissivity")
    radiated /= emissivity
    return np.asarray(radiated**0.25 + ABSOLUTE_ZERO_C, dtype=np.float64)


def default_regions(shape: tuple[int, int]) -> tuple[Region, ...]:
    """Return the whole image and its quarters: upper left, upper right, lower left, lower right."""
    rows, columns = shape
    x, y = float(columns // 2), float(rows // 2)
    return (
        Region("whole", 0.0, float(columns), 0.0, float(rows)),
        Region("upper left", 0.0, x, 0.0, y),
        Region("upper right", x, float(columns), 0.0, y),
        Region("lower left", 0.0, x, y, float(rows)),
        Region("lower right", x, float(columns), y, float(rows)),
    )


def evaluate_thermal_fields(
    fields: Sequence[ThermalField],
    *,
    regions: Sequence[Region] | None = None,
    time_s: Sequence[float] | None = None,
) -> ThermalFieldsResult:
    """Compare thermal fields of one surface, taken from one place.

    Parameters
    ----------
    fields : sequence of ThermalField
        Two images or more, in the order of time, all of one shape.
    regions : sequence of Region, optional
        Where means are taken. Default: the whole image and its quarters.
    time_s : sequence of float, optional
        Times of the images, strictly increasing. Default: not known. [s]

    Returns
    -------
    ThermalFieldsResult
        The difference of the last image to the first one, and the regions' means in every image.
        A mean uses only the pixels that no image misses, so that it does not move with them.

    Raises
    ------
    DataError
        If there are fewer than two images, their shapes differ, times do not fit or do not
        increase, a region is no part of the image, or no pixel is present in both the first image
        and the last one.
    """
    if len(fields) < 2:
        raise DataError("one_image")
    shape = fields[0].shape
    for field in fields[1:]:
        if field.shape != shape:
            raise DataError(
                "image_sizes_differ",
                columns=field.shape[1],
                rows=field.shape[0],
                first_columns=shape[1],
                first_rows=shape[0],
                file=field.name or "thermal field",
            )
    where = tuple(default_regions(shape) if regions is None else regions)
    difference = fields[-1].temperature_c - fields[0].temperature_c
    pixels, means = _region_means(fields, where)
    missing = int(np.count_nonzero(np.isnan(difference)))
    if missing == difference.size:
        raise DataError("no_common_pixel")
    warnings = [replace(one, place=Place(field.name)) for field in fields for one in field.remarks]
    if missing:
        warnings.append(remark("pixels_missing", missing=missing, pixels=difference.size))
    warnings += [
        remark("region_without_mean", region=region.name)
        for region, count in zip(where, pixels.tolist(), strict=True)
        if count == 0
    ]
    return ThermalFieldsResult(
        fields=tuple(fields),
        time_s=_times(time_s, len(fields)),
        difference_k=difference,
        regions=where,
        region_pixels=pixels,
        region_mean_c=means,
        warnings=tuple(warnings),
    )


def _times(time_s: Sequence[float] | None, images: int) -> FloatArray | None:
    if time_s is None:
        return None
    times = np.array(time_s, dtype=np.float64)
    if times.shape != (images,):
        raise DataError("times_not_images", times=times.size, images=images, key="time_s")
    if not bool(np.all(np.isfinite(times))) or bool(np.any(np.diff(times) <= 0.0)):
        raise DataError("not_rising", key="time_s")
    return times


def _region_means(
    fields: Sequence[ThermalField], regions: Sequence[Region]
) -> tuple[NDArray[np.int64], FloatArray]:
    pixels = np.empty(len(regions), dtype=np.int64)
    means = np.empty((len(fields), len(regions)))
    for r, region in enumerate(regions):
        rows, columns = region.slices(fields[0].shape)
        parts = [field.temperature_c[rows, columns] for field in fields]
        present = ~np.isnan(parts[0])
        for part in parts[1:]:
            present &= ~np.isnan(part)
        pixels[r] = np.count_nonzero(present)
        if pixels[r] == 0:
            means[:, r] = np.nan
        else:
            means[:, r] = [float(np.mean(part, where=present)) for part in parts]
    return pixels, means


def relate_to_drift(
    result: ThermalFieldsResult, common: FloatArray, slope: FloatArray
) -> DriftRelation:
    """Relate the regions' means to the drift of a run at the times of the images.

    Parameters
    ----------
    common : FloatArray
        Common drift a(t) at the images, (k,); NaN where an image lies outside the run.
        [µm or arcsec]
    slope : FloatArray
        Growth of the axis b(t) at the images, (k,); NaN likewise. [µm/m or arcsec per 1000 deg]

    Returns
    -------
    DriftRelation
        Correlations from three images up; with fewer there are none, as two points always lie on
        a straight line.

    Raises
    ------
    DataError
        If there is not one value of the drift for each image.
    """
    images = len(result.fields)
    if common.shape != (images,) or slope.shape != (images,):
        raise DataError(
            "wrong_shape",
            shape=f"{common.shape}, {slope.shape}",
            expected=f"({images},)",
            key="drift",
        )
    used = np.isfinite(common) & np.isfinite(slope)
    count = int(np.count_nonzero(used))
    if count < 3:
        return DriftRelation(count, (), ())
    means = result.region_mean_c[used]
    return DriftRelation(
        images=count,
        common=_correlations(result.regions, means, common[used]),
        slope=_correlations(result.regions, means, slope[used]),
    )


def _correlations(
    regions: Sequence[Region], means: FloatArray, drift: FloatArray
) -> tuple[RegionDrift, ...]:
    return tuple(
        RegionDrift(region.name, *_correlation(means[:, r], drift))
        for r, region in enumerate(regions)
    )


def _correlation(x: FloatArray, y: FloatArray) -> tuple[float, float, float]:
    """Return Pearson's r, the slope of y over x, and the p-value of r (two-sided)."""
    from scipy.special import stdtr  # noqa: PLC0415  scipy is slow to import, few images need it

    dx, dy = x - np.mean(x), y - np.mean(y)
    xx, yy = float(dx @ dx), float(dy @ dy)
    if not (xx > 0.0 and yy > 0.0):
        return float("nan"), float("nan"), float("nan")
    r = float(np.clip(float(dx @ dy) / np.sqrt(xx * yy), -1.0, 1.0))
    free = x.size - 2
    if abs(r) == 1.0:
        return r, float(dx @ dy) / xx, 0.0
    t = abs(r) * np.sqrt(free / (1.0 - r * r))
    return r, float(dx @ dy) / xx, float(2.0 * stdtr(free, -t))
