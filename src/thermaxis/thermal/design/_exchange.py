"""The sequence that leaves least open: exchange of levels, one stretch of one source at a time."""

from collections.abc import Callable, Iterator, Mapping
from enum import StrEnum
from itertools import groupby, product
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.errors import ConfigurationError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.design._conditions import HeatingConditions
from thermaxis.thermal.design._foresight import Foresight

IntArray: TypeAlias = NDArray[np.intp]

STARTS = 4
"""Random sequences from which an exchange begins, beside the customary ones. [1]"""
GAINED = 1e-6
"""Share by which an exchange lowers the mean square at least. [1]"""
_LONGEST_STRETCH = 3
_MOST_ROWS = 9
_RANDOM = 100


@final
class CustomaryTest(StrEnum):
    """How thermal tests are run without a plan."""

    HEATING = "heating"
    """One source after another at its highest level, no cooling."""
    HEAT_AND_COOL = "heat_and_cool"
    """One source after another, each for half of its time, then it cools."""
    RANDOM = "random"
    """Levels at random in every block: the median of a hundred sequences."""


def allowed(conditions: HeatingConditions, sequence: IntArray) -> bool:
    """Whether a sequence of levels by number, (b, s), keeps what is stated."""
    block_min, running = conditions.block_min, sequence > 0
    if bool(
        np.any(running[max(len(sequence) - conditions.whole_blocks(conditions.cool_min), 0) :])
    ):
        return False
    if int(running.sum(axis=1).max()) > conditions.most_at_once:
        return False
    for s, source in enumerate(conditions.each):
        runs = [(level, len(list(run))) for level, run in groupby(sequence[:, s].tolist())]
        for k, (level, length) in enumerate(runs):
            inner = 0 < k < len(runs) - 1  # before the begin and behind the end it stands
            least = source.shortest_on_min if level else source.shortest_off_min * inner
            if length * block_min < least - 1e-9:
                return False
        on = (len(list(run)) for level, run in groupby(running[:, s].tolist()) if level)
        if max(on, default=0) * block_min > source.longest_on_min + 1e-9:
            return False
    return True


def _exchanges(conditions: HeatingConditions, sequence: IntArray) -> Iterator[IntArray]:
    """Yield the allowed sequences that differ in one stretch of one source, or in one block."""
    rows = list(product(*(range(len(source.levels)) for source in conditions.each)))
    for block in range(len(sequence) if len(rows) <= _MOST_ROWS else 0):
        for row in rows:
            other = sequence.copy()
            other[block] = row
            if np.count_nonzero(other != sequence) > 1 and allowed(conditions, other):
                yield other
    for s, source in enumerate(conditions.each):
        least = conditions.whole_blocks(max(source.shortest_on_min, source.shortest_off_min))
        longest = max(_LONGEST_STRETCH, least)
        for length in range(1, min(longest, len(sequence)) + 1):
            for begin in range(len(sequence) - length + 1):
                stretch = sequence[begin : begin + length, s]
                for level in range(len(source.levels)):
                    if not bool(np.any(stretch != level)):
                        continue
                    other = sequence.copy()
                    other[begin : begin + length, s] = level
                    if allowed(conditions, other):
                        yield other


def exchanged(
    conditions: HeatingConditions, foreseen: Foresight, sequence: IntArray
) -> tuple[IntArray, float]:
    """Return the sequence that no single exchange improves, and its mean square. [µm²]

    References
    ----------
    Meyer and Nachtsheim 1995 (coordinate exchange).
    """
    best = float(foreseen.variances_um2(conditions.heat(sequence)[None])[0])
    while others := list(_exchanges(conditions, sequence)):
        values = foreseen.variances_um2(conditions.heat(np.stack(others)))
        if values.min() >= best * (1.0 - GAINED):
            break
        sequence, best = others[int(values.argmin())], float(values.min())
    return sequence, best


