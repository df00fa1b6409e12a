"""The app as people have it: its command, and somebody's page of it."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, Self

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect

from thermaxis.cli import main
from thermaxis.messages import LANGUAGES
from thermaxis.web import LANGUAGE_COOKIE

EXAMPLES = Path(__file__).parents[3] / "examples"
SIZES = ((1366, 768, "light"), (1920, 1080, "dark"), (390, 844, "light"), (390, 844, "dark"))
"""Windows and phones, by day and by night."""
LONGEST_MS = 300_000.0
FAULTS: dict[Page, list[str]] = {}
"""What the browser disliked, by page."""
DROP = """([selector, name, text]) => {
  const files = new DataTransfer();
  files.items.add(new File([text], name));
  const event = new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true });
  document.querySelector(selector).dispatchEvent(event);
}"""


class App:
    """A running `thermaxis app`, with its temporary files in a folder of the test."""

    def __init__(self, where: Path) -> None:
        self.where = where
        words = [sys.executable, "-m", "thermaxis", "app", "--port", "0", "--no-browser"]
        with (where / "said.txt").open("w") as said:  # nobody reads it while the app runs
            self.program = subprocess.Popen(
                words,
                stdout=subprocess.PIPE,
                stderr=said,
                text=True,
                env={**os.environ, "TMPDIR": str(where), "XDG_CONFIG_HOME": str(where / "own")},
            )
        assert self.program.stdout is not None
        self.address = self.program.stdout.readline().strip()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.program.poll() is None:
            self.program.send_signal(signal.SIGINT)
        self.program.communicate(timeout=LONGEST_MS / 1e3)


def opened(browser: Browser, app: App, *, language: str = "en", **look: Any) -> Page:
    """Return the page of somebody whose browser says if it dislikes anything."""
    context = browser.new_context(
        **{"locale": language, "viewport": {"width": 1366, "height": 768}, **look}
    )
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    FAULTS[page] = faults
    page.goto(app.address)
    return page


def readable(page: Page) -> None:
    """Hold that a page is for everybody and as wide as the window, in every language and size."""
    for language in LANGUAGES:
        page.context.add_cookies([{"name": LANGUAGE_COOKIE, "value": language, "url": page.url}])
        for width, height, scheme in SIZES if language == "de" else SIZES[-1:]:
            page.set_viewport_size({"width": width, "height": height})
            page.emulate_media(color_scheme=scheme)
            page.reload()
            expect(page.locator("html")).to_have_attribute("lang", re.compile(language))
            expect(page.locator(".chart-plot > svg").first).to_be_visible()
            found = Axe().run(page)
            assert found.violations_count == 0, found.generate_report()
            across = page.evaluate("() => document.documentElement.scrollWidth - innerWidth")
            assert across <= 0, (language, width)


def command(*words: object) -> None:
    """Do what a command does, in this program: its start takes longer than its work."""
    assert main([str(word) for word in words]) == 0
