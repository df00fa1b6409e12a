"""Touches in the loop: each number is taken once, at its time, and the laws hold with them."""

import json
from asyncio import Event, TaskGroup, gather, sleep
from collections.abc import Mapping
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from tests.proofs import quick_first
from tests.unit.runtime.machine_files import machine_file
from tests.unit.runtime.simulated import (
    FLAGS,
    GOAL_UM,
    Memory,
    Rig,
    SimulatedHistorian,
    SimulatedMachine,
    SimulatedSource,
    alarms_of,
    ask,
    enabled_for,
)
from thermaxis.cli.machine._machine_parts import (
    build_parts,
    loop_settings,
    nodes_read,
    probes_read,
)
from thermaxis.compensation import Limits, Request, RequestKind, TouchRules
from thermaxis.runtime import (
    DATUM,
    CompensationLoop,
    MachineConfiguration,
    RuntimeStatus,
    SourceSample,
    StateFile,
    SystemClock,
    VirtualClock,
    counter_name,
    examine_machine,
    probe_name,
    read_machine,
)
from thermaxis.runtime.history import Columns
from thermaxis.runtime.status import OutputTouches, as_json

VIRTUAL_TIME = True
PROBE, COUNTER = probe_name("Z_um"), counter_name("Z_um")
LACKS_UM = 4.0
"""What the model lacks of the displacement. [µm]"""
RULES = TouchRules(limits=Limits(8.0, 0.1), acts=True)
WRONG_SIGN = replace(RULES, limits=Limits(20.0, 0.4), start_um=20.0, noise_um=0.2)
"""Rules by which a wrong sign is found after few touches."""


class Probing(SimulatedMachine):
    """A machine whose probing cycle leaves value and counter."""

    def __init__(self) -> None:
        super().__init__({"s": 23.0, "c": 20.0, **FLAGS, PROBE: 0.0, COUNTER: 7.0})
        self.sees = 1.0
        self.age_s: float | None = 0.0

    def touch(self, wrong_um: float = 0.0) -> None:
        self.touched_um = -GOAL_UM + LACKS_UM + self.sees * self.z_um + wrong_um
        self.values[PROBE] = self.touched_um
        self.values[COUNTER] += 1.0


class Stamped(SimulatedSource):
    """Tells how long ago the counter rose."""

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        found = await super().read(deadline_s)
        return {**found, COUNTER: found[COUNTER]._replace(age_s=self.machine.age_s)}


class Bench(Rig):
    """A rig with a probing cycle."""

    def __init__(self, rules: TouchRules = RULES, **more: Any) -> None:
        super().__init__(machine=Probing(), touches=rules, **more)

    @property
    def outcomes(self) -> list[str]:
        return [str(e.values["outcome"]) for e in self.said("touch")]

    async def touched(self, wait_s: float = 5.0, wrong_um: float = 0.0) -> None:
        self.machine.touch(wrong_um)
        await sleep(wait_s)


def touches_of(loop: CompensationLoop) -> OutputTouches:
    assert loop.status is not None
    return loop.status.touches["Z_um"]


# ---- taken once ----------------------------------------------------------------------------------


async def test_a_touch_brings_the_correction_to_what_the_model_lacks() -> None:
    bench = Bench()
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        assert bench.machine.z_um == GOAL_UM
        for _ in range(5):
            await bench.touched(100.0)
        assert bench.outcomes == ["believed"] * 5
        assert bench.machine.z_um == pytest.approx(GOAL_UM - LACKS_UM, abs=0.1)
        told = touches_of(loop)
        assert told.offset_um == pytest.approx(-LACKS_UM, abs=0.1)
        assert told.known_um == pytest.approx(LACKS_UM, abs=0.1)
        assert told.std_um is not None
        assert told.std_um < 1.0
    bench.assert_law(late_cycles=1.0)


