"""The results of ``field``, described once for terminal and JSON."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from thermaxis import __version__
from thermaxis.cli.axis._field_drift import DriftAtImages
from thermaxis.report.tables import Part, Section, Table, Value, rows_of
from thermaxis.thermal import FloatArray, RegionDrift, ThermalFieldsResult


def described(
    result: ThermalFieldsResult,
    drift: DriftAtImages | None,
    warnings: Sequence[str],
    options: Mapping[str, object],
) -> list[Part]:
    """Return the comparison of images for terminal and JSON."""
    down, across = result.fields[0].shape
    return [
        Value("version", __version__),
        Value("rows", down),
        Value("columns", across),
        *(Value(key, value) for key, value in options.items()),
        *_images(result, f"Thermal fields of {across} x {down} pixels, °C"),
        _regions(result),
        Value("drift", None) if drift is None else Section("drift", list(_drift(drift))),
        Value("warnings", warnings, "warning"),
    ]


def _spread(values: FloatArray, unit: str, sign: str = "") -> list[Value]:
    return [
        Value(f"min_{unit}", np.nanmin(values), "lowest", f"{sign}.2f"),
        Value(f"mean_{unit}", np.nanmean(values), "mean", f"{sign}.2f"),
        Value(f"max_{unit}", np.nanmax(values), "highest", f"{sign}.2f"),
        Value("missing", int(np.count_nonzero(np.isnan(values))), "missing"),
    ]


def _images(result: ThermalFieldsResult, title: str) -> Iterator[Part]:
    rows: list[list[Value]] = []
    for k, field in enumerate(result.fields):
        time_s = None if result.time_s is None else float(result.time_s[k])
        rows.append(
            [
                Value("", f"{k + 1}", ""),
                Value("name", field.name, "image"),
                Value("time_s", time_s),
                Value("", "" if time_s is None else f"{time_s / 3600.0:.2f}", "h"),
                *_spread(field.temperature_c, "c"),
            ]
        )
    change = _spread(result.difference_k, "k", "+")
    last = [Value("", "", ""), Value("", "last minus first, K", "image"), Value("", None)]
    yield Table(title, [*rows, [*last, Value("", "", "h"), *change]], words=2)
    yield Table("", [*rows], key="images")
    yield Section("difference", [value._replace(head=None) for value in change])


def _regions(result: ThermalFieldsResult) -> Table:
    shown = range(len(result.fields)) if len(result.fields) <= 8 else (0, len(result.fields) - 1)
    rows = [
        [
            Value("name", region.name, "region"),
            Value("x_px", [region.left_px, region.right_px]),
            Value("y_px", [region.top_px, region.bottom_px]),
            Value("pixels", int(result.region_pixels[r]), "pixels"),
            Value("mean_c", result.region_mean_c[:, r]),
            *(Value("", result.region_mean_c[k, r], f"image {k + 1}", ".3f") for k in shown),
            Value("change_k", result.region_change_k[r], "change, K", "+.3f"),
        ]
        for r, region in enumerate(result.regions)
    ]
    return Table("Mean temperature of regions, °C", rows, key="regions", words=1)


def _drift(drift: DriftAtImages) -> Iterator[Part]:
    common, slope = drift.common, drift.slope
    places = [*(str(k + 1) for k in range(common.size)), "change"]
    yield Table(
        f"Drift of {drift.name[:60]} (model: {drift.model})",
        rows_of(
            Value("", places, "at image"),
            Value("", [*common, common[-1] - common[0]], f"a(t), {drift.unit}", "+.2f"),
            Value("", [*slope, slope[-1] - slope[0]], f"b(t), {drift.slope_unit}", "+.2f"),
        ),
        words=1,
    )
    yield Value("run", drift.name)
    for key in ("model", "significant", "unit", "slope_unit", "common", "slope"):
        yield Value(key, getattr(drift, key))
    images = drift.relation.images
    yield Value("images", images)
    for key, what, unit, found in (
        ("common", "common drift a(t)", drift.unit, drift.relation.common),
        ("slope", "growth of the axis b(t)", drift.slope_unit, drift.relation.slope),
    ):
        rows = [_correlation(one, unit) for one in found]
        title = f"Region and {what}, {images} images"
        yield Table(title, rows, key=f"correlation_{key}", words=1)


def _correlation(one: RegionDrift, unit: str) -> list[Value]:
    return [
        Value("region", one.region, "region"),
        Value("correlation", one.correlation, "correlation", "+.3f"),
        Value("p_value", one.p_value, "p", ".2g"),
        Value("per_k", one.per_k, f"{unit} per K", "+.2f"),
    ]
