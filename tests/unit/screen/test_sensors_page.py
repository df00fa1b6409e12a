"""The sensors' page: noise, rules, and who may see them."""

import dataclasses
import json
import math
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tests.unit.screen.engineer_bench import CHANNELS, told_by_a_loop
from tests.unit.screen.stand import Feed, client, lathe, parts
from thermaxis.screen.pages import sensors_page
from thermaxis.screen.pages.sensors_page import LEAST_VALUES, facts_of, noise_of, values_of

STATUS = told_by_a_loop(lathe(), dict.fromkeys(CHANNELS, 21.0), seconds=20)


def values(feed: Feed) -> Any:
    """Return what the page's script is told."""
    return client(parts(lathe(), feed), sensors_page.routes).get("/sensors/values").json()


# ---- noise --------------------------------------------------------------------------------------


@given(seed=st.integers(0, 10_000), deviation_k=st.floats(0.01, 1.0), slope=st.floats(-0.02, 0.02))
def test_noise_is_found_again_beneath_a_warming_and_as_numpy_finds_it(
    seed: int, deviation_k: float, slope: float
) -> None:
    noise_k = np.random.default_rng(seed).normal(0.0, deviation_k, 300)
    slope_k = slope * deviation_k * 10.0
    values = [(float(k), 20.0 + slope_k * k + float(noise_k[k])) for k in range(300)]
    found = noise_of(values)
    assert found.values == 300
    assert found.deviation_k == pytest.approx(deviation_k, rel=0.25)
    y = np.array([v for _, v in values])
    assert found.deviation_k == pytest.approx(float(np.sqrt(np.mean(np.diff(y) ** 2) / 2.0)))


def test_a_ramp_of_a_kelvin_a_minute_is_nearly_no_noise_though_it_scatters_widely() -> None:
    values = [(float(k), 20.0 + k / 60.0) for k in range(300)]
    found = noise_of(values)
    assert found.deviation_k == pytest.approx(1.0 / 60.0 / math.sqrt(2.0))
    assert float(np.std([v for _, v in values])) > 1.0


def test_values_that_jump_between_two_levels_have_a_noise_known_by_hand() -> None:
    values = [(float(k), 20.0 + 0.1 * (-1) ** k) for k in range(100)]
    assert noise_of(values).deviation_k == pytest.approx(0.1 * math.sqrt(2.0))
    assert noise_of([(float(k), 20.5) for k in range(60)]).deviation_k == 0.0


def test_below_thirty_values_no_noise_is_told() -> None:
    for count in (LEAST_VALUES - 1, LEAST_VALUES):
        found = noise_of([(float(k), 20.0 + 0.1 * (k % 3)) for k in range(count)])
        assert found.values == count
        assert (found.deviation_k is not None) is (count == LEAST_VALUES)


def test_what_changed_while_nothing_came_is_no_noise_and_old_values_do_not_count() -> None:
    first = [(float(k), 20.0 + 0.1 * (k % 2)) for k in range(50)]
    later = [(200.0 + k, 35.0 + 0.1 * (k % 2)) for k in range(50)]
    both = noise_of([*first, *later])
    assert both.values == 100
    assert both.deviation_k == pytest.approx(0.1 / math.sqrt(2.0))
    much_later = [(2000.0 + k, 35.0) for k in range(50)]
    assert noise_of([*first, *much_later]) == (0.0, 50)


# ---- rules and values ---------------------------------------------------------------------------


def test_every_channel_redundant_interlock_and_flag_of_the_configuration_is_told() -> None:
    configuration = lathe()
    facts = json.loads(json.dumps(facts_of(configuration)))
    assert {c["name"]: c["redundant"] for c in facts["channels"]} == {
        name: f"{name}.redundant" for name in CHANNELS
    }
    first = facts["channels"][0]
    assert first["rules"] == dataclasses.asdict(configuration.rules.sensors[first["name"]])
    assert {i["signal"] for i in facts["interlocks"]} <= set(STATUS["signals"])
    assert {i["name"]: i["met"] for i in facts["interlocks"]} == {
        name: flag.value for name, flag in configuration.interlocks.items()
    }
    assert facts["other_compensation"] is True
    assert facts["diameter_read"] is True
    assert facts["others"] == ["diameter", "probe.Z_um"]


def test_values_carry_noise_and_the_last_minutes_by_the_time_of_day() -> None:
    feed = Feed(STATUS)
    feed.fill(("T_spindle_C",), 25.0, 0.05, 290)
    found = values(feed)
    assert found["least"] == LEAST_VALUES
    assert set(found["values"]) == {n for c in CHANNELS for n in (c, f"{c}.redundant")}
    spindle = found["values"]["T_spindle_C"]
    assert spindle["noise_k"] == pytest.approx(0.05, rel=0.15)
    assert spindle["count"] == len(spindle["t"]) == len(spindle["y"]) == 290
    last = feed.latest.received_utc
    assert last is not None
    assert spindle["t"][-1] == round(last.timestamp() * 1000)
    assert spindle["t"][-1] - spindle["t"][0] == 289_000
    column = found["values"]["T_column_C"]
    assert column == {"noise_k": None, "count": 0, "t": [], "y": []}


def test_a_pause_between_two_values_is_a_gap() -> None:
    told = Feed(STATUS).latest
    found = values_of(told, ((0.0, 1.0), (5.0, 2.0), (20.0, 4.0), (25.0, 5.0)), 10.0)
    assert found["y"] == [1.0, 2.0, None, 4.0, 5.0]
    assert [t - found["t"][0] for t in found["t"]] == [0, 5000, 19_999, 20_000, 25_000]


def test_without_a_status_there_are_rules_and_no_values() -> None:
    found = values(Feed(None))
    assert {value["count"] for value in found["values"].values()} == {0}


def test_the_page_has_the_rules_and_whatever_else_is_read_a_row() -> None:
    page = client(parts(lathe()), sensors_page.routes).get("/sensors").text
    assert re.findall('data-channel="(.*?)"', page) == list(CHANNELS)
    assert "5.0 to 80.0 °C" in page
    for name in STATUS["signals"]:
        assert f'["signals", "{name}"' in page, name
