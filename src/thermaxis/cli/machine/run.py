"""Compensate a machine, cycle after cycle, until it is ended.

Each cycle: read every input with status and time stamp, compute the limited correction, write it,
read it back, record it. A machine that is not there is waited for. The compensation is off until
an operator enables it; it is ended by Ctrl+C or SIGTERM, and fades out first. A second signal ends
it at once.
"""

import argparse
import asyncio
import io
import logging
import os
import queue
import socket
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import AsyncExitStack, redirect_stderr, redirect_stdout, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from thermaxis import runtime
from thermaxis.cli._arguments import adder
from thermaxis.cli.machine._machine_parts import (
    MachineParts,
    build_parts,
    loop_settings,
    sole_runner,
)
from thermaxis.cli.machine._signals import at_signals
from thermaxis.codes import Message
from thermaxis.compensation import AnswerCode, Reason, Request, RequestKind
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence, sentence_of
from thermaxis.runtime import OTHER_COMPENSATION, publish
from thermaxis.runtime.config import with_proven_touches
from thermaxis.runtime.host import RequestSocket
from thermaxis.runtime.publish import Publisher
from thermaxis.runtime.status import is_mismatch

LAST_LINES_S = 1.0
"""Time that the last lines are given to be printed. [s]"""
ALARMS_AFTER: Final = timedelta(seconds=5.0)
"""What stands so long after the start is told: a connection takes a moment."""
ALARM_EVERY: Final = timedelta(seconds=10.0)
"""An alarm is told so often at most, its going too."""
MOST_WAITING: Final = 2000
"""So many texts wait to be printed, of each kind: more than a traceback has. [1]"""
_WAITING: Final = {1: queue.Queue[str](MOST_WAITING), 2: queue.Queue[str](MOST_WAITING)}
"""What waits for standard output and for standard error: who reads one only misses nothing."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("configuration MACHINE.toml", "the machine (TOML)", Path)
    add("--enable", "enable it at the start, as an operator would", bool)
    add("--diameter MM", "clamping diameter of the workpiece, in mm", float)
    add("--cycles N", "end after so many cycles (default: when told)", int)
    add("--quiet", "print errors only, not every change", bool)


def run(arguments: argparse.Namespace) -> int:
    """Run the loop."""
    if arguments.cycles is not None and arguments.cycles < 1:
        raise ConfigurationError("not_positive", key="--cycles", value=arguments.cycles)
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # at DEBUG it writes passwords
    configuration = runtime.read_machine(arguments.configuration)
    with redirect_stdout(_Beside(1)), redirect_stderr(_Beside(2)):
        with sole_runner(configuration):
            standing, lost = asyncio.run(_run(configuration, arguments))
        _say("ended", quiet=arguments.quiet)
        if lost:
            sys.stderr.write(f"thermaxis: {sentence('alarm-history_lost', {'lost': lost})}\n")
        for name, value in standing.items():
            told = f"{name}: an offset of {value:+.2f} um stands in the machine"
            sys.stderr.write(f"thermaxis: {told}\n")
    until_s = time.monotonic() + LAST_LINES_S
    while any(texts.unfinished_tasks for texts in _WAITING.values()) and time.monotonic() < until_s:
        time.sleep(0.01)
    return 1 if standing and configuration.supervisor.at_stop == "fade" else 0


async def _run(
    configuration: runtime.MachineConfiguration, arguments: argparse.Namespace
) -> tuple[dict[str, float], int]:
    """Run the loop; return the offsets other than zero that it leaves, and how much is lost.

    In the machine, by output [um]; of the history [1].
    """
    clock = runtime.SystemClock()
    publisher = Publisher(configuration, clock, _serve)
    parts = build_parts(configuration, clock, publisher)
    replays = configuration.source.kind == "replay"
    proven = with_proven_touches(configuration)
    loop = runtime.CompensationLoop(
        proven.compensation,
        loop_settings(configuration),
        parts.ports,
        state_file=None if replays else runtime.StateFile(configuration.state_file),
        models=proven.other_model,
        self_test=None if replays else _self_test(configuration, parts),
    )
    loop.listeners.append(runtime.SignOfLife().tell)
    ending = _Ending()
    if not arguments.quiet:
        loop.listeners.append(_Teller(ending.stop).tell)
    async with AsyncExitStack() as servers:
        servers.enter_context(
            at_signals(ending.asked, ending.hung_up)
        )  # until everything is closed
        servers.push_async_callback(publisher.close, 5.0)
        publisher.loop = loop
        opened = await publisher.begin()
        for descriptor in _WAITING:
            threading.Thread(target=_print_waiting, args=(descriptor,), daemon=True).start()
        if opened.unrecorded is not None:  # no reason to leave a machine alone
            why = sentence_of(opened.unrecorded)
            sys.stderr.write(f"thermaxis: nothing is recorded: {why}\n")
        if configuration.server is not None:
            _say(f"status server: {opened.url}", quiet=arguments.quiet)
        if configuration.metrics is not None:
            _say(f"metrics: port {opened.metrics_port}", quiet=arguments.quiet)
        if configuration.server is not None or configuration.metrics is not None:
            loop.listeners.append(publisher.publish)
        requests = RequestSocket(
            configuration.state_file, loop, may_start=configuration.supervisor.ask_enables
        )
        try:
            await requests.open()
        except OSError as error:  # no reason to leave a machine alone
            why = error.strerror or type(error).__name__
            sys.stderr.write(f"thermaxis: thermaxis ask does not work here: {why}\n")
        servers.push_async_callback(requests.close)
        standing = await _until_the_end(loop, arguments, ending)
    lost = publisher.status.lost + publisher.status.waiting
    if configuration.sink.kind == "dry":
        return {}, lost
    return {name: um for name, um in standing.items() if um}, lost


def _serve(
    configuration: runtime.MachineConfiguration, clock: runtime.Clock, connected: socket.socket
) -> None:
    """Serve in the copy of this process, which alone loads what that takes."""
    sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__  # no thread prints there
    publish.serve(configuration, clock, connected)


class _Ending:
    """What signals ask for: the first one lets the correction fade, the second one ends at once."""

    def __init__(self) -> None:
        self.stop = asyncio.Event()
        self.running: asyncio.Future[Mapping[str, float]] | None = None

    def asked(self) -> None:
        if not self.stop.is_set():
            _say("it is being ended: the correction fades, then the history is stored", quiet=False)
            self.stop.set()
        elif self.running is not None:
            _say("it is ended at once", quiet=False)
            self.running.cancel()

    def hung_up(self) -> None:
        """End as asked when a terminal is closed; that it tells so twice is no haste."""
        if not self.stop.is_set():
            self.asked()


async def _until_the_end(
    loop: runtime.CompensationLoop, arguments: argparse.Namespace, ending: _Ending
) -> Mapping[str, float]:
    """Run the loop until a signal; return the offsets that it leaves in the machine. [um]"""
    ending.running = asyncio.ensure_future(loop.run(ending.stop, arguments.cycles))
    asking = asyncio.ensure_future(_ask_first(loop, arguments))
    try:
        return await ending.running
    except asyncio.CancelledError:
        last = loop.status
        if last is None:
            return {}
        return dict(zip(last.outputs, last.output.correction_um, strict=True))
    finally:
        asking.cancel()


def _self_test(
    configuration: runtime.MachineConfiguration, parts: MachineParts
) -> Callable[[], asyncio.Future[tuple[Message, ...]]]:
    async def reasons() -> tuple[Message, ...]:
        looked = await runtime.self_test(
            configuration, parts.sessions, parts.sink, parts.probes, parts.pins
        )
        return runtime.reasons_against(looked)

    return lambda: asyncio.ensure_future(reasons())


async def _ask_first(loop: runtime.CompensationLoop, arguments: argparse.Namespace) -> None:
    """Ask what the command line asks for: to be enabled as soon as the machine is there."""
    requests: list[Request] = []
    if arguments.diameter is not None:
        requests.append(Request(RequestKind.DIAMETER, "the command line", value=arguments.diameter))
    if arguments.enable:
        requests.append(Request(RequestKind.ENABLE, "the command line"))
    for request in requests:
        if request.kind is RequestKind.ENABLE:
            await _machine_there(loop)
        answer = await loop.submit(request)
        while answer.code == AnswerCode.OTHER_COMPENSATION_UNREAD:  # one missed read
            await _machine_there(loop)
            answer = await loop.submit(request)
        if not answer.accepted:
            why = sentence_of(answer.message)
            sys.stderr.write(f"thermaxis: {request.kind} was refused: {why}\n")


async def _machine_there(loop: runtime.CompensationLoop) -> None:
    """Wait until the machine can be written to, and says what forbids to enable."""
    there = asyncio.Event()

    def look(status: runtime.RuntimeStatus) -> None:
        other = status.samples.get(OTHER_COMPENSATION)
        if status.source_connected and status.sink_connected and (other is None or other.good):
            there.set()

    loop.listeners.append(look)
    try:
        await there.wait()
    finally:
        loop.listeners.remove(look)


def _say(text: str, *, quiet: bool) -> None:
    if not quiet:
        sys.stdout.write(f"{text}\n")


class _Beside(io.TextIOBase):
    """Hands what anybody prints to a thread; that for which no room is left is left out."""

    def __init__(self, descriptor: int) -> None:
        self._texts = _WAITING[descriptor]

    def write(self, text: str) -> int:
        if text:
            with suppress(queue.Full):
                self._texts.put_nowait(text)
        return len(text)


def _print_waiting(descriptor: int) -> None:
    """Print what waits; a reader that stands still (Ctrl+S, a full pipe) stops nothing else."""
    texts = _WAITING[descriptor]
    while True:
        text = texts.get()
        with suppress(OSError):  # nobody reads any more
            os.write(descriptor, text.encode(errors="replace"))  # a buffer would be waited for
        texts.task_done()


class _Teller:
    """Prints a line when the state or its reasons change, and when an alarm comes or goes."""

    def __init__(self, stop: asyncio.Event) -> None:
        self.stop = stop
        self.last: tuple[object, ...] = ()
        self.alarms: dict[str, tuple[datetime, str, str]] = {}

    def tell(self, status: runtime.RuntimeStatus) -> None:
        output = status.output
        at = f"{status.utc:%Y-%m-%dT%H:%M:%SZ}"
        now = (output.state, output.reasons)
        if now != self.last:
            self.last = now
            corrections = ", ".join(
                f"{name} {value:+.1f}"
                for name, value in zip(status.outputs, output.correction_um, strict=True)
            )
            reasons = [
                "the program is being ended"
                if reason is Reason.DISABLED and self.stop.is_set()
                else sentence(f"reason-{reason}")
                for reason in output.reasons
            ]
            why = f" ({'; '.join(reasons)})" if reasons else ""
            _say(f"{at} {output.state}{why}; correction: {corrections}", quiet=False)
        if status.utc - status.started >= ALARMS_AFTER:
            self._tell_alarms(status, at)

    def _tell_alarms(self, status: runtime.RuntimeStatus, at: str) -> None:
        """Tell what is not told yet; one that comes and goes is told every ten seconds."""
        of = {m.key.rpartition(" ")[0] if is_mismatch(m) else m.key: m for m in status.alarms}
        for name in self.alarms.keys() | of:
            since, key, text = self.alarms.get(name, (datetime.min.replace(tzinfo=UTC), "", ""))
            alarm = of.get(name)
            if key == (alarm.key if alarm else "") or status.utc - since < ALARM_EVERY:
                continue
            if alarm:
                key, text = alarm.key, alarm.sentences.text
                _say(f"{at} alarm, {alarm.priority}: {text}", quiet=False)
            else:
                key = ""
                _say(f"{at} no more: {text}", quiet=False)
            self.alarms[name] = status.utc, key, text
