"""Read the nodes that a configuration names, each at its rate, into a log per day.

A log has the time and one column per channel. Status and source time stamp of every reading stand
in a file beside it. What is not good, no number or no new measurement is an empty cell; gaps,
losses and jumps of the clock are marked. It goes on until it is interrupted (Ctrl+C, or SIGTERM),
through lost connections, a full disk and restarts. With --plan it says every ten minutes what a
planned thermal test has reached, beside what was foreseen, and when that is enough.
"""

import argparse
import asyncio
import shutil
import sys
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path

from thermaxis import files, runtime
from thermaxis.cli._arguments import adder, positive_seconds
from thermaxis.cli._planned_test import check_recorded, told_of_plan
from thermaxis.cli.machine._signals import at_signals
from thermaxis.codes import Message, printable
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.messages import sentence_of
from thermaxis.report.tables import text_table
from thermaxis.runtime.record import (
    RecordingFiles,
    TriedChannel,
    bytes_per_day,
    sole_writer,
    try_once,
)
from thermaxis.thermal import ThermalTestPlan

TOLD_EVERY_S = 600.0
"""What a planned test has reached is told so often. [s]"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("configuration RECORD.toml", "servers, nodes, rates (TOML)", Path)
    add("-o, --output FOLDER", "where the logs are written", Path)
    add(
        "--for TIME",
        "end after so long: a number of seconds, or with min or h (default: when interrupted)",
        positive_seconds,
        dest="duration",
    )
    add(
        "--plan PLAN",
        "plan of thermal-test plan: says while it runs what is reached; a folder of its own",
        Path,
    )
    add(
        "--try", "read every node once, show what it says, and write nothing", bool, dest="only_try"
    )


def run(arguments: argparse.Namespace) -> int:
    """Record."""
    if (arguments.output is None) != bool(arguments.only_try):
        raise ConfigurationError("either_option", key="--output", one="--output", other="--try")
    settings = runtime.read_record(arguments.configuration)
    if arguments.only_try:
        return asyncio.run(_tried(settings))
    plan = None
    if arguments.plan is not None:
        plan = files.read_thermal_test_plan(arguments.plan)
        check_recorded(plan.conditions, (channel.name for channel in settings.channels))
    return _record(settings, arguments.output, arguments.duration, plan)


def _record(
    settings: runtime.RecordSettings,
    folder: Path,
    duration_s: float | None,
    plan: ThermalTestPlan | None,
) -> int:
    with sole_writer(folder, settings.name):
        for line in _about(settings, folder, duration_s or (plan.duration_s if plan else None)):
            _show(line)
        summary = asyncio.run(_recorded(settings, folder, duration_s, plan))
    for line in _summary(summary):
        sys.stdout.write(f"{line}\n")
    if summary.error:
        raise DataError("rows_not_written", file=folder, cause=summary.error)
    if plan is not None and (last := told_of_plan(plan, summary.files)) is not None:
        _tell(last)
    return 0


@asynccontextmanager
async def _connected(
    settings: runtime.RecordSettings, clock: runtime.Clock
) -> AsyncGenerator[dict[str, runtime.OpcUaSession]]:
    """Open the connections, and close them at the end."""
    sessions = {n: runtime.OpcUaSession(c, clock) for n, c in settings.connections.items()}
    async with AsyncExitStack() as opened:
        for session in sessions.values():
            opened.push_async_callback(session.close)
            await session.open()
        yield sessions


async def _recorded(
    settings: runtime.RecordSettings,
    folder: Path,
    duration_s: float | None,
    plan: ThermalTestPlan | None,
) -> runtime.RecordSummary:
    clock, stop = runtime.SystemClock(), asyncio.Event()
    async with _connected(settings, clock) as sessions:
        written = RecordingFiles(settings, folder, _tell)
        recorder = runtime.Recorder(settings, sessions, clock, written, tell=_tell)
        with at_signals(stop.set):  # it ends with its last row
            # no group: a failure to judge must not end a recording
            telling = asyncio.create_task(tell_of_plan(plan, written.written, clock, _tell))
            try:
                return await recorder.run(duration_s, stop)
            finally:
                telling.cancel()


async def tell_of_plan(
    plan: ThermalTestPlan | None,
    logs: Sequence[Path],
    clock: runtime.Clock,
    tell: Callable[[Message], None],
) -> None:
    """Tell every ten minutes what a planned test has reached, by its log, without end."""
    while plan is not None:
        await clock.sleep_until(clock.monotonic_s() + TOLD_EVERY_S)
        if (message := await asyncio.to_thread(told_of_plan, plan, tuple(logs))) is not None:
            tell(message)


def _tell(message: Message) -> None:
    _show(sentence_of(message))


def _show(text: str) -> None:
    """Say what happened, if anybody can be told: a full disk or a closed pipe ends no recording."""
    now = datetime.now(UTC).strftime("%H:%M:%SZ")
    with suppress(OSError):
        sys.stderr.write(f"{now} {printable(text, 500)}\n")
        sys.stderr.flush()


def _about(settings: runtime.RecordSettings, folder: Path, duration_s: float | None) -> list[str]:
    """Return what the user should know before it begins."""
    rates = sorted({channel.period_ms / 1000.0 for channel in settings.channels})
    words = ", ".join(f"{rate:g} s" for rate in rates)
    names = ", ".join(settings.connections)
    lines = [
        f"recording {len(settings.channels)} channels every {words} from {names} into {folder}"
    ]
    a_day = bytes_per_day(settings)
    room = shutil.disk_usage(folder).free / a_day
    lines.append(f"about {a_day / 1e6:.3g} MB a day; the disk has room for {room:.3g} days")
    now = datetime.now(UTC)
    if duration_s is not None:
        days = (now + timedelta(seconds=duration_s)).date() - now.date()
        if settings.days_per_file <= days.days:
            lines.append(
                "the recording ends on another day in UTC and will be in several files: for one"
                f" test in one log write days_per_file = {days.days + 1}"
            )
    return lines


def _summary(summary: runtime.RecordSummary) -> list[str]:
    lines = [
        f"{summary.rows} rows were written" + (f", {summary.lost} lost" if summary.lost else "")
    ]
    for channel in summary.channels:
        words = (
            f"  {channel.settings.name}: {channel.recorded} of {channel.asked} readings recorded"
        )
        if channel.unchanged:
            words += f", {channel.unchanged} with an unchanged source time stamp"
        for status, count in channel.not_good.items():
            words += f", {count} {status}"
        lines.append(words)
    lines += [f"written: {path}" for path in dict.fromkeys(summary.files)]
    return lines


async def _tried(settings: runtime.RecordSettings) -> int:
    """Read every node twice and show what it says; return the exit code."""
    clock = runtime.SystemClock()
    async with _connected(settings, clock) as sessions:
        tried = await try_once(settings, sessions, clock)
        missing = {n: s.last_error for n, s in sessions.items() if not s.connected}
    rows = [
        (t.settings.name, t.settings.node, t.status, _remark(t), t.value, t.settings.unit)
        for t in tried
    ]
    heads = ("channel", "node", "status", "remark", "value", "unit")
    cells = [[printable(cell, 70) for cell in row] for row in rows]
    sys.stdout.write(text_table("read twice:", heads, cells, words=4))
    for name, why in missing.items():
        sys.stdout.write(f"connection {name} is not there: {printable(why, 400)}\n")
    return 0 if all(t.value for t in tried) else 1


def _remark(tried: TriedChannel) -> str:
    return "" if tried.remark is None else sentence_of(tried.remark)