async def test_each_number_is_taken_once_and_neither_the_first_nor_one_that_falls() -> None:
    bench = Bench()
    async with bench.running() as loop:
        await enabled_for(loop, 100.0)
        assert bench.outcomes == []  # the number that stood there was no touch
        await bench.touched(60.0)
        bench.machine.lose()
        await sleep(10.0)
        bench.machine.come_back()
        await sleep(60.0)
        assert bench.outcomes == ["believed"]
        bench.machine.values |= {PROBE: 0.0, COUNTER: 0.0}  # a control that was started anew
        await sleep(10.0)
        assert bench.outcomes == ["believed"]
        bench.machine.values[COUNTER] = 8.0  # a server that told nothing while it started
        bench.machine.values[PROBE] = bench.machine.touched_um
        await sleep(10.0)
        assert bench.outcomes == ["believed"]
        bench.machine.values[COUNTER] = 0.0
        await sleep(10.0)
        for _ in range(8):  # up to numbers that it has had before
            await bench.touched()
        assert bench.outcomes == ["believed"] * 9
    before = len(bench.outcomes)
    async with bench.running():
        await sleep(30.0)
    assert len(bench.outcomes) == before


@pytest.mark.parametrize("count", [None, float("nan"), float("inf"), 8.5, -3.0])
async def test_what_is_no_number_of_a_touch_is_none(count: float | None) -> None:
    bench = Bench()
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        bench.machine.values[COUNTER] = count
        await sleep(5.0)
        assert bench.outcomes == []


async def test_a_counter_that_a_server_tells_before_its_value_waits_for_the_next_look() -> None:
    bench = Bench()
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        value_um, bench.machine.values[PROBE] = -GOAL_UM + LACKS_UM + GOAL_UM, -30.0
        bench.machine.values[COUNTER] += 1.0
        await sleep(1.0)
        bench.machine.values[PROBE] = value_um
        await sleep(5.0)
        assert touches_of(loop).value_um == LACKS_UM


# ---- at its time ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("age_s", "outcome"), [(20.0, "believed"), (500.0, "untimely")])
async def test_a_touch_refers_to_the_correction_in_force_when_its_counter_rose(
    age_s: float, outcome: str
) -> None:
    bench = Bench()
    machine = bench.machine
    async with bench.running(Stamped(machine)) as loop:
        await enabled_for(loop, 30.0)
        seen_um = machine.z_um
        await sleep(age_s)  # meanwhile it moves on by some micrometres
        machine.age_s, machine.values[PROBE] = age_s, -GOAL_UM + LACKS_UM + seen_um
        machine.values[COUNTER] += 1.0
        await sleep(2.0)
        assert bench.outcomes == [outcome]
        if outcome == "believed":
            assert machine.z_um - seen_um < -3.0
            assert touches_of(loop).known_um == pytest.approx(LACKS_UM * 25.0 / 26.0, abs=0.6)


async def test_a_touch_of_unknown_age_refers_to_the_last_look_that_did_not_know_it() -> None:
    bench = Bench()
    machine = bench.machine
    machine.age_s = None
    async with bench.running(Stamped(machine)) as loop:
        await enabled_for(loop, 30.0)
        seen_um, count = machine.z_um, machine.values[COUNTER]
        machine.values[COUNTER] = None  # the probes are lost while the correction moves on
        await sleep(20.0)
        machine.values |= {COUNTER: count + 1.0, PROBE: -GOAL_UM + LACKS_UM + seen_um}
        await sleep(2.0)
        assert bench.outcomes == ["believed"]
        assert machine.z_um - seen_um < -3.0
        assert touches_of(loop).known_um == pytest.approx(LACKS_UM * 25.0 / 26.0, abs=0.6)


