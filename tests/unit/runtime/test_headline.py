"""The headline names the cause, in every language; what acts is told as read, and what it is of."""

import asyncio
import json
import math
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from tests.unit.runtime.simulated import Rig, alarms_of, ask, enabled_for, state_of
from tests.unit.runtime.status_server_parts import NOW, offsets, output, status
from thermaxis.codes import Message
from thermaxis.compensation import Outcome, Reason, RequestKind, SampleQuality, SupervisorState
from thermaxis.messages import ISOLATE, LANGUAGES, remedy_of, sentence_of
from thermaxis.runtime import (
    NOT_READ,
    OTHER_COMPENSATION,
    CompensationLoop,
    RuntimeStatus,
    SourceSample,
)
from thermaxis.runtime.status import Headlines, as_json, leaves_of, shape_of, state_message

VIRTUAL_TIME = True
STATES, REASONS = tuple(SupervisorState), tuple(Reason)
NEEDS_NOTHING = {"headline-off", "headline-active"}


def headline(told: RuntimeStatus) -> Message:
    return Headlines().headline_of(told)[0]


@st.composite
def statuses(draw: st.DrawFn) -> RuntimeStatus:
    """Return a status as a loop may tell it, and many that none ever tells."""
    state = draw(st.sampled_from(STATES))
    qualities = draw(st.tuples(*[st.sampled_from(SampleQuality)] * 2))
    fewest = int(state is SupervisorState.FAULT)
    reasons = draw(st.lists(st.sampled_from(REASONS), min_size=fewest, max_size=3, unique=True))
    known = draw(st.booleans())
    return status(
        enabled=draw(st.booleans()) and state is not SupervisorState.OFF,
        sink_connected=draw(st.booleans()),
        source_connected=draw(st.booleans()),
        interlocks={n: draw(st.sampled_from((True, False, None))) for n in ("drives", "door")},
        offsets={"Z_um": offsets(1.0, 1.0, 1.0, age_s=0.1 if known else 60.0)},
        held_by=draw(st.sampled_from(("", "Jana"))),
        differing=draw(st.sampled_from(((), ("Z_um",)))),
        output=output(
            state=state,
            reasons=tuple(reasons),
            qualities=qualities,
            at_limit=(draw(st.booleans()),),
        ),
    )


@given(statuses(), st.sampled_from(LANGUAGES))
@settings(max_examples=400)
def test_every_status_has_a_headline_with_words_and_a_remedy_in_every_language(
    told: RuntimeStatus, language: Any
) -> None:
    found = headline(told)
    text = sentence_of(found, language=language)
    assert text
    assert ISOLATE not in text
    assert "headline-" not in text
    assert bool(remedy_of(found, language=language)) is (found.code not in NEEDS_NOTHING)


@given(statuses())
@settings(max_examples=400)
def test_the_cause_is_named_before_the_state(told: RuntimeStatus) -> None:
    found = headline(told)
    state, at_work = told.output.state, told.enabled
    usable = {SampleQuality.GOOD, SampleQuality.REDUNDANT}
    dead = [n for n, q in zip(told.channels, told.output.qualities, strict=True) if q not in usable]
    if not told.sink_connected or told.offsets["Z_um"].acting.age_s == 60.0:
        assert found.code == "headline-unreachable"
    elif state is SupervisorState.OFF:
        assert found.code == "headline-off"
    elif state is SupervisorState.FAULT:
        assert found.code == "headline-fault"
    elif told.open_interlocks:
        assert found.code == "headline-interlock"
        assert found.values["names"] == told.open_interlocks
        assert found.values["name"] == told.open_interlocks[0]
    elif told.source_connected and Reason.CONNECTION_LOST in told.output.reasons:
        assert found.code == "headline-unreachable"
    elif Reason.INTERLOCK_OPEN in told.output.reasons:
        assert found.code == "headline-not_released"
    elif told.differing:
        assert found.code == "headline-not_acting"
    elif at_work and not told.source_connected:
        assert found.code == "headline-inputs_unreachable"
    elif dead or None in told.interlocks.values():
        assert found.code not in {"headline-warming", "headline-active", "headline-at_limit"}
        held = state is SupervisorState.HOLDING
        if found.code in {"headline-held_for_input", "headline-input_lost"}:
            assert found.code == ("headline-held_for_input" if held else "headline-input_lost")
            assert found.values["name"] in {*dead, *told.interlocks}
    assert (found.code == "headline-off") <= (state is SupervisorState.OFF)
    assert (found.code == "headline-active") <= (state is SupervisorState.ACTIVE)


