"""What a server says of its nodes, judged by what the configuration expects: no connection here."""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Final

from thermaxis.codes import printable
from thermaxis.compensation import CompensationModel, Limits, SensorRules
from thermaxis.runtime._findings import Finding, error, ok, warning
from thermaxis.runtime._flag import flag_of
from thermaxis.runtime._sign import OFFSET_UNITS, offset_factor
from thermaxis.runtime.config import (
    DiameterSettings,
    FlagSettings,
    InputSettings,
    OutputSettings,
    ProbeSettings,
)

if TYPE_CHECKING:
    from thermaxis.runtime.opcua import NodeDescription

SUSPECT_FACTOR: Final = 10.0
"""An offset so many times beyond its limit is taken for one in another unit: the units differ by
ten and more. [1]"""
LARGEST_DIAMETER_MM: Final = 30_000.0
"""Largest diameter of a workpiece that is believed: the largest vertical lathes turn about 25 m
[trade]. [mm]"""
_WHOLE: Final[Mapping[str, tuple[int, int]]] = {
    "SByte": (-(2**7), 2**7 - 1),
    "Byte": (0, 2**8 - 1),
    "Int16": (-(2**15), 2**15 - 1),
    "UInt16": (0, 2**16 - 1),
    "Int32": (-(2**31), 2**31 - 1),
    "UInt32": (0, 2**32 - 1),
    "Int64": (-(2**63), 2**63 - 1),
    "UInt64": (0, 2**64 - 1),
}
_NUMBERS: Final = frozenset({"Double", "Float", *_WHOLE})
_FLAGS: Final = frozenset({"Boolean", *_WHOLE})
_TO_C: Final[Mapping[str, Callable[[float], float]]] = {
    "degC": lambda value: value,
    "K": lambda value: value - 273.15,
    "degF": lambda value: (value - 32.0) / 1.8,
}
_SCALES: Final = (1.0, 0.1, 0.01, 0.001)
_TO_MM: Final = {"mm": 1.0, "inch": 25.4}
_BROWSE = "Look for the node with the server's own browser and correct the configuration"


def _lacking(
    where: str, node: "NodeDescription", types: frozenset[str], wanted: str
) -> Iterator[Finding]:
    """Yield why a node cannot be what it should be, whatever its value is."""
    shown = printable(node.node, 120)
    if not node.exists:
        yield error(where, f"the server has no node {shown} ({node.status})", _BROWSE)
    elif node.data_type not in types:
        kind = node.data_type or "of a type that is no plain number"
        yield error(where, f"the node {shown} is {kind}, and {wanted} is needed", _BROWSE)


# ---- inputs -------------------------------------------------------------------------------------


def judge_input(
    where: str, node: "NodeDescription", settings: InputSettings, rules: SensorRules
) -> Iterator[Finding]:
    """Judge the node of a temperature.

    A value that is bad at the moment is a warning, for the compensation judges every value of
    every cycle; what cannot get better by itself is an error.

    Parameters
    ----------
    where : str
        Table and key.
    node : NodeDescription
        What the server says.
    settings : InputSettings
        Unit of the value.
    rules : SensorRules
        What is plausible.

    Yields
    ------
    Finding
        At least one.
    """
    lacking = list(_lacking(where, node, _NUMBERS, "a number"))
    if lacking:
        yield from lacking
        return
    if node.value is None or not math.isfinite(node.value):
        status = "it is no number" if node.value is not None else node.status
        yield warning(
            where,
            f"there is no value: {status}",
            "Look at the sensor; nothing is corrected before it has a good value",
        )
        return
    value_c = _temperature_c(node.value, settings)
    wrong = list(_judge_age(where, node, rules))
    wrong += _judge_temperature(where, float(node.value), value_c, settings, rules)
    yield from wrong
    if not wrong:
        age = "" if node.age_s is None else f", {node.age_s:.1f} s old"
        yield ok(where, f"{value_c:.1f} °C{age}")


def _judge_age(where: str, node: "NodeDescription", rules: SensorRules) -> Iterator[Finding]:
    if node.age_s is None:
        if rules.time_stamp_required:
            yield error(
                where,
                "the value has no time stamp that can be used, so that its age is not known",
                "Let the server stamp it; or state time_stamp_required = false, and a frozen value"
                " is found by frozen_s only",
            )
    elif node.age_s > rules.longest_age_s:
        yield warning(
            where,
            f"the value is {node.age_s:.0f} s old, and {rules.longest_age_s:g} s are allowed",
            "Look at the sensor; some servers stamp a value only when it changes: then raise"
            " longest_age_s",
        )


