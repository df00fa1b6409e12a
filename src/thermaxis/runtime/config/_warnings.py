"""What somebody should know of a configuration before it runs, found without the machine."""

import os
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Final

from thermaxis.compensation import START, Limits, Output, Part
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import Secret
from thermaxis.runtime._findings import Finding, error, warning
from thermaxis.runtime.config._settings import MachineConfiguration
from thermaxis.runtime.historian import Encryption, encryption_of
from thermaxis.runtime.host import is_loopback

VISIBLE_STEP_UM: Final = 1.0
"""A correction that moves further from one cycle to the next may mark the surface. [µm]"""
WIDE_LIMIT: Final = 3.0
"""A limit so many times what the model asks for in the range of its training protects little.
[1]"""


def warnings_of(configuration: MachineConfiguration, now: datetime) -> tuple[Finding, ...]:
    """Return what somebody should know of a configuration.

    Parameters
    ----------
    configuration : MachineConfiguration
        The configuration.
    now : datetime
        Time of day, aware: certificates expire.

    Returns
    -------
    tuple of Finding
        Warnings, and errors of what would stop the program at its start; empty if there is none.
    """
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
    where = f"model {configuration.model.path.name}"
    for sentence in model.warnings:
        yield warning(where, sentence.rstrip("."), "It was said when the model was made")
    unknown = [
        f"{output.name} {part.name}"
        for output in model.outputs
        for part in output.parts
        if part.lowest_k is None
    ]
    if unknown:
        yield warning(
            where,
            f"for {', '.join(unknown)} it does not say from which temperatures it was made: nothing"
            " tells when it is used outside of them",
            "Identify it from logs with thermaxis identify",
        )
    if model.reference == START:
        yield warning(
            where,
            "temperatures count from those at the first start; what the machine had grown by then"
            " is not corrected",
            "Start it with a machine that has stood still for hours, or state references in the"
            " model",
        )
    by_diameter = any(part.gain_by_diameter for o in model.outputs for part in o.parts)
    if by_diameter and configuration.diameter is None:
        yield warning(
            "[diameter]",
            "the model has gains by the workpiece's diameter, and no node tells it",
            "Let operators state the diameter, or name the control's node",
        )


# ---- inputs and what protects -------------------------------------------------------------------


def _about_inputs(configuration: MachineConfiguration) -> Iterator[Finding]:
    channels = configuration.compensation.model.channels
    for name, rules in configuration.rules.sensors.items():
        where = f"[input.{name}]"
        if name not in channels:
            yield warning(where, "the model does not use it: it is only recorded", "")
        if rules.lowest_c <= 0.0 <= rules.highest_c:
            yield warning(
                where,
                "0 °C counts as plausible, and an input that is not connected often reads 0",
                "Raise lowest_c, if the machine is never that cold",
            )
        if rules.longest_age_s < configuration.rules.cycle_s:
            yield warning(
                where,
                f"a value older than {rules.longest_age_s:g} s is refused, and the cycle is"
                f" {configuration.rules.cycle_s:g} s",
                "Raise longest_age_s to two cycles at least",
            )


def _about_protection(configuration: MachineConfiguration) -> Iterator[Finding]:
    if configuration.sink.kind == "dry":
        return
    if not configuration.interlocks:
        yield warning(
            "[interlock.NAME]",
            "there is no interlock: a correction goes on while the machine is off, homing or not"
            " referenced",
            "Name the nodes of the machine's states",
        )
    if configuration.sink.kind != "opcua":
        return
    if not configuration.sink.heartbeat_node:
        yield warning(
            "[sink]",
            "there is no heartbeat_node: if this program dies, the machine keeps the last offset",
            "Let the PLC take the offset back when a heartbeat stands still, and name its node",
        )
    if configuration.other_compensation is None:
        yield warning(
            "[other_compensation]",
            "no node tells whether the builder's own compensation is active, and two of them are"
            " wrong for certain",
            "Make sure by other means that it is off",
        )


# ---- outputs ------------------------------------------------------------------------------------


def _about_outputs(configuration: MachineConfiguration) -> Iterator[Finding]:
    for output in configuration.compensation.model.outputs:
        limits = configuration.rules.limits[output.name]
        settings = configuration.outputs[output.name]
        where = f"[output.{output.name}]"
        if configuration.sink.kind == "opcua" and not settings.read_back_stated:
            yield warning(
                where,
                "there is no read_back_node: what the machine made of an offset is not seen",
                "Name the node at which it reports the accepted offset",
            )
        step_um = limits.largest_rate_um_per_s * configuration.rules.cycle_s
        if step_um > VISIBLE_STEP_UM:
            yield warning(
                where,
                f"the correction may move by {step_um:g} µm from one cycle to the next, which may"
                " mark the surface",
                "Lower largest_rate_um_per_s, or shorten the cycle",
            )
        longest_s = limits.total_um / limits.largest_rate_um_per_s
        if configuration.at_stop == "fade" and longest_s > configuration.stop_within_s:
            yield warning(
                where,
                f"to fade from the limit takes {longest_s:.0f} s, and the end of the program waits"
                f" for {configuration.stop_within_s:g} s: what is left stays in the machine",
                "Raise stop_within_s, and leave the rest to the machine's watchdog",
            )
        yield from _about_size(where, output, limits)


