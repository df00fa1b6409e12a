"""Make the pictures of the operator's page: a virtual lathe, its loop, the screen and a browser.

python -m docs.images.draw_screen [--folder DIR] [--wait SECONDS]
"""

import argparse
import io
import os
import shutil
import signal
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from tests.system.screen.stand import Rig

WIDTH, HEIGHT = 1280, 720
COLOURS = 128
"""Colours of a picture: the page has few, and the file stays small. [1]"""
LARGEST_BYTES = 150_000
"""Largest file. [byte]"""


def intervene(page: Page, stand: Rig) -> None:
    """Log in as operator, enable the compensation and trim by 1 µm.

    Parameters
    ----------
    page : Page
        A page of the browser.
    stand : Rig
        Whose screen.
    """
    page.goto(f"{stand.address}/login")
    page.fill("input[name=name]", "operator")
    page.fill("input[name=password]", stand.passwords["operator"])
    page.click("button.main")
    page.wait_for_selector('body[data-live="yes"]')
    page.click('[data-ask="Enable"]')
    page.click("dialog button.main")
    page.wait_for_selector('#op[data-state="Active"]', timeout=60_000)
    page.click('[data-ask="Trim"]')
    page.locator("dialog .op-steps button").nth(2).click()
    page.click("dialog button.main")
    page.click("dialog button.main")


def keep(page: Page, path: Path) -> None:
    """Store what the page shows, with few colours.

    Parameters
    ----------
    page : Page
        The page.
    path : Path
        Where to; PNG.

    Raises
    ------
    ValueError
        If the file is larger than a page of the documentation should load.
    """
    with Image.open(io.BytesIO(page.screenshot())) as picture:
        few = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    size = path.stat().st_size
    print(f"{path}: {size / 1e3:.0f} kB")
    if size > LARGEST_BYTES:
        raise ValueError(f"{path} has {size} bytes, more than {LARGEST_BYTES}")


def draw(folder: Path, wait_s: float) -> None:
    """Make both pictures.

    Parameters
    ----------
    folder : Path
        Where they go.
    wait_s : float
        How long the compensation works before the first one. [s]
    """
    browser = shutil.which("chromium") or "chromium"
    arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
    with (
        tempfile.TemporaryDirectory() as name,
        Rig(Path(name), speed=5.0) as stand,
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=browser, args=arguments) as chromium,
    ):
        page = chromium.new_page(viewport={"width": WIDTH, "height": HEIGHT}, locale="en-GB")
        intervene(page, stand)
        page.wait_for_timeout(1e3 * wait_s)
        keep(page, folder / "screen_active.png")
        stand.programs["run"].signal(signal.SIGSTOP)
        try:
            page.wait_for_selector("#no-data:visible", timeout=10_000)
            keep(page, folder / "screen_no_data.png")
        finally:
            stand.programs["run"].signal(signal.SIGCONT)


def main() -> None:
    """Read the options and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent)
    parser.add_argument("--wait", type=float, default=60.0, metavar="SECONDS")
    arguments = parser.parse_args()
    draw(arguments.folder, arguments.wait)


if __name__ == "__main__":
    main()
