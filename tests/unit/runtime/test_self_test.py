"""The self-test: what is said of nodes, and that nothing moves while they are looked at."""

import asyncio
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, cast

import pytest
from hypothesis import given, strategies as st

from tests.unit.runtime.machine_files import machine_file, model
from thermaxis.codes import Message
from thermaxis.compensation import Limits, SensorRules
from thermaxis.runtime import (
    AWAY,
    OFFSET_UNITS,
    TOWARDS,
    DiameterSettings,
    Finding,
    FlagSettings,
    InputSettings,
    Level,
    MachineConfiguration,
    NodeDescription,
    OutputSettings,
    read_machine,
    reasons_against,
    self_test,
)
from thermaxis.runtime.checks._nodes import (
    judge_diameter,
    judge_heartbeat,
    judge_input,
    judge_interlock,
    judge_other_compensation,
    judge_output,
    judge_read_back,
    judge_redundant,
    units_that_fit,
)
from thermaxis.runtime.checks._self_test import judge_linuxcnc
from thermaxis.runtime.sinks import DrySink
from thermaxis.runtime.sources import NodeSettings

RULES = SensorRules(lowest_c=5.0, highest_c=90.0)
LIMITS = Limits(100.0, 0.5)
OUTPUT = OutputSettings(
    largest_um=100.0,
    largest_rate_um_per_s=0.5,
    node="ns=2;s=Z",
    read_back_node="ns=2;s=Z_accepted",
    unit="mm",
    sign=AWAY,
)


def node(value: float | bool | None = 20.0, **changes: object) -> NodeDescription:
    """Return a node that is as it should be, with changes."""
    good = NodeDescription(
        node="ns=2;s=X",
        exists=True,
        status="Good",
        data_type="Boolean" if isinstance(value, bool) else "Double",
        readable=True,
        writable=True,
        value=value,
        age_s=0.2,
    )
    return replace(good, **changes)


def code(finding: Finding) -> tuple[Level, str]:
    return finding.level, finding.message.code.removeprefix("self_test-")


def one(findings: Sequence[Finding]) -> Finding:
    (finding,) = findings
    return finding


# ---- inputs -------------------------------------------------------------------------------------


def sensor(unit: str, scale: float, redundant: str = "") -> InputSettings:
    return InputSettings(
        node="ns=2;s=X",
        unit=cast("Literal['degC']", unit),
        scale=scale,
        redundant_node=redundant,
        lowest_c=5.0,
        highest_c=90.0,
    )


def of_input(
    described: NodeDescription, unit: str = "degC", scale: float = 1.0, rules: SensorRules = RULES
) -> Finding:
    settings = sensor(unit, scale)
    return one(tuple(judge_input("input.T", described, settings, rules)))


def test_a_temperature_is_told_in_degrees_celsius() -> None:
    for raw, unit, scale in (
        *((20.0, "degC", 1.0), (293.15, "K", 1.0), (68.0, "degF", 1.0), (200.0, "degC", 0.1)),
    ):
        found = of_input(node(raw), unit, scale)
        assert code(found) == (Level.OK, "input_age"), unit
        assert found.message.values["value_c"] == pytest.approx(20.0)
        assert (found.message.values["age_s"], found.message.place.key) == (0.2, "input.T")


def test_a_unit_that_cannot_be_is_an_error_with_the_one_that_could() -> None:
    for raw, unit, scale, advice in (
        (295.0, "degC", 1.0, 'unit = "K"'),
        (22.0, "K", 1.0, 'unit = "degC"'),
        (120.0, "degC", 1.0, 'unit = "degF"'),
        (230.0, "degC", 1.0, "scale = 0.1"),
        (23.0, "degC", 0.1, "scale = 1"),
    ):
        found = of_input(node(raw), unit, scale)
        assert code(found) == (Level.ERROR, "input_other_unit"), advice
        assert found.message.values["first"] == advice