def _judge_temperature(
    where: str, raw: float, value_c: float, settings: InputSettings, rules: SensorRules
) -> Iterator[Finding]:
    if rules.lowest_c <= value_c <= rules.highest_c:
        return
    plausible = f"{rules.lowest_c:g} to {rules.highest_c:g} °C"
    others = units_that_fit(raw, settings, rules)
    if others:
        yield error(
            where,
            f"the value {raw:.6g} is {value_c:.6g} °C as configured, which is not plausible"
            f" ({plausible}); it would be with {' or '.join(others)}",
            f"Check the node's unit, and write {others[0]} if it is so",
        )
        return
    open_input = "; an input that is not connected often reads 0" if raw == 0.0 else ""
    yield warning(
        where,
        f"{value_c:.1f} °C is not plausible ({plausible}){open_input}",
        "Look at sensor, unit and plausible range",
    )


def _temperature_c(value: float, settings: InputSettings) -> float:
    return _TO_C[settings.unit](float(value) * settings.scale)


def units_that_fit(raw: float, settings: InputSettings, rules: SensorRules) -> tuple[str, ...]:
    """Return the units and scales in which a value would be a plausible temperature.

    Parameters
    ----------
    raw : float
        The value as it was read. [unit of the node]
    settings : InputSettings
        Unit and scale that the configuration states.
    rules : SensorRules
        What is plausible.

    Returns
    -------
    tuple of str
        Lines of the configuration, the likeliest first; empty where the value is plausible as it
        is, and where no unit makes it plausible.
    """

    def plausible(unit: str, scale: float) -> bool:
        return rules.lowest_c <= _TO_C[unit](raw * scale) <= rules.highest_c

    if plausible(settings.unit, settings.scale):
        return ()
    units = [
        f'unit = "{unit}"'
        for unit in _TO_C
        if unit != settings.unit and plausible(unit, settings.scale)
    ]
    scales = [
        f"scale = {scale:g}"
        for scale in _SCALES
        if scale != settings.scale and plausible(settings.unit, scale)
    ]
    return (*units, *scales)


def judge_redundant(
    where: str,
    first: "NodeDescription",
    second: "NodeDescription",
    settings: InputSettings,
    rules: SensorRules,
) -> Iterator[Finding]:
    """Judge whether two sensors of one channel agree.

    Parameters
    ----------
    where : str
        Table of the input.
    first, second : NodeDescription
        What the server says of both.
    settings : InputSettings
        Their unit.
    rules : SensorRules
        Largest difference.

    Yields
    ------
    Finding
        A warning if they disagree.
    """
    if first.value is None or second.value is None:
        return  # said of the sensor itself
    difference_k = _temperature_c(second.value, settings) - _temperature_c(first.value, settings)
    if abs(difference_k) > rules.largest_difference_k:
        yield warning(
            where,
            f"the redundant sensor differs by {difference_k:+.1f} K, and"
            f" {rules.largest_difference_k:g} K are allowed",
            "Look at both sensors: one of them is wrong, or they are not at the same place",
        )


# ---- flags and diameter -------------------------------------------------------------------------


def judge_interlock(where: str, node: "NodeDescription", settings: FlagSettings) -> Finding:
    """Judge an interlock: one that is not met now is a warning.

    Parameters
    ----------
    where : str
        Table of the interlock.
    node : NodeDescription
        What the server says.
    settings : FlagSettings
        Value at which it is met.

    Returns
    -------
    Finding
        What was found.
    """
    flag = _flag_or_finding(
        where,
        node,
        "Without a value the interlock counts as a lost input: nothing is enabled, and a"
        " correction at work is held for a while and then fades",
    )
    if isinstance(flag, Finding):
        return flag
    if flag is settings.value:
        return ok(where, "it is met")
    return warning(where, "it is not met at present", "Until it is met, nothing is corrected")


def _flag_or_finding(where: str, node: "NodeDescription", without: str) -> bool | Finding:
    """Return a node's flag, or why it has none; `without` says what follows from no value."""
    lacking = next(_lacking(where, node, _FLAGS, "a Boolean or a whole number"), None)
    if lacking is not None:
        return lacking
    if node.value is None:
        return warning(where, f"there is no value: {node.status}", without)
    flag = flag_of(node.value)
    if flag is not None:
        return flag
    return error(
        where,
        f"its value is {node.value:g}, and a flag is 0 or 1",
        "Name a node that is true or false, or 0 or 1; any other number counts as no value",
    )