def largest_of_training(output: Output) -> float | None:
    """Return the largest displacement that a model gives in the range of its training.

    Parameters
    ----------
    output : Output
        An output of the model.

    Returns
    -------
    float or None
        Every input at that end of its range, for long, and at that diameter, at which its part is
        largest, all of one sign; None where a range is not known. [µm]
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


def _about_size(where: str, output: Output, limits: Limits) -> Iterator[Finding]:
    largest_um = largest_of_training(output)
    if largest_um is None:
        return
    if largest_um > limits.largest_um:
        yield warning(
            where,
            f"in the range of its training the model asks for up to {largest_um:.0f} µm, and"
            f" {limits.largest_um:g} µm are allowed",
            "Look whether the machine grows so far, and raise largest_um if it does; long at the"
            " limit is a fault",
        )
    elif limits.largest_um > WIDE_LIMIT * largest_um:
        yield warning(
            where,
            f"{limits.largest_um:g} µm are allowed, and in the range of its training the model asks"
            f" for {largest_um:.0f} µm at most",
            "Lower largest_um: a narrow limit protects",
        )


# ---- connections, files, certificates -----------------------------------------------------------


def _about_connections(configuration: MachineConfiguration) -> Iterator[Finding]:
    for name, settings in configuration.connections.items():
        if not settings.encrypted and not is_loopback(settings.host):
            yield warning(
                f"[connection.{name}]",
                "whoever reaches the network can read and change what is sent: it is not encrypted",
                'Choose security = "Basic256Sha256", with certificates of thermaxis certificate',
            )
        slowest_s = 0.5 * configuration.rules.cycle_s
        if settings.timeout_s > max(slowest_s, 1.0) and slowest_s >= 1.0:
            yield warning(
                f"[connection.{name}]",
                f"a request may take {settings.timeout_s:g} s, more than half a cycle",
                "Lower timeout_s",
            )


def _about_the_history(configuration: MachineConfiguration) -> Iterator[Finding]:
    if encryption_of(configuration.historian_url) is Encryption.UNPROVEN:
        yield warning(
            "[historian], url",
            "sslmode=require encrypts, and believes whoever answers to be the database: somebody in"
            " between would get the password and the history",
            "Write sslmode=verify-full with sslrootcert",
        )


def _about_the_screen(configuration: MachineConfiguration) -> Iterator[Finding]:
    screen = configuration.screen
    if screen is None:
        return
    if screen.view_without_login and not is_loopback(screen.address):
        yield warning(
            "[screen], view_without_login",
            "whoever reaches the network can look at the pages, the history included",
            "Write view_without_login = false, and give whoever looks a user with the role viewer",
        )


def _about_files(configuration: MachineConfiguration) -> Iterator[Finding]:
    state = configuration.state_file.parent
    while not state.exists() and state != state.parent:
        state = state.parent  # the program makes what is missing below
    yield from _about_folder("[machine], state_file", state)
    url = configuration.historian_url
    if url.startswith("sqlite:///"):
        yield from _about_folder("[historian], url", Path(url.removeprefix("sqlite:///")).parent)


def _about_folder(where: str, folder: Path) -> Iterator[Finding]:
    if not folder.is_dir():
        yield error(where, f"there is no folder {folder}", "Make it, or name another")
    elif not os.access(folder, os.W_OK | os.X_OK):
        yield error(
            where,
            f"nothing can be written into the folder {folder}",
            "Give the user of this program the right to write there, or name another",
        )


def _about_certificates(configuration: MachineConfiguration, now: datetime) -> Iterator[Finding]:
    for name, settings in configuration.connections.items():
        where = f"[connection.{name}]"
        own, key = settings.certificate, settings.private_key
        yield from _about_certificate(
            f"{where}, server_certificate", settings.server_certificate, now
        )
        yield from _about_certificate(f"{where}, certificate", own, now)
        if own is not None and key is not None:
            yield from _about_pair(f"{where}, certificate", own, key, settings.application_uri)
    if configuration.server is not None:
        yield from _about_certificate(
            "[server], certificate", configuration.server.certificate, now
        )
    if configuration.metrics is not None:
        yield from _about_certificate(
            "[metrics], certificate", configuration.metrics.certificate, now
        )
    screen = configuration.screen
    if screen is not None:
        yield from _about_certificate("[screen], certificate", screen.certificate, now)
        own, key = screen.client_certificate, screen.client_private_key
        where = "[screen], client_certificate"
        yield from _about_certificate(where, own, now)
        if own is not None and key is not None and configuration.server is not None:
            uri = configuration.screen_connection("", Secret("")).application_uri
            yield from _about_pair(where, own, key, uri)


def _about_certificate(where: str, path: Path | None, now: datetime) -> Iterator[Finding]:
    if path is None:
        return
    from thermaxis.runtime.opcua import (  # noqa: PLC0415 - cryptography is heavy
        certificate_of,
        validity_warning,
    )

    try:
        certificate = certificate_of(path)
    except ConfigurationError as failure:
        yield error(where, failure.what, failure.remedy)
        return
    said = validity_warning(certificate, now, name=f"certificate {path.name}")
    if said is not None:
        valid = certificate.not_before <= now <= certificate.not_after
        remedy = "See thermaxis certificate; the other side must trust a new one before it is used"
        yield warning(where, said, remedy) if valid else error(where, said, remedy)


def _about_pair(where: str, own: Path, key: Path, application_uri: str) -> Iterator[Finding]:
    from thermaxis.runtime.opcua import (  # noqa: PLC0415 - cryptography is heavy
        certificate_of,
        check_own_pair,
        private_key_of,
    )

    try:
        pair = certificate_of(own), private_key_of(key)
        check_own_pair(*pair, application_uri, where=str(own))
    except ConfigurationError as failure:
        yield error(where, failure.what, failure.remedy)