def test_what_is_wrong_with_an_input_is_said() -> None:
    for changes, level, said in (
        ({"exists": False, "status": "BadNodeIdUnknown"}, Level.ERROR, "no_node"),
        ({"data_type": "String"}, Level.ERROR, "node_no_number"),
        ({"data_type": "Boolean"}, Level.ERROR, "node_no_number"),
        ({"data_type": ""}, Level.ERROR, "node_no_number"),
        ({"value": None, "status": "BadSensorFailure"}, Level.WARNING, "input_no_value"),
        ({"value": math.nan}, Level.WARNING, "input_no_value"),
        ({"value": 150.0}, Level.ERROR, "input_other_unit"),
        ({"value": 1e9}, Level.WARNING, "input_implausible"),
        ({"age_s": 11.0}, Level.WARNING, "value_old"),
        ({"age_s": None}, Level.ERROR, "no_time_stamp"),
    ):
        assert code(of_input(node(**changes))) == (level, said)
    narrow = SensorRules(lowest_c=5.0, highest_c=20.0)  # perhaps not connected
    assert code(of_input(node(0.0), rules=narrow)) == (Level.WARNING, "input_zero")


def test_a_value_without_a_time_stamp_may_be_allowed() -> None:
    rules = replace(RULES, time_stamp_required=False)
    assert of_input(node(age_s=None), rules=rules).level is Level.OK


@given(
    raw=st.floats(-1e4, 1e4),
    unit=st.sampled_from(["degC", "K", "degF"]),
    scale=st.sampled_from([1.0, 0.1, 0.01]),
    lowest_c=st.floats(-50.0, 50.0),
    width_k=st.floats(1.0, 150.0),
)
def test_every_suggested_unit_makes_the_value_plausible_and_none_is_suggested_in_vain(
    raw: float, unit: str, scale: float, lowest_c: float, width_k: float
) -> None:
    rules = SensorRules(lowest_c=lowest_c, highest_c=lowest_c + width_k)
    settings = sensor(unit, scale)
    suggested = units_that_fit(raw, settings, rules)
    if of_input(node(raw), unit, scale, rules).level is Level.OK:
        assert suggested == ()
    for line in suggested:
        key, value = line.split(" = ")
        changed = (value.strip('"'), scale) if key == "unit" else (unit, float(value))
        assert of_input(node(raw), *changed, rules=rules).level is Level.OK


def test_two_sensors_of_one_place_must_agree() -> None:
    settings = sensor("degC", 0.1, "ns=2;s=Y")
    close = tuple(judge_redundant("input.T", node(200.0), node(229.0), settings, RULES))
    apart = one(tuple(judge_redundant("input.T", node(200.0), node(169.0), settings, RULES)))
    assert close == ()
    assert code(apart) == (Level.WARNING, "redundant_differs")
    assert apart.message.values["difference_k"] == pytest.approx(-3.1)
    assert tuple(judge_redundant("input.T", node(None), node(200.0), settings, RULES)) == ()


# ---- flags and diameter -------------------------------------------------------------------------


def test_an_interlock_is_met_or_waited_for_and_another_compensation_forbids_a_correction() -> None:
    for value in (True, False, 1, 0):
        kind = "Boolean" if isinstance(value, bool) else "Int16"
        for met in (True, False):
            flag = FlagSettings("ns=2;s=X", met)
            found = judge_interlock("", node(value, data_type=kind), flag)
            assert found.level is (Level.OK if bool(value) is met else Level.WARNING)
            other = judge_other_compensation("", node(value, data_type=kind), flag)
            assert other.level is (Level.ERROR if bool(value) is met else Level.OK)


@pytest.mark.parametrize("value", [2, -1])
def test_a_number_that_is_no_truth_value_is_refused_as_the_source_refuses_it(value: int) -> None:
    flag = FlagSettings("ns=2;s=X", value=True)
    for judge in (judge_interlock, judge_other_compensation):
        found = judge("", node(value, data_type="Int16"), flag)
        assert code(found) == (Level.ERROR, "flag_no_truth")
    assert NodeSettings(node="ns=2;s=X", unit="bool").value_of(value, 16) == (None, False)