def judge_other_compensation(
    where: str, node: "NodeDescription", settings: FlagSettings
) -> Finding:
    """Judge the flag of another compensation: while it is active, nothing may be enabled.

    Parameters
    ----------
    where : str
        Table of the flag.
    node : NodeDescription
        What the server says.
    settings : FlagSettings
        Value at which the other compensation is active.

    Returns
    -------
    Finding
        What was found.
    """
    flag = _flag_or_finding(
        where, node, "Make sure by other means that the builder's own compensation is off"
    )
    if isinstance(flag, Finding):
        return flag
    if flag is settings.value:
        return error(
            where,
            "another compensation is active on the machine, and two of them are wrong for certain",
            "Switch the builder's own compensation off; or leave thermaxis off",
        )
    return ok(where, "no other compensation is active")


def judge_diameter(
    where: str, node: "NodeDescription", settings: DiameterSettings, model: CompensationModel
) -> Finding:
    """Judge the node of the workpiece's diameter.

    Parameters
    ----------
    where : str
        Its table.
    node : NodeDescription
        What the server says.
    settings : DiameterSettings
        Its unit.
    model : CompensationModel
        The model, with gains by diameter or without.

    Returns
    -------
    Finding
        What was found.
    """
    lacking = next(_lacking(where, node, _NUMBERS, "a number"), None)
    if lacking is not None:
        return lacking
    if node.value is None:
        return warning(where, f"there is no value: {node.status}", "An operator can state it")
    diameter_mm = float(node.value) * settings.scale * _TO_MM[settings.unit]
    if not 0.0 <= diameter_mm <= LARGEST_DIAMETER_MM:
        return warning(
            where, f"{diameter_mm:g} mm is not plausible for a workpiece", "Check node and unit"
        )
    points = [
        point.diameter_mm
        for output in model.outputs
        for part in output.parts
        for point in part.gain_by_diameter
    ]
    if points and not min(points) <= diameter_mm <= max(points):
        return warning(
            where,
            f"{diameter_mm:g} mm lies outside the model's gains, {min(points):g} to"
            f" {max(points):g} mm: the gain at the end is taken",
            "Check node and unit",
        )
    return ok(where, f"{diameter_mm:g} mm")


# ---- probes -------------------------------------------------------------------------------------


def judge_probe(where: str, node: "NodeDescription", settings: ProbeSettings) -> Finding:
    """Judge the node of a probe: nothing that is wrong with it forbids a correction.

    Parameters
    ----------
    where : str
        Its table.
    node : NodeDescription
        What the server says.
    settings : ProbeSettings
        Unit and scale.

    Returns
    -------
    Finding
        Never an error.
    """
    lacking = next(_lacking(where, node, _NUMBERS, "a number"), None)
    if lacking is not None:
        return warning(where, lacking.what, f"{lacking.remedy}; the compensation does without it")
    if node.value is None or not math.isfinite(node.value):
        status = "it is no number" if node.value is not None else node.status
        return warning(
            where, f"there is no value: {status}", "The compensation does not need the probe"
        )
    value_um = float(node.value) * settings.factor
    if node.age_s is None:
        return ok(where, f"{value_um:+.1f} µm, of unknown age")
    return ok(where, f"{value_um:+.1f} µm, {node.age_s:.1f} s old")


# ---- outputs ------------------------------------------------------------------------------------


def judge_output(
    where: str, node: "NodeDescription", settings: OutputSettings, limits: Limits
) -> Iterator[Finding]:
    """Judge the node that a correction is written to.

    Parameters
    ----------
    where : str
        Table and key.
    node : NodeDescription
        What the server says.
    settings : OutputSettings
        Unit and sign.
    limits : Limits
        Limits of the correction.

    Yields
    ------
    Finding
        At least one.
    """
    lacking = list(_lacking(where, node, _NUMBERS, "a number"))
    if lacking:
        yield from lacking
        return
    if not node.writable:
        yield error(
            where,
            "the server does not let this user write the offset",
            "Give the user the right to write; on a SINUMERIK with the method GiveUserAccess",
        )
    yield from _judge_counts(where, node, settings, limits)
    if node.value is None or not math.isfinite(node.value):
        yield error(
            where,
            f"the offset that stands in the machine cannot be read: {node.status}",
            "Let it be readable: a correction begins where the offset stands",
        )
        return
    yield _judge_found(where, float(node.value), settings, limits)


