"""The saved state: what is saved comes back exactly, and what is damaged never comes back."""

import asyncio
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from tests.unit.runtime.simulated import (
    SimulatedHistorian,
    SimulatedMachine,
    SimulatedSink,
    SimulatedSource,
    alarms_of,
)
from thermaxis.codes import Message, printable
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    CycleReading,
    CycleState,
    Limits,
    Memory,
    OffsetState,
    Output,
    Part,
    Reason,
    Sample,
    Section,
    SensorRules,
    SensorState,
    SupervisorRules,
    SupervisorState,
    ThermalState,
    TouchOutcome,
    TouchRules,
    Trim,
    cycle,
    cycle_state,
)
from thermaxis.runtime import (
    AtStop,
    CompensationLoop,
    LoopSettings,
    Ports,
    SavedState,
    StateFile,
    VirtualClock,
    run_in_virtual_time,
)
from thermaxis.runtime._offsets import OffsetMismatch
from thermaxis.runtime.loop._saved_state import resumed

NOW = datetime(2030, 5, 6, 7, 8, 9, 101112, tzinfo=UTC)
SHA = "ab" * 32


def compensation(
    channels: Sequence[str] = ("s", "c"),
    outputs: Sequence[str] = ("Z_um", "X_um"),
    longest_gap_s: float = 600.0,
    gain: float = 2.0,
) -> Compensation:
    plus, minus = channels
    part = Part("spindle", plus, minus, gain, (Section(10.0, 300.0), Section(-1.0, 20.0)))
    model = CompensationModel(
        outputs=tuple(Output(name, (part,)) for name in outputs), longest_gap_s=longest_gap_s
    )
    return Compensation(
        model=model,
        sensors={n: SensorRules(lowest_c=1.0, highest_c=90.0) for n in channels},
        limits={name: Limits(60.0, 0.5) for name in outputs},
        supervisor=SupervisorRules(settle_s=5.0),
    )


MACHINE = compensation()
WARM = (Sample(22.0), Sample(20.0))


def lived(machine: Compensation, seconds: int, begin_s: float = 50.0) -> CycleState:
    """Return the state of a warm machine after some time."""
    state = cycle_state(machine)
    state = state._replace(
        memory=Memory(state=SupervisorState.WARMING, enabled=True),
        trims=(Trim(1.5, "Jana", 3000.0), *(Trim(),) * (len(machine.bounds) - 1)),
        diameter_mm=1500.0,
    )
    for k in range(seconds):
        samples = (Sample(20.0 + 0.01 * k), Sample(20.0))
        back_um = state.correction_um
        state, _ = cycle(machine, state, CycleReading(begin_s + k, samples, read_back_um=back_um))
    return state


def saved(state: CycleState, **changes: object) -> SavedState:
    values: dict[str, object] = {
        "utc": NOW,
        "monotonic_s": 350.25,
        "model_sha256": SHA,
        "model_file": "lathe.json",
        "enabled": True,
        "state": state,
        "held_by": "Jana",
        "mismatches": (OffsetMismatch("Z_um", 35.0, -36.5, 12, another=True, utc=NOW),),
    }
    return SavedState(**{**values, **changes})


def reloaded(folder: Path, one: SavedState) -> SavedState:
    file = StateFile(folder / "state.json")
    assert file.save(one, MACHINE)
    found, why = StateFile(folder / "state.json").load(MACHINE)
    assert why is None
    assert found is not None
    return found


# ---- round trip ---------------------------------------------------------------------------------