@pytest.mark.parametrize("kind", ["Byte", "Int16", "UInt16", "UInt32", "Int64"])
def test_a_bit_of_a_status_word_is_a_flag_and_one_beyond_its_type_is_refused(kind: str) -> None:
    bits = {"Byte": 8, "Int16": 16, "UInt16": 16, "UInt32": 32, "Int64": 64}[kind]
    for word in (0, 0b1010, 127, -2 if kind.startswith("Int") else 254):
        for bit in (0, 1, 3, 7, bits - 1, bits):
            pattern = f"{word % 2**bits:0{bits}b}"[::-1]  # as the PLC's programmer counts
            settings = NodeSettings(node="ns=2;s=X", unit="bool", bit=bit)
            expected = (float(pattern[bit]), True) if bit < bits else (None, False)
            assert settings.value_of(word, bits) == expected
            found = judge_interlock(
                "", node(word, data_type=kind), FlagSettings("ns=2;s=X", value=True, bit=bit)
            )
            if bit == bits:
                assert code(found) == (Level.ERROR, "node_no_bit")
            else:
                assert found.level is (Level.OK if expected[0] else Level.WARNING)
    assert NodeSettings(node="ns=2;s=X", unit="bool", bit=0).value_of(True, 0) == (None, False)
    assert NodeSettings(node="ns=2;s=X", unit="bool", bit=0).value_of(1.0, 0) == (None, False)


def test_a_flag_without_a_value_is_a_warning_and_one_of_another_type_an_error() -> None:
    flag = FlagSettings("ns=2;s=X", value=True)
    for judge in (judge_interlock, judge_other_compensation):
        missing = node(None, data_type="Boolean", status="BadNoCommunication")
        assert judge("", missing, flag).level is Level.WARNING
        assert judge("", node(1.5), flag).level is Level.ERROR
        assert judge("", node(exists=False), flag).level is Level.ERROR


def test_a_diameter_must_be_one_of_a_workpiece() -> None:
    for raw, unit, level in (
        (1500.0, "mm", Level.OK),
        (59.0, "inch", Level.OK),
        (1500.0, "inch", Level.WARNING),
        (-1.0, "mm", Level.WARNING),
        (None, "mm", Level.WARNING),
        (math.nan, "mm", Level.WARNING),
    ):
        settings = DiameterSettings("ns=2;s=D", unit)
        assert judge_diameter("", node(raw), settings, model()).level is level, (raw, unit)


# ---- outputs ------------------------------------------------------------------------------------


def of_output(described: NodeDescription, **changes: object) -> tuple[Finding, ...]:
    settings = replace(OUTPUT, **changes)
    return tuple(judge_output("output.Z_um", described, settings, LIMITS))


@given(
    correction_um=st.floats(-100.0, 100.0),
    unit=st.sampled_from(list(OFFSET_UNITS)),
    sign=st.sampled_from([AWAY, TOWARDS]),
)
def test_an_offset_within_its_limit_is_told_with_the_sign_of_the_correction(
    correction_um: float, unit: str, sign: str
) -> None:
    in_unit = {"um": 1.0, "0.1 um": 0.1, "mm": 1000.0, "m": 1e6, "inch": 25_400.0}[unit]
    raw = (correction_um if sign == AWAY else -correction_um) / in_unit
    found = one(of_output(node(raw * (1 - 1e-9)), unit=unit, sign=sign))
    assert found.level is Level.OK
    assert found.message.values["found_um"] == pytest.approx(correction_um, abs=1e-6)


def test_an_offset_of_another_unit_is_told_from_one_that_is_too_large() -> None:
    for raw, unit, level, said in (
        (30.0, "mm", Level.ERROR, "output_other_unit"),
        (0.15, "mm", Level.WARNING, "output_beyond"),
        (5000.0, "0.1 um", Level.WARNING, "output_beyond"),
    ):
        assert code(one(of_output(node(raw), unit=unit))) == (level, said)


def test_what_forbids_to_write_an_offset_is_an_error() -> None:
    for changes, said in (
        ({"exists": False}, "no_node"),
        ({"data_type": "String"}, "node_no_number"),
        ({"writable": False}, "output_not_writable"),
        ({"value": None, "status": "BadNotReadable"}, "output_unreadable"),
        ({"value": math.nan}, "output_unreadable"),
    ):
        found = of_output(node(**{"value": 0.0, **changes}))
        assert (Level.ERROR, said) in [code(one) for one in found]


