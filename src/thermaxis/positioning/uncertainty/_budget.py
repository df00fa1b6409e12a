"""The terms of an uncertainty budget: what instrument and environment contribute to a run."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.errors import ConfigurationError, DataError
from thermaxis.positioning.run import PositioningTest
from thermaxis.quantities import AxisKind

COVERAGE_FACTOR = 2.0
"""Factor k of the expanded uncertainties that a budget states. [1]"""
RECTANGULAR = 1.0 / np.sqrt(12.0)
"""Standard uncertainty of a rectangular distribution of unit width, GUM 4.3.7. [1]"""
OWN = "own"
"""Mark of a formula that was derived for this program."""
FROM_MEMORY = "M"
"""Mark of a formula that is from memory and was not read in the standard."""


@final
@dataclass(frozen=True, slots=True)
class UncertaintyBudget:
    """What is known of the instrument and the environment; None where it is not known.

    Raises
    ------
    ConfigurationError
        If a number is negative or not finite, or the device is stated in two ways.
    """

    device: float | None = None
    """Expanded uncertainty (k = 2) of the instrument, of its certificate. [µm or arcsec]"""
    device_um_per_m: float | None = None
    """Part of it in proportion to the measured length; it is added. [µm/m]"""
    device_range: float | None = None
    """Width of the interval of the instrument's errors, in place of `device`. [µm or arcsec]"""
    device_range_um_per_m: float | None = None
    """Part of it in proportion to the measured length; it is added. [µm/m]"""
    misalignment_mm: float | None = None
    """Largest lateral misalignment of the beam over the measured length. [mm]"""
    material_temperature_interval_k: float | None = None
    """Width of the interval that holds the error of the material's temperature. [K]"""
    expansion_coefficient_interval_ppm_per_k: float | None = None
    """Width of the interval that holds the error of the expansion coefficient. [ppm/K]"""
    expansion_coefficient_ppm_per_k: float | None = None
    """Expansion coefficient of the machine. Default: what the run's environment says. [ppm/K]"""
    largest_difference_to_20_c_k: float | None = None
    """Largest difference of the material's temperature to 20 °C, without its sign. Default: what
    the run's environment says. [K]"""
    environmental_variation: float | None = None
    """Range E_VE of a drift test with the axis at rest. [µm or arcsec]"""

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value: float | None = getattr(self, name)
            if value is not None and not 0.0 <= value < 1e9:
                raise ConfigurationError(
                    "outside_range", value=value, least=0.0, most=1e9, key=name
                )
        certified = (self.device, self.device_um_per_m)
        ranges = (self.device_range, self.device_range_um_per_m)
        if any(v is not None for v in certified) and any(v is not None for v in ranges):
            raise ConfigurationError("instrument_twice")


@final
@dataclass(frozen=True, slots=True)
class UncertaintyTerm:
    """One input quantity of a budget, as it acts on one run."""

    key: str
    """`device`, `misalignment`, `material_temperature`, `expansion_coefficient`,
    `environmental_variation` or `resolution`."""
    value: float
    """What is known of it: expanded uncertainty (k = 2) or half width of its interval. [unit]"""
    unit: str
    distribution: str
    """`normal` or `rectangular`."""
    standard_uncertainty: float
    """Its standard uncertainty. [unit]"""
    effect: float
    """Error from end to end of the measured length for a unit of it, of the last two of
    one reading. [µm or arcsec per unit]"""
    mark: str
    """Origin of its formula: `own` or `M` (from memory)."""

    @property
    def error(self) -> float:
        """Standard uncertainty of the error that it makes. [µm or arcsec]"""
        return self.effect * self.standard_uncertainty


SYSTEMATIC = ("device", "misalignment", "material_temperature", "expansion_coefficient")
"""Terms that are the same for all readings."""
ENVIRONMENT, RESOLUTION = "environmental_variation", "resolution"
"""Terms that differ from reading to reading."""
_LINEAR_ONLY = (
    "device_um_per_m",
    "device_range_um_per_m",
    "misalignment_mm",
    "material_temperature_interval_k",
    "expansion_coefficient_interval_ppm_per_k",
)


def _stated_in_run(test: PositioningTest, prefix: str) -> list[float]:
    return [
        value
        for key, both in test.environment.items()
        if key.startswith(prefix)
        for value in (both.start, both.end)
        if value is not None
    ]


