"""The headline names the cause, in every language; what acts is told as read, and what it is of."""

import asyncio
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from tests.unit.runtime.simulated import Rig, alarms_of, ask, enabled_for, state_of
from tests.unit.runtime.status_server_parts import (
    NOW,
    alarm,
    compensation,
    offsets,
    output,
    status,
)
from thermaxis.codes import Message
from thermaxis.compensation import (
    CycleOutput,
    Outcome,
    Reason,
    RequestKind,
    SampleQuality,
    SupervisorState,
)
from thermaxis.messages import ISOLATE, LANGUAGES, remedy_of, sentence_of
from thermaxis.runtime import (
    NOT_READ,
    OTHER_COMPENSATION,
    CompensationLoop,
    RuntimeStatus,
    Source,
    SourceSample,
)
from thermaxis.runtime.status import (
    Headlines,
    OutputFacts,
    as_json,
    leaves_of,
    shape_of,
    state_message,
)

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
@settings(max_examples=60)
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
@settings(max_examples=60)
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
        tests = Reason.INTERLOCK_OPEN in told.output.reasons
        assert found.code == ("headline-starting" if tests else "headline-unreachable")
    elif {*told.output.reasons} & {Reason.INTERLOCK_OPEN, Reason.CONNECTION_LOST} == {
        Reason.INTERLOCK_OPEN
    }:
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
        ({"output": output(at_limit=(True,), wanted_um=(-43.0,))}, LOST, "at_limit"),
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
    away = status(number=1, source_connected=False, interlocks={"door": None}, sink_connected=False)
    assert of.headline_of(away)[1] == away.started
    found, since = of.headline_of(status(interlocks=opened))
    assert (found.code, since) == ("headline-interlock", away.started)
    of.headline_of(status())
    assert of.headline_of(status(interlocks=opened))[1] == NOW
    late = Headlines()  # which begins beside a loop that runs
    assert late.headline_of(status(interlocks=opened))[1] == NOW


FADES = SupervisorState.FADING


@pytest.mark.parametrize("lost_at_first", [True, False])
@pytest.mark.parametrize(("state", "um"), [(FADES, -5.0), (SupervisorState.WARMING, 0.0)])
def test_a_hold_that_holds_nothing_says_why_and_since_when(
    state: SupervisorState, um: float, *, lost_at_first: bool
) -> None:
    names, of = Headlines(), output(state=state, reasons=(Reason.OPERATOR_HOLD,))
    lost = status(number=1, held_s=3600.0, output=of._replace(correction_um=(um,)))
    if not lost_at_first:
        names.headline_of(status(number=1))
    found, since = names.headline_of(lost)
    assert found == Message(
        "headline-hold_lost", {"cause": "restart" if lost_at_first else "other"}
    )
    assert since == (lost.started if lost_at_first else NOW)


def test_a_hold_of_what_was_found_before_the_model_has_settled_is_a_hold() -> None:
    of = output(state=SupervisorState.WARMING, reasons=(Reason.OPERATOR_HOLD,))
    assert headline(status(output=of)).code == "headline-held_by_person"


FAR = output(wanted_um=(-43.0,))
HERE = FAR._replace(correction_um=(-41.0,))


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({}, "on_its_way"),
        ({"output": HERE, "offsets": {"Z_um": offsets(-41.0, -41.0, -40.6)}}, "active"),
        ({"output": HERE, "offsets": {"Z_um": offsets(-41.0, -41.0, -12.0)}}, "on_its_way"),
        ({"interlocks": {"door": False}}, "interlock"),
        ({"differing": ("Z_um",)}, "not_acting"),
        ({"sink_connected": False}, "unreachable"),
        ({"output": FAR._replace(state=FADES)}, "warming"),
        ({"output": FAR._replace(state=FADES), "enabled": False}, "fading"),
    ],
)
def test_it_is_on_its_way_only_where_it_moves_and_has_far_to_go(
    changes: dict[str, Any], code: str
) -> None:
    limits = replace(compensation().bounds[0], deadband_um=1.5)
    told = status(**{"output": FAR, "facts": {"Z_um": OutputFacts(limits, ())}, **changes})
    names = Headlines()
    there = told.offsets["Z_um"]
    for at_s, short_um in ((0.0, 1.0), (60.0, 0.0)):  # one look alone is doubted
        acting = there.acting._replace(um=(there.acting.um or 0.0) + short_um)
        offsets_by_name = {"Z_um": there._replace(acting=acting)}
        of = told.output._replace(time_s=at_s)
        found, _ = names.headline_of(replace(told, offsets=offsets_by_name, output=of))
    assert found.code == f"headline-{code}"
    if code == "on_its_way":
        assert found.values == {"name": "Z_um", "left_um": 31.0, "left_s": 62.0}