async def test_a_counter_that_rises_on_the_way_back_refers_to_what_was_in_force_before() -> None:
    bench = Bench()
    machine = bench.machine
    async with bench.running(touch_delay_s={"Z_um": 20.0}) as loop:
        await enabled_for(loop, 30.0)
        machine.values[PROBE] = -GOAL_UM + LACKS_UM + machine.z_um
        await sleep(20.0)
        machine.values[COUNTER] += 1.0
        await sleep(3.0)
        assert touches_of(loop).known_um == pytest.approx(LACKS_UM * 25.0 / 26.0, abs=0.6)


async def test_what_was_in_force_minutes_ago_is_known_where_that_is_asked_for() -> None:
    bench = Bench(replace(RULES, oldest_s=640.0))
    machine = bench.machine
    async with bench.running(Stamped(machine)) as loop:
        await enabled_for(loop, 34.0)  # on its way, at a time between two that are remembered
        seen_um = machine.z_um
        await sleep(300.0)
        machine.age_s, machine.values[PROBE] = 300.0, -GOAL_UM + LACKS_UM + seen_um
        machine.values[COUNTER] += 1.0
        await sleep(2.0)
        assert bench.outcomes == ["believed"]
        assert machine.z_um - seen_um < -3.0
        assert touches_of(loop).known_um == pytest.approx(LACKS_UM, abs=1.0)


# ---- typed, and asked for ------------------------------------------------------------------------


async def test_a_touch_that_somebody_types_counts_and_its_answer_says_what_became_of_it() -> None:
    bench = Bench()
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)

        async def type_in(output: str = "Z_um", um: float | None = LACKS_UM, age_s: float = 5.0):
            touch = Request(RequestKind.TOUCH, "Jana", output, um, age_s)
            said = await loop.submit(touch)
            return said.accepted, str(said.code), said.values.get("outcome")

        assert await type_in() == (True, "touched", "believed")
        taken = touches_of(loop).touched
        assert taken is not None
        assert timedelta(seconds=4.9) < loop.clock.utc() - taken < timedelta(seconds=7.0)
        assert await type_in(um=60.0) == (False, "touched", "excluded")
        assert await type_in("X_um") == (False, "touched", "unknown_output")
        assert await type_in(age_s=1e6) == (False, "touched", "untimely")
        assert await type_in(age_s=-60.0) == (False, "touched", "untimely")
        assert await type_in(um=None) == (False, "not_supported", None)
        assert touches_of(loop).known_um == pytest.approx(LACKS_UM * 25.0 / 26.0, abs=0.1)
    async with Rig().running() as loop:
        assert not await ask(loop, RequestKind.TOUCH, output="Z_um", value=1.0)
    asked = [event for event in bench.said("request") if event.details["kind"] == "touch"]
    assert {event.who for event in asked} == {"Jana"}


@pytest.mark.parametrize("apart_s", [0.0, 2.0])
async def test_a_touch_that_is_typed_twice_counts_once(apart_s: float) -> None:
    bench = Bench(replace(RULES, limits=Limits(20.0, 0.1)))
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)

        async def type_in(after_s: float, um: float = LACKS_UM) -> str:
            await sleep(after_s)
            said = await loop.submit(Request(RequestKind.TOUCH, "Jana", "Z_um", um))
            return str(said.values["outcome"])

        said = await gather(type_in(0.5), type_in(0.5 + apart_s))
        assert said == ["believed", "repeated"]
        assert touches_of(loop).outcome == "believed"
        assert touches_of(loop).known_um == pytest.approx(LACKS_UM * 25.0 / 26.0, abs=0.1)
        assert await type_in(0.0, um=20.0) == "excluded"
        assert await type_in(apart_s, um=20.0) == "repeated", "no second touch that agrees"
        assert await type_in(10.0, um=20.0) == "confirmed"
    columns = Columns()
    columns.outputs = ("Z_um",)
    rows = [columns.row_of(record).values() for record in bench.historian.records]
    told = [(row["Z_touch"], row["probe_Z_um"]) for row in rows if row["probe_Z_um"]]
    assert told == [("believed", LACKS_UM), ("excluded", 20.0), ("confirmed", 20.0)]


