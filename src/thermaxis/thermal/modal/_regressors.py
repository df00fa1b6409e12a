"""Averages over blocks of time of what lags make of the inputs, exact at the log's own rate.

Averaging is linear: the mean of the displacement over a block is the same mean of the lagged
inputs times the gains. A search over time constants therefore works on a few hundred block means
and loses nothing but what changes within a block.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray, recursion
from thermaxis.thermal.log import Experiment

BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.intp]

LONGEST_GAP_S = 900.0
"""Inputs missing for longer are not interpolated: the record is cut there. [s]"""
AT_REFERENCE = 0.15
"""First value over the root mean square of an input up to which it begins at its reference. [1]"""
AMBIENT_LAGS_S = (1800.0, 7200.0, 28800.0)
"""Lags through which a drift may follow the ambient. [s]"""
NODES, SHORTEST = 24, 1.0 / 12.0
"""Rows of a block at whose ages the response of a lag is known, the others being between, exact to
1e-14 [1]; and the shortest time constant over the length of a block for which that holds. [1]"""
MANY_BLOCKS = 30
"""In a record of more blocks than these the rows of an unfinished last block are left out. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """A stretch of one experiment without a long gap in the inputs, cut into blocks."""

    experiment: int
    """Number of the experiment, from zero. [1]"""
    start_s: float
    """Time of the first row since the experiment's first row. [s]"""
    sample_time_s: float
    """Time between rows. [s]"""
    rows: int
    """Rows per block. [1]"""
    u: tuple[FloatArray, ...]
    """Inputs after their delays without gaps, k arrays (blocks x rows,). [K]"""
    mean_u: FloatArray
    """Mean inputs per block, (blocks, k). [K]"""
    start: tuple[float, ...]
    """State of every input's lags at the first row, but for transients. [K]"""
    y: FloatArray
    """Mean displacement per block, (blocks,); NaN where a block has none. [µm]"""
    count: FloatArray
    """Displacements measured per block, (blocks,). [1]"""
    measured: FloatArray | None
    """One where the displacement was measured, else zero, (blocks, rows); None if always."""
    ages: FloatArray
    """Ages within a block for which the next three are sums, (a,): every row's, or nodes. [row]"""
    until_end: FloatArray
    """Inputs by their age at the end of their block, (k, blocks, a). [K]"""
    until_measured: FloatArray
    """Mean over the measured rows of a block of its inputs by age, (k, blocks, a). [K]"""
    since_begin: FloatArray
    """Share of the measured rows by their time since the block's begin, (blocks, a). [1]"""
    zero: IntArray
    """Rows whose mean displacement is the experiment's zero; empty but in one segment, (z,)."""
    zero_um: float
    """That mean. [µm]"""
    ambient: FloatArray
    """Mean of the ambient and of its lags per block, (blocks, a); a = 0 if not known. [K]"""

    @property
    def blocks(self) -> int:
        """Number of blocks. [1]"""
        return int(self.y.size)

    @property
    def times_s(self) -> FloatArray:
        """Begin of every block since the experiment's first row, (blocks,). [s]"""
        return self.start_s + self.rows * self.sample_time_s * np.arange(
            self.blocks, dtype=np.float64
        )

    def means(self, values: FloatArray) -> FloatArray:
        """Return the means per block of a series at full rate, over measured rows."""
        return _block_means(values, self.rows, self.measured)

    def lag_means(self, column: int, time_constants_s: FloatArray) -> FloatArray:
        """Return the mean of lagged inputs per block, (blocks, j). [K]

        Notes
        -----
        Within a block the lag's state is linear in its value at the block's begin and in the
        inputs, which fade by their age: one product of matrices gives the sums of all lags, and a
        recursion from block to block the begins.
        """
        u, start = self.u[column], self.start[column]
        log_keep = -self.sample_time_s / time_constants_s
        alpha = -np.expm1(log_keep)
        if not self._between(time_constants_s):
            return np.column_stack(
                [self.means(recursion(1.0 - a, a * u[:-1], start)) for a in alpha.tolist()]
            )
        left = np.exp(np.outer(self.ages, log_keep))
        ends = (self.until_end[column, :-1] @ left) * alpha
        keep = np.exp(self.rows * log_keep).tolist()
        begins = [recursion(k, e, start) for k, e in zip(keep, ends.T, strict=True)]
        within = (self.until_measured[column] @ left) * alpha
        return within + (self.since_begin @ left) * np.stack(begins, axis=1)

    def _between(self, time_constants_s: FloatArray) -> bool:
        """Whether the sums by age hold for these time constants."""
        shortest_s = SHORTEST * self.rows * self.sample_time_s
        return self.rows <= NODES or float(np.min(time_constants_s)) >= shortest_s

    def lag_zero(self, column: int, time_constants_s: FloatArray) -> FloatArray:
        """Return the mean of an input and of its lags at the rows of the zero, (1 + j,). [K]"""
        u = self.u[column][: self.zero[-1] + 1]
        alphas = -np.expm1(-self.sample_time_s / time_constants_s)
        lagged = [recursion(1.0 - a, a * u[:-1], self.start[column]) for a in alphas.tolist()]
        return np.mean(np.stack([u, *lagged])[:, self.zero], axis=1)

    def fading_zero(self, time_constants_s: FloatArray) -> FloatArray:
        """Return the mean at the rows of the zero of what is left of a unit start, (j,). [1]"""
        times_s = self.sample_time_s * self.zero[:, None]
        return np.mean(np.exp(-times_s / time_constants_s), axis=0)

    def fading_means(self, time_constants_s: FloatArray) -> FloatArray:
        """Return the mean per block of what is left of a unit start, (blocks, j). [1]"""
        log_keep = -self.sample_time_s / time_constants_s
        if not self._between(time_constants_s):
            row = np.arange(self.blocks * self.rows, dtype=np.float64)
            return np.column_stack([self.means(np.exp(row * k)) for k in log_keep.tolist()])
        first = np.exp(self.rows * np.arange(self.blocks)[:, None] * log_keep)
        return np.asarray(first * (self.since_begin @ np.exp(np.outer(self.ages, log_keep))))


