"""Means over blocks of time of all candidates and their lags, computed once for all outputs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.modal import Segment, segments_of

IndexArray: TypeAlias = NDArray[np.intp]


@final
@dataclass(frozen=True, slots=True, eq=False)
class Bank:
    """Regressors and displacements of outputs that were measured in the same rows.

    The columns are the candidates without a lag, then behind each time constant, then a one.
    """

    output_names: tuple[str, ...]
    """Names of the outputs, (o,)."""
    regressors: FloatArray
    """Block means, (n, (1 + L) k + 1). [K]"""
    displacement: FloatArray
    """Block means, (n, o). [µm]"""
    weight: FloatArray
    """Measured rows per block mean, (n,). [1]"""
    part: IndexArray
    """Part of the record that each block mean belongs to, (n,); parts are held out whole."""
    experiment: IndexArray
    """Experiment of each block mean, (n,)."""


@final
@dataclass(frozen=True, slots=True)
class RecordPart:
    """A stretch of an experiment that is held out as a whole."""

    experiment: int
    """Number of the experiment, from zero. [1]"""
    start_s: float
    """Begin since the experiment's first row. [s]"""
    duration_s: float
    """Length. [s]"""


def record_parts(experiments: Sequence[Experiment], count: int) -> tuple[RecordPart, ...]:
    """Cut experiments into parts of about equal length."""
    wanted_s = sum(e.duration_s for e in experiments) / count
    parts: list[RecordPart] = []
    for number, experiment in enumerate(experiments):
        pieces = max(1, round(experiment.duration_s / wanted_s))
        length_s = experiment.duration_s / pieces
        parts += [RecordPart(number, i * length_s, length_s) for i in range(pieces)]
    return tuple(parts)


def _check_same_inputs(outputs: Mapping[str, Sequence[Experiment]]) -> None:
    names = list(outputs)
    first = outputs[names[0]]
    for name in names[1:]:
        own = outputs[name]
        same = len(own) == len(first) and all(
            a.sample_time_s == b.sample_time_s
            and (a.u is b.u or np.array_equal(a.u, b.u, equal_nan=True))
            for a, b in zip(own, first, strict=True)
        )
        if not same:
            raise DataError("inputs_not_shared", first=names[0], channel=name)


def _same_rows(outputs: Mapping[str, Sequence[Experiment]]) -> list[list[str]]:
    """Return the outputs grouped by the rows in which they were measured."""
    groups: dict[tuple[bytes, ...], list[str]] = {}
    for name, experiments in outputs.items():
        rows = tuple(np.packbits(np.isnan(e.y)).tobytes() for e in experiments)
        groups.setdefault(rows, []).append(name)
    return list(groups.values())


def _regressors(segment: Segment, time_constants_s: FloatArray) -> FloatArray:
    inputs = segment.mean_u
    means = np.empty((segment.blocks, 1 + time_constants_s.size, inputs.shape[1]))
    means[:, 0] = inputs
    if time_constants_s.size:
        for i in range(inputs.shape[1]):
            means[:, 1:, i] = segment.lag_means(i, time_constants_s)
    return np.column_stack([means.reshape(segment.blocks, -1), np.ones(segment.blocks)])


def _parts_of(segment: Segment, parts: Sequence[RecordPart]) -> IndexArray:
    middle_s = segment.times_s + 0.5 * segment.rows * segment.sample_time_s
    own = [i for i, part in enumerate(parts) if part.experiment == segment.experiment]
    begins = np.array([parts[i].start_s for i in own])
    return own[0] + np.searchsorted(begins[1:], middle_s, side="right")


def banks_of(
    outputs: Mapping[str, Sequence[Experiment]],
    columns: Sequence[int],
    time_constants_s: FloatArray,
    mean_s: float,
    parts: Sequence[RecordPart],
) -> tuple[Bank, ...]:
    """Compute the regressors of all outputs."""
    _check_same_inputs(outputs)
    banks: list[Bank] = []
    for names in _same_rows(outputs):
        segments = [
            segments_of(
                [replace(e, u=e.u[:, columns], ambient_k=None) for e in outputs[name]],
                mean_s,
                [0.0] * len(columns),
            )
            for name in names
        ]
        kept = [s.count > 0 for s in segments[0]]
        rows = list(zip(segments[0], kept, strict=True))
        banks.append(
            Bank(
                output_names=tuple(names),
                regressors=np.concatenate([_regressors(s, time_constants_s)[k] for s, k in rows]),
                displacement=np.column_stack(
                    [
                        np.concatenate([s.y[k] for s, k in zip(own, kept, strict=True)])
                        for own in segments
                    ]
                ),
                weight=np.concatenate([s.count[k] for s, k in rows]),
                part=np.concatenate([_parts_of(s, parts)[k] for s, k in rows]),
                experiment=np.concatenate(
                    [np.full(int(np.count_nonzero(k)), s.experiment) for s, k in rows]
                ),
            )
        )
    return tuple(banks)