def test_a_node_with_whole_numbers_must_be_fine_and_wide_enough() -> None:
    for kind, unit, level, said in (
        ("Int16", "0.1 um", Level.OK, "output"),
        ("Int16", "um", Level.WARNING, "output_coarse"),
        ("Int16", "mm", Level.ERROR, "output_always_zero"),
        ("SByte", "0.1 um", Level.ERROR, "output_too_narrow"),
        ("UInt16", "um", Level.ERROR, "output_too_narrow"),
    ):
        first, *_ = of_output(node(0, data_type=kind), unit=unit)
        assert code(first) == (level, said), kind


def test_whole_units_that_are_coarse_are_a_warning() -> None:
    settings = replace(OUTPUT, unit="mm")
    wide = Limits(5000.0, 0.5)
    first, *_ = judge_output("", node(0, data_type="Int16"), settings, wide)
    assert code(first) == (Level.WARNING, "output_coarse")
    assert first.message.values["step_um"] == pytest.approx(1000.0)


def test_what_is_read_back_is_compared_with_what_was_written() -> None:
    same = judge_read_back("", node(0.0102), node(0.01), OUTPUT, 0.5)
    other = judge_read_back("", node(0.0), node(0.01), OUTPUT, 0.5)
    nothing = judge_read_back("", node(None), node(0.01), OUTPUT, 0.5)
    assert [f.level for f in (same, other, nothing)] == [Level.OK, Level.WARNING, Level.WARNING]
    assert other.message.values["difference_um"] == pytest.approx(-10.0)
    assert judge_read_back("", node(exists=False), node(0.0), OUTPUT, 0.5).level is Level.ERROR


def test_a_heartbeat_must_be_writable() -> None:
    for kind in ("Boolean", "UInt32", "Double"):
        assert judge_heartbeat("", node(0, data_type=kind)).level is Level.OK
    assert judge_heartbeat("", node(0, writable=False)).level is Level.ERROR
    assert judge_heartbeat("", node(0, data_type="String")).level is Level.ERROR


def test_a_token_must_have_place_in_its_node() -> None:
    for kind in ("Int32", "UInt32", "Float", "Double"):
        assert judge_heartbeat("", node(0, data_type=kind), token=True).level is Level.OK
    for kind in ("Boolean", "Byte", "Int16", "UInt16"):
        assert judge_heartbeat("", node(0, data_type=kind), token=True).level is Level.ERROR


# ---- the whole test -----------------------------------------------------------------------------


class Server:
    """A connection to a machine in memory, which remembers what was written."""

    def __init__(self, nodes: dict[str, NodeDescription]) -> None:
        self.nodes = nodes
        self.connected = True
        self.failure: Message | None = None
        self.clock_difference_s: float | None = 0.1
        self.written: list[tuple[str, float]] = []
        self.answers: Callable[[str], str] = lambda _: "Good"
        self.silent_after = 10**9

    async def describe(self, name: str, deadline_s: float) -> NodeDescription | None:
        self.silent_after -= 1
        return None if self.silent_after < 0 else self.nodes[name]

    async def write(
        self, values: Sequence[tuple[str, float]], deadline_s: float
    ) -> list[str] | None:
        self.written.extend(values)
        return [self.answers(name) for name, _ in values]


@pytest.fixture
def configuration(tmp_path: Path) -> MachineConfiguration:
    (tmp_path / "history").mkdir()
    return read_machine(machine_file(tmp_path))


@pytest.fixture
def server() -> Server:
    values: dict[str, float | bool] = {
        "T_spindle": 25.0,
        "T_spindle_2": 25.5,
        "T_column": 294.0,
        "Z_referenced": True,
        "EmergencyStop": False,
        "OwnCompensation": False,
        "Diameter": 1500.0,
        "Heartbeat": 7.0,
        "Z_offset": 0.0123456789,
        "Z_accepted": 0.0123,
    }
    return Server({f"ns=2;s={name}": node(value) for name, value in values.items()})