def _block_means(values: FloatArray, rows: int, measured: FloatArray | None) -> FloatArray:
    blocked = values.reshape(-1, rows)
    if measured is None:
        return np.asarray(blocked.mean(axis=1), dtype=np.float64)
    total = np.einsum("br,br->b", blocked, measured)
    return np.asarray(total / np.maximum(measured.sum(axis=1), 1.0))


def _ages(rows: int) -> tuple[FloatArray, FloatArray]:
    """Return ages, (a,), and how much of each the whole ages of a block are, (rows, a).

    The response of a lag is a polynomial in the age for all that counts.

    References
    ----------
    Berrut and Trefethen 2004 (barycentric interpolation at Chebyshev points).
    """
    if rows <= NODES:
        return np.arange(rows, dtype=np.float64), np.eye(rows)
    angle = (np.arange(NODES) + 0.5) * np.pi / NODES
    ages = 0.5 * (rows - 1) * (1.0 - np.cos(angle))
    apart = np.arange(rows)[:, None] - ages
    hit = np.abs(apart) < 1e-9
    share = (-1.0) ** np.arange(NODES) * np.sin(angle) / np.where(hit, 1e-300, apart)
    return ages, share / np.sum(share, axis=1, keepdims=True)


def _by_age(
    columns: Sequence[FloatArray], rows: int, counted: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the sums by age of a segment; `counted` are weights of its rows, (blocks, rows).

    The mean over measured rows m of what was s rows before, sum of w(m) u(m - 1 - s), is a
    correlation within the block.
    """
    ages, share = _ages(rows)
    blocks, size = counted.shape[0], 1 << (2 * rows - 1).bit_length()
    until_end = np.empty((len(columns), blocks, ages.size))
    until_measured = np.empty_like(until_end)
    weights = np.fft.rfft(counted, size)
    for k, column in enumerate(columns):
        u = column.reshape(blocks, rows)
        until_end[k] = u @ share[::-1]
        before = np.fft.irfft(weights * np.conj(np.fft.rfft(u, size)), size)
        until_measured[k] = before[:, 1 : 1 + rows] @ share
    return ages, until_end, until_measured, counted @ share


def _without_gaps(values: FloatArray) -> FloatArray:
    """Interpolate missing values; hold the first and the last measured one beyond them."""
    missing = np.isnan(values)
    if not bool(np.any(missing)):
        return values
    row = np.arange(values.size)
    return np.interp(row, row[~missing], values[~missing])


def _runs(wanted: BoolArray) -> list[tuple[int, int]]:
    """Return first and last-plus-one index of every run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], wanted.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _stretches(u: FloatArray, longest_gap: int) -> list[tuple[int, int]]:
    """Return first and last-plus-one row of the stretches without a long gap in any input."""
    if np.isfinite(np.sum(u)):
        return [(0, u.shape[0])]
    cut = np.zeros(u.shape[0], dtype=bool)
    for column in np.isnan(u).T:
        for begin, end in _runs(column):
            if end - begin > longest_gap:
                cut[begin:end] = True
    return _runs(~cut)


def _starts(columns: Sequence[FloatArray]) -> tuple[float, ...]:
    """Return where the lags of every input begin.

    A machine in its reference state has lags at zero, whatever the first reading says: rounding
    and the rise within the first row are no state. Else the first value is taken as lasting.
    """
    first = [float(c[0]) for c in columns]
    at_reference = all(
        abs(value) <= AT_REFERENCE * float(np.sqrt(np.mean(np.square(c))))
        for value, c in zip(first, columns, strict=True)
    )
    return (0.0,) * len(first) if at_reference else tuple(first)