async def test_it_is_time_to_touch_when_the_uncertainty_passes_what_is_wanted() -> None:
    bench = Bench()
    async with bench.running(wanted_std_um={"Z_um": 1.5}) as loop:
        await enabled_for(loop, 100.0)
        assert touches_of(loop).now  # nothing was touched
        await bench.touched(30.0)
        assert not touches_of(loop).now
        # 0.98^2 + 4 um^2/h t = 1.5^2 after 19 minutes
        await sleep(17.0 * 60.0)
        assert not touches_of(loop).now
        await sleep(4.0 * 60.0)
        assert touches_of(loop).now


async def test_a_touch_that_does_not_fit_and_two_that_agree_ask_for_another_one() -> None:
    bench = Bench(replace(RULES, limits=Limits(20.0, 0.4)))
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        await bench.touched(30.0)
        assert not touches_of(loop).now
        await bench.touched(wrong_um=20.0)
        assert touches_of(loop).now
        await bench.touched(wrong_um=20.0)
        assert bench.outcomes[-1] == "confirmed"
        assert not touches_of(loop).now  # on its way
        await sleep(100.0)
        assert touches_of(loop).now


async def test_after_three_touches_that_do_not_fit_no_more_are_asked_for() -> None:
    bench = Bench()
    async with bench.running(wanted_std_um={"Z_um": 1.5}) as loop:
        await enabled_for(loop, 200.0)
        for k in range(1, 5):
            await bench.touched(30.0, wrong_um=100.0 * k)
            assert touches_of(loop).now is (k < 3)
        assert "touch_excluded" in alarms_of(loop), "which says why"
        await bench.touched(30.0)
        assert bench.outcomes == [*["excluded"] * 4, "believed"]
        assert not touches_of(loop).now
        assert "touch_excluded" not in alarms_of(loop)
        await sleep(21.0 * 60.0)
        assert touches_of(loop).now, "one that fits would tell something again"


async def test_another_unit_takes_the_offset_away_and_the_alarm_says_why() -> None:
    bench = Bench()
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        for k in range(10):
            await bench.touched(30.0, wrong_um=1000.0 + 100.0 * k)
        assert bench.outcomes == [*["excluded"] * 9, "too_many_excluded"]
        assert not touches_of(loop).now
        assert loop.status is not None
        (alarm,) = (one for one in loop.status.alarms if one.code == "touch_void")
        assert "ten more touches" in alarm.sentences.text
        assert bench.machine.z_um == GOAL_UM


async def test_what_touches_show_beyond_the_limit_of_the_offset_is_told() -> None:
    bench = Bench(replace(RULES, limits=Limits(3.0, 0.1)))
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        await bench.touched(60.0)
        assert touches_of(loop).offset_um == -3.0
        assert loop.status is not None
        (told,) = [alarm for alarm in loop.status.alarms if alarm.code == "touch_limit"]
        assert told.values["known_um"] == touches_of(loop).known_um
        assert "at most 3.0 µm" in told.sentences.text
        assert await ask(loop, RequestKind.DATUM)
        await sleep(5.0)
        assert "touch_limit" not in alarms_of(loop)


async def test_another_model_and_back_move_the_correction_no_faster_than_its_rate() -> None:
    bench = Bench()
    bench.file = Memory()
    bench.file.every_s = 3600.0
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        await bench.touched(60.0)
        with_offset_um = bench.machine.z_um
        assert with_offset_um == pytest.approx(GOAL_UM - LACKS_UM, abs=0.5)
        assert await ask(loop, RequestKind.MODEL, text="other.json")
        await sleep(2.0)  # it settles, and the correction stays
        assert bench.machine.z_um == with_offset_um
        assert bench.file.saved is not None
        assert bench.file.saved.model_sha256 == "11", "at once: by it the way back is found"
        await sleep(200.0)
        assert touches_of(loop).known_um is None
        assert bench.machine.z_um == pytest.approx(-27.0)
        assert await ask(loop, RequestKind.MODEL, text="copy.json")
        await sleep(200.0)
        assert bench.machine.z_um == pytest.approx(GOAL_UM)
    bench.assert_law(late_cycles=1.0)