def test_what_has_far_to_go_and_stands_does_not_act_though_nothing_differs() -> None:
    for rate_um_per_s, longest_s in ((1.0, 4.0), (0.1, 11.0)):
        limits = replace(compensation().bounds[0], largest_rate_um_per_s=rate_um_per_s)
        facts = {"Z_um": OutputFacts(limits, ())}
        names, told = Headlines(), list[str]()
        for at_s in range(60):
            acting_um = -rate_um_per_s * min(at_s, 30)
            of = replace(
                status(output=FAR._replace(time_s=float(at_s)), facts=facts),
                offsets={"Z_um": offsets(-41.0, -41.0, acting_um)},
            )
            told.append(names.headline_of(of)[0].code)
        began = told.index("headline-not_acting")
        assert {*told[began:]} == {"headline-not_acting"}
        assert 30 < began <= 30 + longest_s


def test_it_follows_the_model_only_since_it_has_arrived() -> None:
    seen = looks()
    assert [seen(s, output=FAR)[0] for s in (0.0, 1.0, 2.0)] == ["on_its_way"] * 3
    assert seen(3.0) == ("active", 3.0)


def test_a_fast_axis_is_there_no_earlier_than_a_slow_one() -> None:
    limits = replace(compensation().bounds[0], largest_rate_um_per_s=10.0)
    for correction_um, acting_um in ((-25.0, -43.0), (-43.0, -25.0)):
        told = status(
            output=FAR._replace(correction_um=(correction_um,)),
            offsets={"Z_um": offsets(correction_um, acting_um, acting_um)},
            facts={"Z_um": OutputFacts(limits, ())},
        )
        assert headline(told).values == {"name": "Z_um", "left_um": 18.0, "left_s": 1.8}


HELD = FAR._replace(state=SupervisorState.HOLDING, reasons=(Reason.OPERATOR_HOLD,))
LOST_INPUT = FAR._replace(qualities=(SampleQuality.STATUS_BAD, SampleQuality.GOOD))


@pytest.mark.parametrize(
    ("age_s", "of", "code"),
    [
        (0.0, FAR, "another_writer"),
        (11.0, FAR, "on_its_way"),
        (11.0, HELD, "held_by_person"),
        (11.0, LOST_INPUT, "input_lost"),
    ],
)
def test_another_writer_is_named_first_and_hides_nothing_that_lasts(
    age_s: float, of: CycleOutput, code: str
) -> None:
    values = {"name": "Z_um", "found_um": 61.0, "left_um": -12.0}
    wrote = alarm(code="another_writer", values=values, since=NOW - timedelta(seconds=age_s))
    assert headline(status(output=of, alarms=(wrote,))).code == f"headline-{code}"


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


class Named(Rig):
    """A rig whose loop is followed as by the process that publishes."""

    def loop(self, source: Source | None = None, **settings: Any) -> CompensationLoop:
        loop, names = super().loop(source, **settings), Headlines()

        def listen(told: RuntimeStatus) -> None:
            headline, since = names.headline_of(told)
            self.named.append(replace(told, headline=headline, headline_since=since))

        self.named = list[RuntimeStatus]()
        loop.listeners.append(listen)
        return loop

    @property
    def since(self) -> datetime:
        since = self.named[-1].headline_since
        assert since is not None
        return since


def of(bench: Named) -> tuple[str, dict[str, Any]]:
    told = bench.named[-1].headline
    return told.code, dict(told.values)


async def test_a_loop_that_begins_with_a_dead_sensor_names_it_and_does_not_warm_up() -> None:
    bench = Named()
    bench.machine.values["s"] = None
    async with bench.running() as loop:
        await ask(loop, RequestKind.ENABLE)
        for _ in range(20):
            await asyncio.sleep(1.0)
            assert of(bench) == ("headline-input_lost", {"name": "s", "then": "wait"})
        bench.machine.values["s"] = 23.0
        await asyncio.sleep(2.0)
        code, values = of(bench)
        assert code == "headline-warming"
        left_s = values["left_s"]
        await asyncio.sleep(left_s + 1.5)
        assert of(bench)[0] == "headline-on_its_way"


async def test_a_loop_says_how_far_the_correction_has_to_go_and_who_else_moved_it() -> None:
    bench = Named()
    async with bench.running() as loop:
        await enabled_for(loop, 20.0)
        for _ in range(2):
            assert of(bench)[0] == "headline-on_its_way"
            await asyncio.sleep(20.0)
        await asyncio.sleep(110.0)
        assert of(bench) == ("headline-active", {})
        bench.machine.set_offset(Z_um=-10.0)
        await asyncio.sleep(2.0)
        assert of(bench) == ("headline-another_writer", {"name": "Z_um"})
        await asyncio.sleep(120.0)
        assert of(bench) == ("headline-active", {})
        assert "another_writer" in alarms_of(loop), "until somebody acknowledges it"


async def test_an_interlock_ends_a_hold_and_the_loop_says_so() -> None:
    bench = Named(hold_operator_s=1000.0)
    async with bench.running() as loop:
        await enabled_for(loop, 100.0)
        await ask(loop, RequestKind.HOLD)
        await asyncio.sleep(5.0)
        bench.machine.values["interlock.referenced"] = 0.0
        await asyncio.sleep(5.0)
        code, values = of(bench)
        assert (code, values["then"]) == ("headline-interlock", "resume_anew")
        bench.machine.values["interlock.referenced"] = 1.0
        for seconds in (2.0, 120.0):
            await asyncio.sleep(seconds)
            assert of(bench) == ("headline-hold_lost", {"cause": "other"})
        held_s = (bench.named[-1].utc - bench.since).total_seconds()
        assert held_s == pytest.approx(127.0, abs=2.0), "since it fades, not since it was held"


