"""Values of the LinuxCNC of this computer: pins of its HAL, through one lasting ``halcmd``."""

import asyncio
import math
from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Final, final

from thermaxis.codes import Message
from thermaxis.errors import ThermaxisError
from thermaxis.runtime._halcmd import LINUXCNC, Hal, open_pipe
from thermaxis.runtime._ports import NOT_READ, Clock, Source, SourceSample
from thermaxis.runtime.sources._life import LifeCounter
from thermaxis.runtime.sources._nodes import HAL, NodeSettings

if TYPE_CHECKING:
    from thermaxis.runtime.opcua import NodeDescription

THREAD_TIME: Final = f"{HAL}motion.servo.last-period"
"""Pin that every period of the servo thread sets anew, to what the last one took."""
RETRY_S: Final = 0.5
"""Pause between two looks for LinuxCNC. [s]"""
_ENDED: Final = Message("error-linuxcnc_not_running", place=LINUXCNC)
_NO_PIN = SourceSample(None, good=False, status="BadNodeIdUnknown", age_s=None)
_WRONG = SourceSample(None, good=False, status="BadTypeMismatch")
_BITS = 32
_TYPES = {"bit": "Boolean", "float": "Double", "s32": "Int32", "u32": "UInt32"}
_TRUTHS: Final[Mapping[str, bool]] = {"TRUE": True, "FALSE": False}


@final
class LinuxCncSource(Source):
    """Reads all pins with one exchange per cycle.

    HAL has neither a status nor a time stamp: a value is as old as the last change of the life
    counter, by default of a pin of the servo thread, which proves that LinuxCNC runs.

    Not protected: a component that has died leaves its last value in its pin, and a pin that
    nothing is connected to reads 0. A life counter of that component, a range above 0 and the
    rule of standstill find them.
    """

    def __init__(
        self,
        nodes: Mapping[str, NodeSettings],
        life: LifeCounter,
        clock: Clock,
        program: str = "halcmd",
        open_hal: Callable[[str], Awaitable[Hal]] = open_pipe,
    ) -> None:
        self._nodes = dict(nodes)
        self._life = life
        self._clock = clock
        self._program = program
        self._open_hal = open_hal
        pins = [*(settings.node for settings in self._nodes.values()), life.node]
        self._commands = [f"getp {pin.removeprefix(HAL)}" for pin in pins]
        self._lost = dict.fromkeys(self._nodes, NOT_READ)
        self._turn = asyncio.Lock()
        self._hal: Hal | None = None
        self._since_s = -math.inf
        self._why: Message | None = None

    async def open(self) -> None:
        """Begin; the first read looks for LinuxCNC."""

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        """Read every pin by its name."""
        answers = await self._ask(self._commands, deadline_s)
        if answers is None:
            return self._lost
        raw = [_number_of(answer) for answer in answers]
        self._life.see(raw[-1])
        there = self._hal is not None and self._hal.there()
        if there and self._life.failure is None:
            entries = zip(self._nodes.values(), raw, strict=False)
            samples = [_sample(settings, one, self._life.age_s) for settings, one in entries]
            return dict(zip(self._nodes, samples, strict=True))
        if not there or self._clock.monotonic_s() - self._since_s > self._life.within_s:
            await self._leave()  # the memory of one that has ended can still be read
            self._why = self._life.failure or _ENDED
        return self._lost

    async def describe(self, node: str, deadline_s: float) -> "NodeDescription | None":
        """Return what HAL says of one pin; None if there is no answer."""
        from thermaxis.runtime.opcua import NodeDescription  # noqa: PLC0415 - the self-test's alone

        pin = node.removeprefix(HAL)
        answers = await self._ask([f"ptype {pin}", f"getp {pin}", self._commands[-1]], deadline_s)
        if answers is None:
            return None
        self._life.see(_number_of(answers[2]))
        kind, value = _TYPES.get("".join(answers[0]).strip().lower(), ""), _number_of(answers[1])
        known = value is not None
        status = "Good" if known else _NO_PIN.status
        return NodeDescription(
            node,
            exists=known,
            status=status,
            data_type=kind,
            readable=known,
            value=value,
            age_s=0.0,
        )

    @property
    def connected(self) -> bool:
        """Whether the last read reached a LinuxCNC whose thread runs."""
        return self._hal is not None and self._life.failure is None

    @property
    def failure(self) -> Message | None:
        """Why LinuxCNC is not reached, or does not run."""
        return self._why if self._hal is None else self._life.failure

    async def close(self) -> None:
        """End the ``halcmd``."""
        await self._leave()

    async def _ask(self, commands: list[str], deadline_s: float) -> list[tuple[str, ...]] | None:
        """Ask a ``halcmd``, which is started where there is none; None if there is no answer."""
        try:
            async with asyncio.timeout(deadline_s), self._turn:
                return await self._exchange(commands, deadline_s)
        except ThermaxisError as error:
            self._why = error.message
        except TimeoutError:
            self._why = Message("error-hal_too_slow")
        except OSError as error:
            self._why = Message("error-halcmd_not_started", {"cause": str(error.strerror)})
        return None

    async def _exchange(
        self, commands: list[str], deadline_s: float
    ) -> list[tuple[str, ...]] | None:
        if self._hal is None:
            if self._clock.monotonic_s() - self._since_s < RETRY_S:
                return None
            self._since_s = self._clock.monotonic_s()
            self._hal = await self._open_hal(self._program)
        try:
            return await self._hal.ask(commands, deadline_s)
        except BaseException:  # one that is cancelled leaves the pipe out of step, too
            await self._leave()
            raise

    async def _leave(self) -> None:
        hal, self._hal = self._hal, None
        if hal is not None:
            await hal.close()


def _number_of(answer: tuple[str, ...]) -> float | bool | None:
    """Return what a pin holds; None if there is no such pin."""
    text = answer[0] if len(answer) == 1 else ""
    if text in _TRUTHS:
        return _TRUTHS[text]
    try:
        return int(text)
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        return None


def _sample(settings: NodeSettings, raw: float | bool | None, age_s: float) -> SourceSample:  # noqa: FBT001 - what a pin holds
    if raw is None:
        return _NO_PIN
    number, fits = settings.value_of(raw, _BITS)
    return SourceSample(number, good=True, age_s=age_s) if fits else _WRONG
