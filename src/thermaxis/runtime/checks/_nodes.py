"""What a server says of its nodes, judged by what the configuration expects: no connection here."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from thermaxis.compensation import CompensationModel, Limits, SensorRules
from thermaxis.runtime._findings import Finding, Level, error, ok, warning
from thermaxis.runtime._machine_values import WHOLE_RANGES, bits_of, converted, flag_of
from thermaxis.runtime._sign import OFFSET_UNITS, offset_factor
from thermaxis.runtime.config import (
    DiameterSettings,
    FlagSettings,
    InputSettings,
    OutputSettings,
    ProbeSettings,
)

if TYPE_CHECKING:
    from thermaxis.codes import Value
    from thermaxis.runtime.opcua import NodeDescription

SUSPECT_FACTOR: Final = 10.0
"""An offset so many times beyond its limit is taken for one in another unit: the units differ by
ten and more. [1]"""
LARGEST_DIAMETER_MM: Final = 30_000.0
"""Largest diameter of a workpiece that is believed: the largest vertical lathes turn about 25 m
[trade]. [mm]"""
_NUMBERS: Final = frozenset({"Double", "Float", *WHOLE_RANGES})
_FLAGS: Final = frozenset({"Boolean", *WHOLE_RANGES})
_WIDE: Final = _NUMBERS - {"SByte", "Byte", "Int16", "UInt16"}  # hold a token, up to 2^24
_TEMPERATURES: Final = ("degC", "K", "degF")
_SCALES: Final = (1.0, 0.1, 0.01, 0.001)


def _lacking(
    key: str,
    node: "NodeDescription",
    code: str = "node_no_number",
    types: frozenset[str] = _NUMBERS,
) -> Finding | None:
    """Return why a node cannot be what it should be, whatever its value is."""
    if not node.exists:
        return error("no_node", key, node=node.node, status=node.status)
    if node.data_type not in types:
        return error(code, key, node=node.node, type=node.data_type or "-")
    return None


def _number(key: str, node: "NodeDescription", without: str) -> float | Finding:
    """Return a node's number, or why it has none; a bad value may get better by itself."""
    lacking = _lacking(key, node)
    if lacking is not None:
        return lacking
    if node.value is None or not math.isfinite(node.value):
        return warning(without, key, status=_status_of(node))
    return float(node.value)


def _status_of(node: "NodeDescription") -> str:
    """Return why a node has no number."""
    return node.status if node.value is None else "NaN"


# ---- inputs -------------------------------------------------------------------------------------


def judge_input(
    key: str, node: "NodeDescription", settings: InputSettings, rules: SensorRules
) -> Iterator[Finding]:
    """Judge the node of a temperature.

    A value that is bad at the moment is a warning, for the compensation judges every value of
    every cycle; what cannot get better by itself is an error.
    """
    raw = _number(key, node, "input_no_value")
    if isinstance(raw, Finding):
        yield raw
        return
    value_c = _temperature_c(raw, settings)
    wrong = [] if settings.on_change else list(_judge_age(key, node, rules))
    # a sensor in kelvin tells no whole degrees: a whole number counts parts of one
    whole = node.data_type in WHOLE_RANGES
    wrong += _judge_temperature(key, raw, value_c, settings, rules, whole=whole)
    yield from wrong
    if not wrong:
        if node.age_s is None:
            yield ok("input", key, value_c=value_c)
        else:
            yield ok("input_age", key, value_c=value_c, age_s=node.age_s)


def _judge_age(key: str, node: "NodeDescription", rules: SensorRules) -> Iterator[Finding]:
    if node.age_s is None:
        if rules.time_stamp_required:
            yield error("no_time_stamp", key)
    elif node.age_s > rules.longest_age_s:
        yield warning("value_old", key, age_s=node.age_s, longest_age_s=rules.longest_age_s)


def _judge_temperature(
    key: str,
    raw: float,
    value_c: float,
    settings: InputSettings,
    rules: SensorRules,
    *,
    whole: bool,
) -> Iterator[Finding]:
    if rules.lowest_c <= value_c <= rules.highest_c:
        return
    values: dict[str, Value] = {
        "value_c": value_c,
        "lowest_c": rules.lowest_c,
        "highest_c": rules.highest_c,
    }
    fit = units_that_fit(raw, settings, rules)
    others = tuple(sorted(fit, key=lambda line: line.startswith("scale") is not whole))
    if others:
        yield error("input_other_unit", key, **values, raw=raw, others=others, first=others[0])
    elif raw == 0.0:
        yield warning("input_zero", key, **values)
    else:
        yield warning("input_implausible", key, **values)


