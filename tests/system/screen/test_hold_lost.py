"""A hold that the machine's watchdog took back while the loop stood still is told on the page."""

import signal
import time
from collections.abc import Callable, Generator
from typing import Final

import pytest

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import Rig, wait_until

Look = Callable[..., Looked]
STOPPED_S: Final = 13.0
"""Longer than the lathe's watchdog, which waits for 10 s. [s]"""
SAID: Final = {
    "en-GB": "The offset of Z was found at 0.0 µm; it had been left at ",
    "de-DE": "Der Versatz von Z wurde bei 0,0 µm gefunden; verlassen worden war er bei ",
    "cs-CZ": "Posun Z byl nalezen na 0,0 µm; ponechán byl na ",
}


@pytest.fixture
def stopped(tmp_path_factory: pytest.TempPathFactory) -> Generator[Rig]:
    """Yield a stand of its own, whose loop is stopped; anybody may look."""
    with Rig(tmp_path_factory.mktemp("stopped"), view_without_login=True) as found:
        yield found


def test_a_hold_that_lost_its_value_is_an_alarm_in_every_language_until_acknowledged(
    look: Look, stopped: Rig
) -> None:
    operator = stopped.visitor()
    assert operator.log_in("operator").status == 200
    operator.enable()
    wait_until("a correction", lambda: abs(stopped.offset_um()) > 15.0)
    assert operator.request("Hold")["answer"] == "accepted"
    stopped.wait_cycles(3)
    held_um = stopped.offset_um()
    stopped.programs["run"].signal(signal.SIGSTOP)
    try:
        time.sleep(STOPPED_S)  # the lathe's watchdog runs in real time
        assert abs(stopped.offset_um()) < 0.05
    finally:
        stopped.programs["run"].signal(signal.SIGCONT)
    for locale, said in SAID.items():
        seen = look(of=stopped, locale=locale)
        seen.open("/")
        seen.wait_live()
        text = seen.page.locator("#alarm-text")
        wait_until(said, lambda text=text, said=said: said in text.inner_text())
        number = text.inner_text().partition(said)[2].split()[0].replace("−", "-")
        assert float(number.replace(",", ".")) == pytest.approx(held_um, abs=0.2)
        assert seen.unexpected() == []
    assert [event for event in stopped.events() if "had been left at" in event["text"]]
    operator = stopped.visitor()  # the session at the loop did not outlive its standstill
    assert operator.log_in("operator").status == 200
    cookies = [
        {"name": c.name, "value": c.value or "", "url": seen.address} for c in operator.cookies
    ]
    seen.context.add_cookies(cookies)
    seen.open("/")
    seen.wait_live()
    button = seen.page.locator('[data-ask="Acknowledge"]')
    wait_until("it can be acknowledged", button.is_enabled)
    button.click()
    dialog = seen.page.locator("dialog.ask")
    assert said in dialog.inner_text()
    dialog.locator("button.main").click()
    wait_until("no alarm", lambda: said not in text.inner_text())
    wait_until("nothing to acknowledge", button.is_disabled)
    wait_until("effective", lambda: "✓" in seen.page.locator("[data-requests]").inner_text())
