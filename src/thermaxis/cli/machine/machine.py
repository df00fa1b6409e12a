"""Run a virtual machine: an OPC UA server, or a log."""

import argparse
import asyncio
import logging
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from thermaxis import virtual
from thermaxis.cli._arguments import adder, refuse_alone, refuse_foreign
from thermaxis.cli._progress import Progress
from thermaxis.cli.machine._signals import at_signals
from thermaxis.codes import printable
from thermaxis.runtime import Secret, SystemClock
from thermaxis.runtime.host import read_secret
from thermaxis.virtual.lathe import check_log_name, parse_seconds

_EVERY_S = 10.0
_OF_LOG = ("--output", "--every", "--truth")
_OF_SERVER = (
    *("--address", "--port", "--speed", "--stop-after", "--certificate", "--private-key"),
    *("--user", "--password-file", "--watchdog", "--rate", "--clamp"),
)


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
    add = adder(parser)
    add("--list", "show the scenarios and what the machine shows, end", bool)
    add("--scenario NAME", "what the machine does (default: day; see --list)")
    add("--seed N", "seed of hall and noise (default: 1)", int, default=1)
    add(
        "--fault SENTENCE",
        'what goes wrong, such as "stuck T_spindle_C at 2h for 10min"; may be given more than once',
        many=True,
    )
    add(
        "--touch-every TIME",
        "the machine's own probe touches so often (default: only when it is asked); a log then has"
        " touches alone",
        _time,
    )
    log = adder(parser.add_argument_group("write a log instead of serving"))
    log(
        "--log TIME|all",
        "write a log of this length, or of the whole scenario, instead of serving",
        _length,
    )
    log("-o, --output FILE", "the log, .csv or .parquet", Path)
    log("--every TIME", "time between rows (default: 10s)", _time)
    log("--truth", "the true displacements beside the measured ones", bool)
    serve = adder(parser.add_argument_group("serve by OPC UA"))
    serve("--address A", "this computer's own address (default: 127.0.0.1)")
    serve("--port N", "port; 0 for a free one (default: 4840)", int)
    serve("--speed F", "times faster than real time (default: 1)", float)
    serve("--stop-after TIME", "end by itself (default: never)", _time)
    serve("--certificate FILE", "sign and encrypt with it", Path)
    serve("--private-key FILE", "key of the certificate", Path)
    serve("--user NAME", "the only user that is let in")
    serve(
        "--password-file FILE",
        "file with the user's password, readable by its owner only (chmod 600)",
        Path,
    )
    serve(
        "--watchdog TIME|off",
        "without a moved heartbeat the offset goes to zero (default: 2s)",
        _watchdog,
    )
    serve("--rate UM_S", "rate of the offset in um/s (default: 2)", float)
    serve("--clamp UM", "largest offset in um (default: 400)", float)


def run(arguments: argparse.Namespace) -> int:
    """Serve the machine, or write its log."""
    if arguments.list:
        sys.stdout.write(_listed())
        return 0
    _check_options(arguments)
    lathe = virtual.VirtualLathe(
        arguments.scenario or virtual.DEFAULT_SCENARIO,
        arguments.seed,
        _settings(arguments),
        [virtual.parse_fault(text, virtual.FAULTY) for text in arguments.fault],
    )
    if arguments.log is not None:
        return _write_log(arguments, lathe)
    return _serve(arguments, lathe)


def _listed() -> str:
    lines = ["Scenarios", ""]
    for scenario in virtual.SCENARIOS.values():
        length = f"{scenario.duration_s / 3600.0:g} h"
        length += ", again and again" if scenario.endless else ""
        lines += [f"  {scenario.name}: {scenario.summary} ({length})"]
    lines += ["", "Signals", ""]
    for name, one in virtual.SIGNALS.items():
        unit = "" if one.unit == "1" else f" [{one.unit}]"
        writable = "; may be written" if one.writable else ""
        lines.append(f"  {name}{unit}: {one.text[0].lower()}{one.text[1:]}{writable}")
    return "\n".join(lines) + "\n"


def _check_options(arguments: argparse.Namespace) -> None:
    if arguments.log is None:
        refuse_foreign(arguments, "--log", *_OF_LOG)
        return
    refuse_foreign(arguments, "serving", *_OF_SERVER)
    refuse_alone(arguments, "--output", "--log")
    check_log_name(arguments.output)


def _settings(arguments: argparse.Namespace) -> virtual.LatheSettings:
    rules = virtual.OffsetRules()
    if arguments.clamp is not None:
        rules = replace(rules, largest_um=arguments.clamp)
    if arguments.rate is not None:
        rules = replace(rules, rate_um_per_s=arguments.rate)
    if arguments.watchdog is not None:
        rules = replace(rules, watchdog_s=arguments.watchdog or None)
    return virtual.LatheSettings(offset=rules, touch_every_s=arguments.touch_every)


def _write_log(arguments: argparse.Namespace, lathe: virtual.VirtualLathe) -> int:
    hours = (arguments.log or lathe.scenario.duration_s) / 3600.0
    every_s = arguments.every or _EVERY_S
    with Progress() as progress:
        log = virtual.log_lathe(
            lathe,
            hours,
            every_s=every_s,
            truth=arguments.truth,
            progress=lambda row, rows: progress("the machine runs", row, rows),
        )
        virtual.write_lathe_log(log, arguments.output)
    sys.stdout.write(
        f"{printable(str(arguments.output))}: {log.rows} rows, {hours:g} h of"
        f" {lathe.scenario.name}, seed {lathe.seed}\n"
    )
    return 0


def _server_settings(arguments: argparse.Namespace) -> virtual.LatheServerSettings:
    names = ("address", "port", "speed", "certificate", "private_key", "user")
    given = {name: getattr(arguments, name) for name in names}
    stated = {name: value for name, value in given.items() if value is not None}
    return virtual.LatheServerSettings(**stated, password=_password(arguments.password_file))


def _password(path: Path | None) -> Secret:
    return Secret("") if path is None else read_secret(path, key="--password-file")


def _serve(arguments: argparse.Namespace, lathe: virtual.VirtualLathe) -> int:
    logging.getLogger("asyncua").setLevel(logging.ERROR)  # its warnings are no errors of anybody
    asyncio.run(_live(lathe, _server_settings(arguments), arguments.stop_after))
    return 0


async def _live(
    lathe: virtual.VirtualLathe,
    settings: virtual.LatheServerSettings,
    stop_after_s: float | None,
) -> None:
    """Serve until a signal asks for the end."""
    end = asyncio.Event()
    started: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    server = virtual.LatheServer(lathe, settings, SystemClock())
    serving = asyncio.create_task(server.run(started))
    waiting = asyncio.create_task(end.wait())
    try:
        with at_signals(end.set):
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
