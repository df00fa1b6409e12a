"""Calls of a block: the test sequence through all its phases, and hours without a fault."""

from collections.abc import Iterator
from typing import final

from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.vectors._phases import Phase, phases_of
from thermaxis.plc.vectors._reference import CycleBlock, words_of
from thermaxis.plc.vectors._simulated_plant import (
    NEAR_SHARE,
    PlcStep,
    SequenceBlock,
    SimulatedPlant,
)

MOST_ROWS = 2000
"""Most rows of the sequence. Default: what a person still looks through. [1]"""
MOST_CALLS = 45_000
"""Most calls of the sequence: a shift of 8 h at 1 s, in which a trim ends, and what else there is.
At a cycle of 0.1 s no row may stand for as many as would take minutes to compute. [1]"""


@final
class CallSequence:
    """The fixed test sequence of a block.

    Every phase gets a share of the rows and calls; what it does not need is left to those behind
    it.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    seed : int
        Seed of the noise.
    most_rows : int
        Rows that its phases share: calls whose inputs or words differ from those before. Default:
        `MOST_ROWS`. [1]
    most_calls : int
        Calls that they share. Default: `MOST_CALLS`. [1]
    block : SequenceBlock, optional
        Who is called. Default: a new instance.
    near_share : float
        Share of the read-back's tolerance by which the reported offset may be away. Default:
        `NEAR_SHARE`. [1]
    """

    def __init__(
        self,
        settings: PlcSettings,
        *,
        seed: int,
        most_rows: int = MOST_ROWS,
        most_calls: int = MOST_CALLS,
        block: SequenceBlock | None = None,
        near_share: float = NEAR_SHARE,
    ) -> None:
        self._plant = SimulatedPlant(settings, seed, block or CycleBlock(settings), near_share)
        self._rows_left, self._calls_left = most_rows, most_calls
        self.cuts: list[str] = []
        """Phases that were ended before their end, in words; complete after the last step."""

    def steps(self) -> Iterator[PlcStep]:
        """Return the calls one by one, once.

        Yields
        ------
        PlcStep
            One call.
        """
        phases = phases_of(self._plant)
        for number, (name, phase) in enumerate(phases):
            yield from self._share(name, phase, len(phases) - number)

    def _share(self, name: str, phase: Phase, phases_left: int) -> Iterator[PlcStep]:
        """Return a phase as far as its share of the rows and calls goes."""
        plant = self._plant
        # What comes later is longer: an early phase may take twice its share of the calls.
        calls = min(self._calls_left, max(2 * self._calls_left // (phases_left + 1), 1))
        rows = self._rows_left // phases_left
        plant.calls_left = calls
        last: PlcStep | None = None
        for step in phase(plant):
            new = last is None or step.inputs != last.inputs or _changed(step, last)
            if plant.calls_left <= 0 or (new and rows <= 0):
                what = "rows" if plant.calls_left > 0 else "calls"
                self.cuts.append(
                    f"{name} after {calls - plant.calls_left} calls for want of {what}"
                )
                break
            rows, self._rows_left = rows - new, self._rows_left - new
            plant.calls_left -= 1
            last = step
            yield step
        self._calls_left -= calls - plant.calls_left


def _changed(step: PlcStep, last: PlcStep) -> bool:
    return words_of(step.outputs) != words_of(last.outputs)


def scenario_steps(settings: PlcSettings, *, hours: float, seed: int) -> Iterator[PlcStep]:
    """Return hours without a fault: a warm-up of three, then a wave and noise; enabled throughout.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    hours : float
        Length. [h]
    seed : int
        Seed of the noise.

    Yields
    ------
    PlcStep
        One call.
    """
    plant = SimulatedPlant(settings, seed, CycleBlock(settings))
    plant.noise_c = 0.05
    seconds = 0.0
    for call in range(round(hours * 3600.0 / settings.cycle_s)):
        if call:
            plant.usual = plant.usual._replace(enable=True)
            for k, base_c in enumerate(plant.base_c):
                rise_k = (6.0 + 1.5 * k) * min(seconds / 10_800.0, 1.0)
                plant.goal_c[k] = base_c + rise_k + 1.5 * _wave(seconds / (5400.0 + 900.0 * k))
            seconds += settings.cycle_s
        yield plant.step()


def _wave(turns: float) -> float:
    """Return a wave like a sine, of parabolas: the same on every computer."""
    x = 2.0 * (turns % 1.0)
    return 4.0 * x * (1.0 - x) if x < 1.0 else -4.0 * (x - 1.0) * (2.0 - x)
