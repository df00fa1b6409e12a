"""Find the test that would tell most of what is not known yet."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import final

import numpy as np

from thermaxis.codes import Message
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.design._foresight import foresight_of
from thermaxis.thermal.design._prior import GainsPrior
from thermaxis.thermal.design._responses import pulses
from thermaxis.thermal.modal import ResponseEvidence

SETTLED = 0.05
"""What is left of the largest displacement when a source has settled: three time constants. [1]"""
SHARES = (1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Shares of the time to settle for which tests heat: one, two and three time constants. [1]"""
AS_GOOD, HELPS = 1.15, 0.8
"""A shorter test is taken where it leaves at most so many times what the best leaves; a test helps
where it leaves at most this share. [1]"""
MOVED = 0.02
"""Share of the highest level of its kind below which an input never moved. [1]"""
FEWEST_READINGS = 8
"""Blocks that a test has at least. [1]"""
HALF_HOUR_S = 1800.0
"""Times of tests that are longer are rounded up to it. [s]"""


@final
@dataclass(frozen=True, slots=True)
class PossibleTest:
    """One source runs, the others stand; then it cools for as long."""

    input: str
    """Name of the input that it heats."""
    level_k: float
    """The most that the input changed in the records. [K]"""
    on_s: float
    """How long it heats, and cools. [s]"""
    own_um: float
    """Error of what this input does in use, by the records. [µm]"""
    after_um: float
    """Error in use of all inputs with this test added. [µm]"""


@final
@dataclass(frozen=True, slots=True)
class NextTest:
    """Tests of which the records ask for the first."""

    before_um: float
    """Error in use by the records: standard deviation of what the gains say of every input alone,
    from rest until it has settled and back; tests are ordered by what they leave of it. [µm]"""
    tests: tuple[PossibleTest, ...]
    """One for every input that moved, the best first."""
    unmoved: tuple[str, ...] = ()
    """Inputs that never moved in the records."""
    not_asked: frozenset[str] = frozenset()
    """Inputs that are known well enough, or that nothing can heat."""
    settled_um: Mapping[str, float] = field(default_factory=dict[str, float])
    """Half of the 95 % interval of what an input does at its highest level when it has settled, by
    that of its DC gain; none where this has none. [µm]"""

    @property
    def message(self) -> Message:
        """What to do, and why."""
        if self.unmoved:
            return Message("next_test-unmoved", {"inputs": ", ".join(self.unmoved)})
        best = next((test for test in self.tests if test.input not in self.not_asked), None)
        if best is None or best.after_um > HELPS * self.before_um:
            return Message("next_test-none")
        what = {"input": best.input, "level_k": best.level_k, "on_s": best.on_s}
        if (um := self.settled_um.get(best.input)) is None:
            return Message("next_test-no_interval", what)
        return Message("next_test-run", {**what, "open_um": significant(um, 2)})


def next_test(
    evidence: ResponseEvidence, input_names: Sequence[str], alike: Sequence[object]
) -> NextTest:
    """Return the tests that shrink the error in use most, by the gains over the grid.

    Inputs that are `alike` (of one unit and form) are compared as if they were used up to one
    level, so that a source that hardly ran counts as much as the others.

    Notes
    -----
    What is known is the gains' covariance by the record, what is wanted one input alone, from rest
    until it has settled and back; what a test leaves is its `Foresight`.
    """
    sizes = evidence.wide_sizes or evidence.sizes
    block_s = max(s.rows * s.sample_time_s for s in evidence.segments)
    means = np.concatenate([s.mean_u for s in evidence.segments])
    highest = means[np.argmax(np.abs(means), axis=0), np.arange(means.shape[1])]
    # An input rises as fast as it was seen to.
    steps = [np.abs(np.diff(s.mean_u, axis=0)).max(axis=0, initial=0.0) for s in evidence.segments]
    rises_s = block_s * np.maximum(np.abs(highest) / np.fmax(np.max(steps, axis=0), 1e-9), 1.0)
    same = np.array([[one == other for other in alike] for one in alike])
    levels = np.max(np.abs(highest) * same, axis=1)
    mean_um_per_k, factor_um_per_k, unit_um = evidence.gains()
    at = np.repeat(levels, 1 + evidence.time_constants_s.size)
    prior = GainsPrior(evidence.time_constants_s, at * mean_um_per_k, at[:, None] * factor_um_per_k)
    settled_s = _settled_s(evidence, prior.mean_um, levels)

    def length(on_s: float) -> tuple[int, float, int]:
        rows = max(FEWEST_READINGS // 2, math.ceil(on_s / block_s))
        return 2, rows * block_s, rows

    uses: list[FloatArray] = []
    for rise_s, own in zip(rises_s.tolist(), np.split(prior.factor_um, levels.size), strict=True):
        used = pulses(*length(settled_s), prior.time_constants_s, rise_s)[0] @ own
        uses.append(used.T @ used / len(used))
    own_um = np.sqrt([np.trace(use) for use in uses])
    use = np.asarray(np.sum(uses, axis=0), dtype=np.float64)

    def left_um(heat: FloatArray, on_s: float) -> float:
        times_s = block_s * np.arange(2 * length(on_s)[2], dtype=np.float64)
        covariance = unit_um**2 * (sizes.noise.covariance(times_s, block_s) + sizes.offset_ratio)
        after = foresight_of(prior, covariance, (use,), rises_s[None], length(on_s))
        return after.foreseen_um(heat)

    tests = list[PossibleTest]()
    moved = np.abs(highest) > MOVED * levels
    for k in np.flatnonzero(moved).tolist():
        heat = np.zeros((2, len(levels)))
        heat[0, k] = 1.0
        tried: list[tuple[float, float]] = []
        for on_s in (share * settled_s for share in SHARES):
            rounded_s = HALF_HOUR_S * math.ceil(on_s / HALF_HOUR_S) if on_s > HALF_HOUR_S else on_s
            tried.append((rounded_s, left_um(heat, rounded_s)))
        least = min(after_um for _, after_um in tried)
        on_s, after_um = next(one for one in tried if one[1] <= AS_GOOD * least)
        level_k, own = abs(float(highest[k])), float(own_um[k])
        tests.append(PossibleTest(input_names[k], level_k, on_s, own, after_um))
    tests.sort(key=lambda test: test.after_um)
    unmoved = tuple(name for name, ran in zip(input_names, moved, strict=True) if not ran)
    return NextTest(float(np.linalg.norm(own_um)), tuple(tests), unmoved)


def _settled_s(evidence: ResponseEvidence, gains_um: FloatArray, levels: FloatArray) -> float:
    """Return when every source has settled by the mean of its gains; at most the record's length.

    A step leaves the sum over the lags of gain exp(-t / time constant).
    """
    shortest_s = float(evidence.time_constants_s[0])
    times_s = np.geomspace(shortest_s, evidence.longest_s, 200)
    each = gains_um.reshape(levels.size, -1)
    left = np.abs(each[:, 1:] @ np.exp(-times_s / evidence.time_constants_s[:, None]))
    largest = max(float(np.max(left)), float(np.max(np.abs(each.sum(axis=1)))))
    late = np.flatnonzero(np.any(left > SETTLED * largest, axis=0))
    return float(times_s[late[-1]]) if late.size else shortest_s
