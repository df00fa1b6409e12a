"""Corrections to LinuxCNC: an offset below the motion controller, through one lasting ``halcmd``.

Why ``halcmd`` over a pipe and no bridge: it works from any Python, while the modules `hal` and
`linuxcnc` are compiled for the distribution's own; nothing listens on a network; one program less
must live for the offset to live; and it stays a program of its own, as its licence asks. The price
is that thermaxis runs on the computer of LinuxCNC, as the same user.
"""

import asyncio
import contextlib
import math
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Final, NamedTuple, TypeVar, final

from thermaxis.codes import Message, Value
from thermaxis.errors import ThermaxisError
from thermaxis.runtime._halcmd import (
    LINUXCNC,
    Hal,
    HalLostError,
    HalRefusedError,
    bit_of,
    confirm_silence,
    number_of,
    open_pipe,
)
from thermaxis.runtime._ports import Applied, Clock, Sink
from thermaxis.runtime.sinks._linuxcnc_hal import (
    ARM,
    COUNT,
    HEARTBEAT,
    OK,
    arrangement_commands,
    arrangement_faults,
)
from thermaxis.runtime.sinks._linuxcnc_settings import LinuxCncSettings

T = TypeVar("T")

STANDSTILL_S = 0.5
"""Time without a period of the servo thread after which it stands still; a kernel without real
time may hold it up for a tenth of that. [s]"""
ARMED_PERIODS = 5
"""Looks at a watchdog that was armed, two periods apart, before it is said not to start. [1]"""
_CONNECT_S = 1.0
_POLL_S = 0.002
_COUNTS = 1 << 32
_DIGITS = 1e-6
_TRIPPED: Final = Message("error-watchdog_tripped", place=LINUXCNC)


class _Seen(NamedTuple):
    """What the machine shows before each write."""

    periods: int
    """Periods of the servo thread. [1]"""
    ok: bool
    """Whether the watchdog has its heartbeat."""
    unhomed: tuple[int, ...]
    """Joints that are not homed."""