def _segment(
    experiment: Experiment,
    number: int,
    span: tuple[int, int],
    rows: int,
    late: Sequence[int],
    zero: IntArray,
) -> Segment | None:
    begin, end = span
    zero = zero[(begin <= zero) & (zero < end)]
    u, y = experiment.u[begin:end], experiment.y[begin:end]
    columns: list[FloatArray] = []
    for i, rows_late in enumerate(late):
        column = _without_gaps(np.ascontiguousarray(u[:, i]))
        held = min(rows_late, column.size)
        columns.append(np.concatenate([np.full(held, column[0]), column[: column.size - held]]))
    blocks = -(-y.size // rows)
    if y.size % rows and blocks > MANY_BLOCKS:
        blocks -= 1
        y, columns = y[: blocks * rows], [c[: blocks * rows] for c in columns]
        zero = zero[zero < begin + y.size]
    padding = blocks * rows - y.size
    missing = np.isnan(y)
    if padding:
        # The last block is filled up with rows that count for nothing.
        columns = [np.concatenate([c, np.full(padding, c[-1])]) for c in columns]
        y = np.concatenate([y, np.full(padding, np.nan)])
        missing = np.isnan(y)
    blocked = y.reshape(blocks, rows)
    if not bool(np.any(missing)):
        mean, count, measured = blocked.mean(axis=1), np.full(blocks, float(rows)), None
    else:
        measured = (~missing).reshape(blocks, rows).astype(np.float64)
        count = measured.sum(axis=1)
        mean = np.where(count > 0, np.nansum(blocked, axis=1) / np.maximum(count, 1.0), np.nan)
    if not np.any(count > 0):
        return None
    weights = np.ones((blocks, rows)) if measured is None else measured
    by_age = _by_age(columns, rows, weights / np.maximum(count, 1.0)[:, None])
    ages, until_end, until_measured, since_begin = by_age
    return Segment(
        experiment=number,
        start_s=begin * experiment.sample_time_s,
        sample_time_s=experiment.sample_time_s,
        rows=rows,
        u=tuple(columns),
        start=_starts(columns),
        mean_u=np.column_stack([_block_means(c, rows, measured) for c in columns]),
        y=mean,
        count=count,
        measured=measured,
        ages=ages,
        until_end=until_end,
        until_measured=until_measured,
        since_begin=since_begin,
        zero=zero - begin,
        zero_um=float(np.mean(experiment.y[zero])) if zero.size else 0.0,
        ambient=_ambient_means(experiment, span, blocks, rows),
    )


def _ambient_means(
    experiment: Experiment, span: tuple[int, int], blocks: int, rows: int
) -> FloatArray:
    """Return a lag of the ambient, and what differs between it and others: means are lagged.

    The differences, which vanish at rest, are what noise and rounding of its sensor do to inputs.
    """
    if experiment.ambient_k is None or bool(np.all(np.isnan(experiment.ambient_k))):
        return np.empty((blocks, 0))
    ambient = _without_gaps(experiment.ambient_k[slice(*span)])
    ambient = np.pad(ambient, (0, max(blocks * rows - ambient.size, 0)), mode="edge")
    mean = _block_means(ambient[: blocks * rows], rows, None)
    keep = np.exp(-rows * experiment.sample_time_s / np.array(AMBIENT_LAGS_S))
    lagged = [recursion(k, (1.0 - k) * mean[1:], mean[0]) for k in keep.tolist()]
    return np.column_stack([lagged[1], -np.diff([mean, *lagged], axis=0).T])


def _zero_rows(experiment: Experiment, spans: Sequence[tuple[int, int]]) -> IntArray:
    """Return the rows that a record's displacements refer to: measured in its first time, or one.

    They are those of `records_of`: the mean over the first time of a log is its zero.
    """
    usable = np.zeros(experiment.y.size, dtype=np.bool_)
    for begin, end in spans:
        usable[begin:end] = True
    measured = np.flatnonzero(usable & ~np.isnan(experiment.y))
    early = measured[measured * experiment.sample_time_s <= experiment.reference_s]
    return early if early.size else measured[:1]


def segments_of(
    experiments: Sequence[Experiment], block_s: float, delays_s: Sequence[float]
) -> tuple[Segment, ...]:
    """Cut experiments into blocks of about one length."""
    found: list[Segment] = []
    for number, experiment in enumerate(experiments):
        step_s = experiment.sample_time_s
        rows = max(1, int(block_s / step_s + 1e-9))
        late = [round(delay / step_s) for delay in delays_s]
        gap = max(1, int(LONGEST_GAP_S / step_s))
        spans = _stretches(experiment.u, gap)
        zero = _zero_rows(experiment, spans)
        for span in spans:
            segment = _segment(experiment, number, span, rows, late, zero)
            if segment is not None:
                found.append(segment)
    if not found:
        raise DataError("no_complete_row")
    return tuple(found)
