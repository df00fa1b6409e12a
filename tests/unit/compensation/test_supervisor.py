"""The table of transitions in the docs is what the program does; and what it does at the edges."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.unit.compensation.bench import RATE, RULES, Bench, away, lathe
from thermaxis.compensation import (
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
from thermaxis.errors import ConfigurationError

PAGE = Path(__file__).parents[3] / "docs" / "theory" / "supervisor.md"
OFF, WARMING, ACTIVE = SupervisorState.OFF, SupervisorState.WARMING, SupervisorState.ACTIVE
HOLDING, FADING, FAULT = SupervisorState.HOLDING, SupervisorState.FADING, SupervisorState.FAULT
ENABLE, DISABLE, HOLD = RequestKind.ENABLE, RequestKind.DISABLE, RequestKind.HOLD
RESUME, ACKNOWLEDGE = RequestKind.RESUME, RequestKind.ACKNOWLEDGE
LOST: dict[str, Any] = {"connected": False, "read_back_um": None}


def table() -> list[tuple[str, str, str, str]]:
    """Return the rows of the table in the docs."""
    text = PAGE.read_text(encoding="utf-8").split("<!-- table of transitions -->")[1]
    lines = [line for line in text.split("\n\n")[1].splitlines() if line.startswith("|")]
    rows = [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in lines[2:]]
    return [row for row in rows if len(row) == 4]


# What brings a bench in the row's state to the row's condition: the last cycle of each is the one
# that the row speaks about.
Scene = Callable[[Bench], Any]


def _long_away(bench: Bench) -> None:
    for _ in range(4):
        bench.step(read_back_um=away(bench))


def _at_limit(bench: Bench) -> None:
    hot = {"samples": (warm(-15.0),)}
    if bench.now is HOLDING:
        bench.compensation = lathe(hold_operator_s=50.0)
    bench.steps(6, **hot)


def warm(warmth_k: float) -> Any:
    return Sample(20.0 + warmth_k)


def _zero(bench: Bench) -> Bench:
    """Let it be at zero without changing its state."""
    bench.warmth_k = 0.0
    bench.step(found_um=(0.0,), seconds=0.0625)
    return bench


def _fade_to_zero(bench: Bench) -> Bench:
    while bench.um:
        bench.step(interlocks=(False,))
    return bench


def _expire_warming(bench: Bench) -> None:
    bench.steps(6, samples=())


SCENES: dict[tuple[str, str], Scene] = {
    ("Off", "not enabled"): lambda b: b.step(),
    ("Off", "enabled"): lambda b: b.step(ENABLE),
    ("any", "another compensation is active"): lambda b: b.step(other_compensation=True),
    ("any", "the read-back differs for longer than read_back_s"): _long_away,
    ("any", "a correction in force lies outside its total"): lambda b: b.step(found_um=(30.0,)),
    (
        "Active, Holding",
        "the model asks for more than the magnitude for longer than at_limit_s",
    ): _at_limit,
    ("any", "disabled, the correction is zero"): lambda b: b.step(DISABLE, found_um=(0.0,)),
    ("any", "disabled, the correction is not zero"): lambda b: b.step(DISABLE, found_um=(5.0,)),
    (
        "any",
        "disabled, the correction is zero, the machine cannot be reached",
    ): lambda b: (_zero(b), b.step(DISABLE, **LOST)),
    ("Warming", "everything there"): lambda b: b.steps(3),
    ("Warming", "expired, the correction is not zero"): lambda b: (
        b.step(found_um=(5.0,), samples=()),
        _expire_warming(b),
    ),
    ("Warming", "expired, the correction is zero"): lambda b: b.steps(9, samples=()),
    ("Warming", "blocked"): lambda b: b.step(),
    ("Active", "nothing blocks"): lambda b: b.step(samples=(warm(-7.0),)),
    ("Active", "the read-back differs"): lambda b: b.step(read_back_um=away(b)),
    ("Active", "the model has nothing to say"): lambda b: (
        setattr(b, "compensation", lathe(longest_hold_s=0.0, grace_s=9.0)),
        b.step(samples=()),
    ),
    ("Active", "expired"): lambda b: b.step(interlocks=(False,)),
    ("Active", "blocked"): lambda b: b.step(HOLD),
    ("Holding", "everything there"): lambda b: b.steps(1, requests=(request(RESUME),)),
    ("Holding", "expired"): lambda b: b.steps(6),
    ("Holding", "blocked"): lambda b: b.steps(5),
    ("Holding", "everything there again, not yet for heal_s"): lambda b: (
        b.step(RESUME, samples=()),
        b.step(samples=()),
        b.step(),
    ),
    ("Fading", "everything there"): lambda b: b.steps(2),
    ("Fading", "the correction is zero"): lambda b: _fade_to_zero(b).step(interlocks=(False,)),
    (
        "Fading",
        "the correction is zero, the machine cannot be reached",
    ): lambda b: _fade_to_zero(b).step(interlocks=(False,), **LOST),
    ("Fading", "blocked"): lambda b: b.step(interlocks=(False,)),
    ("Fading", "the read-back differs"): lambda b: b.step(
        interlocks=(False,), read_back_um=away(b)
    ),
    ("Fault", "acknowledged, the cause is gone"): lambda b: b.step(ACKNOWLEDGE),
    ("Fault", "acknowledged, the cause stands"): lambda b: b.step(
        ACKNOWLEDGE, other_compensation=True
    ),
    ("Fault", "not acknowledged"): lambda b: b.step(),
    ("Fault", "the machine keeps another offset"): lambda b: b.steps(3, read_back_um=(5.25,)),
}


def request(kind: RequestKind) -> Any:
    return Request(kind, "me")


def _cases() -> list[tuple[SupervisorState, str, str, str, str]]:
    cases: list[tuple[SupervisorState, str, str, str, str]] = []
    for row in table():
        names = (
            ["Warming", "Active", "Holding", "Fading"] if row[0] == "any" else row[0].split(", ")
        )
        cases.extend((SupervisorState(name), *row) for name in names)
    return cases


def test_the_docs_and_the_scenes_have_the_same_rows() -> None:
    rows = [(state, condition) for state, condition, _, _ in table()]
    assert sorted(rows) == sorted(SCENES)
    assert len(set(rows)) == len(rows) == 31


@pytest.mark.parametrize(("start", "states", "condition", "next_state", "moves"), _cases())
def test_every_row_of_the_docs_table_is_what_the_cycle_does(
    start: SupervisorState, states: str, condition: str, next_state: str, moves: str
) -> None:
    bench = Bench().to(start)
    SCENES[states, condition](bench)
    output = bench.output
    assert output is not None
    assert output.state is SupervisorState(next_state)
    before, after = output.before_um[0], output.correction_um[0]
    step_um = RATE * min(output.elapsed_s, 2.0)
    if moves == "stays":
        assert after == before
    elif moves == "follows":
        wanted = output.wanted_um[0]
        assert after == min(max(wanted, before - step_um), before + step_um)
        assert after != before or wanted == before
    elif moves == "goes to zero":
        assert after == max(0.0, before - step_um)
    elif moves == "goes to zero as far as the machine follows":
        assert after in {before, max(0.0, before - step_um)}
    else:
        assert moves == "waits for the machine"
        assert after == before


def test_the_reasons_in_the_docs_are_those_of_the_program() -> None:
    text = PAGE.read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| `")]
    said = {row[0].strip("`"): row[1] for row in rows if row[0].strip("`").isupper()}
    reasons = {reason.name: reason.value for reason in Reason}
    assert {name: said[name] for name in reasons} == reasons


def test_the_defaults_in_the_docs_are_those_of_the_program() -> None:
    text = PAGE.read_text(encoding="utf-8")
    rules = SupervisorRules()
    for name, said in (
        ("grace_s", "2 s"),
        ("hold_input_s", "300 s"),
        ("hold_connection_s", "300 s"),
        ("hold_interlock_s", "0 s"),
        ("hold_operator_s", "3600 s"),
        ("settle_s", "60 s"),
        ("at_limit_s", "600 s"),
    ):
        assert f"| `{name}` | {said} |" in text
        assert getattr(rules, name) == float(said.removesuffix(" s"))
    assert rules.patience_s == 3663.0
    assert "| 3663 s |" in text
    assert (rules.read_back_tolerance_um, rules.read_back_s) == (0.5, 10.0)
    assert (rules.longest_trim_s, rules.heal_s) == (28_800.0, 1.0)


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
    bench = Bench().to(ACTIVE)
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
    assert bench.output.reasons == (Reason.HEALING,)
    assert bench.step().state is ACTIVE


def test_an_interlock_may_be_held_for_a_time() -> None:
    bench = Bench(lathe(hold_interlock_s=2.0)).to(ACTIVE)
    states = [bench.step(interlocks=(False,)).state for _ in range(3)]
    assert states == [HOLDING, HOLDING, FADING]
    assert bench.output.reasons == (Reason.INTERLOCK_OPEN,)


@pytest.mark.parametrize("interlocks", [(), (False,), ("yes",), (2,), (float("nan"),)])
def test_an_interlock_that_is_missing_or_no_truth_is_not_met(interlocks: Any) -> None:
    bench = Bench().to(ACTIVE)
    bench.step(HOLD)
    assert bench.step(RESUME, interlocks=interlocks).state is FADING


def test_more_interlocks_than_configured_do_no_harm() -> None:
    assert Bench().to(ACTIVE).step(interlocks=(True, True, False)).state is ACTIVE


def test_a_hold_lasts_as_long_as_it_may_however_often_it_is_asked_for() -> None:
    bench = Bench().to(ACTIVE)
    states = [bench.step(HOLD).state for _ in range(8)]
    assert states == [HOLDING] * 6 + [FADING] * 2
    assert bench.output.reasons == (Reason.HOLD_EXPIRED,)
    assert bench.answer(RESUME) == (True, "the hold is ended")
    assert bench.now is ACTIVE


def test_what_comes_and_goes_is_not_held_for_ever() -> None:
    bench = Bench(lathe(heal_s=3.0)).to(ACTIVE)
    states = [bench.step(**(LOST if k % 2 == 0 else {})).state for k in range(40)]
    longest_s = RULES["hold_operator_s"] + RULES["settle_s"] + 3.0 + RULES["grace_s"]
    assert states.count(HOLDING) == longest_s + 1
    assert set(states[int(longest_s) + 1 :]) == {FADING, WARMING}
    assert bench.um == 0.0


def test_a_model_that_starts_anew_again_and_again_is_not_held_for_ever() -> None:
    bench = Bench().to(ACTIVE)
    states = [bench.step(seconds=-1.0 if k % 2 else 2.0).state for k in range(40)]
    assert states[:4] == [ACTIVE, HOLDING, HOLDING, HOLDING]
    assert states[-1] in {FADING, WARMING}


def test_a_clock_that_stands_still_is_a_lost_input() -> None:
    bench = Bench().to(ACTIVE)
    states = [bench.step(seconds=0.0).state for _ in range(7)]
    assert states == [ACTIVE, HOLDING, HOLDING, HOLDING, HOLDING, FADING, FADING]
    assert bench.um == 5.0
    bench = Bench().to(ACTIVE)
    states = [bench.step(time_s=float("nan")).state for _ in range(7)]
    assert states == [ACTIVE, HOLDING, HOLDING, HOLDING, HOLDING, FADING, FADING]


def test_no_fault_follows_from_a_single_cycle_however_long() -> None:
    bench = Bench().to(ACTIVE)
    assert bench.step(seconds=500.0, read_back_um=None).state is ACTIVE
    assert bench.step(seconds=1.0, read_back_um=None).state is FAULT
    bench = Bench().to(ACTIVE)
    assert bench.step(seconds=500.0, samples=(warm(-15.0),)).state is ACTIVE
    assert bench.step(seconds=1.0, samples=(warm(-15.0),)).state is FAULT


def test_a_read_back_that_returns_in_time_is_no_fault() -> None:
    bench = Bench().to(ACTIVE)
    assert [bench.step(read_back_um=away(bench)).state for _ in range(3)] == [ACTIVE] * 3
    assert bench.step().state is ACTIVE
    assert [bench.step(read_back_um=away(bench)).state for _ in range(3)] == [ACTIVE] * 3


def test_the_time_at_the_limit_begins_anew_when_it_is_left() -> None:
    bench = Bench().to(ACTIVE)
    hot = {"samples": (warm(-15.0),)}
    assert bench.steps(5, **hot).now is ACTIVE
    assert bench.step().state is ACTIVE
    assert bench.steps(5, **hot).now is ACTIVE
    assert bench.step(**hot).state is FAULT
    assert bench.output.reasons == (Reason.LONG_AT_LIMIT,)


def test_of_several_faults_the_gravest_is_named() -> None:
    bench = Bench().to(ACTIVE)
    bench.steps(5, samples=(warm(-15.0),), read_back_um=None)
    assert bench.now is FAULT
    assert bench.output.reasons == (Reason.READ_BACK_DIFFERS,)
    bench = Bench().to(ACTIVE)
    bench.step(found_um=(99.0,), other_compensation=True)
    assert bench.output.reasons == (Reason.DOUBLE_COMPENSATION,)


def test_off_watches_nothing() -> None:
    bench = Bench().to(OFF)
    bench.steps(20, read_back_um=away(bench), other_compensation=True, found_um=(99.0,))
    assert bench.now is OFF
    assert bench.um == 99.0


def test_a_fault_names_itself_until_it_is_acknowledged_and_then_stays_disabled() -> None:
    bench = Bench().to(FAULT)
    for _ in range(20):
        assert bench.step().reasons == (Reason.DOUBLE_COMPENSATION,)
    assert bench.um == 0.0
    assert bench.step(ACKNOWLEDGE).state is OFF
    assert bench.steps(5).now is OFF
    assert not bench.state.memory.enabled


def test_the_state_says_since_when() -> None:
    bench = Bench().to(ACTIVE)
    since_s = bench.output.since_s
    bench.steps(3)
    assert bench.output.since_s == since_s
    bench.step(HOLD)
    assert (bench.output.since_s, bench.output.in_state_s) == (bench.time_s, 0.0)
    assert bench.steps(2).output.in_state_s == 2.0
    bench = Bench().to(FAULT)
    assert bench.step(ACKNOWLEDGE, time_s=float("inf")).since_s == bench.time_s - 1.0


def test_settling_begins_anew_with_the_model() -> None:
    bench = Bench().to(ACTIVE)
    bench.state = with_compensation(bench.compensation, bench.compensation, bench.state)
    seen = [(bench.step().state, bench.output.reasons) for _ in range(4)]
    settling = (HOLDING, (Reason.SETTLING,))
    assert seen == [settling, settling, settling, (ACTIVE, ())]


def test_every_reason_is_said_at_once() -> None:
    bench = Bench().to(ACTIVE)
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
    rules = SupervisorRules(settle_s=3.0, heal_s=2.0)
    memory = Memory(enabled=True)
    for k in range(10):
        memory, _ = supervisor_step(rules, memory, WELL, float(k), 1.0)
    assert (memory.running_s, memory.ready_s) == (3.0, 2.0)
    lost = WELL._replace(inputs_usable=False)
    for k in range(3):
        memory, _ = supervisor_step(rules, memory, lost, 10.0 + k, 1e9)
    assert memory.input_lost_s == 1e9


def test_a_memory_that_is_calm_is_left_as_it_is_by_a_cycle_in_which_all_is_well() -> None:
    rules = SupervisorRules(settle_s=3.0)
    memory = Memory(enabled=True)
    for k in range(6):
        memory, _ = supervisor_step(rules, memory, WELL, float(k), 1.0)
    assert memory.state is ACTIVE
    assert memory.calm
    assert supervisor_step(rules, memory, WELL, 7.0, 1.0) == (memory, ())
    for change in (
        {"inputs_usable": False},
        {"model_runs": False},
        {"connected": False},
        {"interlocks_met": False},
        {"read_back_agrees": False},
        {"at_limit": True},
        {"other_compensation": True},
    ):
        after, _ = supervisor_step(rules, memory, WELL._replace(**change), 7.0, 1.0)
        assert not after.calm


@pytest.mark.parametrize("name", [*RULES, "longest_trim_s", "read_back_tolerance_um"])
@pytest.mark.parametrize("wrong", [-1.0, float("nan"), float("inf"), 86_401.0])
def test_no_time_is_without_an_end(name: str, wrong: float) -> None:
    with pytest.raises(ConfigurationError, match=name):
        SupervisorRules(**{name: wrong})


def test_the_longest_times_and_a_small_tolerance_are_taken_and_none_is_not() -> None:
    assert SupervisorRules(**dict.fromkeys(RULES, 86_400.0)).settle_s == 86_400.0
    assert SupervisorRules(read_back_tolerance_um=1e-9).read_back_tolerance_um == 1e-9
    with pytest.raises(ConfigurationError, match="read_back_tolerance_um"):
        SupervisorRules(read_back_tolerance_um=0.0)


def test_a_new_memory_is_off_and_has_counted_nothing() -> None:
    memory = Memory()
    assert memory.state is OFF
    assert memory.since_s != memory.since_s
    assert (memory.enabled, memory.held, memory.calm) == (False, False, False)
    assert memory.fault is None
    assert memory[5:-1] == (0.0,) * 9


def test_what_follows_from_the_rules_is_not_said_with_them() -> None:
    assert repr(SupervisorRules()).count("=") == 11