def designed(
    conditions: HeatingConditions,
    foreseen: Foresight,
    blocks: int,
    *,
    seed: int = 1,
    starts: int = STARTS,
    progress: Callable[[int, int], None] = lambda _done, _of: None,
) -> IntArray:
    """Return the sequence of levels by number, (b, s), that leaves least open in use.

    Parameters
    ----------
    conditions : HeatingConditions
        What may be switched, and how.
    foreseen : Foresight
        Of so many blocks.
    blocks : int
        Length. [1]
    seed : int
        Seed of the random starts. Default: 1. [1]
    starts : int
        Number of random starts; customary tests that are allowed are starts too, so that the
        sequence is never worse than one of them. Default: 4. [1]
    progress : callable, optional
        Takes starts that are done, and their number.

    Raises
    ------
    ConfigurationError
        If no source can run within what is stated.
    """
    rng = np.random.default_rng(seed)
    begins = [one for one in customary(conditions, blocks).values() if allowed(conditions, one)]
    begins += [random_sequence(conditions, blocks, rng) for _ in range(starts)]
    best, least = begins[0], np.inf
    for k, begin in enumerate(begins):
        progress(k, len(begins))
        sequence, value = exchanged(conditions, foreseen, begin)
        if value < least:
            best, least = sequence, value
    if not best.any():
        raise ConfigurationError("no_sequence_allowed", key="sources")
    return best


def random_sequence(
    conditions: HeatingConditions, blocks: int, rng: np.random.Generator
) -> IntArray:
    """Return levels at random, (b, s), each held as long as it must be."""
    sequence = np.zeros((blocks, len(conditions.sources)), dtype=np.intp)
    end, block_min = blocks - conditions.whole_blocks(conditions.cool_min), conditions.block_min
    order = np.arange(len(conditions.sources))
    for s in rng.permutation(order) if conditions.most_at_once < order.size else order:
        source, begin, on = conditions.each[s], 0, 0
        held, off = (
            max(1, conditions.whole_blocks(least))
            for least in (source.shortest_on_min, source.shortest_off_min)
        )
        while begin < end:
            level = int(rng.integers(len(source.levels)))
            others = np.count_nonzero(sequence[begin : begin + held], axis=1)
            if (
                begin + held > end
                or (on + held) * block_min > source.longest_on_min + 1e-9
                or int(others.max()) >= conditions.most_at_once
            ):
                level = 0
            length = held if level else off
            sequence[begin : begin + length, s] = level
            begin, on = begin + length, on + length if level else 0
    return sequence


def customary(conditions: HeatingConditions, blocks: int) -> Mapping[CustomaryTest, IntArray]:
    """Return the customary tests of the same length that need no chance, (b, s) each."""
    sources = len(conditions.sources)
    found: dict[CustomaryTest, IntArray] = {}
    for test in (CustomaryTest.HEATING, CustomaryTest.HEAT_AND_COOL):
        sequence = np.zeros((blocks, sources), dtype=np.intp)
        for s, source in enumerate(conditions.each):
            begin, end = blocks * s // sources, blocks * (s + 1) // sources
            if test is CustomaryTest.HEAT_AND_COOL:
                end = (begin + end + 1) // 2
            sequence[begin:end, s] = len(source.levels) - 1
        found[test] = sequence
    return found


def customary_um(
    conditions: HeatingConditions, foreseen: Foresight, blocks: int, seed: int = 1
) -> Mapping[CustomaryTest, float]:
    """Return what customary tests of the same length leave open in use. [µm]"""
    found = {
        test: foreseen.foreseen_um(conditions.heat(sequence))
        for test, sequence in customary(conditions, blocks).items()
    }
    rng = np.random.default_rng(seed)
    levels = [len(source.levels) for source in conditions.each]
    drawn = rng.integers(0, levels, (_RANDOM, blocks, len(levels)))
    median = float(np.median(foreseen.variances_um2(conditions.heat(drawn))))
    return {**found, CustomaryTest.RANDOM: median**0.5}


def by_duration_um(foreseen: Foresight, heat: FloatArray) -> FloatArray:
    """Return what is left open in use after each block of a sequence, (b,). [µm]"""
    return np.array([foreseen.foreseen_um(heat, k + 1) for k in range(len(heat))])