def _expansion_coefficient_ppm_per_k(test: PositioningTest, budget: UncertaintyBudget) -> float:
    if budget.expansion_coefficient_ppm_per_k is not None:
        return budget.expansion_coefficient_ppm_per_k
    stated = _stated_in_run(test, "expansion_coefficient_ppm_per_k")
    if not stated:
        raise DataError("no_expansion_coefficient")
    return max(stated)


def _difference_to_20_c_k(test: PositioningTest, budget: UncertaintyBudget) -> float:
    if budget.largest_difference_to_20_c_k is not None:
        return budget.largest_difference_to_20_c_k
    stated = _stated_in_run(test, "material_temperature_")
    if not stated:
        raise DataError("no_material_temperature")
    return max(abs(value - 20.0) for value in stated)


def _rectangular(key: str, width: float, unit: str, effect: float) -> UncertaintyTerm:
    return UncertaintyTerm(
        key, 0.5 * width, unit, "rectangular", RECTANGULAR * width, effect, FROM_MEMORY
    )


def _systematic(test: PositioningTest, budget: UncertaintyBudget) -> Iterator[UncertaintyTerm]:
    """Yield the terms that act as one error along the axis; a rotary axis has no length.

    Notes
    -----
    With the length L: a coefficient of expansion a and its error da, a temperature 20 °C + dT and
    its error dt make an error of a L dt and dT L da; the cosine error of a beam that is misaligned
    by up to b lies between 0 and b^2 / (2 L).
    """
    unit = test.kind.units.deviation
    length_m = test.measured_length / 1000.0 if test.kind is AxisKind.LINEAR else 0.0
    if budget.device is not None or budget.device_um_per_m is not None:
        expanded = (budget.device or 0.0) + (budget.device_um_per_m or 0.0) * length_m
        u = expanded / COVERAGE_FACTOR
        yield UncertaintyTerm("device", expanded, unit, "normal", u, 1.0, OWN)
    if budget.device_range is not None or budget.device_range_um_per_m is not None:
        width = (budget.device_range or 0.0) + (budget.device_range_um_per_m or 0.0) * length_m
        yield _rectangular("device", width, unit, 1.0)
    if budget.misalignment_mm is not None and length_m > 0.0:
        width = budget.misalignment_mm**2 / (2.0 * length_m)
        yield _rectangular("misalignment", width, unit, 1.0)
    width = budget.material_temperature_interval_k
    if width is not None:
        effect = _expansion_coefficient_ppm_per_k(test, budget) * length_m if width else 0.0
        yield _rectangular("material_temperature", width, "K", effect)
    width = budget.expansion_coefficient_interval_ppm_per_k
    if width is not None:
        effect = _difference_to_20_c_k(test, budget) * length_m if width else 0.0
        yield _rectangular("expansion_coefficient", width, "ppm/K", effect)


@final
@dataclass(frozen=True, slots=True)
class Terms:
    """Terms of a budget, evaluated for one run."""

    unit: str
    systematic: tuple[UncertaintyTerm, ...]
    of_readings: tuple[UncertaintyTerm, ...]
    """Terms that act on each reading: environment and resolution."""
    not_stated: tuple[str, ...]
    """Keys of the terms that the budget does not state."""

    @property
    def length_error(self) -> float:
        """Standard uncertainty of the error from end to end. [µm or arcsec]"""
        return float(np.sqrt(sum(term.error**2 for term in self.systematic)))

    @property
    def reading_error(self) -> float:
        """Standard uncertainty of a reading by the environment. [µm or arcsec]"""
        return sum(term.error for term in self.of_readings if term.key == ENVIRONMENT)


def terms_of(test: PositioningTest, budget: UncertaintyBudget) -> Terms:
    """Return the terms of a budget for one run."""
    rotary = test.kind is AxisKind.ROTARY
    for name in _LINEAR_ONLY if rotary else ():
        if getattr(budget, name) is not None:
            raise ConfigurationError("linear_axis_only", key=name)
    systematic, unit = tuple(_systematic(test, budget)), test.kind.units.deviation
    widths = {ENVIRONMENT: budget.environmental_variation, RESOLUTION: test.resolution or None}
    of_readings = tuple(
        _rectangular(key, width, unit, 1.0) for key, width in widths.items() if width is not None
    )
    known = {term.key for term in (*systematic, *of_readings)}
    possible = (*(SYSTEMATIC[:1] if rotary else SYSTEMATIC), ENVIRONMENT)
    not_stated = tuple(key for key in possible if key not in known)
    return Terms(unit, systematic, of_readings, not_stated)
