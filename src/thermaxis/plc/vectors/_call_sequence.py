"""Calls of a block: the test sequence through all its phases."""

from collections.abc import Iterator
from typing import final

from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.vectors._phases import phases_of
from thermaxis.plc.vectors._reference import CycleBlock, JudgedBlock, PlcStep
from thermaxis.plc.vectors._simulated_plant import SimulatedPlant

MOST_CALLS = 45_000
"""Most calls of the sequence, so that it takes seconds to compute at a cycle of 0.1 s too: then
some holds do not fit. [1]"""


@final
class CallSequence:
    """The fixed test sequence of a block.

    Every phase gets a share of the calls; what it does not need is left to those behind it.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    most_calls : int
        Calls that its phases share. Default: `MOST_CALLS`. [1]
    block : CycleBlock or JudgedBlock, optional
        Who is called. Default: a new instance.
    """

    def __init__(
        self,
        settings: PlcSettings,
        *,
        most_calls: int = MOST_CALLS,
        block: CycleBlock | JudgedBlock | None = None,
    ) -> None:
        self._plant = SimulatedPlant(settings, block or CycleBlock(settings))
        self._calls_left = most_calls
        self.cuts: list[str] = []
        """Phases that were ended before their end, in words; complete after the last step."""

    def steps(self) -> Iterator[PlcStep]:
        """Return the calls one by one, once.

        Yields
        ------
        PlcStep
            One call.
        """
        plant, phases = self._plant, phases_of(self._plant)
        for number, (name, phase) in enumerate(phases):
            # What comes later is longer: an early phase may take twice its share of the calls.
            share = 2 * self._calls_left // (len(phases) - number + 1)
            plant.calls_left = share = min(self._calls_left, max(share, 1))
            for lasts, different in phase(plant):
                calls = max(lasts if isinstance(lasts, int) else round(lasts / plant.cycle_s), 1)
                left, plant.calls_left = plant.calls_left, max(plant.calls_left - calls, 0)
                for _ in range(min(calls, left)):
                    yield plant.step(**different)
                if calls > left:
                    self.cuts.append(f"{name} after {share} calls for want of calls")
                    break
            self._calls_left -= share - plant.calls_left

    def missing(self) -> list[str]:
        """Return what did not occur in the steps until now, or did not fit, in words."""
        return self._plant.missing()
