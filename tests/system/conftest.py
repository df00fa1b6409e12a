"""A browser, started once a file; its thread is free for asyncio when the file has ended."""

import shutil
from collections.abc import Generator
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, expect, sync_playwright

from tests.in_time import LONGEST_S

expect.set_options(timeout=1e3 * LONGEST_S)
WITHOUT = (
    "WebUIOmniboxPopup",  # two pages of the window's own, drawn anew for each that is opened
    "WebUIOmniboxAimPopup",
    "HttpsUpgrades",  # these as everywhere where a browser is driven: what is said last counts
    "MediaRouter",
    "OptimizationHints",
    "PaintHolding",
)
"""What Chromium does beside the page."""


@pytest.fixture(scope="module")
def browser() -> Generator[Browser]:
    """Yield the system's Chromium; its pages are waited for patiently."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        pytest.fail("no chromium is installed: apt-get install chromium, as .ci/run does")
    without = f"--disable-features={','.join(WITHOUT)}"
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=path, args=[without]) as found,
    ):
        made = found.new_context

        def patient(**options: Any) -> BrowserContext:
            context = made(**options)
            context.set_default_timeout(1e3 * LONGEST_S)
            return context

        found.new_context = patient
        yield found