def test_another_compensation_is_named_only_where_it_cannot_be_read() -> None:
    waits = output(state=SupervisorState.WARMING, reasons=(Reason.INPUT_BAD,))
    of = {OTHER_COMPENSATION: NOT_READ}
    assert headline(status(output=waits, samples=of)).values["name"] == OTHER_COMPENSATION
    of = {OTHER_COMPENSATION: SourceSample(0.0, good=True)}
    for samples in (of, {}):  # as in the first of slow cycles, which no input was lost in
        found = headline(status(output=waits, samples=samples, active_in_s=12.0))
        assert found == Message("headline-warming", {"left_s": 12.0})


@pytest.mark.parametrize(
    ("changes", "reasons", "then"),
    [
        ({}, (), "it goes on by itself"),
        ({}, (Reason.OPERATOR_HOLD,), "then resume"),
        ({}, (Reason.HOLD_EXPIRED,), "then resume"),
        ({"enabled": False}, (Reason.DISABLED,), "then enable"),
    ],
)
@pytest.mark.parametrize("bad", ["sensor", "source", "interlock"])
def test_it_is_said_to_go_on_by_itself_only_where_it_does(
    changes: dict[str, Any], reasons: tuple[Reason, ...], then: str, bad: str
) -> None:
    quality = SampleQuality.STATUS_BAD if bad == "sensor" else SampleQuality.GOOD
    of = output(
        state=SupervisorState.HOLDING, reasons=reasons, qualities=(quality, SampleQuality.GOOD)
    )
    interlocks = {"door": bad != "interlock"}
    told = status(output=of, interlocks=interlocks, source_connected=bad != "source", **changes)
    if told.enabled or bad == "interlock":
        assert then in remedy_of(headline(told))


LOST = {"source_connected": False, "interlocks": {"door": None}}
"""A look that read nothing."""


@pytest.mark.parametrize(
    ("before", "missed", "code"),
    [
        ({}, LOST, "active"),
        ({"interlocks": {"door": False}}, LOST, "interlock"),
        ({"output": output(at_limit=(True,))}, LOST, "at_limit"),
        ({}, {"sink_reason": Message("error-not_answered")}, "active"),
        ({}, {"differing": ("Z_um",)}, "active"),
    ],
)
def test_what_one_look_alone_does_not_show_stands_until_that_lasts(
    before: dict[str, Any], missed: dict[str, Any], code: str
) -> None:
    seen = looks()
    seen(0.0, **before)  # what is seen at first may have been so for longer
    came_s = seen(1.0, **before)[1]
    missed = {**before, **missed}
    assert seen(2.0, **missed) == (code, came_s)
    assert seen(3.0, **before) == (code, came_s)
    assert [seen(s, **missed)[0] for s in (4.0, 5.0)] == [code] * 2
    last = "not_acting" if "source_connected" not in missed else "inputs_unreachable"
    assert seen(6.0, **missed) == (last, 4.0)
    assert seen(7.0, **before)[0] == code


def test_looks_that_fail_one_after_the_other_each_in_its_way_are_bridged_as_one() -> None:
    seen = looks()
    seen(0.0)
    bad, good = SampleQuality.STATUS_BAD, SampleQuality.GOOD
    dead = [{"output": output(qualities=one)} for one in ((bad, good), (good, bad))]
    fail = [LOST, LOST, *dead, {"differing": ("Z_um",)}, LOST, *dead]
    told = [seen(1.0 + k, **changes)[0] for k, changes in enumerate(fail)]
    assert told[:2] == ["active"] * 2
    assert set(told[2:]) == {"input_lost", "not_acting", "inputs_unreachable"}


@pytest.mark.parametrize("set_s", [-3600.0, 3600.0])
@pytest.mark.parametrize("fails", [LOST, {"differing": ("Z_um",)}])
def test_a_clock_that_is_set_bridges_nothing_for_longer_and_nothing_for_less(
    fails: dict[str, Any], set_s: float
) -> None:
    seen = looks()
    told = "not_acting" if "differing" in fails else "inputs_unreachable"
    assert seen(0.0)[0] == "active"
    assert [seen(s, set_s, **fails)[0] for s in (1.0, 2.0)] == ["active"] * 2
    assert {seen(s, set_s, **fails)[0] for s in (3.0, 10.0)} == {told}
    assert {seen(s, 2.0 * set_s, **fails)[0] for s in (11.0, 600.0)} == {told}


