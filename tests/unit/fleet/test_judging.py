"""Who is named in the morning: who departs from its past, its sisters in the same nights aside."""

from dataclasses import replace
from datetime import date, timedelta

import numpy as np
import pytest

from thermaxis.fleet import Cause, Judgement, StoredNight, judge
from thermaxis.messages import remedy_of, text_of

LAST = date(2026, 11, 20)
MACHINES, NIGHTS = 60, 4
FIGURES = {
    ("level", "", "T_a_C"): 0.2,
    ("level", "", "T_b_C"): 0.2,
    ("level", "", "T_c_C"): 0.2,
    ("swap", "Z_um", "T_a_C,T_b_C"): 0.05,
    ("gain", "Z_um", "a"): 0.02,
    ("time_constant", "Z_um", "a"): 0.03,
    ("mean", "Z_um", ""): 0.4,
    ("rest", "Z_um", ""): 0.1,
}
"""Standard deviations of the signs from night to night."""
Departures = dict[tuple[str, tuple[str, str, str]], list[float]]


TOUCHED = [key for key in FIGURES if key[0] in {"mean", "gain", "time_constant", "swap"}]
TOUCHED.sort(key=lambda key: ("mean", "gain", "time_constant", "swap").index(key[0]))


def equations(values: list[float], stds: list[float]) -> dict[str, list[float]]:
    """Return the normal equations of unknowns that say nothing of each other."""
    weight = np.array(stds) ** -2.0
    upper = np.diag(weight)[np.triu_indices(weight.size)]
    return {"matrix": upper.tolist(), "vector": (weight * values).tolist()}


def fleet(departures: Departures, seed: int = 0, hot: float = 0.0) -> list[StoredNight]:
    """Return nights of machines by chance, with what departs added, on all of them if it is hot."""
    rng = np.random.default_rng(seed)
    nights: list[StoredNight] = []
    for name in (f"M{k}" for k in range(MACHINES)):
        for back in range(NIGHTS - 1, -1, -1):
            value = {}
            for key, std in FIGURES.items():
                more = departures.get((name, key), [0.0] * NIGHTS)[-1 - back]
                value[key] = rng.normal(more, std) + hot * std * (back == 0)
            signs = [
                dict(zip(("sign", "output", "of"), key, strict=True))
                | {"value": value[key], "std": std, "before": 0.0, "before_std": std / 6**0.5}
                for key, std in FIGURES.items()
                if key not in TOUCHED
            ]
            stds = [FIGURES[key] for key in TOUCHED]
            touched = {
                "output": "Z_um",
                "columns": [[key[0], key[2]] for key in TOUCHED],
                "day": equations([value[key] for key in TOUCHED], stds),
                "before": equations([0.0] * len(stds), [std / 6**0.5 for std in stds]),
                "datum_set": False,
            }
            result = {"signs": signs, "touched": [touched], "sensor_codes": []}
            day = LAST - timedelta(days=back)
            nights.append(StoredNight(name, "mill", day, "a" * 64, "1", result))
    return nights


def shift(night: StoredNight, apart: float, kinds: set[str]) -> None:
    """Move what a night and the days before it say of signs."""
    for sign in night.result["signs"]:
        if sign["sign"] in kinds:
            sign["value"] += apart
            sign["before"] += apart
    for one in night.result["touched"]:
        for which in ("day", "before"):
            k = np.flatnonzero([kind in kinds for kind, _ in one["columns"]])
            size = len(one["columns"])
            diagonal = np.cumsum([0, *range(size, 1, -1)])
            for at in k:
                one[which]["vector"][at] += apart * one[which]["matrix"][diagonal[at]]


def named(nights: list[StoredNight]) -> list[Judgement]:
    judged = judge(nights, LAST)
    assert len(judged) == len({night.machine for night in nights})
    assert [one.named for one in judged] == sorted((one.named for one in judged), reverse=True)
    return [one for one in judged if one.named]


@pytest.mark.parametrize("hot", [0.0, 6.0])
def test_nobody_is_named_for_what_chance_or_a_hot_day_does_to_all(hot):
    assert [one for seed in range(5) for one in named(fleet({}, seed, hot))] == []


@pytest.mark.parametrize(
    ("key", "departure", "cause"),
    [
        (("level", "", "T_a_C"), 2.0, Cause.SENSOR_OFFSET),
        (("swap", "Z_um", "T_a_C,T_b_C"), 1.0, Cause.SENSORS_SWAPPED),
        (("gain", "Z_um", "a"), 0.3, Cause.GAIN),
        (("time_constant", "Z_um", "a"), 0.34, Cause.TIME_CONSTANT),
        (("mean", "Z_um", ""), 5.0, Cause.DRIFT),
        (("rest", "Z_um", ""), 1.0, Cause.UNKNOWN),
    ],
)
@pytest.mark.parametrize("hot", [0.0, 6.0])
def test_a_machine_that_departs_is_named_with_its_cause_day_and_sentence(
    key, departure, cause, hot
):
    (one,) = named(fleet({("M7", key): [0.0, 0.0, departure, departure]}, 1, hot))
    assert (one.machine, one.causes[0], one.output) == ("M7", cause, key[1])
    assert abs((LAST - one.since).days - 1) <= 1
    assert one.q_value < 0.01
    for language in ("en", "de", "cs"):
        assert text_of(one.evidence[0], language=language)
        assert remedy_of(one.evidence[0], language=language)


