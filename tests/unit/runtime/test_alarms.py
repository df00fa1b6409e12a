"""Alarms: each with cause and remedy, the gravest first, and none for what is only a state."""

import inspect
import json
import math
from dataclasses import replace
from datetime import timedelta
from typing import Any

from hypothesis import given, strategies as st

from tests.unit.runtime.status_server_parts import NOW, alarm, compensation, offsets, output, status
from thermaxis.codes import Message, Place, value_as_json
from thermaxis.compensation import (
    Compensation,
    Outcome,
    Provenance,
    Reason,
    SampleQuality,
    SupervisorState,
)
from thermaxis.messages import alarm_sentences
from thermaxis.runtime import (
    ALARMS,
    PRIORITIES,
    Alarm,
    HistorianStatus,
    RuntimeStatus,
    SourceSample,
    alarms_of,
)
from thermaxis.runtime.status import _alarms, as_json


def found(
    told: RuntimeStatus, of: Compensation | None = None, *forbidden: Message
) -> dict[str, Alarm]:
    return {a.key: a for a in alarms_of(told, of or compensation(*told.outputs), forbidden)}


def with_output(**changes: Any) -> RuntimeStatus:
    return status(output=output(**changes))


def test_an_undisturbed_machine_has_no_alarm() -> None:
    assert alarms_of(status(), compensation()) == ()


def test_a_state_alone_is_no_alarm() -> None:
    for state in SupervisorState:
        reasons = () if state is SupervisorState.ACTIVE else (Reason.INTERLOCK_OPEN,)
        assert found(with_output(state=state, correction_um=(0.0,), reasons=reasons)) == {}


def test_an_offset_that_stands_while_it_is_off_is_told_with_the_way_out() -> None:
    alarm = found(with_output(state=SupervisorState.OFF))["standing offset Z_um"]
    assert alarm.priority == "medium"
    assert "stands in Z," in alarm.sentences.text
    assert "fade it out" in alarm.sentences.remedy
    unreachable = replace(with_output(state=SupervisorState.OFF), sink_connected=False)
    assert "standing offset Z_um" not in found(unreachable), "nobody knows whether it stands"


def test_a_fault_says_that_it_waits_to_be_acknowledged() -> None:
    for reason in (
        Reason.READ_BACK_DIFFERS,
        Reason.LONG_AT_LIMIT,
        Reason.OFFSET_OUTSIDE,
        Reason.DOUBLE_COMPENSATION,
    ):
        (one,) = found(with_output(state=SupervisorState.FAULT, reasons=(reason,))).values()
        assert (one.priority, one.code) == ("critical", f"fault_{reason.value}")
        assert "acknowledge" in one.sentences.remedy
    # a double compensation is one that was read as active
    assert "is on" in one.sentences.cause
    assert "cannot be read" not in one.sentences.cause


def test_a_bad_sensor_is_named_with_what_it_acts_on_and_how_long_is_held() -> None:
    for quality in set(SampleQuality) - {SampleQuality.GOOD, SampleQuality.REDUNDANT}:
        told = with_output(qualities=(quality, SampleQuality.GOOD), values=(None, 22.0))
        (one,) = found(told).values()
        assert (one.key, one.priority) == ("sensor T_spindle_C", "high")
        assert one.values["quality"] == quality
        assert (one.values["name"], one.values["acts_on"]) == ("T_spindle_C", "Z_um")
        assert "Z is held for 5 min" in one.sentences.remedy


def test_a_bad_sensor_that_the_model_does_without_is_told_as_well() -> None:
    rules = compensation().sensors["T_column_C"]
    sensors = {
        **compensation().sensors,
        "T_column_C": replace(rules, moves_with="T_hall_C", rests_k=1.0),
        "T_hall_C": rules,
    }
    told = with_output(qualities=(*[SampleQuality.GOOD] * 2, SampleQuality.MISSING))
    (one,) = alarms_of(told, replace(compensation(), sensors=sensors))
    assert (one.key, one.priority, one.code) == ("sensor T_hall_C", "medium", "witness_bad")
    assert "is believed no more" in one.sentences.remedy


def test_a_redundant_sensor_that_stands_in_is_told_before_it_is_the_only_one() -> None:
    told = with_output(qualities=(SampleQuality.REDUNDANT, SampleQuality.GOOD))
    (one,) = found(told).values()
    assert (one.key, one.priority) == ("sensor T_spindle_C", "medium")