def looks() -> Callable[..., tuple[str, float]]:
    """Return what tells the headline of one look after the other, and since when it stands."""
    of = Headlines()

    def seen(at_s: float, set_s: float = 0.0, **changes: Any) -> tuple[str, float]:
        told = status(**{"utc": NOW + timedelta(seconds=at_s + set_s), **changes})
        told = replace(told, output=told.output._replace(time_s=100.0 + at_s))
        found, since = of.headline_of(told)
        return found.code.removeprefix("headline-"), (since - NOW).total_seconds()

    return seen


def test_an_interlock_that_is_met_is_not_said_to_be_open_because_another_read_failed() -> None:
    of, opened = Headlines(), output(state=SupervisorState.FADING, reasons=(Reason.INTERLOCK_OPEN,))
    of.headline_of(status(output=opened, interlocks={"door": False}))
    dead = (SampleQuality.STATUS_BAD, SampleQuality.GOOD)
    bad = opened._replace(qualities=dead, reasons=(Reason.INPUT_BAD,))
    after = status(output=bad, interlocks={"door": True})
    assert of.headline_of(after)[0].code == "headline-input_lost"


def test_what_stood_at_the_first_look_stands_since_the_start_at_least() -> None:
    of, opened = Headlines(), {"door": False}
    away = status(source_connected=False, interlocks={"door": None}, sink_connected=False)
    assert of.headline_of(away)[1] == away.started
    found, since = of.headline_of(status(interlocks=opened))
    assert (found.code, since) == ("headline-interlock", away.started)
    of.headline_of(status())
    assert of.headline_of(status(interlocks=opened))[1] == NOW


def test_a_cause_keeps_its_time_through_other_states_and_other_causes() -> None:
    told, of = Headlines(), output(state=SupervisorState.HOLDING, reasons=(Reason.OPERATOR_HOLD,))
    told.headline_of(status())  # what is seen at first may have been so for longer
    times: tuple[tuple[dict[str, Any], str, int], ...] = (
        ({}, "held_by_person", 0),
        ({"interlocks": {"door": False}}, "interlock", 1),
        ({"interlocks": {"door": False}, "sink_connected": False}, "unreachable", 2),
        ({"interlocks": {"door": False, "drives": False}}, "interlock", 1),
        ({"interlocks": {"door": True, "drives": False}}, "interlock", 3),
        ({}, "held_by_person", 0),
        ({}, "active", 6),
    )
    for k, (changes, code, since) in enumerate(times):
        at = NOW + timedelta(seconds=k)
        now = status(output=of, utc=at) if k < 6 else status(utc=at)
        found, came = told.headline_of(replace(now, **changes))
        assert found.code == f"headline-{code}"
        assert came == NOW + timedelta(seconds=since)


# ---- beside a loop ------------------------------------------------------------------------------


def of(loop: CompensationLoop) -> tuple[str, dict[str, Any]]:
    assert loop.status is not None
    return loop.status.headline.code, dict(loop.status.headline.values)


async def test_a_loop_that_begins_with_a_dead_sensor_names_it_and_does_not_warm_up() -> None:
    bench = Rig()
    bench.machine.values["s"] = None
    async with bench.running() as loop:
        await ask(loop, RequestKind.ENABLE)
        for _ in range(20):
            await asyncio.sleep(1.0)
            assert of(loop) == ("headline-input_lost", {"name": "s", "then": "wait"})
        bench.machine.values["s"] = 23.0
        await asyncio.sleep(2.0)
        code, values = of(loop)
        assert code == "headline-warming"
        left_s = values["left_s"]
        await asyncio.sleep(left_s + 1.5)
        assert of(loop) == ("headline-active", {})


