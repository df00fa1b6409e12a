"""The results of ``field`` as tables and as JSON."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from thermaxis import __version__
from thermaxis.cli._text_table import text_table
from thermaxis.cli.axis._field_drift import DriftAtImages
from thermaxis.cli.axis._results import finite_or_none
from thermaxis.errors import printable
from thermaxis.thermal import RegionDrift, ThermalFieldsResult


def fields_as_text(
    result: ThermalFieldsResult, drift: DriftAtImages | None, warnings: Sequence[str]
) -> str:
    """Return the result as tables for a terminal."""
    parts = [_image_table(result), _region_table(result)]
    if drift is not None:
        parts += [_drift_table(drift), *_correlation_tables(drift)]
    parts += [f"warning: {printable(warning, 400)}" for warning in warnings]
    return "\n".join(parts) + "\n"


def _fixed(value: float, sign: str = "") -> str:
    return "–" if math.isnan(value) else f"{value:{sign}.3f}"


def _signed(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:+.2f}"


def _image_table(result: ThermalFieldsResult) -> str:
    rows: list[list[str]] = []
    for k, field in enumerate(result.fields):
        values = field.temperature_c
        time = "" if result.time_s is None else f"{float(result.time_s[k]) / 3600.0:.2f}"
        figures = [f"{float(f(values)):.2f}" for f in (np.nanmin, np.nanmean, np.nanmax)]
        missing = str(int(np.count_nonzero(np.isnan(values))))
        rows.append([f"{k + 1}", printable(field.name, 40), time, *figures, missing])
    change = result.difference_k
    figures = [f"{float(f(change)):+.2f}" for f in (np.nanmin, np.nanmean, np.nanmax)]
    missing = str(int(np.count_nonzero(np.isnan(change))))
    rows.append(["", "last minus first, K", "", *figures, missing])
    across, down = result.fields[0].shape[1], result.fields[0].shape[0]
    title = f"Thermal fields of {across} x {down} pixels, °C"
    heads = ("", "image", "h", "lowest", "mean", "highest", "missing")
    return text_table(title, heads, rows, words=2)


def _region_table(result: ThermalFieldsResult) -> str:
    shown = range(len(result.fields)) if len(result.fields) <= 8 else (0, len(result.fields) - 1)
    heads = ("region", "pixels", *(f"image {k + 1}" for k in shown), "change, K")
    rows = [
        (
            printable(region.name, 40),
            str(int(result.region_pixels[r])),
            *(_fixed(float(result.region_mean_c[k, r])) for k in shown),
            _fixed(float(result.region_change_k[r]), "+"),
        )
        for r, region in enumerate(result.regions)
    ]
    return text_table("Mean temperature of regions, °C", heads, rows, words=1)


def _drift_table(drift: DriftAtImages) -> str:
    heads = ("", "at image", f"a(t), {drift.unit}", f"b(t), {drift.slope_unit}")
    rows = [
        ("", str(k + 1), *(_signed(value) for value in pair))
        for k, pair in enumerate(zip(drift.common.tolist(), drift.slope.tolist(), strict=True))
    ]
    change = [float(drift.common[-1] - drift.common[0]), float(drift.slope[-1] - drift.slope[0])]
    rows.append(("", "change", *(_signed(value) for value in change)))
    title = f"Drift of {printable(drift.name, 60)} (model: {drift.model})"
    return text_table(title, heads, rows, words=1)


def _correlation_tables(drift: DriftAtImages) -> list[str]:
    tables: list[str] = []
    for symbol, unit, found in (
        ("common drift a(t)", drift.unit, drift.relation.common),
        ("growth of the axis b(t)", drift.slope_unit, drift.relation.slope),
    ):
        if not found:
            continue
        rows = [
            (
                printable(one.region, 40),
                _fixed(one.correlation, "+"),
                "–" if math.isnan(one.p_value) else f"{one.p_value:.2g}",
                _signed(one.per_k),
            )
            for one in found
        ]
        title = f"Region and {symbol}, {drift.relation.images} images"
        heads = ("region", "correlation", "p", f"{unit} per K")
        tables.append(text_table(title, heads, rows, words=1))
    return tables


def fields_as_json(
    result: ThermalFieldsResult,
    drift: DriftAtImages | None,
    warnings: Sequence[str],
    options: Mapping[str, object],
) -> dict[str, object]:
    """Return the result with the keys of the command's JSON."""
    time = result.time_s
    images: list[dict[str, object]] = []
    for k, field in enumerate(result.fields):
        values = field.temperature_c
        images.append(
            {
                "name": field.name,
                "time_s": None if time is None else float(time[k]),
                "missing": int(np.count_nonzero(np.isnan(values))),
                "min_c": float(np.nanmin(values)),
                "mean_c": float(np.nanmean(values)),
                "max_c": float(np.nanmax(values)),
            }
        )
    change = result.difference_k
    return {
        "version": __version__,
        "rows": result.fields[0].shape[0],
        "columns": result.fields[0].shape[1],
        **options,
        "images": images,
        "difference": {
            "missing": int(np.count_nonzero(np.isnan(change))),
            "min_k": float(np.nanmin(change)),
            "mean_k": float(np.nanmean(change)),
            "max_k": float(np.nanmax(change)),
        },
        "regions": _regions_as_json(result),
        "drift": None if drift is None else _drift_as_json(drift),
        "warnings": list(warnings),
    }


def _regions_as_json(result: ThermalFieldsResult) -> list[dict[str, object]]:
    return [
        {
            "name": region.name,
            "x_px": [region.left_px, region.right_px],
            "y_px": [region.top_px, region.bottom_px],
            "pixels": int(result.region_pixels[r]),
            "mean_c": [finite_or_none(mean) for mean in result.region_mean_c[:, r].tolist()],
            "change_k": finite_or_none(float(result.region_change_k[r])),
        }
        for r, region in enumerate(result.regions)
    ]


def _drift_as_json(drift: DriftAtImages) -> dict[str, object]:
    return {
        "run": drift.name,
        "model": drift.model,
        "significant": drift.significant,
        "unit": drift.unit,
        "slope_unit": drift.slope_unit,
        "common": [finite_or_none(value) for value in drift.common.tolist()],
        "slope": [finite_or_none(value) for value in drift.slope.tolist()],
        "images": drift.relation.images,
        "correlation_common": [_correlation_as_json(one) for one in drift.relation.common],
        "correlation_slope": [_correlation_as_json(one) for one in drift.relation.slope],
    }


def _correlation_as_json(one: RegionDrift) -> dict[str, object]:
    return {
        "region": one.region,
        "correlation": finite_or_none(one.correlation),
        "per_k": finite_or_none(one.per_k),
        "p_value": finite_or_none(one.p_value),
    }