async def test_a_loop_that_tests_the_machine_at_first_says_that_it_starts() -> None:
    bench = Named()

    async def finds_nothing() -> Sequence[Message]:
        await asyncio.sleep(4.0)
        return ()

    bench.self_test = finds_nothing
    async with bench.running() as loop:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(3.0)
        assert of(bench) == ("headline-starting", {})
        await asyncio.sleep(3.0)
        assert of(bench)[0] == "headline-on_its_way"


async def test_a_loop_names_who_holds_it_and_what_keeps_it() -> None:
    bench = Named(hold_input_s=20.0)
    async with bench.running() as loop:
        await asyncio.sleep(2.0)
        assert of(bench) == ("headline-off", {})
        await enabled_for(loop, 30.0)
        await ask(loop, RequestKind.HOLD)
        await asyncio.sleep(2.0)
        assert of(bench) == ("headline-held_by_person", {"who": "Jana"})
        await ask(loop, RequestKind.RESUME)
        await asyncio.sleep(3.0)
        bench.machine.values["s"] = None
        await asyncio.sleep(10.0)
        began = bench.since
        assert of(bench) == ("headline-held_for_input", {"name": "s", "then": "wait"})
        text = bench.said("state")[-1].text
        assert text == "Hold: an input has no usable value (s)"
        await asyncio.sleep(30.0)
        assert state_of(loop) is SupervisorState.FADING
        assert of(bench) == ("headline-input_lost", {"name": "s", "then": "wait"})
        assert bench.since == began, "the sensor is dead since then"
        bench.machine.lose()
        await asyncio.sleep(2.0)
        assert of(bench) == ("headline-unreachable", {})


async def test_a_control_that_falls_silent_is_said_to_be_unreachable_and_no_interlock() -> None:
    bench = Named()
    async with bench.running() as loop:
        await enabled_for(loop, 150.0)
        bench.named.clear()
        bench.machine.unanswered = 100
        await asyncio.sleep(10.0)
        assert bench.named[-1].sink_connected
        seen = {told.headline.code for told in bench.named}
        assert seen == {"headline-active", "headline-unreachable"}


@pytest.mark.parametrize("deaf", ["refuses", "obeys"])
async def test_a_loop_whose_offset_does_not_follow_says_so_before_it_is_a_fault(deaf: str) -> None:
    bench = Named(read_back_s=60.0)
    async with bench.running() as loop:
        await enabled_for(loop, 150.0)
        assert of(bench) == ("headline-active", {})
        setattr(bench.machine, deaf, deaf == "refuses")
        bench.machine.values["s"] = 24.0
        await asyncio.sleep(10.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert of(bench) == ("headline-not_acting", {"names": ("Z_um",)})
        setattr(bench.machine, deaf, deaf != "refuses")
        await asyncio.sleep(100.0)
        assert of(bench) == ("headline-active", {})


async def test_a_loop_whose_writes_are_refused_says_so_also_while_it_fades() -> None:
    bench = Named()
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        loop.sink.failure = Message("error-write_refused", {"refused": "Z_um"})
        await asyncio.sleep(5.0)
        assert (of(bench)[0], "write_refused" in alarms_of(loop)) == ("headline-not_acting", True)
        await ask(loop, RequestKind.DISABLE)
        await asyncio.sleep(5.0)
        assert state_of(loop) is SupervisorState.FADING
        assert (of(bench)[0], "write_refused" in alarms_of(loop)) == ("headline-not_acting", True)
        loop.sink.failure = None
        await asyncio.sleep(2.0)
        assert of(bench)[0] == "headline-fading"


async def test_a_headline_comes_with_its_alarm_however_short_the_cycle() -> None:
    bench = Named(cycle_s=0.2)
    async with bench.running():
        await asyncio.sleep(9.5)  # off: its state does not change
        bench.machine.lose()
        await asyncio.sleep(2.0)
    told = [one.alarms for one in bench.named if one.headline.code == "headline-unreachable"]
    assert told[1:]
    assert all("sink_lost" in {alarm.code for alarm in alarms} for alarms in told)


def test_a_hold_keeps_its_time_and_its_person_through_a_restart() -> None:
    bench = Named(hold_operator_s=1000.0)

    async def holds(_: Rig, loop: CompensationLoop) -> None:
        await enabled_for(loop, 30.0)
        await ask(loop, RequestKind.HOLD)
        await asyncio.sleep(100.0)
        begun.append(bench.since)

    async def goes_on(*_: object) -> None:
        await asyncio.sleep(10.0)
        assert of(bench) == ("headline-held_by_person", {"who": "Jana"})
        assert abs(bench.since - begun[0]) <= timedelta(
            seconds=2.0
        )  # the state is saved once a second

    begun: list[datetime] = []
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