def test_two_sensors_that_are_off_by_as_much_are_not_called_exchanged():
    up, down = ("level", "", "T_a_C"), ("level", "", "T_c_C")
    (one,) = named(fleet({("M7", up): [0, 0, 2.0, 2.0], ("M7", down): [0, 0, -2.0, -2.0]}, 1))
    assert one.causes == (Cause.SENSOR_OFFSET,)


@pytest.mark.parametrize("departure", [0.65, 4.0])
def test_what_lies_far_from_exchanged_sensors_is_not_called_exchanged(departure):
    key = ("swap", "Z_um", "T_a_C,T_b_C")
    assert named(fleet({("M7", key): [0.0, 0.0, departure, departure]}, 1)) == []


@pytest.mark.parametrize("apart", [0.5, 3.0])
@pytest.mark.parametrize(
    ("machines", "kind"), [(2, "mill"), (4, "mill"), (60, "mill"), (60, "own")]
)
def test_a_past_that_was_always_another_than_its_sisters_names_nobody(machines, kind, apart):
    nights = [night for night in fleet({}) if int(night.machine[1:]) < machines]
    for k, night in enumerate(nights):
        if night.machine == "M1":
            nights[k] = replace(night, kind=kind)
            shift(night, apart, {"level", "rest", "gain", "time_constant", "mean"})
    assert named(nights) == []


def test_a_slow_drift_is_found_by_lasting():
    key = ("mean", "Z_um", "")
    for departure, expected in (([0.0, 0.0, 0.0, 1.2], []), ([1.2, 1.2, 1.2, 1.2], ["M3"])):
        found = named(fleet({("M3", key): departure}, 3))
        assert [one.machine for one in found] == expected


def test_a_sensor_that_stands_still_is_named_unless_those_of_its_sisters_do_as_well():
    code = {"code": "log-stuck", "values": {}, "place": {"channel": "T_a_C"}}
    nights = fleet({})
    for night in nights:
        if night.machine == "M1" and night.day > LAST - timedelta(days=2):
            night.result["sensor_codes"].append(code)
    (one,) = named(nights)
    assert (one.machine, one.causes, one.since) == (
        "M1", (Cause.SENSOR_FROZEN,), LAST - timedelta(days=1),
    )  # fmt: skip
    for night in nights:
        night.result["sensor_codes"] = [code]
    assert named(nights) == []


def test_a_machine_without_a_night_of_the_day_is_not_judged_and_another_model_begins_anew():
    key = ("gain", "Z_um", "a")
    nights = fleet({("M7", key): [0.3] * NIGHTS})
    assert len(judge([one for one in nights if one.machine != "M7"], LAST)) == MACHINES - 1
    assert judge([], LAST) == []
    old = [
        StoredNight(n.machine, n.kind, n.day, "b" * 64, n.version, n.result)
        if n.machine == "M7" and n.day < LAST
        else n
        for n in fleet({("M7", key): [0.3, 0.3, 0.3, 0.0]})
    ]
    assert named(old) == []


def test_a_departure_is_the_least_squares_change_beside_the_machine_as_it_was():
    """Against numpy's own least squares on the rows themselves, in place of normal equations."""
    rng = np.random.default_rng(5)
    change, kinds = 0.4, ["mean", "gain", "time_constant"]
    rows = [rng.normal(size=(48, 3)) * (1.0, 3.0, 1.0) for _ in range(NIGHTS + 1)]
    seen = [x @ (1.5, 0.05, 0.02) + rng.normal(size=48) for x in rows]
    for night in (-2, -1):
        seen[night] += change * rows[night][:, 1]

    def summed(x: np.ndarray, y: np.ndarray) -> dict[str, list[float]]:
        return {
            "matrix": (x.T @ x)[np.triu_indices(3)].tolist(),
            "vector": (x.T @ y).tolist(),
        }

    nights = []
    for name in (f"M{k}" for k in range(MACHINES)):
        of = 1.0 if name == "M7" else 0.0
        for k in range(NIGHTS):
            touched = {"output": "Z_um", "columns": [[kind, "a" * (kind != "mean")]
                       for kind in kinds], "datum_set": False,
                       "day": summed(rows[k + 1], of * seen[k + 1]),
                       "before": summed(rows[0], of * seen[0])}  # fmt: skip
            day = LAST - timedelta(days=NIGHTS - 1 - k)
            nights.append(StoredNight(name, "mill", day, "a" * 64, "1", {"touched": [touched]}))
    (one,) = named(nights)
    assert (one.machine, one.causes[0]) == ("M7", Cause.GAIN)
    known = np.diag([0.0, 1 / 0.3, 1 / 0.6])
    # what the model was learnt from says nothing of the mean
    learnt = rows[0] - rows[0][:, :1] * (rows[0].T @ rows[0])[0] / (rows[0][:, 0] @ rows[0][:, 0])
    changed = np.concatenate([np.zeros(48 * (NIGHTS - 1)), *(x[:, 1] for x in rows[-2:])])
    every = np.concatenate([*rows, learnt, known])
    design = np.column_stack([every, np.append(changed, np.zeros(51))])
    solved = np.linalg.lstsq(design, np.append(np.concatenate(seen), np.zeros(51)))[0]
    assert one.evidence[0].values["departure_percent"] == pytest.approx(100.0 * solved[3])
    assert (LAST - one.since).days == 1
