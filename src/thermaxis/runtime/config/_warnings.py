"""What somebody should know of a configuration before it runs, found without the machine."""

import errno
import ipaddress
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Final

from thermaxis.codes import Place
from thermaxis.compensation import START, Limits, Output, Part
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import Secret
from thermaxis.runtime._findings import Finding, Level, advice
from thermaxis.runtime.config._configuration import MachineConfiguration
from thermaxis.runtime.config._contradictions import EVERY_ADDRESS, HOST
from thermaxis.runtime.config._machine import sqlite_file
from thermaxis.runtime.config._tables import ScreenSettings
from thermaxis.runtime.history import Encryption, encryption_of, history_folder, parse_url
from thermaxis.runtime.host import is_loopback

VISIBLE_STEP_UM: Final = 1.0
"""A correction that moves further from one cycle to the next may mark the surface. [µm]"""
LONG_BRIDGE_S: Final = 60.0
"""A loss or a difference that is believed for longer protects little: heat moves a tool by some
micrometres in a minute. [s]"""
WIDE_TOLERANCE_UM: Final = 2.0
"""A read-back that may differ by more hides a wrong unit, or another writer. [µm]"""
BYTES_PER_CYCLE: Final = 30.0
"""Size of a cycle in the files of the history without its values. [byte]"""
BYTES_PER_VALUE: Final = 1.5
"""Size of a value there: 78 bytes a cycle were measured with 32 values at 1 s, and at 10 Hz, where
neighbours are more alike, 60, and 348 with 277. [byte]"""
WIDE_LIMIT: Final = 3.0
"""A limit so many times what the model asks for in the range of its training protects little.
[1]"""


def warnings_of(configuration: MachineConfiguration, now: datetime) -> tuple[Finding, ...]:
    """Return what somebody should know of a configuration; errors would stop the program."""
    return (
        *_about_the_model(configuration),
        *_about_inputs(configuration),
        *_about_protection(configuration),
        *_about_outputs(configuration),
        *_about_connections(configuration),
        *_about_the_history(configuration),
        *_about_the_screen(configuration),
        *_about_files(configuration),
        *_about_certificates(configuration, now),
    )


# ---- the model ----------------------------------------------------------------------------------


def _about_the_model(configuration: MachineConfiguration) -> Iterator[Finding]:
    model = configuration.model.model
    file = configuration.model.path.name
    for sentence in model.warnings:
        yield advice("said_of_model", file, said=sentence)
    unknown = tuple(
        f"{output.name} {part.name}"
        for output in model.outputs
        for part in output.parts
        if part.lowest_k is None
    )
    if unknown:
        yield advice("range_unknown", file, parts=unknown)
    if model.reference == START:
        yield advice("reference_at_start", file)
    by_diameter = any(part.gain_by_diameter for o in model.outputs for part in o.parts)
    if by_diameter and configuration.diameter is None:
        yield advice("diameter_unread", "diameter")


# ---- inputs and what protects -------------------------------------------------------------------


def _about_inputs(configuration: MachineConfiguration) -> Iterator[Finding]:
    channels = configuration.compensation.model.channels
    for name, rules in configuration.rules.sensors.items():
        key = f"input.{name}"
        if name not in channels:
            yield advice("input_unused", key)
        if rules.lowest_c <= 0.0 <= rules.highest_c:
            yield advice("zero_plausible", key)
        if rules.frozen_s == 0.0:
            yield advice("frozen_unseen", key)
        if rules.longest_age_s < configuration.rules.cycle_s:
            yield advice(
                "age_below_cycle",
                key,
                longest_age_s=rules.longest_age_s,
                cycle_s=configuration.rules.cycle_s,
            )


def _about_protection(configuration: MachineConfiguration) -> Iterator[Finding]:
    if configuration.sink.kind == "dry":
        return
    rules = configuration.rules.supervisor
    for name in ("input_timeout_s", "read_back_s"):
        value_s: float = getattr(rules, name)
        if value_s > LONG_BRIDGE_S:
            yield advice("time_long", f"supervisor.{name}", value_s=value_s)
    if rules.read_back_tolerance_um > WIDE_TOLERANCE_UM:
        key, wide_um = "supervisor.read_back_tolerance_um", rules.read_back_tolerance_um
        yield advice("tolerance_wide", key, tolerance_um=wide_um)
    if not configuration.interlocks:
        yield advice("no_interlock", "interlock")
    if configuration.sink.kind != "opcua":
        return
    if not configuration.sink.heartbeat_node:
        yield advice("no_heartbeat", "sink")
    if configuration.other_compensation is None:
        yield advice("other_compensation_unread", "other_compensation")


# ---- outputs ------------------------------------------------------------------------------------


