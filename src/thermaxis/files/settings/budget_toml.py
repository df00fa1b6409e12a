"""Read what is known of the instrument and the environment: the file of ``--budget``."""

from collections.abc import Mapping
from pathlib import Path

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._reading import read_toml, settings_of, unknown_key
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
    "device": {"expanded_uncertainty_arcsec": "device", "error_range_arcsec": "device_range"},
    "environment": {"variation_arcsec": "environmental_variation"},
}
"""The same of a rotary axis: angles neither expand nor have a length."""
BUDGET_KEYS: Mapping[str, tuple[str, ...]] = {
    table: (*keys, *_ROTARY.get(table, ())) for table, keys in _LINEAR.items()
}
"""Keys by table, of axes of both kinds."""


def _check_name(file: str, name: str, kind: AxisKind) -> None:
    """Raise the error for a table or a key that an axis of this kind does not have."""
    known, other = (_LINEAR, _ROTARY) if kind is AxisKind.LINEAR else (_ROTARY, _LINEAR)
    table, _, key = name.partition(".")
    if table in known and (not key or key in known[table]):
        return
    if table in other and (not key or key in other[table]):
        raise ConfigurationError("other_kind_of_axis", kind=kind, file=file, key=name)
    raise unknown_key(file, name, known[table] if key else known)


def read_budget(path: Path, kind: AxisKind) -> UncertaintyBudget:
    """Read a file with the terms of instrument and environment.

    Returns
    -------
    UncertaintyBudget
        The terms that the file states.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a table or key is unknown, or a value is not possible.
    """
    file = str(path)
    values: dict[str, float] = {}
    content = read_toml(path)
    for table in content:
        _check_name(file, table, kind)
    terms = _LINEAR if kind is AxisKind.LINEAR else _ROTARY
    for table, keys in settings_of(dict[str, dict[str, float]], content, file=file).items():
        for key, value in keys.items():
            _check_name(file, f"{table}.{key}", kind)
            if not 0.0 <= value < _LARGEST:
                raise ConfigurationError(
                    "outside_range",
                    value=value,
                    least=0.0,
                    most=_LARGEST,
                    file=file,
                    key=f"{table}.{key}",
                )
            values[terms[table][key]] = value
    if not values.keys() - {"expansion_coefficient_ppm_per_k", "largest_difference_to_20_c_k"}:
        raise ConfigurationError("no_uncertainty_term", file=file)
    try:
        return UncertaintyBudget(**values)
    except ConfigurationError as error:
        raise error.at(Place(file)) from None