@pytest.mark.proof
async def test_an_acknowledge_ends_no_alarm_of_touches_that_nobody_has_seen() -> None:
    bench = Bench(WRONG_SIGN, cycle_s=0.1)  # alarms are looked for once a second
    bench.machine.sees = -1.0
    async with bench.running() as loop:
        await enabled_for(loop, 200.3)
        for _ in range(12):
            bench.machine.touch()
            for _ in range(300):
                await sleep(0.1)
                if bench.outcomes[-1:] == ["too_far"]:
                    break
            else:
                continue
            break
        assert touches_of(loop).void
        assert "touch_void" not in alarms_of(loop)
        assert not await ask(loop, RequestKind.ACKNOWLEDGE)
        await sleep(2.0)
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        assert not touches_of(loop).void


# ---- laws, and what ends it ----------------------------------------------------------------------


async def test_without_acts_it_is_shown_and_changes_no_bit_of_what_is_written() -> None:
    silent, shown = Rig(), Bench(replace(RULES, acts=False))
    for bench in (silent, shown):
        async with bench.running() as loop:
            await enabled_for(loop, 100.0)
            if bench is shown:
                await shown.touched(50.0)
                assert touches_of(loop).known_um == pytest.approx(LACKS_UM, abs=0.5)
                assert touches_of(loop).offset_um == 0.0
            else:
                await sleep(50.0)
    assert repr(silent.machine.written) == repr(shown.machine.written)


async def test_a_chip_moves_nothing_and_raises_an_alarm_until_a_touch_agrees() -> None:
    bench = Bench()
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        await bench.touched(60.0)
        stood_um = bench.machine.z_um
        await bench.touched(20.0, wrong_um=50.0)
        assert bench.machine.z_um == stood_um
        assert "touch_excluded" in alarms_of(loop)
        await bench.touched(20.0)
        assert "touch_excluded" not in alarms_of(loop)
        assert bench.outcomes == ["believed", "excluded", "believed"]


async def test_a_wrong_sign_takes_the_offset_away_until_somebody_acknowledges() -> None:
    bench = Bench(WRONG_SIGN)
    bench.machine.sees = -1.0
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        for _ in range(12):
            await bench.touched(30.0)
            if touches_of(loop).void:
                break
        assert "touch_void" in alarms_of(loop)
        await sleep(100.0)
        assert bench.machine.z_um == pytest.approx(GOAL_UM)
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        await sleep(3.0)
        assert "touch_void" not in alarms_of(loop)
    bench.assert_law(late_cycles=1.0)


@pytest.mark.parametrize("set_back_s", quick_first(1, [0.0, 3600.0]))
async def test_no_restart_takes_an_acknowledge_away(tmp_path: Path, set_back_s: float) -> None:
    bench = Bench(WRONG_SIGN)
    bench.machine.sees = -1.0
    bench.file = StateFile(tmp_path / "state.json")
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        for _ in range(12):
            await bench.touched(30.0)
            if touches_of(loop).void:
                break
        assert touches_of(loop).void
    bench.machine.come_back()
    bench.clock = VirtualClock(bench.clock.utc() - timedelta(seconds=set_back_s))
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        assert "touch_void" in alarms_of(loop)
        await bench.touched(30.0)
        assert bench.outcomes[-1] == touches_of(loop).void == "too_far"
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        assert not touches_of(loop).void