def _temperature_c(value: float, settings: InputSettings) -> float:
    return converted(float(value) * settings.scale, settings.unit)


def units_that_fit(raw: float, settings: InputSettings, rules: SensorRules) -> tuple[str, ...]:
    """Return the units and scales in which a value would be a plausible temperature."""

    def plausible(unit: str, scale: float) -> bool:
        return rules.lowest_c <= converted(raw * scale, unit) <= rules.highest_c

    if plausible(settings.unit, settings.scale):
        return ()
    units = [
        f'unit = "{unit}"'
        for unit in _TEMPERATURES
        if unit != settings.unit and plausible(unit, settings.scale)
    ]
    scales = [
        f"scale = {scale:g}"
        for scale in _SCALES
        if scale != settings.scale and plausible(settings.unit, scale)
    ]
    return (*units, *scales)


def judge_redundant(
    key: str,
    first: "NodeDescription",
    second: "NodeDescription",
    settings: InputSettings,
    rules: SensorRules,
) -> Iterator[Finding]:
    """Judge whether two sensors of one channel agree."""
    if first.value is None or second.value is None:
        return  # said of the sensor itself
    difference_k = _temperature_c(second.value, settings) - _temperature_c(first.value, settings)
    if abs(difference_k) > rules.largest_difference_k:
        largest_k = rules.largest_difference_k
        yield warning("redundant_differs", key, difference_k=difference_k, largest_k=largest_k)


def judge_life(key: str, node: "NodeDescription") -> Finding:
    """Judge the node of a life counter; whether it moves, the loop says."""
    return _lacking(key, node, types=_NUMBERS | _FLAGS) or ok("life", key)


# ---- flags and diameter -------------------------------------------------------------------------


def judge_interlock(key: str, node: "NodeDescription", settings: FlagSettings) -> Finding:
    """Judge an interlock: one that is not met now is a warning."""
    flag = _flag_or_finding(key, node, settings, "interlock_no_value")
    if isinstance(flag, Finding):
        return flag
    return ok("interlock_met", key) if flag is settings.value else warning("interlock_open", key)


def _flag_or_finding(
    key: str, node: "NodeDescription", settings: FlagSettings, without: str
) -> bool | Finding:
    """Return a node's flag, or why it has none; `without` is the code for no value."""
    bit, types = settings.bit, _FLAGS
    if bit is not None:
        types = frozenset(kind for kind in WHOLE_RANGES if bit < bits_of(kind))
    lacking = _lacking(key, node, "node_no_flag" if bit is None else "node_no_bit", types)
    if lacking is not None:
        return lacking
    if node.value is None:
        return warning(without, key, status=node.status)
    flag = flag_of(node.value) if bit is None else bool(int(node.value) >> bit & 1)
    return error("flag_no_truth", key, value=node.value) if flag is None else flag


def judge_other_compensation(key: str, node: "NodeDescription", settings: FlagSettings) -> Finding:
    """Judge the flag of another compensation: while it is active, nothing may be enabled."""
    flag = _flag_or_finding(key, node, settings, "other_compensation_no_value")
    if isinstance(flag, Finding):
        return flag
    if flag is settings.value:
        return error("other_compensation_active", key)
    return ok("other_compensation_off", key)


def judge_diameter(
    key: str, node: "NodeDescription", settings: DiameterSettings, model: CompensationModel
) -> Finding:
    """Judge the node of the workpiece's diameter."""
    raw = _number(key, node, "diameter_no_value")
    if isinstance(raw, Finding):
        return raw
    diameter_mm = converted(raw * settings.scale, settings.unit)
    if not 0.0 <= diameter_mm <= LARGEST_DIAMETER_MM:
        return warning("diameter_implausible", key, diameter_mm=diameter_mm)
    points = [
        point.diameter_mm
        for output in model.outputs
        for part in output.parts
        for point in part.gain_by_diameter
    ]
    if points and not min(points) <= diameter_mm <= max(points):
        ends = {"least_mm": min(points), "most_mm": max(points)}
        return warning("diameter_outside", key, diameter_mm=diameter_mm, **ends)
    return ok("diameter", key, diameter_mm=diameter_mm)


