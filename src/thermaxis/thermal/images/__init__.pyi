from ._field import (
    ABSOLUTE_ZERO_C as ABSOLUTE_ZERO_C,
    MOST_PIXELS as MOST_PIXELS,
    DriftRelation as DriftRelation,
    Region as Region,
    RegionDrift as RegionDrift,
    ThermalField as ThermalField,
    ThermalFieldsResult as ThermalFieldsResult,
    correct_emissivity as correct_emissivity,
    default_regions as default_regions,
    evaluate_thermal_fields as evaluate_thermal_fields,
    relate_to_drift as relate_to_drift,
)
