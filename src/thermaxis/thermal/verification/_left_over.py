"""What a free run left over: does it scatter, drift, or still follow an input?"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import block_means, block_numbers
from thermaxis.thermal.transfer_function import ResidualAnalysis, analyse_residuals
from thermaxis.thermal.verification._verification import Verification, VerifiedOutput

ANALYSED_MEANS = 400
"""Means of a log that are analysed: 25 lags of them are a sixteenth of it. [1]"""
_LARGEST_LAG_SHARE = 0.1
_ENOUGH = 1.25


@final
@dataclass(frozen=True, slots=True, eq=False)
class LeftOver:
    """Residual analysis of one output."""

    channel: str
    inputs: tuple[str, ...]
    """Names of the inputs, in the order of the analysis."""
    analysis: ResidualAnalysis
    step_s: float
    """Means over so much time were analysed. [s]"""

    @property
    def messages(self) -> tuple[Message, ...]:
        """What it means: white or slow, and which inputs are not explained at which lag."""
        return tuple(self._messages())

    def _messages(self) -> Iterator[Message]:
        found = self.analysis
        values = {
            "channel": self.channel,
            "step_min": self.step_s / 60.0,
            "white_p": found.white_p,
            "correlation": float(found.autocorrelation[1]),
            "rows": found.rows,
            "worth": found.residual_effective_rows,
        }
        yield Message("residual-white" if found.white else "residual-slow", values)
        for k, name in enumerate(self.inputs):
            if not found.independent[k]:
                lag_min = float(found.input_lags[k]) * self.step_s / 60.0
                values = {
                    "channel": self.channel,
                    "name": name,
                    "from_min": lag_min,
                    "to_min": lag_min + self.step_s / 60.0,
                    "p": float(found.input_p[k]),
                }
                yield Message("residual-input", values)


def left_over(runs: Sequence[VerifiedOutput]) -> LeftOver:
    """Analyse what the free runs of one output left over, on means of their logs.

    Parameters
    ----------
    runs : sequence of VerifiedOutput
        The same output on one log or several; rows that do not count are left out.

    Returns
    -------
    LeftOver
        Correlations of the residual, with what they mean.

    Raises
    ------
    DataError
        If too few rows were measured.
    """
    step_s = max(max(float(np.ptp(run.time_s)) for run in runs) / ANALYSED_MEANS, _gap_s(runs))
    means = [_means(run, step_s) for run in runs]
    residuals = [residual for residual, _ in means]
    known = max(int(np.count_nonzero(~np.isnan(e))) for e in residuals)
    lags = int(np.clip(_LARGEST_LAG_SHARE * known, 1, 25))
    analysis = analyse_residuals(residuals, [inputs for _, inputs in means], lags=lags)
    return LeftOver(runs[0].measured.name, runs[0].parts, analysis, step_s)


def _means(run: VerifiedOutput, step_s: float) -> tuple[FloatArray, FloatArray]:
    """Return means of the residual over the rows that count, (b,), and of the inputs, (b, k)."""
    number = block_numbers(run.time_s - run.time_s[0], step_s)
    blocks = int(number[-1]) + 1
    residual = np.where(run.counted, run.residual_um, np.nan)
    inputs = [block_means(column, number, blocks) for column in run.input_k.T]
    return block_means(residual, number, blocks), np.stack(inputs, axis=1)


def left_over_messages(result: Verification) -> list[Message]:
    """Return what every output's residual says over all logs, or why it says nothing."""
    said: list[Message] = []
    for name in result.pooled:
        try:
            said += left_over(runs_of(result, name)).messages
        except DataError as error:
            if error.message.code == "error-too_few_residuals":
                said.append(Message("residual-few_rows", {"channel": name}))
            else:
                said.append(replace(error.message, place=Place(channel=name)))
    return said


def runs_of(result: Verification, name: str) -> list[VerifiedOutput]:
    """Return the free runs of a measured channel, one per log."""
    return [run for log in result.logs for run in log.outputs if run.measured.name == name]


def _gap_s(runs: Sequence[VerifiedOutput]) -> float:
    """Return a time in which there mostly is a measured row: bursts have long pauses. [s]"""
    gaps = np.sort(np.concatenate([np.diff(run.time_s[run.counted]) for run in runs]))
    if gaps.size == 0:
        return 1.0
    middle = np.searchsorted(np.cumsum(gaps), 0.5 * float(np.sum(gaps)))  # of the time
    return _ENOUGH * float(gaps[middle])