def test_what_was_read_of_a_bad_sensor_is_shown_without_control_characters() -> None:
    told = with_output(qualities=(SampleQuality.STATUS_BAD, SampleQuality.GOOD))
    samples = {"T_spindle_C": SourceSample(850.04, good=False, status="Bad\x1b[2J" * 100)}
    (one,) = found(replace(told, samples=samples)).values()
    assert "850.0 was read" in one.sentences.cause
    assert one.sentences.cause.isprintable()
    assert len(one.sentences.cause) <= 300


def test_a_lost_source_is_one_alarm_and_not_one_for_every_sensor() -> None:
    bad = (SampleQuality.MISSING, SampleQuality.MISSING)
    told = replace(with_output(qualities=bad, values=(None, None)), source_connected=False)
    assert [(a.key, a.priority) for a in found(told).values()] == [("source lost", "high")]


def test_a_machine_that_is_switched_off_at_night_alarms_nobody_loudly() -> None:
    off = status(source_connected=False, sink_connected=False, enabled=False)
    assert {a.priority for a in found(off).values()} == {"low"}
    on = status(source_connected=False, sink_connected=False)
    assert found(on)["sink lost"].priority == "critical"


def test_limit_and_soft_limit_are_one_alarm_that_becomes_graver() -> None:
    soft = with_output(correction_um=(-40.1,), wanted_um=(-40.1,))
    assert found(soft)["soft limit Z_um"].priority == "medium"
    hard = with_output(correction_um=(-50.0,), wanted_um=(-50.0,), at_limit=(True,))
    assert {k: a.priority for k, a in found(hard).items()} == {"limit Z_um": "critical"}
    assert "50.0 µm" in found(hard)["limit Z_um"].sentences.text
    assert found(with_output(correction_um=(40.0,), wanted_um=(40.0,))) == {}


def test_a_weight_that_falls_is_told_in_percent_until_it_is_whole() -> None:
    fallen = found(with_output(weight=(0.4,)))["validity Z_um"]
    assert "40 %" in fallen.sentences.text
    for weight, told, stays in ((0.98, False, True), (0.94, True, True), (1.0, False, False)):
        now = with_output(weight=(weight,))
        assert ("validity Z_um" in found(now)) is told
        assert ("validity Z_um" in found(replace(now, alarms=(fallen,)))) is stays


def test_a_correction_is_behind_when_the_rate_needs_longer_than_five_minutes() -> None:
    # 0.5 µm/s for 300 s are 150 µm; an ordinary start from zero is no alarm
    of = compensation()
    wide = replace(
        of, limits={"Z_um": replace(of.limits["Z_um"], largest_um=400.0, total_um=400.0)}
    )
    behind = with_output(correction_um=(0.0,), wanted_um=(150.1,))
    assert found(behind, wide)["behind Z_um"].priority == "medium"
    assert found(with_output(correction_um=(0.0,), wanted_um=(149.9,)), wide) == {}
    fading = replace(behind, output=behind.output._replace(state=SupervisorState.FADING))
    assert found(fading, wide) == {}


def test_a_trim_is_told_before_it_expires() -> None:
    told = replace(with_output(trim_um=(3.0,)), trim_left_s={"Z_um": 299.0})
    assert "+3.0 µm, expires in 5 min" in found(told)["trim Z_um"].sentences.text
    assert found(replace(told, trim_left_s={"Z_um": 300.0})) == {}
    assert found(status(trim_left_s={"Z_um": 0.0})) == {}


def test_a_diameter_that_does_not_fit_is_told_while_it_matters() -> None:
    for outcome in (Outcome.DIAMETER_HELD, Outcome.DIAMETER_UNKNOWN):
        told = with_output(outcomes=(outcome,))
        assert found(told)["diameter"].priority == "low"
        assert found(replace(told, enabled=False)) == {}


def test_a_historian_that_does_not_store_is_told_and_a_loss_stays() -> None:
    failing = status(
        historian=HistorianStatus(
            False, 120, 0, Message("failure-history_unwritable", {"detail": "the disk is full"})
        )
    )
    assert "120 records" in found(failing)["historian"].sentences.cause
    lost = status(historian=HistorianStatus(True, 0, 17))
    assert found(lost)["history lost"].sentences.text.startswith("17 records")


