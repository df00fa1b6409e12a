"""What a laser's environment factor should be, from air, material and expansion coefficient."""

import math
from collections.abc import Mapping

from thermaxis.codes import Message, remark
from thermaxis.positioning import StartEnd

VACUUM_WAVELENGTH_UM = 0.632990577
"""Wavelength of the laser in vacuum that the environment factors met in files follow. [µm]"""
FACTOR_TOLERANCE_PPM = 0.5
"""Largest difference of a stated environment factor that passes without a remark. [ppm]"""
AIR_LIMITS = {
    "air_temperature_c": (-40.0, 100.0),
    "air_pressure_kpa": (50.0, 120.0),
    "air_humidity_percent": (0.0, 100.0),
}
"""Values that the air around a machine can have: outside them a unit is wrong."""

_MATERIALS = tuple(f"material_temperature_{k}_c" for k in (1, 2, 3))


def environment_factor_um(
    air_temperature_c: float,
    air_pressure_kpa: float,
    air_humidity_percent: float,
    *,
    expansion_coefficient_ppm_per_k: float = 0.0,
    material_temperature_c: float = 20.0,
) -> float:
    """Compute half the wavelength of the laser in air, reduced to a scale at 20 °C.

    References
    ----------
    .. [1] K. P. Birch, M. J. Downs, Correction to the updated Edlén equation for the refractive
       index of air, Metrologia 31 (1994) 315-316: dispersion, density and water vapour terms.
    .. [2] World Meteorological Organization, Guide to Instruments (WMO-No. 8), annex on
       humidity formulas: saturation pressure over water (Magnus form).

    Notes
    -----
    That the factor in a file follows this formula with this wavelength was found from one
    published file (two values, within 0.08 ppm); no document of the maker says so.
    """
    wave_number_squared = VACUUM_WAVELENGTH_UM**-2  # σ² in µm⁻²
    pressure_pa = 1000.0 * air_pressure_kpa
    t = air_temperature_c
    standard = 1e-8 * (
        8342.54 + 2406147.0 / (130.0 - wave_number_squared) + 15998.0 / (38.9 - wave_number_squared)
    )
    density = (1.0 + 1e-8 * (0.601 - 0.00972 * t) * pressure_pa) / (1.0 + 0.0036610 * t)
    saturation_pa = 611.2 * math.exp(17.62 * t / (243.12 + t))
    vapour_pa = air_humidity_percent / 100.0 * saturation_pa
    index = (
        1.0
        + pressure_pa * standard / 96095.43 * density
        - 1e-10 * vapour_pa * (3.7345 - 0.0401 * wave_number_squared)
    )
    expansion = 1e-6 * expansion_coefficient_ppm_per_k * (material_temperature_c - 20.0)
    return VACUUM_WAVELENGTH_UM / (2.0 * index) * (1.0 - expansion)


def environment_factor_remarks(environment: Mapping[str, StartEnd]) -> list[Message]:
    """Compare a stated environment factor with the one that the other values give."""
    remarks: list[Message] = []
    for moment in ("start", "end"):
        remarks += _remarks_of_moment(_stated(environment, moment), moment)
    return remarks


def reduction_to_20_c(environment: Mapping[str, StartEnd]) -> str | None:
    """Say with which expansion coefficient the instrument has reduced its readings to 20 °C."""
    coefficients: list[str] = []
    told = False
    for moment in ("start", "end"):
        stated = _stated(environment, moment)
        smallest_ppm = None if _impossible(stated) else _smallest_difference_ppm(stated)
        if smallest_ppm is None or abs(smallest_ppm) > FACTOR_TOLERANCE_PPM:
            return None
        plain_ppm = _difference_ppm(stated, 20.0)
        told |= abs(plain_ppm) > FACTOR_TOLERANCE_PPM
        coefficients.append(f"{stated['expansion_coefficient_ppm_per_k']:.6g}")
    return f"{' to '.join(dict.fromkeys(coefficients))} ppm/K" if told else None


def _stated(environment: Mapping[str, StartEnd], moment: str) -> dict[str, float]:
    return {
        key: value
        for key, both in environment.items()
        if (value := both.start if moment == "start" else both.end) is not None
    }


def _impossible(stated: Mapping[str, float]) -> list[str]:
    return [
        key
        for key, (low, high) in AIR_LIMITS.items()
        if key in stated and not low <= stated[key] <= high
    ]


def _remarks_of_moment(stated: Mapping[str, float], moment: str) -> list[Message]:
    impossible = _impossible(stated)
    if impossible:
        named = ", ".join(f"{key} {stated[key]:.6g}" for key in impossible)
        return [remark("air_impossible", moment=moment, values=named)]
    smallest_ppm = _smallest_difference_ppm(stated)
    if smallest_ppm is None or abs(smallest_ppm) <= FACTOR_TOLERANCE_PPM:
        return []
    return [remark("factor_off", moment=moment, off_ppm=f"{smallest_ppm:+.2g}")]


def _smallest_difference_ppm(stated: Mapping[str, float]) -> float | None:
    """Return how far the stated factor is off, None where a value is not stated. [ppm]"""
    needed = (*AIR_LIMITS, "environment_factor_um", "expansion_coefficient_ppm_per_k")
    materials = [stated[key] for key in _MATERIALS if key in stated]
    if _MATERIALS[0] not in stated or any(key not in stated for key in needed):
        return None
    # whether the instrument averages several sensors is not known: either way passes
    differences_ppm = [
        _difference_ppm(stated, material_c)
        for material_c in (materials[0], sum(materials) / len(materials))
    ]
    return min(differences_ppm, key=abs)


def _difference_ppm(stated: Mapping[str, float], material_temperature_c: float) -> float:
    computed = environment_factor_um(
        stated["air_temperature_c"],
        stated["air_pressure_kpa"],
        stated["air_humidity_percent"],
        expansion_coefficient_ppm_per_k=stated["expansion_coefficient_ppm_per_k"],
        material_temperature_c=material_temperature_c,
    )
    return 2e6 * (stated["environment_factor_um"] - computed) / VACUUM_WAVELENGTH_UM
