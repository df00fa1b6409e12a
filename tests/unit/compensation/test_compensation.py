"""What a machine is compensated with fits together, or is refused with the place."""

from dataclasses import replace
from typing import Any

import pytest

from tests.unit.compensation.bench import lathe
from tests.unit.compensation.hostile import quick_lathe
from thermaxis.compensation import Compensation, Limits, SensorRules
from thermaxis.errors import ConfigurationError

RULES = SensorRules(lowest_c=1.0, highest_c=60.0)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"sensors": {}}, "there are no sensor rules of channel s"),
        ({"sensors": {"s": RULES, "w": RULES}}, "sensor rules are stated for w"),
        ({"limits": {}}, "there are no limits of output Z_um"),
        (
            {"limits": {"Z_um": Limits(1.0, 1.0), "Y_um": Limits(1.0, 1.0)}},
            "limits are stated for Y_um",
        ),
        ({"redundant": frozenset({"w"})}, "the model has no channel w"),
        ({"cycle_s": 0.09}, "the cycle is not from 0.1 to 60 s"),
        ({"cycle_s": 60.1}, "the cycle is not from 0.1 to 60 s"),
        ({"cycle_s": float("nan")}, "the cycle is not from 0.1 to 60 s"),
        ({"validity_margin_k": 0.0}, "validity_margin_k"),
        ({"validity_margin_k": 1.1e6}, "validity_margin_k"),
        ({"lowest_weight": -0.01}, "lowest_weight"),
        ({"lowest_weight": 1.01}, "lowest_weight"),
        ({"interlocks": ("on", "on")}, "two interlocks have the same name"),
        ({"interlocks": tuple(map(str, range(101)))}, "too many interlocks"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        replace(lathe(), **changes)


def test_the_ends_of_the_ranges_are_taken() -> None:
    for changes in (
        {"cycle_s": 0.1},
        {"cycle_s": 60.0},
        {"validity_margin_k": 1e6},
        {"lowest_weight": 1.0},
        {"lowest_weight": 0.0},
        {"interlocks": tuple(map(str, range(100)))},
    ):
        assert isinstance(replace(lathe(), **changes), Compensation)


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
