"""A planned thermal test: what runs when, and how sure a model will be after each block."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np

from thermaxis.errors import ConfigurationError
from thermaxis.thermal._arrays import FloatArray, frozen_array
from thermaxis.thermal.design._conditions import HeatingConditions
from thermaxis.thermal.design._exchange import (
    CustomaryTest,
    IntArray,
    allowed,
    by_duration_um,
    customary_um,
    designed,
)
from thermaxis.thermal.design._foresight import foresight
from thermaxis.thermal.design._prior import GainsPrior


@final
@dataclass(frozen=True, slots=True)
class PlannedKnowledge:
    """What was known when a test was planned: `GainsPrior` as a file has it."""

    time_constants_s: tuple[float, ...]
    mean_um: tuple[float, ...]
    factor_um: tuple[tuple[float, ...], ...]

    @property
    def prior(self) -> GainsPrior:
        """The moments of the gains."""
        arrays = (frozen_array(self.time_constants_s), frozen_array(self.mean_um))
        return GainsPrior(*arrays, np.array(self.factor_um))


class PlannedStep(NamedTuple):
    """A time in which no source changes its level."""

    begin_s: float
    """Since the begin of the rest. [s]"""
    duration_s: float
    """How long. [s]"""
    levels: tuple[float, ...]
    """Level of each source. [its unit]"""


@final
@dataclass(frozen=True, slots=True)
class ThermalTestPlan:
    """A sequence of heating with what it will reach.

    Raises
    ------
    ConfigurationError
        If a level is none of its source, or the sequence breaks what is stated.
    """

    conditions: HeatingConditions
    blocks: tuple[tuple[float, ...], ...]
    """Level of each source in each block. [its unit]"""
    foreseen_um: tuple[float, ...]
    """Standard deviation of what is wanted after each block. [µm]"""
    settled_um: tuple[float, ...]
    """Standard deviation of what each source does at its highest level when it has settled, after
    the whole test. [µm]"""
    customary_um: Mapping[CustomaryTest, float]
    """What customary tests of the same length leave. [µm]"""
    knowledge: PlannedKnowledge

    def __post_init__(self) -> None:
        if len(self.foreseen_um) != len(self.blocks):
            raise ConfigurationError("plan_incomplete", key="foreseen_um")
        if not allowed(self.conditions, self.sequence):
            raise ConfigurationError("sequence_not_allowed", key="blocks")

    @property
    def sequence(self) -> IntArray:
        """Levels by number, (b, s). [1]"""
        each = self.conditions.each
        for k, block in enumerate(self.blocks):
            if len(block) != len(each) or any(
                level not in source.levels for level, source in zip(block, each, strict=True)
            ):
                raise ConfigurationError("no_such_level", key=f"blocks[{k}]")
        found = [[s.levels.index(x) for x, s in zip(b, each, strict=True)] for b in self.blocks]
        return np.array(found, dtype=np.intp).reshape(len(found), len(each))

    @property
    def duration_s(self) -> float:
        """How long it lasts, its rest included. [s]"""
        return 60.0 * (self.conditions.rest_min + self.conditions.block_min * len(self.blocks))

    @property
    def steps(self) -> tuple[PlannedStep, ...]:
        """The rest, and the times between changes of level."""
        block_s, begin_s = 60.0 * self.conditions.block_min, 60.0 * self.conditions.rest_min
        found = [PlannedStep(0.0, begin_s, (0.0,) * len(self.conditions.sources))]
        for levels in self.blocks:
            last = found[-1]
            if len(found) > 1 and levels == last.levels:
                found[-1] = last._replace(duration_s=last.duration_s + block_s)
            else:
                found.append(PlannedStep(begin_s, block_s, levels))
            begin_s += block_s
        return tuple(found)

    @property
    def enough_s(self) -> float | None:
        """When `enough_um` is foreseen to be reached; None: not stated, or not in this test."""
        enough_um = self.conditions.enough_um
        if enough_um is None:
            return None
        reached = [k for k, um in enumerate(self.foreseen_um, start=1) if um <= enough_um]
        conditions = self.conditions
        return 60.0 * (conditions.rest_min + reached[0] * conditions.block_min) if reached else None

    def foreseen_at_um(self, time_s: float) -> float | None:
        """Return what is foreseen for a time since the begin of the rest; None before a block."""
        block_s, rest_s = 60.0 * self.conditions.block_min, 60.0 * self.conditions.rest_min
        block = int((time_s - rest_s) / block_s + 1e-9)
        if block < 1:
            return None
        return self.foreseen_um[min(block, len(self.foreseen_um)) - 1]


def planned(
    conditions: HeatingConditions,
    prior: GainsPrior,
    duration_s: float,
    *,
    seed: int = 1,
    progress: Callable[[int, int], None] = lambda _done, _of: None,
) -> ThermalTestPlan:
    """Return the test of a duration after which least is open.

    Parameters
    ----------
    conditions : HeatingConditions
        What may be switched, what is measured, what is wanted.
    prior : GainsPrior
        What is known, as of `prior_of`, or of `reached` after a test.
    duration_s : float
        Length without its rest. [s]
    seed : int
        Seed of the search. Default: 1. [1]
    progress : callable, optional
        Takes starts that are done, and their number.

    Raises
    ------
    ConfigurationError
        If the duration has fewer than two blocks or more than 200, or nothing is allowed.
    """
    blocks = conditions.blocks(duration_s)
    foreseen = foresight(conditions, prior, blocks)
    sequence = designed(conditions, foreseen, blocks, seed=seed, progress=progress)
    heat = conditions.heat(sequence)
    numbers: list[list[int]] = sequence.tolist()
    levels = [source.levels for source in conditions.each]
    return ThermalTestPlan(
        conditions=conditions,
        blocks=tuple(tuple(levels[s][k] for s, k in enumerate(row)) for row in numbers),
        foreseen_um=tuple(by_duration_um(foreseen, heat).tolist()),
        settled_um=tuple(foreseen.settled_um(heat).tolist()),
        customary_um=customary_um(conditions, foreseen, blocks, seed),
        knowledge=_knowledge(prior),
    )


def _knowledge(prior: GainsPrior) -> PlannedKnowledge:
    def row(values: FloatArray) -> tuple[float, ...]:
        return tuple(values.tolist())

    factor: Sequence[FloatArray] = list(prior.factor_um)
    return PlannedKnowledge(
        row(prior.time_constants_s), row(prior.mean_um), tuple(row(one) for one in factor)
    )
