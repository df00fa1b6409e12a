"""The tables are what the cycle does and what the page shows; and what it does at the edges."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from tests.unit.compensation.bench import RATE, RULES, Rig, away, lathe
from thermaxis.compensation import (
    AnswerCode,
    Memory,
    Reason,
    Request,
    RequestKind,
    Sample,
    Signals,
    SupervisorRules,
    SupervisorState,
    supervisor_step,
    with_compensation,
)
from thermaxis.compensation._supervisor import (
    FAULTS,
    MOVEMENTS,
    TRANSITIONS,
    Condition,
    Motion,
    blockers,
)
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence

PAGE = Path(__file__).parents[3] / "docs" / "theory" / "supervisor.md"
OFF, WARMING, ACTIVE = SupervisorState.OFF, SupervisorState.WARMING, SupervisorState.ACTIVE
HOLDING, FADING, FAULT = SupervisorState.HOLDING, SupervisorState.FADING, SupervisorState.FAULT
ENABLE, DISABLE, HOLD = RequestKind.ENABLE, RequestKind.DISABLE, RequestKind.HOLD
RESUME, ACKNOWLEDGE = RequestKind.RESUME, RequestKind.ACKNOWLEDGE
LOST: dict[str, Any] = {"connected": False, "read_back_um": None}


# What brings a bench in a state to a row's condition: the last cycle of each is the one that the
# row speaks about.
Scene = Callable[[Rig], Any]


class Played(NamedTuple):
    """From a state by a scene: the rows that count then, written by hand, and what they say."""

    states: tuple[SupervisorState, ...]
    condition: Condition
    next_state: SupervisorState
    movement: Condition
    motion: Motion
    scene: Scene


def _long_away(bench: Rig) -> None:
    for _ in range(4):
        bench.step(read_back_um=away(bench))


def _at_limit(bench: Rig) -> None:
    hot = {"samples": (warm(-15.0),)}
    if bench.now is HOLDING:
        bench.compensation = lathe(hold_operator_s=50.0)
    bench.steps(6, **hot)


def warm(warmth_k: float) -> Any:
    return Sample(20.0 + warmth_k)


def _zero(bench: Rig) -> Rig:
    """Let it be at zero without changing its state."""
    bench.warmth_k = 0.0
    bench.step(found_um=(0.0,), seconds=0.0625)
    return bench


def _fade_to_zero(bench: Rig) -> Rig:
    while bench.um:
        bench.step(interlocks=(False,))
    return bench


def _expire_warming(bench: Rig) -> None:
    bench.steps(6, samples=())


ANY = (WARMING, ACTIVE, HOLDING, FADING)
C, OTHERWISE = Condition, Condition.OTHERWISE
STAYS, FOLLOWS, TO_ZERO = Motion.STAYS, Motion.FOLLOWS, Motion.TO_ZERO
WITH_MACHINE = Motion.TO_ZERO_WITH_MACHINE
PLAYED = (
    Played((OFF,), C.NOT_ENABLED, OFF, OTHERWISE, STAYS, lambda b: b.step()),
    Played((OFF,), OTHERWISE, WARMING, OTHERWISE, STAYS, lambda b: b.step(ENABLE)),
    Played(
        *(ANY, C.OTHER_COMPENSATION, FAULT, OTHERWISE, TO_ZERO),
        lambda b: b.step(other_compensation=True),
    ),
    Played(ANY, C.DIFFERS_LONG, FAULT, C.DIFFERS, WITH_MACHINE, _long_away),
    Played(ANY, C.OUTSIDE, FAULT, OTHERWISE, TO_ZERO, lambda b: b.step(found_um=(30.0,))),
    Played((ACTIVE, HOLDING), C.LONG_AT_LIMIT, FAULT, OTHERWISE, TO_ZERO, _at_limit),
    Played(
        *(ANY, C.NOT_ENABLED_AT_ZERO, OFF, OTHERWISE, STAYS),
        lambda b: b.step(DISABLE, found_um=(0.0,)),
    ),
    Played(
        *(ANY, C.NOT_ENABLED, FADING, OTHERWISE, TO_ZERO),
        lambda b: b.step(DISABLE, found_um=(5.0,)),
    ),
    Played(
        *(ANY, C.NOT_ENABLED, FADING, C.UNREACHABLE, TO_ZERO),
        lambda b: (_zero(b), b.step(DISABLE, **LOST)),
    ),
    Played((WARMING,), C.ALL_THERE, ACTIVE, OTHERWISE, FOLLOWS, lambda b: b.steps(3)),
    Played(
        *((WARMING,), C.EXPIRED_NOT_AT_ZERO, FADING, OTHERWISE, TO_ZERO),
        lambda b: (b.step(found_um=(5.0,), samples=()), _expire_warming(b)),
    ),
    Played((WARMING,), OTHERWISE, WARMING, OTHERWISE, STAYS, lambda b: b.steps(9, samples=())),
    Played((WARMING,), OTHERWISE, WARMING, OTHERWISE, STAYS, lambda b: b.step()),
    Played(
        *((ACTIVE,), C.NOTHING_BLOCKS, ACTIVE, OTHERWISE, FOLLOWS),
        lambda b: b.step(samples=(warm(-7.0),)),
    ),
    Played(
        *((ACTIVE,), C.NOTHING_BLOCKS, ACTIVE, C.DIFFERS, STAYS),
        lambda b: b.step(samples=(warm(-7.0),), read_back_um=away(b)),
    ),
    Played(
        *((ACTIVE,), C.NOTHING_BLOCKS, ACTIVE, C.NOTHING_TO_SAY, STAYS),
        lambda b: (
            setattr(b, "compensation", lathe(longest_hold_s=0.0, input_timeout_s=9.0)),
            b.step(samples=()),
        ),
    ),
    Played(
        *((ACTIVE,), C.EXPIRED, FADING, OTHERWISE, TO_ZERO),
        lambda b: b.step(interlocks=(False,)),
    ),
    Played((ACTIVE,), OTHERWISE, HOLDING, OTHERWISE, STAYS, lambda b: b.step(HOLD)),
    Played(
        *((HOLDING,), C.ALL_THERE, ACTIVE, OTHERWISE, FOLLOWS),
        lambda b: b.steps(1, requests=(request(RESUME),)),
    ),
    Played((HOLDING,), C.EXPIRED, FADING, OTHERWISE, TO_ZERO, lambda b: b.steps(6)),
    Played((HOLDING,), OTHERWISE, HOLDING, OTHERWISE, STAYS, lambda b: b.steps(5)),
    Played(  # everything there again, not yet for recovery_delay_s
        *((HOLDING,), OTHERWISE, HOLDING, OTHERWISE, STAYS),
        lambda b: (b.step(RESUME, samples=()), b.step(samples=()), b.step()),
    ),
    Played((FADING,), C.ALL_THERE, ACTIVE, OTHERWISE, FOLLOWS, lambda b: b.steps(2)),
    Played(
        *((FADING,), C.KNOWN_AT_ZERO, WARMING, OTHERWISE, STAYS),
        lambda b: _fade_to_zero(b).step(interlocks=(False,)),
    ),
    Played(
        *((FADING,), OTHERWISE, FADING, C.UNREACHABLE, TO_ZERO),
        lambda b: _fade_to_zero(b).step(interlocks=(False,), **LOST),
    ),
    Played(
        *((FADING,), OTHERWISE, FADING, OTHERWISE, TO_ZERO),
        lambda b: b.step(interlocks=(False,)),
    ),
    Played(
        *((FADING,), OTHERWISE, FADING, C.DIFFERS, STAYS),
        lambda b: b.step(interlocks=(False,), read_back_um=away(b)),
    ),
    Played(
        *((FADING,), OTHERWISE, FADING, C.UNREACHABLE, TO_ZERO),
        lambda b: b.step(interlocks=(False,), **LOST),
    ),
    Played((FAULT,), OTHERWISE, FAULT, OTHERWISE, TO_ZERO, lambda b: b.step()),
    Played((FAULT,), OTHERWISE, FAULT, C.UNREACHABLE, TO_ZERO, lambda b: b.step(**LOST)),
    Played(  # acknowledged, the cause stands
        *((FAULT,), OTHERWISE, FAULT, OTHERWISE, TO_ZERO),
        lambda b: b.step(ACKNOWLEDGE, other_compensation=True),
    ),
    Played(  # acknowledged, the cause is gone: the row is one of the state Fading then
        *((FAULT,), C.NOT_ENABLED, FADING, OTHERWISE, TO_ZERO),
        lambda b: b.step(ACKNOWLEDGE),
    ),
    Played(  # the machine keeps another offset
        *((FAULT,), OTHERWISE, FAULT, C.DIFFERS, WITH_MACHINE),
        lambda b: b.steps(3, read_back_um=(5.25,)),
    ),
)


def request(kind: RequestKind) -> Any:
    return Request(kind, "me")


def test_every_row_of_the_tables_is_played() -> None:
    played = {(s, p.condition, p.next_state) for p in PLAYED for s in p.states}
    rows = [(s, row.condition, row.next_state) for row in TRANSITIONS for s in row.states]
    assert played == {*rows, (FAULT, C.NOT_ENABLED, FADING)}
    assert len(set(rows)) == len(rows) == 37
    moved = {(p.next_state, p.movement, p.motion) for p in PLAYED}
    rows = [(s, row.condition, row.motion) for row in MOVEMENTS for s in row.states]
    assert moved == set(rows)
    assert len(moved) == len(rows) == 12


def test_whatever_happens_a_row_counts() -> None:
    for state in SupervisorState:
        for table in (TRANSITIONS, MOVEMENTS):
            last = [row.condition for row in table if state in row.states][-1]
            assert last is OTHERWISE, state


@pytest.mark.parametrize("start", list(SupervisorState))
def test_every_row_of_the_tables_is_what_the_cycle_does(start: SupervisorState) -> None:
    for number, played in enumerate(PLAYED):
        if start not in played.states:
            continue
        bench = Rig().to(start)
        played.scene(bench)
        output = bench.output
        assert output is not None
        row = f"row {number}: {played.condition}, {played.movement}"
        assert output.state is played.next_state, row
        before, after = output.before_um[0], output.correction_um[0]
        step_um = RATE * min(output.elapsed_s, 2.0)
        if played.motion is FOLLOWS:
            wanted = output.wanted_um[0]
            assert after == min(max(wanted, before - step_um), before + step_um), row
            assert after != before or wanted == before, row
        elif played.motion is TO_ZERO:
            assert after == max(0.0, before - step_um), row
        else:  # it stays, or waits for a machine that stands outside of the correction
            assert after == before, row


def _of(states: tuple[SupervisorState, ...]) -> str:
    return ", ".join(states)


def tables() -> dict[str, list[str]]:
    """Return the tables of the page, made from those of the program."""
    rules = SupervisorRules()
    lost = Memory(running_s=-1e9, held_s=1.0)
    return {
        "faults": [
            "| fault | in | condition |",
            *(f"| `{r.fault.name}` | {_of(r.states)} | {r.condition} |" for r in FAULTS if r.fault),
        ],
        "blockers": [
            "| reason | bridged for | then held for at most |",
            *(
                f"| `{b.reason.name}` | {b.bridged_s:g} s | "
                + ("without end |" if b.held_s > 1e9 else f"{b.held_s:g} s |")
                for b in blockers(rules, lost)
            ),
        ],
        "transitions": [
            "| state | condition | next state |",
            *(
                f"| {_of(r.states)} | {r.condition} | {r.next_state} |"
                for r in TRANSITIONS
                if r not in FAULTS
            ),
        ],
        "movements": [
            "| state | condition | the correction |",
            *(f"| {_of(r.states)} | {r.condition} | {r.motion} |" for r in MOVEMENTS),
        ],
    }


def test_the_page_shows_the_tables_of_the_program() -> None:
    for name, (head, *rows) in tables().items():
        wanted = "\n".join((head, "|---" * head.count(" | ") + "|---|", *rows))
        shown = PAGE.read_text(encoding="utf-8").split(f"<!-- table of {name} -->\n\n")[1]
        assert shown.split("\n\n")[0] == wanted, f"the page should have\n\n{wanted}\n"


def test_the_reasons_in_the_docs_are_those_of_the_program() -> None:
    text = PAGE.read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| `")]
    said = {row[0].strip("`"): row[1] for row in rows if row[0].strip("`").isupper()}
    reasons = {reason.name: sentence(f"reason-{reason}") for reason in Reason}
    assert {name: said[name] for name in reasons} == reasons


def test_the_defaults_in_the_docs_are_those_of_the_program() -> None:
    text = PAGE.read_text(encoding="utf-8")
    rules = SupervisorRules()
    for name, said in (
        ("input_timeout_s", "2 s"),
        ("hold_input_s", "300 s"),
        ("hold_connection_s", "300 s"),
        ("hold_interlock_s", "0 s"),
        ("hold_operator_s", "3600 s"),
        ("settle_s", "60 s"),
        ("at_limit_s", "600 s"),
    ):
        assert f"| `{name}` | {said} |" in text
        assert getattr(rules, name) == float(said.removesuffix(" s"))
    assert rules.max_hold_s == 3663.0
    assert "| 3663 s |" in text
    assert (rules.read_back_tolerance_um, rules.read_back_s) == (0.5, 10.0)
    assert (rules.longest_trim_s, rules.recovery_delay_s) == (28_800.0, 1.0)


# ---- times: one cycle before, and at -------------------------------------------------------------


@pytest.mark.parametrize(
    ("loss", "reason", "held"),
    [
        ({"samples": ()}, Reason.INPUT_BAD, 4),
        ({"interlocks": (None,)}, Reason.INPUT_BAD, 4),
        ({"other_compensation": None}, Reason.INPUT_BAD, 4),
        (LOST, Reason.CONNECTION_LOST, 4),
    ],
)
def test_a_loss_is_bridged_then_held_for_its_time_and_then_fades(
    loss: dict[str, Any], reason: Reason, held: int
) -> None:
    bench = Rig().to(ACTIVE)
    if reason is Reason.INPUT_BAD:
        assert bench.step(**loss).state is ACTIVE
    for _ in range(held):
        output = bench.step(**loss)
        assert output.state is HOLDING
        assert output.reasons == (reason,)
        assert bench.um == 5.0
    assert bench.step(**loss).state is FADING
    assert bench.um == 4.0
    assert bench.step().state is FADING
    assert bench.output.reasons == (Reason.RECOVERING,)
    assert bench.step().state is ACTIVE


def test_an_interlock_may_be_held_for_a_time() -> None:
    bench = Rig(lathe(hold_interlock_s=2.0)).to(ACTIVE)
    states = [bench.step(interlocks=(False,)).state for _ in range(3)]
    assert states == [HOLDING, HOLDING, FADING]
    assert bench.output.reasons == (Reason.INTERLOCK_OPEN,)


def test_an_interlock_that_is_missing_or_no_truth_is_not_met_and_further_ones_do_no_harm() -> None:
    for interlocks in ((), (False,), ("yes",), (2,), (float("nan"),)):
        bench = Rig().to(ACTIVE)
        bench.step(HOLD)
        assert bench.step(RESUME, interlocks=interlocks).state is FADING, interlocks
    assert Rig().to(ACTIVE).step(interlocks=(True, True, False)).state is ACTIVE


def test_a_hold_lasts_as_long_as_it_may_however_often_it_is_asked_for() -> None:
    bench = Rig().to(ACTIVE)
    states = [bench.step(HOLD).state for _ in range(8)]
    assert states == [HOLDING] * 6 + [FADING] * 2
    assert bench.output.reasons == (Reason.HOLD_EXPIRED,)
    assert bench.answer(RESUME) == (True, AnswerCode.RESUMED)
    assert bench.now is ACTIVE


def test_a_hold_is_expired_when_it_has_lasted_for_longer_than_it_may() -> None:
    bench = Rig().to(ACTIVE)
    bench.step(HOLD)
    assert bench.steps(5).output.reasons == (Reason.OPERATOR_HOLD,)
    assert bench.state.memory.held_s == RULES["hold_operator_s"]
    assert bench.step(seconds=1e-6).reasons == (Reason.HOLD_EXPIRED,)


def test_what_comes_and_goes_is_not_held_for_ever() -> None:
    bench = Rig(lathe(recovery_delay_s=3.0)).to(ACTIVE)
    states = [bench.step(**(LOST if k % 2 == 0 else {})).state for k in range(40)]
    longest_s = RULES["hold_operator_s"] + RULES["settle_s"] + 3.0 + RULES["input_timeout_s"]
    assert states.count(HOLDING) == longest_s + 1
    assert set(states[int(longest_s) + 1 :]) == {FADING, WARMING}
    assert bench.um == 0.0


def test_a_model_that_starts_anew_again_and_again_is_not_held_for_ever() -> None:
    bench = Rig().to(ACTIVE)
    states = [bench.step(seconds=-1.0 if k % 2 else 2.0).state for k in range(40)]
    assert states[:4] == [ACTIVE, HOLDING, HOLDING, HOLDING]
    assert states[-1] in {FADING, WARMING}


def test_a_clock_that_stands_still_is_a_lost_input() -> None:
    bench = Rig().to(ACTIVE)
    states = [bench.step(seconds=0.0).state for _ in range(7)]
    assert states == [ACTIVE, HOLDING, HOLDING, HOLDING, HOLDING, FADING, FADING]
    assert bench.um == 5.0
    bench = Rig().to(ACTIVE)
    states = [bench.step(time_s=float("nan")).state for _ in range(7)]
    assert states == [ACTIVE, HOLDING, HOLDING, HOLDING, HOLDING, FADING, FADING]


def test_no_fault_follows_from_a_single_cycle_however_long() -> None:
    bench = Rig().to(ACTIVE)
    assert bench.step(seconds=500.0, read_back_um=None).state is ACTIVE
    assert bench.step(seconds=1.0, read_back_um=None).state is FAULT
    bench = Rig().to(ACTIVE)
    assert bench.step(seconds=500.0, samples=(warm(-15.0),)).state is ACTIVE
    assert bench.step(seconds=1.0, samples=(warm(-15.0),)).state is FAULT


def test_a_read_back_that_returns_in_time_is_no_fault() -> None:
    bench = Rig().to(ACTIVE)
    assert [bench.step(read_back_um=away(bench)).state for _ in range(3)] == [ACTIVE] * 3
    assert bench.step().state is ACTIVE
    assert [bench.step(read_back_um=away(bench)).state for _ in range(3)] == [ACTIVE] * 3


def test_the_time_at_the_limit_begins_anew_when_it_is_left() -> None:
    bench = Rig().to(ACTIVE)
    hot = {"samples": (warm(-15.0),)}
    assert bench.steps(5, **hot).now is ACTIVE
    assert bench.step().state is ACTIVE
    assert bench.steps(5, **hot).now is ACTIVE
    assert bench.step(**hot).state is FAULT
    assert bench.output.reasons == (Reason.LONG_AT_LIMIT,)


def test_of_several_faults_the_gravest_is_named() -> None:
    bench = Rig().to(ACTIVE)
    bench.steps(5, samples=(warm(-15.0),), read_back_um=None)
    assert bench.now is FAULT
    assert bench.output.reasons == (Reason.READ_BACK_DIFFERS,)
    bench = Rig().to(ACTIVE)
    bench.step(found_um=(99.0,), other_compensation=True)
    assert bench.output.reasons == (Reason.DOUBLE_COMPENSATION,)


def test_off_watches_nothing() -> None:
    bench = Rig().to(OFF)
    bench.steps(20, read_back_um=away(bench), other_compensation=True, found_um=(99.0,))
    assert bench.now is OFF
    assert bench.um == 99.0


def test_a_fault_names_itself_until_it_is_acknowledged_and_then_stays_disabled() -> None:
    bench = Rig().to(FAULT)
    for _ in range(20):
        assert bench.step().reasons == (Reason.DOUBLE_COMPENSATION,)
    assert bench.um == 0.0
    assert bench.step(ACKNOWLEDGE).state is OFF
    assert bench.steps(5).now is OFF
    assert not bench.state.memory.enabled


def test_the_state_says_since_when() -> None:
    bench = Rig().to(ACTIVE)
    since_s = bench.output.since_s
    bench.steps(3)
    assert bench.output.since_s == since_s
    bench.step(HOLD)
    assert (bench.output.since_s, bench.output.in_state_s) == (bench.time_s, 0.0)
    assert bench.steps(2).output.in_state_s == 2.0
    bench = Rig().to(FAULT)
    assert bench.step(ACKNOWLEDGE, time_s=float("inf")).since_s == bench.time_s - 1.0


def test_settling_begins_anew_with_the_model() -> None:
    bench = Rig().to(ACTIVE)
    bench.state = with_compensation(bench.compensation, bench.compensation, bench.state)
    seen = [(bench.step().state, bench.output.reasons) for _ in range(4)]
    settling = (HOLDING, (Reason.SETTLING,))
    assert seen == [settling, settling, settling, (ACTIVE, ())]


def test_every_reason_is_said_at_once() -> None:
    bench = Rig().to(ACTIVE)
    bench.step(HOLD)
    loss = {"samples": (), "interlocks": (False,), **LOST}
    output = bench.steps(3, **loss).output
    assert output.reasons == (
        Reason.CONNECTION_LOST,
        Reason.INTERLOCK_OPEN,
        Reason.INPUT_BAD,
        Reason.OPERATOR_HOLD,
    )


WELL = Signals(
    inputs_usable=True,
    model_runs=True,
    connected=True,
    interlocks_met=True,
    read_back_agrees=True,
    at_limit=False,
    other_compensation=False,
    offset_outside=False,
    at_zero=True,
)


def test_times_are_counted_no_further_than_asked() -> None:
    rules = SupervisorRules(settle_s=3.0, recovery_delay_s=2.0)
    memory = Memory(enabled=True)
    for k in range(10):
        memory = supervisor_step(rules, memory, WELL, float(k), 1.0).memory
    assert (memory.running_s, memory.ready_s) == (3.0, 2.0)
    lost = WELL._replace(inputs_usable=False)
    for k in range(3):
        memory = supervisor_step(rules, memory, lost, 10.0 + k, 1e9).memory
    assert memory.input_lost_s == 1e9


def test_a_memory_in_which_nothing_is_counted_is_left_as_it_is_while_all_is_well() -> None:
    rules = SupervisorRules(settle_s=3.0)
    memory = Memory(enabled=True)
    for k in range(6):
        memory = supervisor_step(rules, memory, WELL, float(k), 1.0).memory
    assert memory.state is ACTIVE
    assert supervisor_step(rules, memory, WELL, 7.0, 1.0) == (memory, (), FOLLOWS)
    for change in (
        {"inputs_usable": False},
        {"model_runs": False},
        {"connected": False},
        {"interlocks_met": False},
        {"read_back_agrees": False},
        {"at_limit": True},
        {"other_compensation": True},
    ):
        assert supervisor_step(rules, memory, WELL._replace(**change), 7.0, 1.0).memory != memory


def test_no_time_is_without_an_end() -> None:
    for name in (*RULES, "longest_trim_s", "read_back_tolerance_um"):
        for wrong in (-1.0, float("nan"), float("inf"), 86_401.0):
            with pytest.raises(ConfigurationError) as error:
                SupervisorRules(**{name: wrong})
            assert error.value.place.key == name


def test_the_longest_times_and_a_small_tolerance_are_taken_and_none_is_not() -> None:
    assert SupervisorRules(**dict.fromkeys(RULES, 86_400.0)).settle_s == 86_400.0
    assert SupervisorRules(read_back_tolerance_um=1e-9).read_back_tolerance_um == 1e-9
    with pytest.raises(ConfigurationError, match="read_back_tolerance_um"):
        SupervisorRules(read_back_tolerance_um=0.0)