@pytest.mark.parametrize("by", ["node", "request"])
async def test_a_datum_that_is_set_anew_makes_the_offset_leave_at_its_rate(by: str) -> None:
    bench = Bench()
    bench.machine.values[DATUM] = 3.0
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        await bench.touched(60.0)
        assert bench.machine.z_um == pytest.approx(GOAL_UM - LACKS_UM, abs=0.5)
        if by == "node":
            bench.machine.values[DATUM] = 4.0
        else:
            assert await ask(loop, RequestKind.DATUM)
        await sleep(10.0)
        assert touches_of(loop).known_um is None
        await sleep(60.0)
        assert bench.machine.z_um == pytest.approx(GOAL_UM)
    bench.assert_law(late_cycles=1.0)
    assert [e.details["kind"] for e in bench.said("request")].count("datum") == 1
    told = [record.touched["Z_um"] for record in bench.historian.records if record.touched]
    assert told == ["believed", DATUM]


async def test_where_nothing_is_touched_nobody_can_say_that_a_datum_was_set() -> None:
    async with Rig().running() as loop:
        assert not await ask(loop, RequestKind.DATUM)


async def test_a_restart_forgets_what_touches_have_taught(tmp_path: Path) -> None:
    bench = Bench()
    bench.file = StateFile(tmp_path / "state.json")
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        await bench.touched(60.0)
    bench.machine.come_back()
    async with bench.running() as loop:
        await sleep(30.0)
        assert touches_of(loop) == OutputTouches(0.0, None, RULES.start_um, acts=True)


async def test_a_probe_without_a_counter_is_shown_all_the_time() -> None:
    bench = Bench()
    del bench.machine.values[COUNTER]
    async with bench.running() as loop:
        await enabled_for(loop, 10.0)
        assert loop.status is not None
        assert loop.status.samples[PROBE].value == 0.0


# ---- told and recorded ---------------------------------------------------------------------------


async def test_status_and_history_hold_the_offset_apart_from_trim_and_model() -> None:
    bench = Bench()
    statuses: list[RuntimeStatus] = []
    async with bench.running() as loop:
        loop.listeners.append(statuses.append)
        await enabled_for(loop, 200.0)
        await bench.touched(60.0)
        told = json.loads(as_json(statuses[-1]))["outputs"]["Z_um"]
        assert told["offset_um"] == pytest.approx(-LACKS_UM * 25.0 / 26.0, abs=0.1)
        assert told["touch_outcome"] == "believed"
        shares = (*told["sources_um"].values(), told["trim_um"], told["offset_um"])
        assert told["correction_um"] == pytest.approx(sum(shares), abs=0.01)
        assert told["rest_um"] == pytest.approx(0.0, abs=0.01)
    columns = Columns()
    columns.outputs = ("Z_um",)
    rows = [columns.row_of(record).values() for record in bench.historian.records]
    (touched,) = [row for row in rows if row["Z_touch"]]
    assert (touched["Z_touch"], touched["probe_Z_um"]) == ("believed", LACKS_UM)
    assert [row["probe_Z_um"] for row in rows if row is not touched] == [None] * (len(rows) - 1)
    assert min(row["Z_offset_um"] for row in rows) == pytest.approx(-LACKS_UM, abs=0.2)
    assert rows[-1]["Z_offset_std_um"] == pytest.approx(1.0, abs=0.1)
    assert {row["Z_trim_um"] for row in rows} == {0.0}


# ---- configured ----------------------------------------------------------------------------------

TABLE = """\
[probe.Z_um]
node = "ns=2;s=Touch"
unit = "mm"
counter_node = "ns=2;s=Touches"
largest_um = 10.0
largest_rate_um_per_s = 0.05
"""


def configured(folder: Path, table: str = TABLE, *changes: tuple[str, str]) -> Path:
    (folder / "history").mkdir(exist_ok=True)
    path = machine_file(folder, *changes)
    path.write_text(f"{path.read_text('utf-8')}\n{table}", encoding="utf-8")
    return path