numbers = st.floats(width=64)
rows = st.lists(numbers, max_size=5).map(tuple)
sensors = st.tuples(*(st.builds(SensorState, numbers, numbers, numbers) for _ in range(2)))
states = st.builds(
    CycleState,
    thermal=st.builds(
        ThermalState,
        time_s=st.none() | numbers,
        reference=rows,
        value=rows,
        good_s=rows,
        filtered=rows,
        raw=rows,
        sections=rows,
        history=st.lists(st.tuples(numbers, rows), max_size=4).map(tuple),
        warm=st.booleans(),
    ),
    sensors=sensors,
    redundant=sensors,
    memory=st.builds(
        Memory,
        state=st.sampled_from(SupervisorState),
        since_s=numbers,
        enabled=st.booleans(),
        held=st.booleans(),
        fault=st.none() | st.sampled_from(Reason),
        running_s=numbers,
        ready_s=numbers,
        input_lost_s=numbers,
        connection_lost_s=numbers,
        interlock_open_s=numbers,
        held_s=numbers,
        differs_s=numbers,
        at_limit_s=numbers,
        halted_s=numbers,
    ),
    time_s=numbers,
    correction_um=st.tuples(numbers, numbers),
    goal_um=st.tuples(numbers, numbers),
    trims=st.tuples(
        *(st.builds(Trim, numbers, st.text().map(printable), numbers) for _ in range(2))
    ),
    diameter_mm=st.none() | numbers,
    offsets=st.just(()) | st.just((OffsetState(in_force_um=3.0),) * 2),
    expected=st.just(()) | st.just(((1.0, (2.0, 3.0)),)),
)


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    state=states,
    utc=st.datetimes(min_value=datetime(1971, 1, 1), max_value=datetime(2200, 1, 1)),  # noqa: DTZ001 - hypothesis adds it
    enabled=st.booleans(),
    name=st.text(),
)
def test_what_is_saved_comes_back_exactly(
    tmp_path: Path, state: CycleState, utc: datetime, enabled: bool, name: str
) -> None:
    one = saved(state, utc=utc.replace(tzinfo=UTC), enabled=enabled, model_file=name)
    found = reloaded(tmp_path, one)
    anew = state._replace(offsets=(), expected=())  # what touches have taught is not kept
    assert repr(found.state) == repr(anew)  # repr: every bit of a number, and NaN is NaN
    assert (found.utc, found.enabled) == (one.utc, enabled)
    assert (found.model_file, found.monotonic_s) == (name, one.monotonic_s)
    assert found.mismatches == one.mismatches


@pytest.mark.parametrize("why", TouchOutcome)
def test_why_an_offset_is_off_comes_back_and_of_an_older_program_that_it_is(
    tmp_path: Path, why: TouchOutcome
) -> None:
    machine = replace(MACHINE, touches={"Z_um": TouchRules(limits=Limits(8.0, 0.1))})
    names = [output.name for output in machine.model.outputs]
    offsets = tuple(OffsetState(off=why if name == "Z_um" else None) for name in names)
    file = StateFile(tmp_path / "state.json")
    file.save(saved(cycle_state(machine)._replace(offsets=offsets)), machine)
    found, _ = file.load(machine)
    assert found is not None
    assert found.state.offsets == offsets
    whole = json.loads(file.path.read_text(encoding="utf-8").partition("\n")[2])
    for void, expected in ((["Z_um"], TouchOutcome.NO_EFFECT), ({"Q_um": why}, None)):
        write_body(file.path, json.dumps({**whole, "touches_void": void}))
        found, _ = file.load(machine)
        assert found is not None
        assert {one.off for one in found.state.offsets if one.off} == ({expected} - {None})


def test_a_reloaded_state_goes_on_exactly_like_the_one_that_was_saved(tmp_path: Path) -> None:
    state = lived(MACHINE, 100)
    other = reloaded(tmp_path, saved(state)).state
    output = None
    for k in range(100, 200):
        reading = CycleReading(
            50.0 + k,
            (Sample(20.0 + 0.01 * k), Sample(20.0)),
            read_back_um=state.correction_um,
        )
        state, output = cycle(MACHINE, state, reading)
        other, again = cycle(MACHINE, other, reading)
        assert output.correction_um == again.correction_um
        assert output.model_um == again.model_um
    assert output is not None
    assert output.state is SupervisorState.ACTIVE


# ---- damage -------------------------------------------------------------------------------------


def one_file(folder: Path) -> Path:
    """Save, and return the file."""
    path = folder / "state.json"
    assert StateFile(path).save(saved(lived(MACHINE, 20)), MACHINE)
    return path


def why_not(path: Path) -> str | None:
    """Return the code of why nothing is taken up; None if something is."""
    found, why = StateFile(path).load(MACHINE)
    assert (found is None) is bool(why)
    return None if why is None else why.code


def test_a_file_that_is_torn_anywhere_is_damaged(tmp_path: Path) -> None:
    path = one_file(tmp_path)
    whole = path.read_bytes()
    for length in range(0, len(whole) - 1, 61):
        path.write_bytes(whole[:length])
        assert why_not(path) == "why-damaged"
    path.write_bytes(whole[:-1])  # but for its last line end it is whole
    assert why_not(path) is None


