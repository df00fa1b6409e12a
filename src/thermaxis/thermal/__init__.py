"""Evaluate temperatures: numbers in, frozen results out."""

from thermaxis.thermal._field import (
    MOST_PIXELS,
    DriftRelation,
    Region,
    RegionDrift,
    ThermalField,
    ThermalFieldsResult,
    correct_emissivity,
    default_regions,
    evaluate_thermal_fields,
    relate_to_drift,
)

__all__ = [
    "MOST_PIXELS",
    "DriftRelation",
    "Region",
    "RegionDrift",
    "ThermalField",
    "ThermalFieldsResult",
    "correct_emissivity",
    "default_regions",
    "evaluate_thermal_fields",
    "relate_to_drift",
]