async def test_a_loop_names_who_holds_it_and_what_keeps_it() -> None:
    bench = Rig(hold_input_s=20.0)
    async with bench.running() as loop:
        await asyncio.sleep(2.0)
        assert of(loop) == ("headline-off", {})
        await enabled_for(loop, 30.0)
        await ask(loop, RequestKind.HOLD)
        await asyncio.sleep(2.0)
        assert of(loop) == ("headline-held_by_person", {"who": "Jana"})
        await ask(loop, RequestKind.RESUME)
        await asyncio.sleep(3.0)
        bench.machine.values["s"] = None
        await asyncio.sleep(10.0)
        assert loop.status is not None
        began = loop.status.headline_since
        assert of(loop) == ("headline-held_for_input", {"name": "s", "then": "wait"})
        text = bench.said("state")[-1].text
        assert text == "Hold: an input has no usable value (s)"
        await asyncio.sleep(30.0)
        assert state_of(loop) is SupervisorState.FADING
        assert of(loop) == ("headline-input_lost", {"name": "s", "then": "wait"})
        assert loop.status.headline_since == began, "the sensor is dead since then"
        bench.machine.lose()
        await asyncio.sleep(2.0)
        assert of(loop) == ("headline-unreachable", {})


async def test_a_control_that_falls_silent_is_said_to_be_unreachable_and_no_interlock() -> None:
    bench, seen = Rig(), set[str]()
    async with bench.running() as loop:
        await enabled_for(loop, 40.0)
        loop.listeners.append(lambda told: seen.add(told.headline.code))
        bench.machine.unanswered = 100
        await asyncio.sleep(10.0)
        assert loop.status is not None
        assert loop.status.sink_connected
        assert seen == {"headline-active", "headline-unreachable"}


