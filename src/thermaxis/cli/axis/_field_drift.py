"""The drift of a positioning run at the times of thermal images."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from thermaxis.cli._reading import Reading
from thermaxis.codes import Message, remark
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_positioning
from thermaxis.positioning import DriftResult, FloatArray, evaluate_drift
from thermaxis.quantities import AxisKind
from thermaxis.thermal import DriftRelation, ThermalFieldsResult, relate_to_drift

EDGE_SHARE = 0.05
"""An image taken that share of the run's duration before or after it counts as taken at its end."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class DriftAtImages:
    """The drift of a run at the images, and what it has to do with the regions."""

    name: str
    """Name of the run's file."""
    model: str
    """Drift model that the run supports."""
    significant: bool
    unit: str
    """Unit of the common drift."""
    slope_unit: str
    """Unit of the growth of the axis."""
    common: FloatArray
    """a(t) at the images, (k,); NaN outside the run. [unit]"""
    slope: FloatArray
    """b(t) at the images, (k,); NaN outside the run. [slope_unit]"""
    relation: DriftRelation
    warnings: tuple[Message, ...]
    """What the reader must know."""


def drift_at_images(path: Path, result: ThermalFieldsResult, reading: Reading) -> DriftAtImages:
    """Evaluate the drift of a run and set it beside thermal images."""
    test = read_positioning(path, **reading)
    drift = evaluate_drift(test)
    time_s, said = _times_in_run(drift, result)
    first, last = float(drift.time_s[0]), float(drift.time_s[-1])
    edge = EDGE_SHARE * (last - first)
    inside = (time_s >= first - edge) & (time_s <= last + edge)
    if bool(np.any(inside & ((time_s < first) | (time_s > last)))):
        said.append(remark("image_at_edge_of_run"))
    if not bool(np.all(inside)):
        numbers = ", ".join(str(k + 1) for k in np.flatnonzero(~inside).tolist())
        said.append(remark("image_outside_run", images=numbers))
    common = np.where(inside, np.interp(time_s, drift.time_s, drift.common), np.nan)
    slope = np.where(inside, 1000.0 * np.interp(time_s, drift.time_s, drift.slope), np.nan)
    relation = relate_to_drift(result, common, slope)
    return DriftAtImages(
        name=path.name,
        model=str(drift.model),
        significant=drift.significant,
        unit=test.kind.units.deviation,
        slope_unit="µm/m" if test.kind is AxisKind.LINEAR else "arcsec per 1000°",
        common=common,
        slope=slope,
        relation=relation,
        warnings=(*drift.warnings, *said, *_judgement(drift, relation)),
    )


def _times_in_run(
    drift: DriftResult, result: ThermalFieldsResult
) -> tuple[FloatArray, list[Message]]:
    if result.time_s is not None:
        if drift.reference_time_s is None:
            raise ConfigurationError("run_without_times", key="--times")
        return result.time_s, []
    if len(result.fields) > 2:
        raise ConfigurationError("option_needs", key="--run", option="--run", needed="--times")
    return drift.time_s[[0, -1]], [remark("images_without_times")]


def _judgement(drift: DriftResult, relation: DriftRelation) -> Iterator[Message]:
    if not drift.significant:
        yield remark("no_drift_to_explain")
    if relation.images < 3:
        yield remark("images_without_correlation", images=relation.images)
    else:
        yield remark("correlation_no_proof")