def test_a_model_older_than_a_year_is_told_and_a_date_that_is_none_is_no_alarm() -> None:
    of = compensation()
    for date in ("2029-04-30", "2029-05-02", "", "last spring", "2029-13-40", "2029"):
        aged = replace(of, model=replace(of.model, provenance=Provenance(date=date)))
        assert list(found(status(), aged)) == (["model old"] if date == "2029-04-30" else []), date


def test_a_certificate_is_told_from_thirty_days_before_its_end() -> None:
    for days, priority in (
        (31.0, None),
        (30.0, None),
        (29.9, "medium"),
        (0.1, "medium"),
        (-0.1, "high"),
    ):
        told = found(status(certificates={"server.certificate": NOW + timedelta(days=days)}))
        assert [one.priority for one in told.values()] == ([priority] if priority else []), days
    assert "expired on" in told["certificate server.certificate"].sentences.text


def test_every_finding_of_the_self_test_is_an_alarm_of_its_own() -> None:
    one = Message("self_test-output_not_writable", {}, Place(key="output.Z_um"))
    told = found(status(), None, one, Message("self_test-no_time_stamp"))
    assert [a.values["finding"] for a in told.values()] == [one, Message("self_test-no_time_stamp")]
    first = next(iter(told.values()))
    assert first.sentences.text.startswith("output.Z_um: The server does not let")
    assert first.sentences.remedy.startswith("Give the user the right to write")


def test_an_expired_hold_and_a_late_cycle_are_told() -> None:
    held = with_output(state=SupervisorState.FADING, reasons=(Reason.HOLD_EXPIRED,))
    assert found(held)["hold expired"].priority == "medium"
    assert found(status(lateness_s=1.5))["late"].sentences.text == "A cycle came 1.5 s late."


def test_an_alarm_keeps_the_time_at_which_it_came() -> None:
    came = NOW - timedelta(hours=2)
    standing = alarm(key="validity Z_um", since=came)
    told = replace(with_output(weight=(0.4,), correction_um=(-45.0,)), alarms=(standing,))
    times = {key: one.since for key, one in found(told).items()}
    assert times == {"validity Z_um": came, "soft limit Z_um": NOW}


@given(
    st.lists(st.sampled_from(list(SampleQuality)), min_size=2, max_size=2),
    st.lists(st.sampled_from(list(Reason)), max_size=3),
    st.sampled_from(list(SupervisorState)),
    st.tuples(st.booleans(), st.booleans(), st.booleans(), st.booleans()),
    st.floats(allow_nan=True),
    st.floats(allow_nan=True),
)
def test_every_alarm_has_all_its_words_and_the_gravest_come_first(
    qualities: list[SampleQuality],
    reasons: list[Reason],
    state: SupervisorState,
    flags: tuple[bool, bool, bool, bool],
    correction_um: float,
    weight: float,
) -> None:
    told = replace(
        with_output(
            qualities=tuple(qualities),
            reasons=tuple(reasons),
            state=state,
            at_limit=(flags[0],),
            correction_um=(correction_um,),
            weight=(weight,),
        ),
        source_connected=flags[1],
        sink_connected=flags[2],
        enabled=flags[3],
    )
    alarms = alarms_of(told, compensation(), (Message("self_test-no_time_stamp"),))
    ranks = [PRIORITIES.index(a.priority) for a in alarms]
    assert ranks == sorted(ranks)
    assert len({a.key for a in alarms}) == len(alarms)
    for one in alarms:
        assert one.sentences.text.endswith(".")
        assert one.sentences.cause.endswith(".")
        assert one.sentences.remedy.endswith(".")
        assert "".join(one.sentences).isprintable()


def test_an_offset_that_is_accepted_and_does_not_act_is_told() -> None:
    acting = dict.fromkeys(status().outputs, offsets(-40.0, -40.0, -39.5))
    assert not any(key.startswith("no effect") for key in found(status(offsets=acting)))
    dead = dict.fromkeys(status().outputs, offsets(-40.0, -40.0, 0.0))
    assert "no effect Z_um" not in found(status(offsets=dead)), "it may follow yet"
    told = alarms_of(status(offsets=dead), compensation(), standing={"Z_um"})
    (alarm,) = (one for one in told if one.key == "no effect Z_um")
    assert alarm.priority == "high"
    assert "but 0.0 µm acts" in alarm.sentences.text


