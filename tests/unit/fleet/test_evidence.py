"""What carries a naming: the sign that departs, night by night, beyond its limits."""

from datetime import timedelta

import pytest

from tests.unit.fleet.test_judging import LAST, fleet, named
from thermaxis.fleet import Evidence, StoredNight, evidence_of


def shown(nights: list[StoredNight]) -> list[Evidence]:
    (one,) = named(nights)
    return evidence_of(one, [night for night in nights if night.machine == one.machine])


def weaken(night: StoredNight) -> None:
    """Let the touches of a night say next to nothing."""
    for one in night.result["touched"]:
        for numbers in one["day"].values():
            numbers[:] = [1e-4 * number for number in numbers]


@pytest.mark.parametrize(
    ("key", "departure", "unit", "last"),
    [
        (("level", "", "T_a_C"), 2.0, "K", 2.0),
        (("swap", "Z_um", "T_a_C,T_b_C"), 1.0, "%", 100.0),
        (("gain", "Z_um", "a"), 0.3, "%", 30.0),
        (("time_constant", "Z_um", "a"), 0.34, "%", 40.0),
        (("mean", "Z_um", ""), 5.0, "µm", 5.0),
        (("rest", "Z_um", ""), 1.0, "%", 172.0),
    ],
)
def test_the_sign_of_the_cause_is_shown_from_the_past_to_beyond_its_limits(
    key, departure, unit, last
):
    one = shown(fleet({("M7", key): [0.0, 0.0, departure, departure]}, 1))[0]
    assert (one.of, one.unit) == (key[2] or key[1], unit)
    assert one.days == tuple(LAST - timedelta(days=k) for k in (3, 2, 1, 0))
    before, *_, now = one.departures
    low, high = one.limits
    assert (low is None) == (key[0] in {"swap", "rest"})
    assert low is None or low < before
    assert before < high < now
    assert now == pytest.approx(last, rel=0.2)
    for departs, (below, above) in zip(one.departures, one.twice_std, strict=True):
        assert below < departs < above


def test_a_night_that_tells_nothing_is_left_out_and_what_goes_on_over_it_stays():
    key = ("mean", "Z_um", "")
    nights = fleet({("M7", key): [0.0, 0.0, 5.0, 5.0]}, 1)
    told = shown(nights)[0]
    (sunday,) = [n for n in nights if (n.machine, n.day) == ("M7", LAST - timedelta(days=2))]
    weaken(sunday)
    one = shown(nights)[0]
    assert one.days == (told.days[0], *told.days[2:])
    assert one.departures == (told.departures[0], *told.departures[2:])
    judged = named(nights)[0]
    for night in nights:
        weaken(night)
    assert evidence_of(judged, [night for night in nights if night.machine == "M7"]) == []


def test_a_sensor_that_stands_still_has_no_figure():
    code = {"code": "log-stuck", "values": {}, "place": {"channel": "T_a_C"}}
    nights = fleet({})
    for night in nights:
        if (night.machine, night.day) == ("M1", LAST):
            night.result["sensor_codes"].append(code)
    assert shown(nights) == []


def test_nights_of_another_model_are_no_past():
    nights = fleet({("M7", ("gain", "Z_um", "a")): [0.0, 0.0, 0.3, 0.3]}, 1)
    (one,) = named(nights)
    own = [night for night in nights if night.machine == one.machine]
    first = StoredNight(*(getattr(own[0], k) for k in ("machine", "kind", "day")), "b", "0", {})
    assert evidence_of(one, [first, *own[1:]])[0].days == tuple(night.day for night in own[1:])
