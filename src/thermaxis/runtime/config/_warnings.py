"""What somebody should know of a configuration before it runs, found without the machine."""

import errno
import ipaddress
import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Final

from thermaxis.codes import Place, Value
from thermaxis.compensation import START, Output, SensorRules
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import Secret
from thermaxis.runtime._findings import Finding, Level, advice
from thermaxis.runtime.config._certificates import certificates_of
from thermaxis.runtime.config._configuration import MachineConfiguration
from thermaxis.runtime.config._contradictions import EVERY_ADDRESS, HOST
from thermaxis.runtime.config._tables import ScreenSettings
from thermaxis.runtime.config._touch_proofs import unproven_touches
from thermaxis.runtime.history import Encryption, encryption_of, history_folder, sqlite_path
from thermaxis.runtime.host import is_loopback

VISIBLE_STEP_UM: Final = 1.0
"""A correction that moves further from one cycle to the next may mark the surface. [µm]"""
LONG_BRIDGE_S: Final = 60.0
"""A loss or a difference that is believed for longer protects little: heat moves a tool by some
micrometres in a minute. [s]"""
LONG_HOLD_S: Final = 3600.0
"""A correction that is held for longer is that of another thermal state. [s]"""
WIDE_TOLERANCE_UM: Final = 2.0
"""A read-back that may differ by more hides a wrong unit, or another writer. [µm]"""
WIDE_REST_K: Final = 3.0
"""A witness that may go further tells of hardly any sensor that it is stuck. [K]"""
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
        *(
            advice(code, key, **values)
            for said, code, key, values in _advice(configuration)
            if said
        ),
        *_about_files(configuration),
        *_about_certificates(configuration, now),
        *_about_users(configuration),
    )


_Row = tuple[bool, str, str, dict[str, Value]]
"""Whether something is to be said, its code, its place and its values."""


def _advice(configuration: MachineConfiguration) -> Iterator[_Row]:
    """Yield what may be said of the tables, one after the other."""
    yield from _about_the_model(configuration)
    for name, rules in configuration.rules.sensors.items():
        yield from _about_input(configuration, name, rules)
    if configuration.sink.kind != "dry":
        yield from _about_protection(configuration)
    for output in configuration.compensation.model.outputs:
        yield from _about_output(configuration, output)
    for name in unproven_touches(configuration):
        yield True, "touches_unproven", f"probe.{name}.acts", {"name": name}
    slowest_s = 0.5 * configuration.rules.cycle_s
    for name, one in configuration.connections.items():
        key, open_to_all = f"connection.{name}", not (one.encrypted or is_loopback(one.host))
        yield open_to_all, "connection_unencrypted", key, {}
        long = one.timeout_s > slowest_s >= 1.0
        yield long, "timeout_long", key, {"timeout_s": one.timeout_s}
    unproven = encryption_of(configuration.historian.url) is Encryption.UNPROVEN
    yield unproven, "database_unproven", "historian.url", {}
    screen = configuration.screen
    if screen is not None:
        everybody = bool(screen.view_without_login) and not is_loopback(screen.address)
        yield everybody, "everybody_may_look", "screen.view_without_login", {}


def _about_the_model(configuration: MachineConfiguration) -> Iterator[_Row]:
    model, file = configuration.model.model, configuration.model.path.name
    for sentence in model.warnings:
        yield True, "said_of_model", file, {"said": sentence}
    parts = [(output, part) for output in model.outputs for part in output.parts]
    unknown = tuple(f"{o.name} {part.name}" for o, part in parts if part.lowest_k is None)
    yield bool(unknown), "range_unknown", file, {"parts": unknown}
    yield model.reference == START, "reference_at_start", file, {}
    by_diameter = any(part.gain_by_diameter for _, part in parts)
    yield by_diameter and configuration.diameter is None, "diameter_unread", "diameter", {}


def _about_input(
    configuration: MachineConfiguration, name: str, rules: SensorRules
) -> Iterator[_Row]:
    key, cycle_s = f"input.{name}", configuration.rules.cycle_s
    yield name not in configuration.compensation.judged, "input_unused", key, {}
    yield rules.lowest_c <= 0.0 <= rules.highest_c, "zero_plausible", key, {}
    yield rules.frozen_s == 0.0, "frozen_unseen", key, {}
    yield rules.rests_k > WIDE_REST_K, "rests_wide", key, {"rests_k": rules.rests_k}
    ages: dict[str, Value] = {"longest_age_s": rules.longest_age_s, "cycle_s": cycle_s}
    yield rules.longest_age_s < cycle_s, "age_below_cycle", key, ages


