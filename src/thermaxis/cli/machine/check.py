"""Read the configuration of a machine, and say in plain words what would be done with it.

Then connect and look whether the machine is as the configuration says. Nothing moves, nothing is
corrected, and without --write nothing is written.
"""

import argparse
import asyncio
import contextlib
import socket
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from thermaxis import runtime
from thermaxis.cli._arguments import add_json, adder, number, refuse_both
from thermaxis.cli._json import write_json
from thermaxis.cli.machine._machine_parts import (
    build_pins,
    build_probe_session,
    build_sessions,
    build_sink,
    sole_runner,
)
from thermaxis.cli.machine._machine_words import (
    describe_machine,
    findings_as_json,
    findings_in_words,
)
from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import schema_of
from thermaxis.messages import text_of
from thermaxis.report.tables import as_json, as_text
from thermaxis.runtime.config import MachineFile, page_certificate_findings
from thermaxis.runtime.history import check_database

_LOOKS_AFTER_S = 0.05
FOUND = 1
"""Exit code where the machine is not as the configuration says. [1]"""
WRONG = 2
"""Exit code where the configuration is wrong. [1]"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("configuration MACHINE.toml", "configuration of the machine", Path)
    add("--offline", "do not connect: the configuration alone", bool)
    add(
        "--write",
        "write the offset that stands in the machine back to it: nothing moves, and that it"
        " can be written is proven; refused while another program runs the machine; not with"
        " the option above (default: the access level is believed)",
        bool,
    )
    add(
        "--wait S",
        "seconds in which the machine must be reached (default: 10)",
        number("wait of more than 0 and at most 3600 s", 1e-9, 3600.0),
        default=10.0,
    )
    text = "print the JSON schema of such files, for editors, and end"
    parser.add_argument("--schema", action=_Schema, nargs=0, help=text)
    add_json(parser)


class _Schema(argparse.Action):
    """Prints the schema; no configuration is needed for that."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print it and end."""
        write_json(schema_of(MachineFile), "-")
        parser.exit()


def run(arguments: argparse.Namespace) -> int:
    """Check a configuration and its machine."""
    refuse_both(arguments, "--write", "--offline")
    try:
        found = runtime.examine_machine(arguments.configuration)
    except ConfigurationError as error:  # no TOML at all
        found = (error.message,)
    if not isinstance(found, runtime.MachineConfiguration):
        for problem in found:
            sys.stderr.write(f"thermaxis: error: {text_of(problem)}\n")
        listed = findings_as_json([runtime.Finding(runtime.Level.ERROR, one) for one in found])
        _write_result(arguments, machine=None, configuration=listed)
        return WRONG
    quiet = arguments.json == "-"
    warnings = (*runtime.warnings_of(found, datetime.now(UTC)), *page_certificate_findings(found))
    described = describe_machine(found)
    if not quiet:
        sys.stdout.write(as_text(described))
        if warnings:
            sys.stdout.write("\n" + findings_in_words("What somebody should know", warnings))
        sys.stdout.flush()
    findings: Sequence[runtime.Finding] = ()
    if not arguments.offline:
        findings = _look(found, wait_s=arguments.wait, write=arguments.write)
        findings = (*findings, *_about_history(found), *_about_ports(found))
    _write_result(
        arguments,
        machine=as_json(described),
        warnings=findings_as_json(warnings),
        self_test=None if arguments.offline else findings_as_json(findings),
    )
    wrong = sum(f.level is runtime.Level.ERROR for f in (*warnings, *findings))
    if not quiet:
        if not arguments.offline:
            sys.stdout.write("\n" + findings_in_words("Self-test", findings))
        sys.stdout.write(f"\n{_verdict(wrong, offline=arguments.offline)}\n")
    return FOUND if wrong else 0


def _write_result(arguments: argparse.Namespace, **result: object) -> None:
    if arguments.json is not None:
        known: dict[str, object] = {
            "machine": None,
            "configuration": [],
            "warnings": [],
            "self_test": None,
        }
        write_json(known | result, arguments.json)


