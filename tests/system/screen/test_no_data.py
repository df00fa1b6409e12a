"""Loss and return: the page says by its own clock that there are no data, and recovers itself."""

import re
import signal
import time
from collections.abc import Callable, Generator
from typing import Final

import pytest

from tests.in_time import in_time
from tests.system.screen.conftest import Looked
from tests.system.screen.stand import CYCLE_S, Rig, wait_until

Look = Callable[..., Looked]
SOON_S: Final = 4.0
"""So soon at the latest the page says that there are no data. [s]"""
BACK_S: Final = 20.0
"""So soon at the latest it is back after the loop's or the screen's start. [s]"""


@pytest.fixture(scope="module")
def lonely(tmp_path_factory: pytest.TempPathFactory) -> Generator[Rig]:
    """Yield a stand whose parts are stopped and killed; anybody may look."""
    with Rig(tmp_path_factory.mktemp("lonely"), view_without_login=True) as found:
        yield found


@pytest.fixture
def watched(look: Look, lonely: Rig) -> Looked:
    """Return the operator's page with fresh values."""
    seen = look(of=lonely)
    seen.open("/")
    seen.wait_live()
    return seen


def wait_no_data(seen: Looked, since_s: float) -> float:
    """Wait for the words, and return how long they took. [s]"""
    wait_until("NO DATA", lambda: seen.page.locator("#no-data").is_visible())
    took_s = time.monotonic() - since_s
    text = seen.page.locator("#no-data").inner_text()
    assert re.search(r"NO DATA since \d\d:\d\d:\d\d", text, re.IGNORECASE), text
    assert seen.page.locator("body").get_attribute("data-live") == "no"
    assert seen.page.locator('[data-ask="Enable"]').is_disabled()
    return took_s


def wait_back(seen: Looked) -> None:
    began_s = time.monotonic()
    seen.wait_live()
    assert in_time(time.monotonic() - began_s, BACK_S)
    wait_until("the words go", lambda: not seen.page.locator("#no-data").is_visible())


@pytest.mark.parametrize("part", ["run", "screen"])
def test_a_part_that_stands_still_is_told_within_four_seconds_and_forgotten_when_it_goes_on(
    watched: Looked, lonely: Rig, part: str
) -> None:
    loads = watched.loads
    since_s = lonely.programs[part].signal(signal.SIGSTOP)
    try:
        assert in_time(wait_no_data(watched, since_s), SOON_S)
    finally:
        lonely.programs[part].signal(signal.SIGCONT)
    wait_back(watched)
    assert watched.loads == loads, "the page was loaded again for nothing"
    assert watched.unexpected() == []


def test_the_loop_is_killed_and_comes_back(watched: Looked, lonely: Rig) -> None:
    loads = watched.loads
    since_s = time.monotonic()
    lonely.kill("run")
    assert in_time(wait_no_data(watched, since_s), SOON_S)
    lonely.start_loop()
    wait_back(watched)
    assert watched.loads == loads
    assert watched.unexpected() == []


def test_the_screen_is_killed_and_comes_back(watched: Looked, lonely: Rig) -> None:
    since_s = time.monotonic()
    lonely.kill("screen")
    assert in_time(wait_no_data(watched, since_s), SOON_S)
    lonely.start_screen()
    wait_back(watched)
    assert watched.unexpected() == []


def test_the_death_of_the_screen_does_not_touch_the_loop(watched: Looked, lonely: Rig) -> None:
    lonely.kill("run")
    lonely.start_loop("--enable")
    wait_until("an offset in the lathe", lambda: abs(lonely.offset_um()) > 5.0)
    before = lonely.lathe_values("heartbeat")[0]
    lonely.kill("screen")
    first = lonely.lathe_values("heartbeat")[0]
    began_s = time.monotonic()
    wait_until("the loop goes on writing", lambda: lonely.lathe_values("heartbeat")[0] >= first + 8)
    assert first >= before
    assert in_time(time.monotonic() - began_s, 8 * CYCLE_S + 2.0)
    lonely.start_screen()
    wait_back(watched)
