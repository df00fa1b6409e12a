"""Read what is known of the instrument and the environment: the file of ``--budget``."""

from collections.abc import Mapping
from pathlib import Path

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import as_table, read_toml, unknown_key
from thermaxis.positioning import UncertaintyBudget
from thermaxis.quantities import AxisKind

_LARGEST = 1e6
"""No uncertainty, misalignment or temperature is larger. [unit of its key]"""

_LINEAR: Mapping[str, Mapping[str, str]] = {
    "device": {
        "expanded_uncertainty_um": "device",
        "expanded_uncertainty_um_per_m": "device_um_per_m",
        "error_range_um": "device_range",
        "error_range_um_per_m": "device_range_um_per_m",
    },
    "alignment": {"misalignment_mm": "misalignment_mm"},
    "material": {
        "temperature_interval_k": "material_temperature_interval_k",
        "expansion_coefficient_ppm_per_k": "expansion_coefficient_ppm_per_k",
        "expansion_coefficient_interval_ppm_per_k": "expansion_coefficient_interval_ppm_per_k",
        "largest_difference_to_20_c_k": "largest_difference_to_20_c_k",
    },
    "environment": {"variation_um": "environmental_variation"},
}
"""Fields of the budget of a linear axis by table and key."""
_ROTARY: Mapping[str, Mapping[str, str]] = {
    "device": {
        "expanded_uncertainty_arcsec": "device",
        "error_range_arcsec": "device_range",
    },
    "environment": {"variation_arcsec": "environmental_variation"},
}
"""The same of a rotary axis: angles neither expand nor have a length."""


def _known(kind: AxisKind) -> Mapping[str, Mapping[str, str]]:
    return _LINEAR if kind is AxisKind.LINEAR else _ROTARY


def _other(kind: AxisKind) -> Mapping[str, Mapping[str, str]]:
    return _ROTARY if kind is AxisKind.LINEAR else _LINEAR


def _check_name(path: Path, table: str, key: str | None, kind: AxisKind) -> None:
    """Raise the error for a table or a key that an axis of this kind does not have."""
    known, other = _known(kind), _other(kind)
    name = table if key is None else f"{table}.{key}"
    if table in known and (key is None or key in known[table]):
        return
    if table in other and (key is None or key in other[table]):
        there = AxisKind.ROTARY if kind is AxisKind.LINEAR else AxisKind.LINEAR
        raise ConfigurationError(
            "key_of_other_axis",
            place=Place(file=str(path), key=name),
            kind=str(there),
            axis=str(kind),
        )
    listed = known if key is None else [f"{table}.{k}" for k in known[table]]
    raise unknown_key(path, name, listed)


def _number(path: Path, name: str, value: object) -> float:
    number = value if isinstance(value, int | float) and not isinstance(value, bool) else -1.0
    if not 0.0 <= number < _LARGEST:
        raise ConfigurationError(
            "not_a_number_from_zero", place=Place(file=str(path), key=name), text=str(value)
        )
    return float(number)


def read_budget(path: Path, kind: AxisKind) -> UncertaintyBudget:
    """Read a file with the terms of instrument and environment.

    Parameters
    ----------
    path : Path
        TOML with a table for each term.
    kind : AxisKind
        Kind of the axis, which fixes the unit.

    Returns
    -------
    UncertaintyBudget
        The terms that the file states.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a table or key is unknown, or a value is not possible.
    """
    values: dict[str, float] = {}
    example = "Write [device] on a line and expanded_uncertainty_um = 0.2 below it"
    for table, content in read_toml(path, remedy=example).items():
        _check_name(path, table, None, kind)
        for key, value in as_table(path, table, content).items():
            _check_name(path, table, key, kind)
            field = _known(kind)[table][key]
            values[field] = _number(path, f"{table}.{key}", value)
    if not values.keys() - {"expansion_coefficient_ppm_per_k", "largest_difference_to_20_c_k"}:
        example = "expanded_uncertainty_" + kind.units.deviation_suffix
        raise ConfigurationError(
            "budget_without_terms", place=Place(file=str(path)), example=example
        )
    try:
        return UncertaintyBudget(**values)
    except ConfigurationError as error:
        raise error.at(Place(file=str(path))) from None
