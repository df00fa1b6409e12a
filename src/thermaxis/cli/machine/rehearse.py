"""Let a configuration compensate the virtual lathe in virtual time: a day takes some seconds.

Its model, rules and limits run in the real loop, in the same program as the lathe of thermaxis
machine. Nodes, sign and unit of the configuration are not used; its channels must be those of the
lathe. Where touches are looked at, they are those of the lathe's own probe (--touch-every). At
the end the true tool point with and without the compensation is shown for every measuring position.
"""

import argparse
import asyncio
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import fmean
from typing import NamedTuple

from thermaxis import runtime, virtual
from thermaxis.cli._arguments import adder, number, positive_seconds
from thermaxis.cli._json import show
from thermaxis.cli.machine._machine_parts import loop_settings
from thermaxis.compensation import Request, RequestKind, TouchOutcome
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.messages import sentence, sentence_of
from thermaxis.report.tables import Part, Table, Value
from thermaxis.runtime.history import NoHistorian, SqlHistorian
from thermaxis.virtual.lathe import INTERLOCKS, TRUE, UNCORRECTED, lathe_names

_WATCHDOG_CYCLES = 2.0
"""The lathe's watchdog waits for at least so many cycles of the loop. [1]"""
MOST_HOURS = 24.0 * 14
"""Longest rehearsal: two weeks; every cycle is kept for the file. [h]"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("configuration MACHINE.toml", "the machine (TOML)", Path)
    add("--scenario NAME", "what the lathe does (default: verification)", default="verification")
    add("--seed N", "seed of hall and noise", int, default=1)
    hours = number(f"number of hours above 0 and at most {MOST_HOURS:g}", 1e-9, MOST_HOURS)
    add("--hours H", "for how long (default: the scenario's length)", hours)
    add(
        "--diameter MM",
        "clamping diameter of the workpiece (default: none, the tool centre point)",
        float,
    )
    add(
        "--fault SENTENCE",
        'what goes wrong, such as "stuck T_spindle_C at 2h for 10min"; may be given more than once',
        many=True,
    )
    add(
        "--touch-every TIME",
        "the lathe's own probe touches so often, and at once again when a touch was excluded"
        " (default: never)",
        positive_seconds,
    )
    add(
        "-o, --output FILE",
        "every cycle as a row of CSV: true displacements with and without, correction, what touches"
        " add to it and the standard uncertainty that they leave, state",
        Path,
    )
    add("--history FILE", "record every cycle into this new SQLite file", Path)


def run(arguments: argparse.Namespace) -> int:
    """Rehearse."""
    configuration = runtime.read_machine(arguments.configuration)
    foreign = [c for c in configuration.compensation.model.channels if c not in virtual.SENSORS]
    if foreign or len(configuration.outputs) != 1:
        raise ConfigurationError(
            "not_the_lathes",
            file=arguments.configuration,
            channels=", ".join(foreign),
            outputs=len(configuration.outputs),
            known=", ".join(virtual.SENSORS),
        )
    (output,) = configuration.outputs
    probe = configuration.probes.get(output)
    if arguments.touch_every is not None and (probe is None or not probe.counter_node):
        raise ConfigurationError(
            "touches_not_read", file=arguments.configuration, key=f"probe.{output}"
        )
    faults = [virtual.parse_fault(text, virtual.FAULTY) for text in arguments.fault]
    own, cycle_s = virtual.OffsetRules(), configuration.compensation.cycle_s
    own = replace(own, watchdog_s=max(own.watchdog_s or 0.0, _WATCHDOG_CYCLES * cycle_s))
    settings = virtual.LatheSettings(offset=own, touch_every_s=arguments.touch_every)
    lathe = virtual.VirtualLathe(arguments.scenario, arguments.seed, settings, faults)
    endless = lathe.scenario.endless
    hours = arguments.hours or (24.0 if endless else lathe.scenario.duration_s / 3600.0)
    if arguments.history is not None and arguments.history.exists():
        raise ConfigurationError("file_exists", file=arguments.history, key="--history")
    rehearsal = _Rehearsal(configuration, lathe, arguments.diameter, arguments.history)
    runtime.run_in_virtual_time(rehearsal.play(hours))
    show(rehearsal.described(hours), None)
    if arguments.output is not None:
        rehearsal.write(arguments.output)
        sys.stdout.write(f"written: {arguments.output}\n")
    return 0


def build_rehearsal(
    configuration: runtime.MachineConfiguration,
    lathe: virtual.VirtualLathe,
    clock: runtime.Clock,
    historian: runtime.Historian,
    state_file: runtime.StateFile | None = None,
    names: Mapping[str, str] | None = None,
) -> runtime.CompensationLoop:
    """Make the loop of a configuration at the lathe in this program.

    It reads all that the lathe has, touches where they are looked at, and its interlocks; with
    `names` these signals alone.
    """
    interlocks = () if names else tuple(INTERLOCKS)
    (output,) = configuration.outputs
    rules = replace(configuration.compensation, interlocks=interlocks)
    settings = replace(
        loop_settings(configuration),
        interlocks_met={},
        other_active=None if names else True,
        reads_diameter=False,
        at_stop=runtime.AtStop.LEAVE,
    )
    read = names or lathe_names(touched=output in rules.touches)
    source = virtual.LatheSource(lathe, clock, names=read, interlocks=interlocks)
    sink = virtual.LatheSink(lathe, clock, output=output)
    ports = runtime.Ports(source, sink, historian, clock)
    return runtime.CompensationLoop(rules, settings, ports, state_file=state_file)


async def rehearse(
    loop: runtime.CompensationLoop, hours: float, diameter_mm: float | None = None
) -> None:
    """Let a loop compensate for some hours.

    Raises
    ------
    DataError
        If it does not let itself be enabled.
    """
    cycles = max(1, round(3600.0 * hours / loop.compensation.cycle_s))
    running = asyncio.ensure_future(loop.run(asyncio.Event(), cycles))
    for request in (
        Request(RequestKind.DIAMETER, "the rehearsal", value=diameter_mm),
        Request(RequestKind.ENABLE, "the rehearsal"),
    ):
        answer = await loop.submit(request)
        if not answer.accepted:
            running.cancel()
            raise DataError(
                "request_refused", request=str(request.kind), cause=sentence_of(answer.message)
            )
    await running


class _Stood(NamedTuple):
    """An alarm: since when, in how many cycles, and what it said last."""

    since_s: float
    cycles: int = 0
    said: str = ""


class _Rehearsal:
    """One run of the loop against the lathe."""

    def __init__(
        self,
        configuration: runtime.MachineConfiguration,
        lathe: virtual.VirtualLathe,
        diameter_mm: float | None,
        history: Path | None,
    ) -> None:
        self.configuration, self.lathe, self.diameter_mm = configuration, lathe, diameter_mm
        self.history = history
        self.rows: list[tuple[float, ...]] = []
        self.states: list[str] = []
        self.reasons: dict[str, float] = {}
        self.touches: list[TouchOutcome] = []
        self.alarms: dict[str, _Stood] = {}

    async def play(self, hours: float) -> None:
        clock = runtime.VirtualClock()
        loop = build_rehearsal(self.configuration, self.lathe, clock, self._historian(clock))
        loop.listeners.append(self._see)
        await rehearse(loop, hours, self.diameter_mm)

    def _historian(self, clock: runtime.Clock) -> runtime.Historian:
        if self.history is None:
            return NoHistorian()

        url = f"sqlite:///{self.history.absolute()}"
        settings = replace(self.configuration.historian, url=url, folder=None)
        return SqlHistorian(settings, clock)

    def _see(self, status: runtime.RuntimeStatus) -> None:
        lathe, output = self.lathe, status.output
        true, free = lathe.true_um.tolist(), lathe.uncorrected_um.tolist()
        (offset_um,), (std_um,) = output.offset_um or (0.0,), output.offset_std_um or (None,)
        std_um = math.nan if std_um is None else std_um
        row = (lathe.time_s, *true, *free, output.correction_um[0], offset_um, std_um)
        self.rows.append(row)
        self.states.append(str(output.state))
        self.touches += output.touch_outcomes
        for alarm in (one for one in status.alarms if one.priority != "low"):
            stood = self.alarms.get(alarm.key, _Stood(lathe.time_s))
            said = f"{alarm.priority}: {alarm.sentences.text}"
            self.alarms[alarm.key] = stood._replace(cycles=stood.cycles + 1, said=said)
        if TouchOutcome.EXCLUDED in output.touch_outcomes:
            lathe.ask_touch()
        for reason in output.reasons:
            seconds = self.reasons.get(str(reason), 0.0)
            self.reasons[str(reason)] = seconds + status.cycle_s

    def described(self, hours: float) -> list[Part]:
        """Return what the rehearsal showed."""
        scenario, seed = self.lathe.scenario.name, self.lathe.seed
        where = "tool centre point" if self.diameter_mm is None else f"{self.diameter_mm:g} mm"
        columns = list(zip(*self.rows, strict=True))
        table: list[list[Value]] = []
        for k, position in enumerate(virtual.POSITIONS):
            with_um = max(columns[1 + k]) - min(columns[1 + k])
            free_um = max(columns[5 + k]) - min(columns[5 + k])
            less = free_um / with_um if with_um > 0.0 else math.inf
            numbers = {"without": free_um, "with": with_um, "times less": less}
            cells = [Value("", number, head, ".1f") for head, number in numbers.items()]
            table.append([Value("", position, "position"), *cells])
        counts = {state: self.states.count(state) for state in dict.fromkeys(self.states)}
        cycle_s = self.configuration.compensation.cycle_s
        shares = ", ".join(f"{s} {_length(n * cycle_s)}" for s, n in counts.items())
        return [
            f"{scenario}, seed {seed}, {hours:g} h, workpiece: {where}",
            Table("true peak-to-peak, um", table, words=1),
            f"states: {shares}",
            *(f"  {sentence(f'reason-{r}')}: {_length(s)}" for r, s in self.reasons.items()),
            *(["alarms:"] if self.alarms else []),
            *(
                f"  from {_length(one.since_s)} on, for {_length(one.cycles * cycle_s)}, {one.said}"
                for one in self.alarms.values()
            ),
            *self._touched(columns),
        ]

    def _touched(self, columns: Sequence[Sequence[float]]) -> list[str]:
        """Return what became of touches, and of the true error by them; nothing without."""
        if not self.touches:
            return []
        told = ", ".join(f"{self.touches.count(o)} {o}" for o in dict.fromkeys(self.touches))
        with_um, free_um = (fmean(map(abs, columns[k])) for k in (1, 5))
        (rules,) = self.configuration.compensation.touches.values()
        largest_um = rules.limits.largest_um
        at_limit = fmean(abs(um) >= largest_um for um in columns[10])
        limit = f"their offset stood at its limit of {largest_um:g} um: {at_limit:.0%} of the time"
        return [
            f"touches: {told}",
            *([limit] if at_limit else []),
            f"true mean error at the TCP, um: {free_um:.1f} without, {with_um:.1f} with",
        ]

    def write(self, path: Path) -> None:
        """Write every cycle as a line of CSV."""
        added = ("correction_um", "offset_um", "offset_std_um", "state")
        heads = ("time_s", *TRUE, *UNCORRECTED, *added)
        with path.open("w", encoding="utf-8", newline="") as file:
            file.write(",".join(heads) + "\n")
            for row, state in zip(self.rows, self.states, strict=True):
                file.write(",".join(f"{value:.10g}" for value in row) + f",{state}\n")


def _length(seconds: float) -> str:
    return f"{seconds / 3600.0:.2f} h" if seconds >= 3600.0 else f"{seconds:.0f} s"
