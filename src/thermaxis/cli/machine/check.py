"""``thermaxis check``: say what a configuration would do, and look at the machine."""

import argparse
import asyncio
import contextlib
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import final

from thermaxis.cli._arguments import add_json, adder
from thermaxis.cli._json import write_json
from thermaxis.cli.machine._machine_parts import build_probe_session, build_sessions, build_sink
from thermaxis.cli.machine._machine_words import (
    findings_as_json,
    findings_in_words,
    machine_as_json,
    machine_in_words,
)
from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError
from thermaxis.messages import text_of
from thermaxis.runtime import (
    Clock,
    Finding,
    Level,
    MachineConfiguration,
    OpcUaSession,
    Sink,
    SystemClock,
    examine_machine,
    self_test,
    sole_runner,
    warnings_of,
)
from thermaxis.runtime.config import page_certificate_findings

_DESCRIPTION = """\
Read the configuration of a machine, say in plain words what would be done with it and what somebody
should know; then connect and look whether the machine is as the configuration says. Nothing moves,
nothing is corrected, and without --write nothing is written.
"""
_LOOKS_AFTER_S = 0.05
_LONGEST_WAIT_S = 3600.0
FOUND = 1
"""Exit code where the machine is not as the configuration says. [1]"""
WRONG = 2
"""Exit code where the configuration is wrong. [1]"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
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
        float,
        default=10.0,
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check a configuration and its machine."""
    _check_options(arguments)
    found = examine_machine(arguments.configuration)
    if not isinstance(found, MachineConfiguration):
        _tell_problems(found, arguments)
        return WRONG
    now = datetime.now(UTC)
    warnings = (*warnings_of(found, now), *page_certificate_findings(found))
    if arguments.json != "-":
        _tell_configuration(found, warnings)
    findings: Sequence[Finding] = ()
    if not arguments.offline:
        findings = _look(found, wait_s=arguments.wait, write=arguments.write)
    return _tell_result(found, warnings, findings, arguments)


def _check_options(arguments: argparse.Namespace) -> None:
    if arguments.write and arguments.offline:
        raise ConfigurationError(
            "options_exclude", place=Place(key="--write"), one="--write", other="--offline"
        )
    if not 0.0 < arguments.wait <= _LONGEST_WAIT_S:
        raise ConfigurationError(
            "outside_range",
            place=Place(key="--wait"),
            value=arguments.wait,
            least=0.0,
            most=_LONGEST_WAIT_S,
        )


# ---- looking at the machine ---------------------------------------------------------------------


def _look(
    configuration: MachineConfiguration, *, wait_s: float, write: bool
) -> tuple[Finding, ...]:
    """Look at the machine; only a program that has it for itself writes to it."""
    lock = sole_runner(configuration.state_file, configuration.name) if write else None
    with lock or contextlib.nullcontext():
        return asyncio.run(_tested(configuration, wait_s=wait_s, write=write))


@final
@dataclass(frozen=True, slots=True)
class _Parts:
    """Connections and sink alone: what the self-test needs."""

    sessions: Mapping[str, OpcUaSession]
    """Connections by name."""
    sink: Sink
    """Where corrections go."""
    probes: OpcUaSession | None
    """The connection of the probes; None where there are none."""


async def _tested(
    configuration: MachineConfiguration, *, wait_s: float, write: bool
) -> tuple[Finding, ...]:
    """Connect, run the self-test, and leave."""
    clock = SystemClock()
    sessions = build_sessions(configuration, clock)
    probes = build_probe_session(configuration, clock)
    parts = _Parts(sessions, build_sink(configuration, sessions, clock), probes)
    async with contextlib.AsyncExitStack() as opened:
        for part in (*sessions.values(), parts.sink, *_present(probes)):
            await part.open()
            opened.push_async_callback(part.close)
        await _reached(parts, clock, wait_s)
        return await self_test(parts, configuration, write=write)


async def _reached(parts: _Parts, clock: Clock, wait_s: float) -> None:
    """Wait until everything is connected, or a time has passed."""
    until_s = clock.monotonic_s() + wait_s
    wanted = (*parts.sessions.values(), parts.sink, *_present(parts.probes))
    while clock.monotonic_s() < until_s and not all(part.connected for part in wanted):
        await clock.sleep_until(clock.monotonic_s() + _LOOKS_AFTER_S)


def _present(session: OpcUaSession | None) -> tuple[OpcUaSession, ...]:
    return () if session is None else (session,)


# ---- telling ------------------------------------------------------------------------------------


def _tell_problems(problems: Sequence[Message], arguments: argparse.Namespace) -> None:
    """Say everything that is wrong in the file."""
    for problem in problems:
        sys.stderr.write(f"thermaxis: error: {text_of(problem)}\n")
    if arguments.json is not None:
        listed = findings_as_json([Finding(Level.ERROR, one) for one in problems])
        write_json(
            {"machine": None, "configuration": listed, "warnings": [], "self_test": None},
            arguments.json,
        )


def _tell_configuration(configuration: MachineConfiguration, warnings: Sequence[Finding]) -> None:
    sys.stdout.write(machine_in_words(configuration))
    if warnings:
        sys.stdout.write("\n" + findings_in_words("What somebody should know", warnings))
    sys.stdout.flush()


def _tell_result(
    configuration: MachineConfiguration,
    warnings: Sequence[Finding],
    findings: Sequence[Finding],
    arguments: argparse.Namespace,
) -> int:
    if arguments.json is not None:
        result: dict[str, object] = {
            "machine": machine_as_json(configuration),
            "configuration": [],
            "warnings": findings_as_json(warnings),
            "self_test": None if arguments.offline else findings_as_json(findings),
        }
        write_json(result, arguments.json)
    wrong = sum(f.level is Level.ERROR for f in (*warnings, *findings))
    if arguments.json != "-":
        if not arguments.offline:
            sys.stdout.write("\n" + findings_in_words("Self-test", findings))
        sys.stdout.write(f"\n{_verdict(wrong, offline=arguments.offline)}\n")
    return FOUND if wrong else 0


def _verdict(wrong: int, *, offline: bool) -> str:
    if wrong:
        errors = "1 error" if wrong == 1 else f"{wrong} errors"
        return f"{errors}: to be mended before this machine is compensated."
    if offline:
        return "Nothing is wrong in the configuration; the machine was not looked at."
    return "Nothing forbids a correction. The sign is proven by thermaxis commission."