def _about_outputs(configuration: MachineConfiguration) -> Iterator[Finding]:
    for output in configuration.compensation.model.outputs:
        limits = configuration.rules.limits[output.name]
        settings = configuration.outputs[output.name]
        key = f"output.{output.name}"
        if configuration.sink.kind == "opcua" and not settings.read_back_node:
            yield advice("no_read_back", key)
        step_um = limits.largest_rate_um_per_s * configuration.rules.cycle_s
        if step_um > VISIBLE_STEP_UM:
            yield advice("visible_step", key, step_um=step_um)
        longest_s = limits.total_um / limits.largest_rate_um_per_s
        if (
            configuration.supervisor.at_stop == "fade"
            and longest_s > configuration.supervisor.stop_within_s
        ):
            stop_s = configuration.supervisor.stop_within_s
            yield advice("fade_too_long", key, longest_s=longest_s, stop_within_s=stop_s)
        yield from _about_size(key, output, limits)


def largest_of_training(output: Output) -> float | None:
    """Return the largest displacement [µm] that a model gives in the range of its training.

    Every input stands for long at that end of its range, and at that diameter, at which its part
    is largest, all of one sign. None where a range is not known.
    """
    lowest_um, highest_um = output.offset_um, output.offset_um
    for part in output.parts:
        ends = _ends_of(part)
        if ends is None:
            return None
        lowest_um += min(ends)
        highest_um += max(ends)
    return max(abs(lowest_um), abs(highest_um))


def _ends_of(part: Part) -> tuple[float, ...] | None:
    if part.lowest_k is None or part.highest_k is None:
        return None
    gains = [part.tool_gain, *(point.gain for point in part.gain_by_diameter)]
    return (
        0.0,
        *(
            gain * part.dc_gain_um_per_k * value_k
            for gain in gains
            for value_k in (part.lowest_k, part.highest_k)
        ),
    )


def _about_size(key: str, output: Output, limits: Limits) -> Iterator[Finding]:
    largest_um, limit_um = largest_of_training(output), limits.largest_um
    if largest_um is None:
        return
    if largest_um > limit_um:
        yield advice("limit_below_model", key, largest_um=largest_um, limit_um=limit_um)
    elif limit_um > WIDE_LIMIT * largest_um:
        yield advice("limit_wide", key, largest_um=largest_um, limit_um=limit_um)


# ---- connections, files, certificates -----------------------------------------------------------


def _about_connections(configuration: MachineConfiguration) -> Iterator[Finding]:
    for name, settings in configuration.connections.items():
        if not settings.encrypted and not is_loopback(settings.host):
            yield advice("connection_unencrypted", f"connection.{name}")
        slowest_s = 0.5 * configuration.rules.cycle_s
        if settings.timeout_s > max(slowest_s, 1.0) and slowest_s >= 1.0:
            yield advice("timeout_long", f"connection.{name}", timeout_s=settings.timeout_s)


def _about_the_history(configuration: MachineConfiguration) -> Iterator[Finding]:
    if encryption_of(configuration.historian_url) is Encryption.UNPROVEN:
        yield advice("database_unproven", "historian.url")


def _about_the_screen(configuration: MachineConfiguration) -> Iterator[Finding]:
    screen = configuration.screen
    if screen is None:
        return
    if screen.view_without_login and not is_loopback(screen.address):
        yield advice("everybody_may_look", "screen.view_without_login")


def _about_files(configuration: MachineConfiguration) -> Iterator[Finding]:
    state, url = configuration.state_file, configuration.historian_url
    yield from _about_folder("machine.state_file", _there(state.parent), state)
    file = sqlite_file(url)
    if file is not None:
        yield from _about_folder("historian.url", file.parent, file)
    folder = _there(history_folder(parse_url(url), configuration.historian.folder))
    if file is None or not file.parent.is_relative_to(folder):
        yield from _about_folder("historian.folder", folder)
    days, day_mb = configuration.historian.retention_days, history_day_mb(configuration)
    if folder.is_dir():
        left = shutil.disk_usage(folder).free / (day_mb * 1e6)
        if left < days:
            key = "historian.retention_days"
            yield advice("disk_short", key, day_mb=day_mb, days=days, left_days=left)