def test_a_table_makes_the_rules_and_reads_the_counter_before_its_value(tmp_path: Path) -> None:
    source = 'connection = "control"\ndatum_node = "ns=2;s=Datum"\n\n[sink]'
    table = f"{TABLE}delay_s = 8.0\nwanted_std_um = 0.99\n"
    path = configured(tmp_path, table, ('connection = "control"\n\n[sink]', source))
    found = read_machine(path)
    assert found.compensation.touches == {"Z_um": TouchRules(limits=Limits(10.0, 0.05))}
    asked = loop_settings(found)
    assert (asked.touch_delay_s, asked.wanted_std_um) == ({"Z_um": 8.0}, {"Z_um": 0.99})
    assert [(name, one.node) for name, one in probes_read(found).items()] == [
        (COUNTER, "ns=2;s=Touches"),
        (PROBE, "ns=2;s=Touch"),
    ]
    assert nodes_read(found)[DATUM].node == "ns=2;s=Datum"


def test_what_cannot_be_touched_is_said(tmp_path: Path) -> None:
    rate, largest = "largest_rate_um_per_s = 0.05\n", "largest_um = 10.0\n"
    for table, key, code in (
        (TABLE.replace(rate, ""), "probe.Z_um", "key_needed_here"),
        (TABLE.replace(largest, ""), "probe.Z_um", "key_needed_here"),
        (TABLE.replace('node = "ns=2;s=Touch"\n', "", 1), "probe.Z_um", "key_needed_here"),
        (TABLE.replace('unit = "mm"\n', ""), "probe.Z_um", "key_needed_here"),
        (TABLE.replace("10.0", "101.0"), "probe.Z_um.largest_um", "outside_range"),
        (TABLE.replace("10.0", "0.0"), "probe.Z_um.largest_um", "not_above_bound"),
        (f"{TABLE}noise_um = 0.0\n", "probe.Z_um.noise_um", "outside_range"),
        (f"{TABLE}wanted_std_um = 0.98\n", "probe.Z_um.wanted_std_um", "outside_range"),
        (f"{TABLE}delay_s = 100.0\n", "probe.Z_um.delay_s", "outside_range"),
        (TABLE.replace("s=Touches", "s=Touch"), "probe.Z_um.counter_node", "node_twice"),
    ):
        found = examine_machine(configured(tmp_path, table))
        assert not isinstance(found, MachineConfiguration), table
        assert {(one.place.key, one.code) for one in found} == {(key, f"error-{code}")}, table


async def test_a_replay_touches_where_the_log_has_a_value(tmp_path: Path) -> None:
    # a ramp of 0.01 K/s is 6.39 um by the model after 300 s, and the log lacks 6 um more
    rows = [f"{t},{22 + 0.01 * t},20,{'12.39' if t in (300, 301) else ''}" for t in range(400)]
    text = "\n".join(["time_s,T_spindle_C,T_column_C,Z_um", *rows])
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    replay = '[source]\nkind = "replay"\nas_fast_as_possible = true\nlog = "log.csv"'
    changes = (
        ('[source]\nkind = "opcua"\nconnection = "control"', replay),
        ('[sink]\nkind = "opcua"', '[sink]\nkind = "dry"'),
    )
    found = read_machine(configured(tmp_path, TABLE, *changes))
    historian = SimulatedHistorian()
    ports = build_parts(found, SystemClock(), historian).ports
    loop = CompensationLoop(found.compensation, loop_settings(found), ports)
    async with TaskGroup() as group:
        running = group.create_task(loop.run(Event()))
        await enabled_for(loop, 0.0)
        await running
    touches = [event for event in historian.events if event.kind == "touch"]
    assert [one.values["outcome"] for one in touches] == ["believed"] * 2
    assert touches_of(loop).known_um == pytest.approx(6.0, abs=0.3)
    assert touches_of(loop).value_um == pytest.approx(6.0, abs=0.2)  # the log's was not corrected