# ---- probes -------------------------------------------------------------------------------------


def judge_probe(key: str, node: "NodeDescription", settings: ProbeSettings | None) -> Finding:
    """Judge the node of a probe, or of its counter: nothing wrong with it forbids a correction."""
    raw = _number(key, node, "probe_no_value")
    if isinstance(raw, Finding):
        lacking = raw.level is Level.ERROR
        return warning("probe_unusable", key, why=raw.message) if lacking else raw
    if settings is None:
        return ok("probe_counter", key, count=raw)
    value_um = raw * settings.factor
    if node.age_s is None:
        return ok("probe", key, value_um=value_um)
    return ok("probe_age", key, value_um=value_um, age_s=node.age_s)


# ---- outputs ------------------------------------------------------------------------------------


def judge_output(
    key: str, node: "NodeDescription", settings: OutputSettings, limits: Limits
) -> Iterator[Finding]:
    """Judge the node that a correction is written to."""
    lacking = _lacking(key, node)
    if lacking is not None:
        yield lacking
        return
    if not node.writable:
        yield error("output_not_writable", key)
    yield from _judge_counts(key, node, settings, limits)
    if node.value is None or not math.isfinite(node.value):
        yield error("output_unreadable", key, status=_status_of(node))
        return
    yield _judge_found(key, float(node.value), settings, limits)


def _judge_counts(
    key: str, node: "NodeDescription", settings: OutputSettings, limits: Limits
) -> Iterator[Finding]:
    """Judge a node with whole numbers: how coarse it is, and whether it is wide enough."""
    if node.data_type not in WHOLE_RANGES:
        return
    per_um = abs(offset_factor(settings.unit, settings.sign))
    lowest, highest = WHOLE_RANGES[node.data_type]
    largest = limits.total_um * per_um
    unit, total_um = settings.unit, limits.total_um
    if largest < 1.0:
        yield error("output_always_zero", key, unit=unit, total_um=total_um)
    elif largest > highest or -largest < lowest:
        yield error("output_too_narrow", key, unit=unit, total_um=total_um, type=node.data_type)
    elif per_um <= 1.0:
        yield warning("output_coarse", key, unit=unit, step_um=1.0 / per_um)


def _judge_found(key: str, raw: float, settings: OutputSettings, limits: Limits) -> Finding:
    found_um = raw / offset_factor(settings.unit, settings.sign)
    if abs(found_um) <= limits.total_um:
        return ok("output", key, found_um=found_um)
    others = tuple(
        unit
        for unit, per_um in OFFSET_UNITS.items()
        if unit != settings.unit and abs(raw) <= limits.total_um * per_um
    )
    if abs(found_um) > SUSPECT_FACTOR * limits.total_um and others:
        unit, total_um = settings.unit, limits.total_um
        values = {"raw": raw, "unit": unit, "found_um": found_um, "total_um": total_um}
        return error("output_other_unit", key, **values, others=others)
    return warning("output_beyond", key, found_um=found_um, total_um=limits.total_um)


def judge_read_back(
    key: str,
    node: "NodeDescription",
    written: "NodeDescription",
    settings: OutputSettings,
    tolerance_um: float,
) -> Finding:
    """Judge a node at which the machine reports an offset."""
    raw = _number(key, node, "read_back_no_value")
    if isinstance(raw, Finding):
        return raw
    factor = offset_factor(settings.unit, settings.sign)
    reported_um = raw / factor
    if written.value is not None:
        difference_um = reported_um - float(written.value) / factor
        if abs(difference_um) > tolerance_um:
            values = {"reported_um": reported_um, "difference_um": difference_um}
            return warning("read_back_differs", key, **values)
    return ok("read_back", key, reported_um=reported_um)


def judge_heartbeat(key: str, node: "NodeDescription", *, token: bool = False) -> Finding:
    """Judge the node of the heartbeat, or of the token, which needs a wider number."""
    code, types = ("node_no_token", _WIDE) if token else ("node_no_beat", _FLAGS | _NUMBERS)
    lacking = _lacking(key, node, code, types)
    if lacking is not None:
        return lacking
    if not node.writable:
        return error("heartbeat_not_writable", key)
    return ok("heartbeat", key)