# ---- codes and values, by which a screen says an alarm in another language ----------------------


def test_every_code_is_given_by_the_alarms() -> None:
    source = inspect.getsource(_alarms)
    reasons_and_outcomes = {f"fault_{reason}" for reason in Reason} | set(Outcome)
    once = {code for code in ALARMS if source.count(f'"{code}"') < 2}
    assert once <= reasons_and_outcomes


def test_an_alarm_tells_its_numbers_beside_its_sentence() -> None:
    one = found(with_output(correction_um=(-45.04,)))["soft limit Z_um"]
    assert one.code == "soft_limit"
    assert one.values == {"name": "Z_um", "correction_um": -45.04, "soft_um": 40.0}
    text = "The correction of Z is −45.0 µm, beyond the warning limit of 40.0 µm."
    assert one.sentences.text == text


def test_a_bad_sensor_that_was_read_is_told_with_what_was_read() -> None:
    told = with_output(qualities=(SampleQuality.OUT_OF_RANGE, SampleQuality.GOOD))
    samples = {"T_spindle_C": SourceSample(850.04, good=True, status="Good")}
    (one,) = found(replace(told, samples=samples)).values()
    assert one.code == "sensor_bad"
    assert one.values["quality"] == SampleQuality.OUT_OF_RANGE.value
    assert (one.values["read_c"], one.values["status"]) == (850.04, "Good")
    assert (one.values["hold"], one.values["hold_unit"]) == (5.0, "min")
    (unread,) = found(replace(told, samples={})).values()
    assert (unread.code, "read_c" in unread.values) == ("sensor_unread", False)
    broken = {"T_spindle_C": SourceSample(None, good=False, status="BadSensorFailure")}
    (failed,) = found(replace(told, samples=broken)).values()
    assert failed.values["status"] == "BadSensorFailure"


def test_short_times_are_told_in_seconds_and_long_ones_in_minutes() -> None:
    of = compensation()
    for hold_s, said in ((119.0, "119 s"), (120.0, "2 min"), (0.0, "0 s")):
        rules = replace(of, supervisor=replace(of.supervisor, hold_connection_s=hold_s))
        lost = found(status(source_connected=False), rules)["source lost"]
        assert f"held for {said}," in lost.sentences.remedy


@given(
    st.sampled_from(list(SampleQuality)),
    st.floats(allow_nan=True) | st.none(),
    st.floats(allow_nan=True),
    st.sampled_from(list(Reason)),
    st.text(max_size=20),
)
def test_the_sentences_of_every_alarm_are_its_code_filled_with_its_values(
    quality: SampleQuality, read: float | None, number: float, reason: Reason, text: str
) -> None:
    told = replace(
        with_output(
            qualities=(quality, SampleQuality.GOOD),
            reasons=(reason,),
            state=SupervisorState.FAULT,
            correction_um=(number,),
            trim_um=(number,),
            weight=(0.25,),
            outcomes=tuple(Outcome),
        ),
        samples={"T_spindle_C": SourceSample(read, good=False, status=text)},
        historian=HistorianStatus(
            False, 3, 4, Message("failure-history_unwritable", {"detail": text})
        ),
        lateness_s=2.5,
    )
    alarms = alarms_of(told, compensation(), (Message("self_test-offset_gone", {"status": text}),))
    assert len(alarms) > 4
    for one in alarms:
        whole = alarm_sentences(one.code, one.values)
        if max(map(len, whole)) <= 300 and "".join(whole).isprintable():
            assert one.sentences == whole
        for value in one.values.values():
            assert not isinstance(value, str) or value.isprintable()
    said = json.loads(as_json(replace(told, alarms=alarms)))["alarms"]
    for one, shown in zip(alarms, said, strict=True):
        assert shown["code"] == one.code
        for name, value in one.values.items():
            unknown = isinstance(value, float) and not math.isfinite(value)
            assert shown["values"][name] == (None if unknown else value_as_json(value))


def test_a_saved_state_of_another_version_is_an_alarm_until_a_person_decides() -> None:
    other = Message("why-other_version", {"file": "a.state.json", "version": "1"})
    (one,) = alarms_of(status(), compensation(), other_state=other)
    assert (one.code, one.priority) == ("state_version", "high")
    assert "a.state.json" in one.sentences.text