def _about_protection(configuration: MachineConfiguration) -> Iterator[_Row]:
    rules, sink = configuration.rules.supervisor, configuration.sink
    short, long = ("input_timeout_s", "read_back_s"), ("hold_input_s", "hold_connection_s")
    for name in (*short, *long):
        value_s: float = getattr(rules, name)
        most_s = LONG_BRIDGE_S if name in short else LONG_HOLD_S
        yield value_s > most_s, "time_long", f"supervisor.{name}", {"value_s": value_s}
    wide_um = rules.read_back_tolerance_um
    wide, key = wide_um > WIDE_TOLERANCE_UM, "supervisor.read_back_tolerance_um"
    yield wide, "tolerance_wide", key, {"tolerance_um": wide_um}
    yield not configuration.interlocks, "no_interlock", "interlock", {}
    on_server = sink.kind == "opcua"
    yield on_server and not sink.heartbeat_node, "no_heartbeat", "sink", {}
    unread, key = configuration.other_compensation is None, "other_compensation"
    yield on_server and unread, "other_compensation_unread", key, {}


def _about_output(configuration: MachineConfiguration, output: Output) -> Iterator[_Row]:
    limits, supervisor = configuration.rules.limits[output.name], configuration.supervisor
    key, settings = f"output.{output.name}", configuration.outputs[output.name]
    on_server = configuration.sink.kind == "opcua"
    yield on_server and not settings.read_back_node, "no_read_back", key, {}
    step_um = limits.largest_rate_um_per_s * configuration.rules.cycle_s
    yield step_um > VISIBLE_STEP_UM, "visible_step", key, {"step_um": step_um}
    longest_s, stop_s = limits.total_um / limits.largest_rate_um_per_s, supervisor.stop_within_s
    times: dict[str, Value] = {"longest_s": longest_s, "stop_within_s": stop_s}
    yield supervisor.at_stop == "fade" and longest_s > stop_s, "fade_too_long", key, times
    largest_um, limit_um = largest_of_training(output), limits.largest_um
    if largest_um is not None:
        sizes: dict[str, Value] = {"largest_um": largest_um, "limit_um": limit_um}
        yield largest_um > limit_um, "limit_below_model", key, sizes
        yield limit_um > WIDE_LIMIT * largest_um, "limit_wide", key, sizes


def largest_of_training(output: Output) -> float | None:
    """Return the largest displacement [µm] that a model gives in the range of its training.

    Every input stands for long at that end of its range, and at that diameter, at which its part
    is largest, all of one sign. None where a range is not known.
    """
    lowest_um = highest_um = output.offset_um
    for part in output.parts:
        if part.lowest_k is None or part.highest_k is None:
            return None
        gains = [part.tool_gain, *(point.gain for point in part.gain_by_diameter)]
        ends_k = (0.0, part.lowest_k, part.highest_k)
        ends_um = [gain * part.dc_gain_um_per_k * end_k for gain in gains for end_k in ends_k]
        lowest_um += min(ends_um)
        highest_um += max(ends_um)
    return max(abs(lowest_um), abs(highest_um))


# ---- files and certificates ---------------------------------------------------------------------


def _about_files(configuration: MachineConfiguration) -> Iterator[Finding]:
    state, url = configuration.state_file, configuration.historian.url
    yield from _about_folder("machine.state_file", _there(state.parent), state)
    file = sqlite_path(url)
    if file is not None:
        yield from _about_folder("historian.url", file.parent, file)
    folder = _there(history_folder(url, configuration.historian.folder))
    if file is None or not file.parent.is_relative_to(folder):
        yield from _about_folder("historian.folder", folder)
    days, day_mb = configuration.historian.retention_days, history_day_mb(configuration)
    if folder.is_dir():
        left = shutil.disk_usage(folder).free / (day_mb * 1e6)
        if left < days:
            key = "historian.retention_days"
            yield advice("disk_short", key, day_mb=day_mb, days=days, left_days=left)


def _about_users(configuration: MachineConfiguration) -> Iterator[Finding]:
    from thermaxis.runtime.users import read_users  # noqa: PLC0415 - argon2 comes with it

    server = configuration.server
    if server is not None and server.users is not None:
        yield from _tried(read_users, server.users)


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


def _tried(look: Callable[..., object], *arguments: object) -> Iterator[Finding]:
    """Yield what a look at a file raises."""
    try:
        look(*arguments)
    except ConfigurationError as failure:
        yield _wrong(failure)


def _about_certificates(configuration: MachineConfiguration, now: datetime) -> Iterator[Finding]:
    for key, path in certificates_of(configuration):
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

    def look() -> None:
        check_own_pair(certificate_of(own), private_key_of(key), application_uri, file=str(own))

    return _tried(look)


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
    unusable = [*_tried(server_context, screen.certificate, screen.private_key)]
    if unusable:
        yield from unusable
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
        return str(ipaddress.ip_address(name)) in contained
    except ValueError:
        rest = name.partition(".")[2]
        wanted = {name.lower(), f"*.{rest.lower()}"} if rest else {name.lower()}
        return any(one.lower() in wanted for one in contained)