def _there(folder: Path) -> Path:
    """Return a folder, or what there is above it: the program makes what is missing."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder


def history_day_mb(configuration: MachineConfiguration) -> float:
    """Return about how much history a day makes. [MB]"""
    outputs = configuration.compensation.model.outputs
    values = len(configuration.inputs) + sum(len(one.parts) + 4 for one in outputs)
    cycle = BYTES_PER_CYCLE + values * BYTES_PER_VALUE
    return cycle * 86_400.0 / configuration.rules.cycle_s / 1e6


def _about_folder(key: str, folder: Path, file: Path | None = None) -> Iterator[Finding]:
    place, denied = Place(str(folder), key=key), os.strerror(errno.EACCES)
    if not folder.is_dir():
        yield _wrong(ConfigurationError("folder_not_found", place=place))
    elif not os.access(folder, os.W_OK | os.X_OK):
        yield _wrong(ConfigurationError("folder_unwritable", cause=denied, place=place))
    elif file is not None and file.exists() and not (file.is_file() and os.access(file, os.W_OK)):
        cause = denied if file.is_file() else os.strerror(errno.EISDIR)
        place = Place(str(file), key=key)
        yield _wrong(ConfigurationError("file_unwritable", cause=cause, place=place))


def _wrong(failure: ConfigurationError) -> Finding:
    return Finding(Level.ERROR, failure.message)


def certificate_ends(configuration: MachineConfiguration) -> dict[str, datetime]:
    """Return until when every certificate is valid, by its key; without those that none can read.

    They are read now: a file that was renewed while the loop runs counts as it is.
    """
    from thermaxis.runtime.opcua import certificate_of  # noqa: PLC0415 - cryptography is heavy

    ends: dict[str, datetime] = {}
    for key, path in _certificates(configuration):
        with suppress(ConfigurationError):
            ends[key] = certificate_of(path).not_after
    return ends


def _certificates(configuration: MachineConfiguration) -> Iterator[tuple[str, Path]]:
    """Yield every certificate, own ones and those of others, with its key."""
    tables = [
        *((f"connection.{name}", one) for name, one in configuration.connections.items()),
        *((name, getattr(configuration, name)) for name in ("server", "metrics", "screen")),
    ]
    for table, settings in tables:
        for name in ("server_certificate", "certificate", "client_certificate"):
            path: Path | None = getattr(settings, name, None)
            if path is not None:
                yield f"{table}.{name}", path


def _about_certificates(configuration: MachineConfiguration, now: datetime) -> Iterator[Finding]:
    for key, path in _certificates(configuration):
        yield from _about_certificate(key, path, now)
    for settings in configuration.connections.values():
        own, key = settings.certificate, settings.private_key
        if own is not None and key is not None:
            yield from _about_pair(own, key, settings.application_uri)
    screen = configuration.screen
    if screen is not None and configuration.server is not None:
        own, key = screen.client_certificate, screen.client_private_key
        if own is not None and key is not None:
            uri = configuration.screen_connection("", Secret("")).application_uri
            yield from _about_pair(own, key, uri)


def _about_certificate(key: str, path: Path, now: datetime) -> Iterator[Finding]:
    from thermaxis.runtime.opcua import (  # noqa: PLC0415 - cryptography is heavy
        certificate_of,
        validity_warning,
    )

    try:
        certificate = certificate_of(path)
    except ConfigurationError as failure:
        yield _wrong(failure)
        return
    said = validity_warning(certificate, now, path)
    if said is not None:
        valid = certificate.not_before <= now <= certificate.not_after
        said = replace(said, place=Place(key=key))
        yield Finding(Level.WARNING if valid else Level.ERROR, said)


def _about_pair(own: Path, key: Path, application_uri: str) -> Iterator[Finding]:
    from thermaxis.runtime.opcua import (  # noqa: PLC0415 - cryptography is heavy
        certificate_of,
        check_own_pair,
        private_key_of,
    )

    try:
        pair = certificate_of(own), private_key_of(key)
        check_own_pair(*pair, application_uri, file=str(own))
    except ConfigurationError as failure:
        yield _wrong(failure)


def page_certificate_findings(configuration: MachineConfiguration) -> Iterator[Finding]:
    """Look at the certificate with which the pages are served, as a browser will.

    Whether it is one, and its dates, are looked at with all other certificates: see `warnings_of`.
    """
    screen = configuration.screen
    if screen is None or screen.certificate is None or screen.private_key is None:
        return
    from thermaxis.runtime.host import server_context  # noqa: PLC0415 - as above
    from thermaxis.runtime.opcua import certificate_of  # noqa: PLC0415 - cryptography is heavy

    key = "screen.certificate"
    try:
        contained = certificate_of(screen.certificate).hosts
    except ConfigurationError:
        return  # told already
    try:
        server_context(screen.certificate, screen.private_key)
    except ConfigurationError as failure:
        yield Finding(Level.ERROR, failure.message)
        return
    for name in _called(screen):
        if not _contains(contained, name):
            yield advice("host_not_in_certificate", key, name=name, hosts=contained)


def _called(screen: ScreenSettings) -> list[str]:
    """Return the names by which browsers reach the pages, without ports, each once."""
    names = [HOST.fullmatch(host) for host in screen.hosts]
    found = [one["name"].strip("[]") for one in names if one is not None]
    if screen.address not in EVERY_ADDRESS and not (is_loopback(screen.address) and found):
        found.append(screen.address)
    return list(dict.fromkeys(found))


def _contains(contained: Iterable[str], name: str) -> bool:
    """Whether a certificate is for a name, by RFC 9525, 6.3: a star stands for one first label."""
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        rest = name.partition(".")[2]
        wanted = {name.lower(), f"*.{rest.lower()}"} if rest else {name.lower()}
        return any(one.lower() in wanted for one in contained)
    return any(_is_address(one, address) for one in contained)


def _is_address(text: str, address: ipaddress.IPv4Address | ipaddress.IPv6Address) -> bool:
    try:
        return ipaddress.ip_address(text) == address
    except ValueError:
        return False
