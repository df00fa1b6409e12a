"""Find the test that would tell most of what is not known yet."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import final

import numpy as np

from thermaxis.codes import Message
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.modal._evidence import Design, design_of, factored, log_prior_variance
from thermaxis.thermal.modal._modal import ResponseEvidence
from thermaxis.thermal.modal._regressors import segments_of

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
    With the gains' precision A (`log_evidence_of`; transients and offsets integrated out), the rows
    G of a test and the covariance K of its noise, its offset integrated out too, the precision
    after the test is A + G' K^-1 G, whatever the test will show. With the n rows U of the use of
    one input and the variance v of the white noise, the square of its error is
    v trace(U A^-1 U') / n; the squares of all inputs add up.

    References
    ----------
    Pukelsheim 2006 (designs by the precision of what is predicted).
    """
    design, sizes = evidence.design, evidence.wide_sizes or evidence.sizes
    block_s = max(s.rows * s.sample_time_s for s in evidence.segments)
    means = np.concatenate([s.mean_u for s in evidence.segments])
    highest = means[np.argmax(np.abs(means), axis=0), np.arange(design.inputs)]
    # An input rises as fast as it was seen to.
    steps = [np.abs(np.diff(s.mean_u, axis=0)).max(axis=0, initial=0.0) for s in evidence.segments]
    rises_s = block_s * np.maximum(np.abs(highest) / np.fmax(np.max(steps, axis=0), 1e-9), 1.0)
    same = np.array([[one == other for other in alike] for one in alike])
    levels = np.max(np.abs(highest) * same, axis=1)

    def design_of_test(number: int, on_s: float) -> Design:
        t = block_s * (np.arange(max(FEWEST_READINGS, math.ceil(2.0 * on_s / block_s))) + 0.5)
        risen = -np.expm1(-t / rises_s[number]) + np.expm1(
            -np.maximum(t - on_s, 0.0) / rises_s[number]
        )
        u = np.zeros((t.size, design.inputs))
        u[:, number] = levels[number] * risen
        segments = segments_of(
            [Experiment(block_s, u, np.zeros(t.size))], block_s, (0.0,) * design.inputs
        )
        lags_s, scales = evidence.time_constants_s, evidence.scales
        return design_of(segments, lags_s, scales, free_start=False, experiments=1)

    def precision_of(one: Design, gains_known: float) -> tuple[FloatArray, FloatArray]:
        """Return the precision of the gains and what the rows say, (g, g) and (q + 1, q + 1)."""
        gram, _ = one.products(sizes.noise)
        own = replace(sizes, log_transients=sizes.log_transients[: one.transients])
        prior = np.exp(-log_prior_variance(one, own, one.lags))
        prior[: one.gains] *= gains_known
        whole, g = gram.copy(), one.gains
        whole[:-1, :-1] += np.diag(prior)
        cross = whole[g:-1, :g]
        return whole[:g, :g] - cross.T @ np.linalg.solve(whole[g:-1, g:-1], cross), whole

    precision, whole = precision_of(design, 1.0)
    mean = np.asarray(np.linalg.solve(whole[:-1, :-1], whole[:-1, -1]), dtype=np.float64)
    left = max(float(whole[-1, -1] - whole[:-1, -1] @ mean), 0.0)
    unit_um = evidence.scales.y * math.sqrt(left / design.readings)
    settled_s = _settled_s(evidence, mean[: design.gains], levels)
    uses = [design_of_test(k, settled_s).rows[0][:, : design.gains] for k in range(design.inputs)]

    def errors_um(precision: FloatArray) -> FloatArray:
        inverse = np.linalg.inv(factored(precision))
        squares = [np.sum(np.square(inverse @ rows.T)) / rows.shape[0] for rows in uses]
        return np.asarray(unit_um * np.sqrt(squares), dtype=np.float64)

    own_um, tests = errors_um(precision), list[PossibleTest]()
    moved = np.abs(highest) > MOVED * levels
    for k in np.flatnonzero(moved).tolist():
        tried: list[tuple[float, float]] = []
        for on_s in (share * settled_s for share in SHARES):
            rounded_s = HALF_HOUR_S * math.ceil(on_s / HALF_HOUR_S) if on_s > HALF_HOUR_S else on_s
            added, _ = precision_of(design_of_test(k, rounded_s), 0.0)
            tried.append((rounded_s, float(np.linalg.norm(errors_um(precision + added)))))
        least = min(after_um for _, after_um in tried)
        on_s, after_um = next(one for one in tried if one[1] <= AS_GOOD * least)
        level_k, own = abs(float(highest[k])), float(own_um[k])
        tests.append(PossibleTest(input_names[k], level_k, on_s, own, after_um))
    tests.sort(key=lambda test: test.after_um)
    unmoved = tuple(name for name, ran in zip(input_names, moved, strict=True) if not ran)
    return NextTest(float(np.linalg.norm(own_um)), tuple(tests), unmoved)


def _settled_s(evidence: ResponseEvidence, gains: FloatArray, levels: FloatArray) -> float:
    """Return when every source has settled by the mean of its gains; at most the record's length.

    A step leaves the sum over the lags of gain exp(-t / time constant).
    """
    shortest_s = float(evidence.time_constants_s[0])
    times_s = np.geomspace(shortest_s, evidence.longest_s, 200)
    each = gains.reshape(levels.size, -1) * (levels / evidence.scales.u)[:, None]
    left = np.abs(each[:, 1:] @ np.exp(-times_s / evidence.time_constants_s[:, None]))
    largest = max(float(np.max(left)), float(np.max(np.abs(each.sum(axis=1)))))
    late = np.flatnonzero(np.any(left > SETTLED * largest, axis=0))
    return float(times_s[late[-1]]) if late.size else shortest_s