def _judge_counts(
    where: str, node: "NodeDescription", settings: OutputSettings, limits: Limits
) -> Iterator[Finding]:
    """Judge a node with whole numbers: how coarse it is, and whether it is wide enough."""
    if node.data_type not in _WHOLE:
        return
    per_um = abs(offset_factor(settings.unit, settings.sign))
    lowest, highest = _WHOLE[node.data_type]
    largest = limits.total_um * per_um
    if largest < 1.0:
        yield error(
            where,
            f"the node takes whole {settings.unit} only: a correction of up to"
            f" {limits.total_um:g} µm is always written as 0",
            "Check the unit, or let the PLC offer a finer one",
        )
    elif largest > highest or -largest < lowest:
        yield error(
            where,
            f"a correction of {limits.total_um:g} µm does not fit into {node.data_type} in"
            f" {settings.unit}",
            "Check the unit, or lower the limits",
        )
    elif per_um < 1.0:
        yield warning(
            where,
            f"the node takes whole {settings.unit} only: the correction moves in steps of"
            f" {1.0 / per_um:g} µm, which may mark the surface",
            "Let the PLC offer a finer unit",
        )


def _judge_found(where: str, raw: float, settings: OutputSettings, limits: Limits) -> Finding:
    found_um = raw / offset_factor(settings.unit, settings.sign)
    if abs(found_um) <= limits.total_um:
        return ok(where, f"an offset of {found_um + 0.0:.1f} µm stands in the machine")
    others = [
        unit
        for unit, per_um in OFFSET_UNITS.items()
        if unit != settings.unit and abs(raw) <= limits.total_um * per_um
    ]
    if abs(found_um) > SUSPECT_FACTOR * limits.total_um and others:
        return error(
            where,
            f"the offset found is {raw:.6g}, in {settings.unit} {found_um:.6g} µm: far beyond the"
            f" limit of {limits.total_um:g} µm, but plausible in {' or '.join(others)}",
            "Check the unit; if it is right, set the offset to zero by hand",
        )
    return warning(
        where,
        f"an offset of {found_um:.1f} µm stands in the machine, beyond the limit of"
        f" {limits.total_um:g} µm",
        "Find out who wrote it; once enabled it is a fault and goes to zero at the allowed rate",
    )


def judge_read_back(
    where: str,
    node: "NodeDescription",
    written: "NodeDescription",
    settings: OutputSettings,
    tolerance_um: float,
) -> Finding:
    """Judge a node at which the machine reports an offset.

    Parameters
    ----------
    where : str
        Table and key.
    node, written : NodeDescription
        What the server says of it, and of the node that is written.
    settings : OutputSettings
        Unit and sign.
    tolerance_um : float
        Difference that is believed. [µm]

    Returns
    -------
    Finding
        What was found.
    """
    lacking = next(_lacking(where, node, _NUMBERS, "a number"), None)
    if lacking is not None:
        return lacking
    if node.value is None or not math.isfinite(node.value):
        return warning(
            where,
            f"there is no value: {node.status}",
            "Nothing that is read back for too long is a fault",
        )
    factor = offset_factor(settings.unit, settings.sign)
    reported_um = float(node.value) / factor + 0.0
    if written.value is not None:
        difference_um = reported_um - float(written.value) / factor
        if abs(difference_um) > tolerance_um:
            return warning(
                where,
                f"the machine reports {reported_um:.1f} µm, {difference_um:+.1f} µm from what was"
                " written last",
                "Without a heartbeat the machine may have taken the offset back; else check the"
                " node",
            )
    return ok(where, f"the machine reports {reported_um:.1f} µm")


def judge_heartbeat(where: str, node: "NodeDescription") -> Finding:
    """Judge the node of the heartbeat.

    Parameters
    ----------
    where : str
        Table and key.
    node : NodeDescription
        What the server says.

    Returns
    -------
    Finding
        What was found.
    """
    lacking = next(_lacking(where, node, _FLAGS | _NUMBERS, "a whole number or a Boolean"), None)
    if lacking is not None:
        return lacking
    if not node.writable:
        return error(
            where,
            "the server does not let this user write the heartbeat",
            "Give the user the right to write",
        )
    return ok(where, "it can be written")