def _verdict(wrong: int, *, offline: bool) -> str:
    if wrong:
        errors = "1 error" if wrong == 1 else f"{wrong} errors"
        return f"{errors}: to be mended before this machine is compensated."
    if offline:
        return "Nothing is wrong in the configuration; the machine was not looked at."
    return "Nothing forbids a correction. The sign is proven by thermaxis commission."


# ---- looking at the machine ---------------------------------------------------------------------


def _look(
    configuration: runtime.MachineConfiguration, *, wait_s: float, write: bool
) -> tuple[runtime.Finding, ...]:
    """Look at the machine; only a program that has it for itself writes to it."""
    lock = sole_runner(configuration) if write else None
    with lock or contextlib.nullcontext():
        return asyncio.run(_tested(configuration, wait_s=wait_s, write=write))


def _about_history(configuration: runtime.MachineConfiguration) -> Iterator[runtime.Finding]:
    """Say whether the database can keep a history; one that is out of reach is waited for."""
    url, key = configuration.historian.url, "historian.url"
    try:
        check_database(url, configuration.historian.password.reveal())
    except ConfigurationError as error:
        message = replace(error.message, place=error.place._replace(key=key))
        yield runtime.Finding(runtime.Level.ERROR, message)
    except OSError as error:
        values, place = {"cause": str(error)}, Place(key=key)
        message = Message("self_test-history_unreachable", values, place)
        yield runtime.Finding(runtime.Level.WARNING, message)


def _about_ports(configuration: runtime.MachineConfiguration) -> Iterator[runtime.Finding]:
    """Say where nobody can listen: the port is taken, or the address is another computer's."""
    for table in ("server", "metrics", "screen"):
        settings = getattr(configuration, table)
        if settings is None or settings.port == 0:
            continue
        family = socket.AF_INET6 if ":" in settings.address else socket.AF_INET
        try:
            socket.create_server((settings.address, settings.port), family=family).close()
        except OSError as error:
            code, level = "error-cannot_listen", runtime.Level.ERROR
            if table == "screen":  # which may run meanwhile, and which the loop does without
                code, level = "self_test-port_unusable", runtime.Level.WARNING
            elif _loop_runs(configuration):  # the port is its own
                continue
            values = {"cause": error.strerror or str(error), "port": settings.port}
            message = Message(code, values, Place(key=f"{table}.port"))
            yield runtime.Finding(level, message)


def _loop_runs(configuration: runtime.MachineConfiguration) -> bool:
    """Whether the machine's loop holds its lock; none is made."""
    state = configuration.state_file
    try:
        if state.with_name(f"{state.name}.lock").exists():
            with runtime.sole_runner(state, configuration.name):
                pass
    except ConfigurationError as error:
        return error.code == "machine_in_use"
    return False


async def _tested(
    configuration: runtime.MachineConfiguration, *, wait_s: float, write: bool
) -> tuple[runtime.Finding, ...]:
    """Connect, run the self-test, and leave."""
    clock = runtime.SystemClock()
    sessions = build_sessions(configuration, clock)
    sink = build_sink(configuration, sessions, clock)
    probes, pins = build_probe_session(configuration, clock), build_pins(configuration, clock)
    every = (*sessions.values(), sink, *([] if probes is None else [probes]))
    async with contextlib.AsyncExitStack() as opened:
        if pins is not None:  # which the self-test's questions connect
            opened.push_async_callback(pins.close)
        for part in every:
            await part.open()
            opened.push_async_callback(part.close)
        until_s = clock.monotonic_s() + wait_s
        while clock.monotonic_s() < until_s and not all(part.connected for part in every):
            await clock.sleep_until(clock.monotonic_s() + _LOOKS_AFTER_S)
        return await runtime.self_test(configuration, sessions, sink, probes, pins, write=write)
