"""``thermaxis machine``: the virtual vertical lathe, as an OPC UA server or as a log."""

import argparse
import asyncio
import logging
import signal
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from thermaxis.cli._progress import Progress
from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import Secret, SystemClock
from thermaxis.runtime.host import read_secret
from thermaxis.virtual import (
    DEFAULT_SCENARIO,
    FAULTY,
    SCENARIOS,
    SIGNALS,
    LatheServer,
    LatheServerSettings,
    LatheSettings,
    OffsetRules,
    VirtualLathe,
    log_lathe,
    parse_fault,
    write_lathe_log,
)
from thermaxis.virtual.lathe import check_log_name, parse_seconds

_EVERY_S = 10.0
_OF_LOG = {"output": "-o", "every": "--every", "truth": "--truth"}
_OF_SERVER = {
    "address": "--address",
    "port": "--port",
    "speed": "--speed",
    "stop_after": "--stop-after",
    "certificate": "--certificate",
    "private_key": "--private-key",
    "user": "--user",
    "password_file": "--password-file",
    "watchdog": "--watchdog",
    "rate": "--rate",
    "clamp": "--clamp",
}


def _time(text: str) -> float:
    seconds = parse_seconds(text)
    if seconds is None or seconds <= 0.0:
        raise argparse.ArgumentTypeError(f"'{text}' is no positive time; write 90s, 10min or 8h")
    return seconds


def _length(text: str) -> float:
    return 0.0 if text == "all" else _time(text)


def _watchdog(text: str) -> float:
    return 0.0 if text == "off" else _time(text)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = parser.add_argument
    add("--list", action="store_true", help="show the scenarios and what the machine shows, end")
    add("--scenario", metavar="NAME", help="what the machine does (default: day; see --list)")
    add("--seed", metavar="N", type=int, default=1, help="seed of hall and noise (default: 1)")
    add(
        "--fault",
        metavar="SENTENCE",
        action="append",
        default=[],
        help='what goes wrong, such as "stuck T_spindle_C at 2h for 10min"; may be given more than'
        " once",
    )
    log = parser.add_argument_group("write a log instead of serving").add_argument
    log("--log", metavar="TIME|all", type=_length, help="length of the log, such as 8h")
    log("-o", "--output", metavar="FILE", type=Path, help="the log, .csv or .parquet")
    log("--every", metavar="TIME", type=_time, help="time between rows (default: 10s)")
    log("--truth", action="store_true", help="the true displacements beside the measured ones")
    serve = parser.add_argument_group("serve by OPC UA").add_argument
    serve("--address", metavar="A", help="this computer's own address (default: 127.0.0.1)")
    serve("--port", metavar="N", type=int, help="port; 0 for a free one (default: 4840)")
    serve("--speed", metavar="F", type=float, help="times faster than real time (default: 1)")
    serve("--stop-after", metavar="TIME", type=_time, help="end by itself (default: never)")
    serve("--certificate", metavar="FILE", type=Path, help="sign and encrypt with it")
    serve("--private-key", metavar="FILE", type=Path, help="key of the certificate")
    serve("--user", metavar="NAME", help="the only user that is let in")
    serve("--password-file", metavar="FILE", type=Path, help="file with the user's password")
    serve(
        "--watchdog",
        metavar="TIME|off",
        type=_watchdog,
        help="without a moved heartbeat the offset goes to zero (default: 2s)",
    )
    serve("--rate", metavar="UM_S", type=float, help="rate of the offset in um/s (default: 2)")
    serve("--clamp", metavar="UM", type=float, help="largest offset in um (default: 400)")


def run(arguments: argparse.Namespace) -> int:
    """Serve the machine, or write its log."""
    if arguments.list:
        sys.stdout.write(_listed())
        return 0
    _check_options(arguments)
    lathe = VirtualLathe(
        arguments.scenario or DEFAULT_SCENARIO,
        arguments.seed,
        _settings(arguments),
        [parse_fault(text, FAULTY) for text in arguments.fault],
    )
    if arguments.log is not None:
        return _write_log(arguments, lathe)
    return _serve(arguments, lathe)