def test_a_bit_that_flips_anywhere_is_noticed(tmp_path: Path) -> None:
    path = one_file(tmp_path)
    whole = path.read_bytes()
    for k in range(0, 8 * len(whole), 101):
        flipped = bytearray(whole)
        flipped[k // 8] ^= 1 << k % 8
        path.write_bytes(flipped)
        assert why_not(path) == "why-damaged", k


def test_damage_says_of_which_kind_it_is(tmp_path: Path) -> None:
    path = one_file(tmp_path)
    path.write_bytes(b"\xff\xfe" * 100)
    values = {"file": "state.json", "detail": "UnicodeDecodeError"}
    assert StateFile(path).load(MACHINE) == (None, Message("why-damaged", values))
    path.unlink()
    assert StateFile(path).load(MACHINE) == (None, Message("why-no_file"))


def write_body(path: Path, body: str) -> None:
    """Write a state file whose checksum is right."""
    path.write_text(f"{sha256(body.encode()).hexdigest()}\n{body}\n", encoding="utf-8")


def test_a_file_with_a_right_checksum_and_wrong_content_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "state.json"
    head = '{"format": "thermaxis-loop-state", "version": 2'
    for body in (
        *("[]", "null", "{}", "[" * 100_000, f"{head}}}", f'{head}, "utc": 7}}'),
        *('{"format": "thermaxis-loop-state"}'),
    ):
        write_body(path, body)
        found, why = StateFile(path).load(MACHINE)
        assert (found, why and why.code) == (None, "why-damaged"), body[:99]


def test_a_state_of_another_version_is_not_guessed_at_and_leaves_it_off_with_an_alarm(
    tmp_path: Path,
) -> None:
    path = tmp_path / "state.json"
    write_body(path, '{"format": "thermaxis-loop-state", "version": 1}')
    other = Message("why-other_version", {"file": "state.json", "version": "1"})
    assert StateFile(path).load(MACHINE) == (None, other)
    _, loop = started(path, after_s=0.0)
    assert loop.status is not None
    assert (loop.status.output.state, loop.status.enabled) == (SupervisorState.OFF, False)
    assert "state_version" in alarms_of(loop)
    _, again = started(path, after_s=0.0)
    assert "state_version" not in alarms_of(again)
    write_body(path, '{"format": "thermaxis-loop-state", "version": "\\ud800"}')
    assert StateFile(path).load(MACHINE)[1] == replace(
        other, values={**other.values, "version": r"\ud800"}
    )


def test_a_field_that_is_missing_is_damage_or_a_beginning_anew(tmp_path: Path) -> None:
    path = one_file(tmp_path)
    whole = json.loads(path.read_text(encoding="utf-8").partition("\n")[2])
    thermal = whole["state"]["thermal"]
    for place in (whole, whole["state"], thermal):
        for key in sorted(place):
            kept = place.pop(key)
            write_body(path, json.dumps(whole))
            found, _ = StateFile(path).load(MACHINE)
            if place is thermal and found is not None:  # the model checks what is not its own
                _, output = cycle(MACHINE, found.state, CycleReading(90.0, WARM))
                assert math.isfinite(output.model_um[0]), key
            else:
                later = key in {"held_by", "judged", "mismatches", "touches_void"}  # not at first
                assert (found is None) is not later, key
            place[key] = kept


@pytest.mark.parametrize("name", ["\ud800", "\x1b[2J", "x" * 700_000, None, 7, ["Jana"]])
def test_a_name_that_nobody_can_have_is_told_as_text_that_is_short_and_printable(
    tmp_path: Path, name: object
) -> None:
    path = one_file(tmp_path)
    whole = json.loads(path.read_text(encoding="utf-8").partition("\n")[2])
    whole["held_by"] = whole["state"]["trims"][0][1] = name
    write_body(path, json.dumps(whole))
    found, why = StateFile(path).load(MACHINE)
    assert found is not None, why
    for told in (found.held_by, found.state.trims[0].who):
        assert told.isprintable()
        assert len(told) <= 200
        assert bool(told) is isinstance(name, str)


# ---- saved anew ---------------------------------------------------------------------------------


def test_what_was_saved_last_is_taken_whatever_the_clock_said(tmp_path: Path) -> None:
    path, state = tmp_path / "state.json", lived(MACHINE, 3)
    for k, utc in enumerate((NOW, NOW + timedelta(days=1), NOW - timedelta(days=1))):
        assert StateFile(path).save(saved(state, utc=utc, model_file=str(k)), MACHINE)
        found, _ = StateFile(path).load(MACHINE)
        assert found is not None
        assert found.model_file == str(k)


def test_a_full_disk_is_said_and_leaves_what_was_saved(tmp_path: Path) -> None:
    path = one_file(tmp_path)
    file, draft, before = StateFile(path), path.with_name("state.json.new"), path.read_bytes()
    draft.symlink_to("/dev/full")
    assert not file.save(saved(lived(MACHINE, 3)), MACHINE)
    assert file.failure == Message(
        "event-state_unsaved", {"file": "state.json", "detail": "No space left on device"}
    )
    assert path.read_bytes() == before
    draft.unlink()
    assert file.save(saved(lived(MACHINE, 3)), MACHINE)
    assert file.failure is None
    assert path.read_bytes() != before


# ---- what a restart takes up --------------------------------------------------------------------

SETTINGS = LoopSettings(
    machine="lathe", model_file="lathe.json", model_sha256=SHA, at_stop=AtStop.LEAVE
)


def test_a_state_of_before_a_restart_of_the_computer_is_put_on_the_new_clock(
    tmp_path: Path,
) -> None:
    found = reloaded(tmp_path, saved(lived(MACHINE, 300), monotonic_s=349.0))
    state, said = resumed(found, MACHINE, SETTINGS, now_s=12.0, age_s=4.0)
    assert said == Message("resumed-enabled", {"kept": Message("kept-sections")})
    assert state.time_s == pytest.approx(8.0)
    assert state.thermal.time_s == pytest.approx(8.0)
    assert state.thermal.sections == found.state.thermal.sections
    assert state.memory.state is SupervisorState.WARMING
    assert state.trims[0].left_s == pytest.approx(found.state.trims[0].left_s - 4.0)
    straight = lived(MACHINE, 300)
    for k in range(30):
        samples = (Sample(23.0), Sample(20.0))
        straight, wanted = cycle(MACHINE, straight, CycleReading(353.0 + k, samples))
        state, output = cycle(MACHINE, state, CycleReading(12.0 + k, samples))
        assert output.model_um == pytest.approx(wanted.model_um, rel=1e-12)


def test_a_state_older_than_the_model_s_gap_starts_at_the_steady_state_with_its_references(
    tmp_path: Path,
) -> None:
    found = reloaded(tmp_path, saved(lived(MACHINE, 300), monotonic_s=349.0))
    state, said = resumed(found, MACHINE, SETTINGS, now_s=5000.0, age_s=700.0)
    assert said.values["kept"] == Message("kept-steady_state")
    _, output = cycle(MACHINE, state, CycleReading(5000.0, (Sample(22.0), Sample(20.0))))
    assert output.model_um == pytest.approx((2.0 * (2.0 + 10.0 - 1.0),) * 2)  # reference 20, 20


def test_a_state_of_another_model_gives_its_references_only(tmp_path: Path) -> None:
    found = reloaded(tmp_path, saved(lived(MACHINE, 300), monotonic_s=349.0))
    machine = compensation(gain=5.0)
    other = LoopSettings(machine="lathe", model_file="new.json", model_sha256="cd" * 32)
    state, said = resumed(found, machine, other, now_s=350.0, age_s=1.0)
    kept = Message("kept-other_model", {"file": "lathe.json"})
    assert said == Message("resumed-off", {"kept": kept})
    assert state.correction_um == found.state.correction_um
    _, output = cycle(machine, state, CycleReading(350.0, (Sample(22.0), Sample(20.0))))
    assert output.model_um == pytest.approx((2.0 * (5.0 + 10.0 - 1.0),) * 2)


def test_a_state_of_other_channels_and_outputs_keeps_what_has_the_same_name(
    tmp_path: Path,
) -> None:
    state = lived(MACHINE, 300)
    state = state._replace(correction_um=(7.0, -3.0))
    assert StateFile(tmp_path / "state.json").save(saved(state), MACHINE)
    machine = compensation(channels=("new", "s"), outputs=("Y_um", "X_um"))
    found, _ = StateFile(tmp_path / "state.json").load(machine)
    assert found is not None
    assert found.state.correction_um == (0.0, -3.0)
    assert math.isnan(found.state.sensors[0].good_c)
    assert found.state.sensors[1][:3] == state.sensors[0][:3]
    reference = dict(zip(machine.model.channels, found.state.thermal.reference, strict=True))
    assert math.isnan(reference["new"])
    assert reference["s"] == 20.0
    new, output = cycle(machine, found.state, CycleReading(400.0, (Sample(31.0), Sample(22.0))))
    assert output.model_um == pytest.approx((11.0 * (0.0 - 2.0),) * 2)
    assert new.trims[1] == state.trims[1]


@pytest.mark.parametrize(
    ("changes", "enabled"),
    [({}, True), ({"resume_enabled": False}, False), ({"resume_within_s": 3.0}, False)],
)
def test_it_is_enabled_again_only_as_configured(changes: dict[str, float], enabled: bool) -> None:
    settings_ = LoopSettings(machine="m", model_file="m", model_sha256=SHA, **changes)
    state, said = resumed(saved(lived(MACHINE, 30)), MACHINE, settings_, now_s=360.0, age_s=4.0)
    assert state.memory.enabled is enabled
    wanted = SupervisorState.WARMING if enabled else SupervisorState.OFF
    assert state.memory.state is wanted
    assert said.code == ("resumed-enabled" if enabled else "resumed-off")


def test_a_fault_stands_after_a_restart_until_it_is_acknowledged() -> None:
    state = lived(MACHINE, 30)
    memory = state.memory._replace(
        state=SupervisorState.FAULT, fault=Reason.READ_BACK_DIFFERS, enabled=True
    )
    state, said = resumed(
        saved(state._replace(memory=memory)), MACHINE, SETTINGS, now_s=360.0, age_s=4.0
    )
    assert state.memory.state is SupervisorState.FAULT
    assert (said.code, said.values["reason"]) == ("resumed-fault", "read_back_differs")


def test_a_hold_and_a_trim_grow_older_while_nothing_runs() -> None:
    state = lived(MACHINE, 30)
    memory = state.memory._replace(held=True, held_s=100.0)
    state = state._replace(memory=memory, trims=(Trim(1.0, "Jana", 50.0), Trim(2.0, "Jana", 10.0)))
    state, _ = resumed(saved(state), MACHINE, SETTINGS, now_s=400.0, age_s=20.0)
    assert state.memory.held_s == pytest.approx(120.0)
    assert state.trims == (Trim(1.0, "Jana", 30.0), Trim())


# ---- in the loop --------------------------------------------------------------------------------


def started(path: Path, *, after_s: float) -> tuple[SimulatedHistorian, CompensationLoop]:
    """Run a loop for a few seconds, with a state that was saved before its time of day."""
    historian = SimulatedHistorian()
    machine = SimulatedMachine({"s": 22.0, "c": 20.0}, ("Z_um", "X_um"))

    async def life() -> CompensationLoop:
        loop = CompensationLoop(
            MACHINE,
            SETTINGS,
            Ports(
                SimulatedSource(machine),
                SimulatedSink(machine),
                historian,
                VirtualClock(NOW + timedelta(seconds=after_s)),
            ),
            state_file=StateFile(path),
        )
        await loop.run(asyncio.Event(), cycles=10)
        return loop

    return historian, run_in_virtual_time(life())


def test_the_age_of_the_state_decides_and_is_said(tmp_path: Path) -> None:
    newer = "event-saved_state_newer"
    for after_s, age_s, kept, enabled in (
        (30.0, 30.0, "kept-sections", True),
        (-5.0, 0.0, "kept-sections", True),  # the clock was set back a little
        (-60.0, None, newer, False),
        (86_400.0, 86_400.0, "kept-steady_state", False),
    ):
        path = tmp_path / f"{after_s}.json"
        StateFile(path).save(saved(lived(MACHINE, 300)), MACHINE)
        historian, loop = started(path, after_s=after_s)
        said = next(event for event in historian.events if event.kind == "start")
        assert said.values.get("age_s") == age_s
        resumed_as = said.values.get("resumed")
        told = resumed_as.values["kept"] if isinstance(resumed_as, Message) else Message(said.code)
        assert told == Message(kept)
        assert loop.status is not None
        assert loop.status.enabled is enabled


def test_a_full_disk_stops_no_cycle_and_is_told_once(tmp_path: Path) -> None:
    path = tmp_path / "state.json"
    (tmp_path / "state.json.new").symlink_to("/dev/full")
    historian, loop = started(path, after_s=0.0)
    assert loop.status is not None
    assert loop.status.number == 10
    assert [event.code for event in historian.events].count("event-state_unsaved") == 1
    (tmp_path / "state.json.new").unlink()
    historian, _ = started(path, after_s=0.0)
    assert StateFile(path).load(MACHINE)[0] is not None


def test_the_loop_saves_once_a_second_and_at_its_end(tmp_path: Path) -> None:
    path = tmp_path / "state.json"
    _, loop = started(path, after_s=0.0)
    found, _ = StateFile(path).load(MACHINE)
    assert found is not None
    assert found.utc == NOW + timedelta(seconds=9.0)
    assert loop.status is not None
    assert found.state.correction_um == loop.status.output.correction_um
