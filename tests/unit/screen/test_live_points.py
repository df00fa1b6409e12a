"""What a page has seen itself: gaps stay gaps, and a clock that was set back loses nothing new."""

import random
from typing import Any

from tests.unit.screen.page_script import said_by
from thermaxis.web import asset_folder

SCRIPT = asset_folder() / "live_points.js"


def said(body: str) -> Any:
    """Return what a script says that has the module's functions."""
    text = f"""
const {{ addPoint, withGaps, joined }} = await import("file://{SCRIPT}");
process.stdout.write(JSON.stringify((() => {{ {body} }})()));
"""
    return said_by(text)


def test_a_pause_between_two_values_is_a_gap() -> None:
    found = said("return withGaps({ t: [0, 5, 10, 60, 65], y: [1, 2, null, 4, 5] }, 15);")
    assert found == {"x": [0, 5, 10, 11, 60, 65], "y": [1, 2, None, None, 4, 5]}


def test_a_clock_that_is_set_back_takes_away_what_is_later_and_goes_on() -> None:
    found = said(
        """
        const points = { t: [], y: [] };
        for (const at of [100, 110, 120, 120, 105, 112, NaN, 300]) addPoint(points, at, at, 150);
        return points;
        """
    )
    assert found == {"t": [300], "y": [300]}
    found = said(
        """
        const points = { t: [], y: [] };
        for (const at of [100, 110, 120, 120, 105, 112]) addPoint(points, at, at, 150);
        return points;
        """
    )
    assert found == {"t": [100, 105, 112], "y": [100, 105, 112]}


def test_times_always_grow_end_with_the_newest_and_are_no_older_than_the_span() -> None:
    chance = random.Random(1)  # noqa: S311 - examples
    runs = [chance.choices(range(400), k=chance.randint(1, 30)) for _ in range(200)]
    every = said(
        f"""
        return {runs}.map((times) => {{
          const points = {{ t: [], y: [] }};
          for (const at of times) addPoint(points, at, -at, 100);
          return points;
        }});
        """
    )
    for times, found in zip(runs, every, strict=True):
        assert found["t"] == sorted(set(found["t"]))
        assert found["t"][-1] == times[-1]
        assert found["t"][0] >= times[-1] - 100
        assert found["y"] == [-at for at in found["t"]]


def test_what_was_seen_follows_what_is_stored_with_the_pause_between_them() -> None:
    stored = "{ t: [0, 10, 20, 30], y: [0, 1, null, 3] }"
    near = said(f"return joined({stored}, {{ t: [25, 35, 40], y: [7, 8, 9] }}, 1000, 6);")
    assert near == {"x": [0, 10, 20, 30, 35, 40], "y": [0, 1, None, 3, 8, 9]}
    far = said(f"return joined({stored}, {{ t: [100, 105, 200], y: [7, 8, 9] }}, 1000, 6);")
    assert far == {
        "x": [0, 10, 20, 30, 31, 100, 105, 106, 200],
        "y": [0, 1, None, 3, None, 7, 8, None, 9],
    }
    none = said(f"return joined({stored}, {{ t: [5], y: [7] }}, 1000, 6);")
    assert none == {"x": [0, 10, 20, 30], "y": [0, 1, None, 3]}
    alone = said("return joined({ t: [], y: [] }, { t: [5, 6], y: [7, 8] }, 1000, 6);")
    assert alone == {"x": [5, 6], "y": [7, 8]}


def test_what_is_stored_of_the_time_after_a_clock_was_set_back_does_not_hide_what_is_seen() -> None:
    found = said("return joined({ t: [0, 10, 500], y: [0, 1, 2] }, { t: [15], y: [3] }, 20, 60);")
    assert found == {"x": [0, 10, 15], "y": [0, 1, 3]}