def _listed() -> str:
    lines = ["Scenarios", ""]
    for scenario in SCENARIOS.values():
        length = f"{scenario.duration_s / 3600.0:g} h"
        length += ", again and again" if scenario.endless else ""
        lines += [f"  {scenario.name}: {scenario.summary} ({length})"]
    lines += ["", "Signals", ""]
    for name, one in SIGNALS.items():
        unit = "" if one.unit == "1" else f" [{one.unit}]"
        writable = "; may be written" if one.writable else ""
        lines.append(f"  {name}{unit}: {one.text[0].lower()}{one.text[1:]}{writable}")
    return "\n".join(lines) + "\n"


def _check_options(arguments: argparse.Namespace) -> None:
    logging = arguments.log is not None
    foreign = _OF_SERVER if logging else _OF_LOG
    for name, option in foreign.items():
        value = getattr(arguments, name)
        if value is not None and value is not False:
            why = "a log is written without a server" if logging else "this belongs to --log"
            raise ConfigurationError(why, where=option, remedy="Leave it out")
    if logging and arguments.output is None:
        raise ConfigurationError(
            "the log has no file", where="--log", remedy="Give -o log.parquet or -o log.csv"
        )
    if logging:
        check_log_name(arguments.output)


def _settings(arguments: argparse.Namespace) -> LatheSettings:
    rules = OffsetRules()
    if arguments.clamp is not None:
        rules = replace(rules, largest_um=arguments.clamp)
    if arguments.rate is not None:
        rules = replace(rules, rate_um_per_s=arguments.rate)
    if arguments.watchdog is not None:
        rules = replace(rules, watchdog_s=arguments.watchdog or None)
    return LatheSettings(offset=rules)


def _write_log(arguments: argparse.Namespace, lathe: VirtualLathe) -> int:
    hours = (arguments.log or lathe.scenario.duration_s) / 3600.0
    every_s = arguments.every or _EVERY_S
    with Progress() as progress:
        log = log_lathe(
            lathe,
            hours,
            every_s=every_s,
            truth=arguments.truth,
            progress=lambda row, rows: progress("the machine runs", row, rows),
        )
        write_lathe_log(log, arguments.output)
    sys.stdout.write(
        f"{printable(str(arguments.output))}: {log.rows} rows, {hours:g} h of"
        f" {lathe.scenario.name}, seed {lathe.seed}\n"
    )
    return 0


def _server_settings(arguments: argparse.Namespace) -> LatheServerSettings:
    names = ("address", "port", "speed", "certificate", "private_key", "user")
    given = {name: getattr(arguments, name) for name in names}
    stated = {name: value for name, value in given.items() if value is not None}
    return LatheServerSettings(**stated, password=_password(arguments.password_file))


def _password(path: Path | None) -> Secret:
    return Secret("") if path is None else read_secret(path, where="--password-file")


def _serve(arguments: argparse.Namespace, lathe: VirtualLathe) -> int:
    logging.getLogger("asyncua").setLevel(logging.ERROR)  # its warnings are no errors of anybody
    asyncio.run(_live(lathe, _server_settings(arguments), arguments.stop_after))
    return 0


async def _live(
    lathe: VirtualLathe, settings: LatheServerSettings, stop_after_s: float | None
) -> None:
    """Serve until a signal asks for the end."""
    loop = asyncio.get_running_loop()
    end = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        with suppress(NotImplementedError):  # not on every system
            loop.add_signal_handler(number, end.set)
    started: asyncio.Future[str] = loop.create_future()
    serving = asyncio.create_task(LatheServer(lathe, settings, SystemClock()).run(started))
    waiting = asyncio.create_task(end.wait())
    try:
        await asyncio.wait({serving, started}, return_when=asyncio.FIRST_COMPLETED)
        if started.done():
            sys.stdout.write(f"endpoint: {started.result()}\n")
            sys.stdout.write(f"{lathe.scenario.name}, seed {lathe.seed}; Ctrl-C ends it\n")
            sys.stdout.flush()
            await asyncio.wait(
                {serving, waiting}, timeout=stop_after_s, return_when=asyncio.FIRST_COMPLETED
            )
    finally:
        waiting.cancel()
        serving.cancel()
        with suppress(asyncio.CancelledError):
            await serving
