"""What a machine is compensated with fits together, or is refused with the place."""

from dataclasses import replace

import pytest

from tests.refusals import refused
from tests.unit.compensation.bench import lathe
from tests.unit.compensation.hostile import quick_lathe
from thermaxis.compensation import Compensation, Limits, SensorRules

RULES = SensorRules(lowest_c=1.0, highest_c=60.0)
TWICE = {"Z_um": Limits(1.0, 1.0), "Y_um": Limits(1.0, 1.0)}


def test_what_does_not_fit_is_refused_at_its_place() -> None:
    for changes, code, values in (
        ({"sensors": {}}, "entries_missing", {"names": ("s",)}),
        ({"sensors": {"s": RULES, "w": RULES}}, "unknown_name", {"name": "w", "known": ("s",)}),
        ({"limits": {}}, "entries_missing", {"names": ("Z_um",)}),
        ({"limits": TWICE}, "unknown_name", {"name": "Y_um", "known": ("Z_um",)}),
        ({"redundant": frozenset({"w"})}, "unknown_name", {"name": "w", "known": ("s",)}),
        ({"cycle_s": 0.09}, "outside_range", {"value": 0.09, "least": 0.1, "most": 60.0}),
        ({"cycle_s": 60.1}, "outside_range", {"value": 60.1, "least": 0.1, "most": 60.0}),
        ({"cycle_s": float("nan")}, "outside_range", {"least": 0.1, "most": 60.0}),
        ({"validity_margin_k": 0.0}, "not_positive_up_to", {"value": 0.0, "most": 1e6}),
        ({"validity_margin_k": 1.1e6}, "not_positive_up_to", {"value": 1.1e6, "most": 1e6}),
        ({"lowest_weight": -0.01}, "outside_range", {"value": -0.01, "least": 0.0, "most": 1.0}),
        ({"lowest_weight": 1.01}, "outside_range", {"value": 1.01, "least": 0.0, "most": 1.0}),
        ({"interlocks": ("on", "on")}, "stated_twice", {"name": "on"}),
        (
            {"interlocks": tuple(map(str, range(101)))},
            *("outside_count", {"count": 101, "least": 0, "most": 100}),
        ),
    ):
        with refused(code, key=next(iter(changes)), **values):
            replace(lathe(), **changes)
    for changes in (
        {"cycle_s": 0.1},
        {"cycle_s": 60.0},
        {"validity_margin_k": 1e6},
        {"lowest_weight": 1.0},
        {"lowest_weight": 0.0},
        {"interlocks": tuple(map(str, range(100)))},
    ):
        assert isinstance(replace(lathe(), **changes), Compensation)


def test_an_input_moves_with_another_one_that_is_judged_and_never_with_itself() -> None:
    def stated(**moves_with: str) -> dict[str, SensorRules]:
        plain = dict.fromkeys(("s", "a", "t"), RULES)
        rests = {n: replace(RULES, moves_with=w, rests_k=1.0) for n, w in moves_with.items()}
        return plain | rests

    found = replace(quick_lathe(), sensors={**stated(s="room", a="s"), "room": RULES})
    assert found.judged == ("s", "a", "t", "room")
    assert found.witnesses == (3, 0, -1, -1)
    for sensors, code, values in (
        (stated(s="room"), "entries_missing", {"names": ("room",)}),
        (stated(s="s"), "moves_with_itself", {"name": "s"}),
        (stated(s="a", a="s"), "moves_with_itself", {}),
        (stated(s="a", a="t", t="a"), "moves_with_itself", {}),
        (
            {**stated(s="a"), "a": replace(RULES, frozen_s=0.0)},
            *("witness_may_stand", {"name": "a"}),
        ),
    ):
        with refused(code, key="sensors", **values):
            replace(quick_lathe(), sensors=sensors)


def test_rules_and_limits_stand_in_the_order_of_the_model() -> None:
    compensation = quick_lathe()
    assert compensation.model.channels == ("s", "a", "t")
    assert [rules.frozen_s for rules in compensation.rules] == [30.0, 0.0, 0.0]
    assert [bounds.largest_um for bounds in compensation.bounds] == [20.0, 9.0]


def test_rules_cannot_be_changed_behind_its_back() -> None:
    sensors = {"s": RULES}
    compensation = replace(lathe(), sensors=sensors)
    sensors["s"] = replace(RULES, highest_c=1e6)
    assert compensation.sensors["s"].highest_c == 60.0
    with pytest.raises(TypeError):
        compensation.sensors["s"] = RULES