@final
class LinuxCncSink(Sink):
    """Offsets on joints of the LinuxCNC of this computer.

    The program position, the display and the soft limits do not see the offset. On the machine
    itself `limit3` bounds it and its rate, and a watchdog takes it back at that rate when no write
    comes for a while; a watchdog that has tripped stays so. Then, and after every return of
    LinuxCNC, `found` tells where the offset stands, and only a write after it arms the watchdog
    again.

    A machine whose HAL file is not as `hal_text` makes it is not written to, nor one with a joint
    that is not homed: an offset shifts the switch that the joint is homed to.

    Not protected: a wrong sign or unit; a drive that does not follow; a second program that sets
    the same signals in the instant between two looks. The soft limits do not see the offset: the
    hard stops must lie outside them by its bound.

    Notes
    -----
    A set is confirmed by a get of the same signal. A period counter of the servo thread proves
    that the thread runs and that the memory is that of the LinuxCNC of now: memory of an ended one
    can still be written to, without any effect.
    """

    def __init__(
        self,
        settings: LinuxCncSettings,
        clock: Clock,
        open_hal: Callable[[], Awaitable[Hal]] | None = None,
    ) -> None:
        self.settings = settings
        self._clock = clock
        self._open_hal = open_hal if open_hal is not None else self._start_halcmd
        self._outputs = tuple(settings.outputs.items())
        self.tells_effective = frozenset(settings.outputs)
        self._turn = asyncio.Lock()
        self._hal: Hal | None = None
        self._left: list[Hal] = []
        self._watching: asyncio.Task[None] | None = None
        self._homed = False
        self._news = False
        self._armed = False
        self._beat = False
        self._count = -1
        self._moved_s = 0.0
        self._requested: dict[str, float] = {}

    # ---- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Begin to look for LinuxCNC, again and again; one that is not there is waited for."""
        if self._watching is None:
            self._watching = asyncio.create_task(self._watch())

    async def close(self) -> None:
        """End. The heartbeat stops with it, and the machine takes the offset back."""
        watching, self._watching = self._watching, None
        if watching is not None:
            async with self._turn:  # no command is cut short
                watching.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await watching
        self._leave()
        await self._end_left()

    @property
    def connected(self) -> bool:
        """Whether LinuxCNC is there, arranged as it must be, with its joints homed."""
        return self._hal is not None and self._homed

    async def _watch(self) -> None:
        while True:
            await self._end_left()
            if self._hal is None:
                try:
                    await self._connect()
                except ThermaxisError as error:
                    self.failure = error.message
                except OSError as error:
                    self.failure = _failure("halcmd_not_started", cause=str(error.strerror))
            else:
                await self._in_turn(self._look, STANDSTILL_S)
                await self._end_left()
            await self._clock.sleep_until(self._clock.monotonic_s() + self.settings.retry_s)

    async def _start_halcmd(self) -> Hal:
        return await open_pipe(self.settings.halcmd)

    async def _connect(self) -> None:
        """Attach, and compare the machine with its HAL file, before anything is believed."""
        hal = await self._open_hal()
        try:
            until_s = self._clock.monotonic_s() + _CONNECT_S
            answers = await self._ask(hal, arrangement_commands(self.settings), until_s)
            self._refuse_other_arrangements(answers)
            before = (await self._see(hal, until_s)).periods
            await self._wait_for_periods(hal, before, until_s)
            seen = await self._see(hal, until_s)
            self._beat = bit_of(
                (await self._ask(hal, [f"gets {HEARTBEAT}"], until_s))[0], HEARTBEAT
            )
        except TimeoutError:
            await hal.close()
            raise HalLostError("servo_thread_off", place=LINUXCNC) from None
        except BaseException:
            await hal.close()
            raise
        self._hal = hal
        self._homed = self._armed = False
        self._news = True
        self._count, self._moved_s = seen.periods, self._clock.monotonic_s()
        self.failure = None
        self._judge(seen)

    def _refuse_other_arrangements(self, answers: Sequence[Sequence[str]]) -> None:
        faults = arrangement_faults(self.settings, answers)
        if faults:
            raise HalRefusedError("hal_arrangement", faults=faults[:3], place=LINUXCNC)

    async def _look(self, hal: Hal, until_s: float) -> None:
        self._judge(await self._see(hal, until_s))

    # ---- what the loop asks ---------------------------------------------------------------------

    async def found(self, deadline_s: float) -> Mapping[str, float | None] | None:
        """Return where the offsets stand [µm], when that is news.

        That is once after LinuxCNC came or its joints were homed, and once after the watchdog
        tripped; then an offset may be on its way to zero.
        """
        if not (self.connected and self._news):
            return None
        return await self._in_turn(self._find, deadline_s)

    async def _find(self, hal: Hal, until_s: float) -> Mapping[str, float | None]:
        commands = [f"getp {output.shift}.offset" for _, output in self._outputs]
        answers = await self._ask(hal, commands, until_s)
        found: dict[str, float | None] = {
            name: number_of(answer, output.shift) / output.factor + 0.0
            for (name, output), answer in zip(self._outputs, answers, strict=True)
        }
        self._news = False
        return found

    async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
        """Write corrections and move the heartbeat, or do neither.

        Returns whether the machine has all of them, and its watchdog is satisfied. Nothing is
        written while what `found` has to tell was not read.
        """
        lacking = [n for n, _ in self._outputs if not math.isfinite(correction_um.get(n, math.nan))]
        if lacking:
            self.failure = _failure("no_finite_correction", names=tuple(lacking))
            return False
        wanted = dict(correction_um)

        async def put(hal: Hal, until_s: float) -> bool:
            return await self._put(hal, wanted, until_s)

        return await self._in_turn(put, deadline_s) is True

    async def _put(self, hal: Hal, correction_um: Mapping[str, float], until_s: float) -> bool:
        seen = await self._see(hal, until_s)
        self._judge(seen)
        if not self.connected or self._news:
            return False
        commands: list[str] = []
        values: list[float] = []
        for name, output in self._outputs:
            value = correction_um[name] * output.factor
            values.append(value)
            commands += [f"sets {output.request} {value!r}", f"gets {output.request}"]
        answers = await self._ask(hal, commands, until_s)
        for i, (name, output) in enumerate(self._outputs):
            confirm_silence(answers[2 * i], output.request)
            got = number_of(answers[2 * i + 1], output.request)
            if not _same(got, values[i]):
                place = LINUXCNC._replace(channel=output.request)
                raise HalRefusedError("hal_value_differs", set=values[i], found=got, place=place)
            self._requested[name] = correction_um[name]
        if not (self._armed or seen.ok):
            await self._arm(hal, seen.periods, until_s)
        else:
            self._armed = True
            await self._set_bit(hal, HEARTBEAT, until_s, value=not self._beat)
            self._beat = not self._beat
        self.failure = None
        return True

    async def _arm(self, hal: Hal, count: int, until_s: float) -> None:
        """Give the watchdog its rising edge, and see that it takes it."""
        await self._set_bit(hal, ARM, until_s, value=False)
        count = await self._wait_for_periods(hal, count, until_s)
        await self._set_bit(hal, HEARTBEAT, until_s, value=not self._beat)
        self._beat = not self._beat
        await self._set_bit(hal, ARM, until_s, value=True)
        for _ in range(ARMED_PERIODS):  # a busy computer may stop a period between its functions
            count = await self._wait_for_periods(hal, count, until_s)
            if bit_of((await self._ask(hal, [f"gets {OK}"], until_s))[0], OK):
                break
        else:
            raise HalRefusedError("watchdog_not_started", place=LINUXCNC)
        self._armed = True

    async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:
        """Return what was asked, what the machine's limiter accepts, and what acts now.

        Accepted is where the limiter goes: the request within its bounds, and zero without a
        heartbeat. Effective is the offset that is added.
        """
        read = await self._in_turn(self._read, deadline_s)
        if read is not None:
            return read
        return {name: Applied(self._requested.get(name), None) for name, _ in self._outputs}

    async def _read(self, hal: Hal, until_s: float) -> Mapping[str, Applied]:
        pins = [
            f"{component}.{pin}"
            for _, output in self._outputs
            for component, pin in (
                (output.limit, "enable"),
                (output.limit, "min"),
                (output.limit, "in"),
                (output.limit, "max"),
                (output.shift, "offset"),
            )
        ]
        answers = iter(await self._ask(hal, [f"getp {pin}" for pin in pins], until_s))
        applied: dict[str, Applied] = {}
        for name, output in self._outputs:
            enabled = bit_of(next(answers), output.limit)
            low, asked, high, offset = (number_of(next(answers), output.limit) for _ in range(4))
            if self._armed and not enabled:
                self._withdraw(_TRIPPED)
            goal = min(max(asked, low), high) if enabled else 0.0
            applied[name] = Applied(
                self._requested.get(name), goal / output.factor + 0.0, offset / output.factor + 0.0
            )
        return applied

    # ---- HAL ------------------------------------------------------------------------------------

    async def _in_turn(
        self, step: Callable[[Hal, float], Awaitable[T]], deadline_s: float
    ) -> T | None:
        """Take a step that no other one interrupts; None if HAL is lost or time is up."""
        until_s = self._clock.monotonic_s() + deadline_s
        try:
            async with asyncio.timeout(deadline_s):
                await self._turn.acquire()
        except TimeoutError:
            return None
        try:
            if self._hal is None:
                return None
            return await step(self._hal, until_s)
        except TimeoutError:
            self.failure = _failure("hal_too_slow")
        except (HalLostError, HalRefusedError) as error:
            self.failure = error.message
            self._leave()
        finally:
            self._turn.release()
        return None

    async def _ask(
        self, hal: Hal, commands: Sequence[str], until_s: float
    ) -> list[tuple[str, ...]]:
        """Ask as long as time is left: what a frozen program comes back to is not sent late."""
        left_s = until_s - self._clock.monotonic_s()
        if left_s <= 0.0:
            raise TimeoutError
        return await hal.ask(commands, left_s)

    async def _see(self, hal: Hal, until_s: float) -> _Seen:
        commands = [f"getp {COUNT}", f"gets {OK}"]
        outputs = [output for _, output in self._outputs]
        commands += [f"getp {output.homed}" for output in outputs]
        answers = await self._ask(hal, commands, until_s)
        homed = [bit_of(said, o.homed) for o, said in zip(outputs, answers[2:], strict=True)]
        return _Seen(
            round(number_of(answers[0], COUNT)),
            bit_of(answers[1], OK),
            tuple(sorted(o.joint for o, there in zip(outputs, homed, strict=True) if not there)),
        )

    def _judge(self, seen: _Seen) -> None:
        """Note what the machine shows; raise if its servo thread stands still."""
        now_s = self._clock.monotonic_s()
        if seen.periods != self._count:
            self._count, self._moved_s = seen.periods, now_s
        elif now_s - self._moved_s > STANDSTILL_S:
            raise HalLostError("servo_thread_stands_still", place=LINUXCNC)
        homed = not seen.unhomed
        if homed is not self._homed:
            self._homed, self.failure = homed, None
        if not homed:
            self._withdraw(_failure("joint_not_homed", joints=tuple(map(str, seen.unhomed))))
        elif self._armed and not seen.ok:
            self._withdraw(_TRIPPED)

    def _withdraw(self, why: Message) -> None:
        """Write nothing more before `found` was read."""
        self._armed = False
        self._news = True
        self.failure = why

    def _leave(self) -> None:
        """Give HAL up; `_watch` ends what is left of it, which may take a moment."""
        if self._hal is not None:
            self._left.append(self._hal)
        self._hal = None
        self._homed = self._armed = self._news = False

    async def _end_left(self) -> None:
        while self._left:
            await self._left.pop().close()

    async def _wait_for_periods(self, hal: Hal, count: int, until_s: float) -> int:
        """Wait until the servo thread has run twice, so that it has seen everything set before."""
        while True:
            now = round(number_of((await self._ask(hal, [f"getp {COUNT}"], until_s))[0], COUNT))
            if (now - count) % _COUNTS >= 2:
                return now
            await self._clock.sleep_until(self._clock.monotonic_s() + _POLL_S)

    async def _set_bit(self, hal: Hal, signal: str, until_s: float, *, value: bool) -> None:
        text = "TRUE" if value else "FALSE"
        answers = await self._ask(hal, [f"sets {signal} {text}", f"gets {signal}"], until_s)
        confirm_silence(answers[0], signal)
        if bit_of(answers[1], signal) is not value:
            place = LINUXCNC._replace(channel=signal)
            raise HalRefusedError("hal_bit_differs", set=text, place=place)


def _failure(code: str, **values: Value) -> Message:
    return Message(f"error-{code}", values, LINUXCNC)


def _same(got: float, wanted: float) -> bool:
    """Return whether a number in HAL's seven digits is that number."""
    return abs(got - wanted) <= _DIGITS * abs(wanted)