@pytest.mark.parametrize("deaf", ["refuses", "obeys"])
async def test_a_loop_whose_offset_does_not_follow_says_so_before_it_is_a_fault(deaf: str) -> None:
    bench = Rig(read_back_s=60.0)
    async with bench.running() as loop:
        await enabled_for(loop, 40.0)
        assert of(loop) == ("headline-active", {})
        setattr(bench.machine, deaf, deaf == "refuses")
        bench.machine.values["s"] = 24.0
        await asyncio.sleep(10.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert of(loop) == ("headline-not_acting", {"names": ("Z_um",)})
        setattr(bench.machine, deaf, deaf != "refuses")
        await asyncio.sleep(10.0)
        assert of(loop) == ("headline-active", {})


async def test_a_loop_whose_writes_are_refused_says_so_also_while_it_fades() -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        loop.sink.failure = Message("error-write_refused", {"refused": "Z_um"})
        await asyncio.sleep(5.0)
        assert (of(loop)[0], "write_refused" in alarms_of(loop)) == ("headline-not_acting", True)
        await ask(loop, RequestKind.DISABLE)
        await asyncio.sleep(5.0)
        assert state_of(loop) is SupervisorState.FADING
        assert (of(loop)[0], "write_refused" in alarms_of(loop)) == ("headline-not_acting", True)
        loop.sink.failure = None
        await asyncio.sleep(2.0)
        assert of(loop)[0] == "headline-fading"


async def test_a_headline_comes_with_its_alarm_however_short_the_cycle() -> None:
    bench, seen = Rig(cycle_s=0.2), list[tuple[str, set[str]]]()
    async with bench.running() as loop:
        await asyncio.sleep(9.5)  # off: its state does not change
        loop.listeners.append(lambda told: seen.append((told.headline.code, alarms_of(loop))))
        bench.machine.lose()
        await asyncio.sleep(2.0)
    told = [codes for code, codes in seen if code == "headline-unreachable"]
    assert told
    assert all("sink_lost" in codes for codes in told)


def test_a_hold_keeps_its_time_and_its_person_through_a_restart() -> None:
    bench = Rig(hold_operator_s=1000.0)

    async def holds(rig: Rig, loop: CompensationLoop) -> None:
        await enabled_for(loop, 30.0)
        await ask(loop, RequestKind.HOLD)
        await asyncio.sleep(100.0)
        assert loop.status is not None
        begun.append(loop.status.headline_since)

    async def goes_on(rig: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(10.0)
        assert of(loop) == ("headline-held_by_person", {"who": "Jana"})
        assert loop.status is not None
        began, since = begun[0], loop.status.headline_since
        assert began is not None
        assert since is not None
        assert abs(since - began) <= timedelta(seconds=2.0)  # the state is saved once a second

    begun: list[datetime | None] = []
    bench.play_and_kill(holds)
    bench.play(goes_on)


def test_an_event_names_the_interlock_that_is_open() -> None:
    fades = output(state=SupervisorState.FADING, reasons=(Reason.INTERLOCK_OPEN,))
    told = state_message(status(output=fades, interlocks={"door": False, "drives": True}))
    assert sentence_of(told, language="de") == (
        "Läuft aus: eine Verriegelung ist nicht erfüllt (door)"
    )


# ---- what acts, and what it is made of ----------------------------------------------------------

UM = st.floats(-1e3, 1e3)


@given(UM, UM, st.tuples(UM, UM), st.floats(0.0, 1.0))
def test_sources_trim_and_rest_add_up_to_the_correction(
    correction_um: float, trim_um: float, parts_um: tuple[float, float], weight: float
) -> None:
    told = output(
        correction_um=(correction_um,),
        trim_um=(trim_um,),
        contribution_um=(parts_um,),
        weight=(weight,),
    )
    found = json.loads(as_json(status(output=told)))["outputs"]["Z_um"]
    assert list(found["sources_um"]) == ["spindle", "column"]
    assert found["sources_um"]["spindle"] == -weight * parts_um[0]
    whole_um = math.fsum((*found["sources_um"].values(), found["trim_um"], found["rest_um"]))
    assert whole_um == pytest.approx(found["correction_um"], rel=0.0, abs=1e-9)


def test_the_difference_that_drives_a_part_is_the_rise_of_its_channels() -> None:
    told = status(reference_c={"T_spindle_C": 20.0, "T_column_C": 21.0})
    found = json.loads(as_json(told))["outputs"]["Z_um"]["differences_k"]
    assert found == pytest.approx({"spindle": 10.5, "column": 1.0})  # (31.5 - 20) - (22 - 21)
    dead = status(output=output(values=(None, 22.0)), reference_c=told.reference_c)
    found = json.loads(as_json(dead))["outputs"]["Z_um"]["differences_k"]
    assert found == {"spindle": None, "column": pytest.approx(1.0)}


@pytest.mark.parametrize("outcome", [Outcome.WAITING, Outcome.STATE_UNUSABLE])
def test_what_a_model_that_has_not_run_contributes_is_not_known(outcome: Outcome) -> None:
    told = output(
        outcomes=(outcome,), model_um=(0.0,), contribution_um=((0.0, 0.0),), wanted_um=(0.0,)
    )
    found = json.loads(as_json(status(output=told)))["outputs"]["Z_um"]
    unknown = {"spindle": None, "column": None}
    assert found["sources_um"] == found["parts_um"] == unknown
    assert found["rest_um"] is found["model_um"] is None
    assert quality(status(output=told), "Model") == "BadNoData"
    assert quality(status(output=told), "Parts") == "BadNoData"
    ran = output(outcomes=(Outcome.STARTED,))
    assert quality(status(output=ran), "Model") == "Good"


def quality(told: RuntimeStatus, node: str) -> str:
    return leaves_of(shape_of(told)).shown[f"Outputs/Z_um/{node}"].read(told).quality


def test_what_acts_keeps_its_last_value_and_is_bad_once_it_may_be_gone() -> None:
    for age_s, connected, known in (
        (0.1, True, True),
        (2.5, True, True),
        (2.6, True, False),
        (0.1, False, False),
    ):
        of = {"Z_um": offsets(-12.5, -12.4, -12.0, age_s=age_s)}
        told = status(offsets=of, sink_connected=connected)
        found = json.loads(as_json(told))["outputs"]["Z_um"]
        assert (found["acting_um"], found["acting_age_s"]) == (-12.0, age_s)
        assert found["acting_known"] is known
        assert quality(told, "Acting") == ("Good" if known else "BadNoCommunication")


def test_a_machine_that_tells_no_acting_offset_is_told_from_one_that_is_silent() -> None:
    silent = offsets(-12.5, None, None)
    assert quality(status(offsets={"Z_um": silent}), "Effective") == "GoodNoData"
    asked = silent._replace(tells_effective=True)
    for node in ("Effective", "EffectiveAge", "Accepted", "AcceptedAge", "Acting", "ActingAge"):
        assert quality(status(offsets={"Z_um": asked}), node) == "BadNoCommunication"