def look_at(
    server: Server, configuration: MachineConfiguration, *, write: bool = False
) -> tuple[Finding, ...]:
    sink = DrySink(("Z_um",))
    return asyncio.run(self_test(configuration, {"control": server}, sink, write=write))


def test_a_machine_that_is_as_configured_has_nothing_but_good_findings(
    configuration: MachineConfiguration, server: Server
) -> None:
    found = look_at(server, configuration)
    assert {finding.level for finding in found} == {Level.OK}
    told = {finding.message.place.key for finding in found}
    for table in (
        "connection.control",
        "input.T_spindle_C",
        "input.T_spindle_C.redundant_node",
        "input.T_column_C",
        "interlock.referenced",
        "interlock.emergency_stop",
        "other_compensation",
        "diameter",
        "sink.heartbeat_node",
        "output.Z_um",
        "output.Z_um.read_back_node",
    ):
        assert table in told
    assert reasons_against(found) == ()
    assert server.written == []


def test_exactly_the_offset_that_stands_there_is_written_back_and_nothing_else(
    configuration: MachineConfiguration, server: Server
) -> None:
    found = look_at(server, configuration, write=True)
    assert server.written == [("ns=2;s=Z_offset", 0.0123456789)]
    assert code(found[-1]) == (Level.OK, "offset_written_back")


def test_an_offset_that_is_in_doubt_is_not_written_back(
    configuration: MachineConfiguration, server: Server
) -> None:
    for changes in ({"value": math.nan}, {"value": None}, {"writable": False}, {"value": 30.0}):
        server.nodes["ns=2;s=Z_offset"] = node(**{"value": 0.0, **changes})
        assert reasons_against(look_at(server, configuration, write=True)), changes
        assert server.written == []


def test_a_write_that_is_refused_is_an_error_with_its_reason(
    configuration: MachineConfiguration, server: Server
) -> None:
    status = "BadUserAccessDenied"
    server.answers = lambda _: status
    (reason,) = reasons_against(look_at(server, configuration, write=True))
    assert (reason.code, reason.values["status"]) == ("self_test-offset_not_written_back", status)


def test_a_machine_that_is_not_there_is_one_error_with_the_connections_own_words(
    configuration: MachineConfiguration, server: Server
) -> None:
    server.connected = False
    server.failure = Message("error-user_refused", {"user": "machine"})
    found = one(look_at(server, configuration, write=True))
    assert code(found) == (Level.ERROR, "not_connected")
    assert found.message.values["why"] is server.failure


def test_a_server_that_falls_silent_ends_the_test_with_an_error(
    configuration: MachineConfiguration, server: Server
) -> None:
    for answers in range(11):
        server.silent_after = answers
        found = look_at(server, configuration, write=True)
        codes = [reason.code for reason in reasons_against(found)]
        assert "self_test-no_more_answers" in codes, answers
        assert server.written == []


def test_a_clock_that_goes_wrong_or_is_not_told_is_a_warning(
    configuration: MachineConfiguration, server: Server
) -> None:
    for difference_s, level, said in (
        (0.1, Level.OK, "connected"),
        (-1.9, Level.OK, "connected"),
        (-2.1, Level.WARNING, "clock_behind"),
        (3600.0, Level.WARNING, "clock_ahead"),
        (None, Level.WARNING, "server_without_time"),
    ):
        server.clock_difference_s = difference_s
        found = look_at(server, configuration)[0]
        assert code(found) == (level, said)
        if level is Level.WARNING and difference_s is not None:
            assert found.message.values["difference_s"] == abs(difference_s)


def test_linuxcnc_that_does_not_run_is_an_error_with_its_reason() -> None:
    sink = DrySink(("Z_um",))
    assert judge_linuxcnc(sink).level is Level.OK

    class Missing:
        connected = False
        failure = Message("error-linuxcnc_not_running")

    found = judge_linuxcnc(Missing())
    assert code(found) == (Level.ERROR, "linuxcnc_unusable")
    assert found.message.values["why"] is Missing.failure
