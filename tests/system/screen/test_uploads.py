"""A run is uploaded to the whole screen, evaluated beside it, and its certificate downloaded."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import Rig, wait_until

Look = Callable[..., Looked]
RUN: Final = "x_axis_100_cycles.csv"


def test_a_run_is_evaluated_and_its_certificate_downloaded(
    look: Look, stand: Rig, root: Path, tmp_path: Path
) -> None:
    seen = look("engineer")
    page = seen.open("/positioning")
    seen.wait_live()
    run = root / "examples" / RUN
    page.set_input_files("input[name=file]", run)
    page.click("#run-submit")
    page.wait_for_selector("#run-result:not([hidden])", timeout=300_000)
    wait_until("the figures", lambda: page.locator("#run-shown").inner_text().strip())
    shown = page.locator("#run-shown").inner_text()
    told = json.loads(stand.command("evaluate", str(run), "--json", "-"))
    for figures in (told["iso230_2"], told["drift"]["iso230_2"]):
        assert f"{figures['A']:.2f}" in shown, (figures["A"], shown)
    page.click("#run-report")
    page.frame_locator("#run-frame").locator("body").wait_for()
    with page.expect_download() as found:
        page.click("#run-certificate")
    certificate = tmp_path / "certificate.pdf"
    found.value.save_as(certificate)
    assert found.value.suggested_filename.endswith(".pdf")
    assert certificate.read_bytes().startswith(b"%PDF")
    assert seen.wrong == []
