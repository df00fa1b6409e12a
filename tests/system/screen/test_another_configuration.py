"""A loop that was started with another configuration than the screen: every page says so."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from tests.system.screen import operator_stand_in
from tests.system.screen.conftest import Looked
from tests.system.screen.operator_browser import LOCALES, SCROLLS
from tests.system.screen.operator_stand_in import EXAMPLE, StandIn, served
from tests.unit.screen.stand import parts
from thermaxis import __version__
from thermaxis.messages import sentence
from thermaxis.runtime import read_machine
from thermaxis.runtime.config import configuration_sha256
from thermaxis.screen.access import ScreenParts

SIZES = ((1024, 600), (1920, 1080))


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> Iterator[StandIn]:
    own = configuration_sha256(read_machine(EXAMPLE))

    def known(*given: Any, **more: Any) -> ScreenParts:
        return replace(parts(*given, **more), configuration_sha256=own)

    monkeypatch.setattr(operator_stand_in, "parts", known)
    with served(StandIn()) as found:
        yield found


def live(page: Page, stand_in: StandIn) -> None:
    page.goto(stand_in.address)
    page.wait_for_selector('body[data-live="yes"]')


def test_it_is_said_while_the_hashes_differ_and_only_then(
    browser: Browser, stand_in: StandIn
) -> None:
    own = configuration_sha256(read_machine(EXAMPLE))
    with browser.new_context(locale="en-GB") as context:
        page = context.new_page()
        live(page, stand_in)  # the loop tells none, and is believed
        page.wait_for_selector("#beat-text:not(:empty)")
        assert not page.locator("#differs").is_visible()
        stand_in.status["configuration_sha256"] = "ab" * 32
        page.wait_for_selector("#differs", state="visible")
        assert page.inner_text("#differs") == sentence("common-differs")
        stand_in.status["configuration_sha256"] = own
        page.wait_for_selector("#differs", state="hidden")
        stand_in.status["configuration_sha256"] = "cd" * 32
        page.wait_for_selector("#differs", state="visible")
        stand_in.live = False
        page.wait_for_selector("#differs", state="hidden")  # nobody knows what it runs with now


def test_where_the_versions_differ_too_they_are_what_is_said(
    browser: Browser, stand_in: StandIn
) -> None:
    language = "cs"
    with browser.new_context(locale=LOCALES[language]) as context:
        page = context.new_page()
        stand_in.status |= {"configuration_sha256": "ab" * 32, "program_version": "9.8.7 <b>"}
        live(page, stand_in)
        page.wait_for_selector("#differs")
        said = sentence(
            "common-differs_version", {"told": "9.8.7 <b>", "own": __version__}, language=language
        )
        assert page.inner_text("#differs") == said
        stand_in.status["program_version"] = __version__
        page.wait_for_function(
            "said => document.getElementById('differs').innerText === said",
            arg=sentence("common-differs", language=language),
        )
        stand_in.status |= {
            "configuration_sha256": configuration_sha256(read_machine(EXAMPLE)),
            "program_version": "9.8.7",
        }
        page.wait_for_selector("#differs", state="hidden")  # the rules are the same all the same


@pytest.mark.parametrize("language", LOCALES)
def test_the_page_says_it_in_its_language_and_does_not_scroll(
    browser: Browser, stand_in: StandIn, language: str
) -> None:
    stand_in.status["configuration_sha256"] = "ab" * 32
    for width, height in SIZES:
        size = {"width": width, "height": height}
        with browser.new_context(viewport=size, locale=LOCALES[language]) as context:
            page = context.new_page()
            live(page, stand_in)
            page.wait_for_selector("#differs")
            assert page.inner_text("#differs") == sentence("common-differs", language=language)
            assert max(page.evaluate(SCROLLS)) <= 0, (width, height)


def test_loop_and_screen_that_were_started_with_one_file_agree(look: Callable[..., Looked]) -> None:
    seen = look("viewer")
    page = seen.open("/")
    own = page.get_attribute("body", "data-configuration") or ""
    assert len(own) == 64
    with page.expect_websocket() as sockets:
        page.reload()
    with sockets.value.expect_event(
        "framereceived", lambda frame: '"kind":"status"' in str(frame)
    ) as frame:
        pass
    assert f'"configuration_sha256":"{own}"' in str(frame.value)
    seen.wait_live()
    assert not page.locator("#differs").is_visible()
