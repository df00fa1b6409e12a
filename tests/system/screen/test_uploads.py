"""A run is uploaded to the whole screen, evaluated beside it, and its certificate downloaded."""

import json
from collections.abc import Callable
from http.client import HTTPConnection
from pathlib import Path
from typing import Final
from urllib.parse import quote

import pytest

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import PATIENCE_S, Rig, Visitor, wait_until

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


def test_a_file_that_is_no_run_is_refused_in_words(look: Look, tmp_path: Path) -> None:
    seen = look("engineer")
    page = seen.open("/positioning")
    seen.wait_live()
    wrong = tmp_path / "..;rm -rf.csv"
    wrong.write_text("<script>alert(1)</script>\n" * 50, encoding="utf-8")
    page.set_input_files("input[name=file]", wrong)
    page.click("#run-submit")
    page.wait_for_selector("#run-wrong:not([hidden])", timeout=300_000)
    assert ".csv" in page.locator("#run-wrong").inner_text()
    assert page.locator("#run-wrong script").count() == 0


@pytest.mark.parametrize(
    "name", ["../../users.toml", "/etc/passwd", "a\\..\\b.csv", "\u202egnp.csv", "x" * 300 + ".csv"]
)
def test_the_name_of_a_file_never_becomes_a_path(
    people: Callable[[str], Visitor], stand: Rig, root: Path, name: str
) -> None:
    before = {path for path in stand.folder.rglob("*") if "history" not in path.name}
    body = (root / "examples" / "y_axis_50_cycles.rtl").read_bytes()[:2000]
    answer = people("engineer").ask(f"/positioning/upload?name={quote(name)}", body)
    assert answer.status in {200, 400, 413, 422}, answer
    after = {path for path in stand.folder.rglob("*") if "history" not in path.name}
    assert after == before


def test_a_file_that_is_too_large_is_refused_before_it_is_sent(
    people: Callable[[str], Visitor], stand: Rig
) -> None:
    person = people("engineer")
    connection = HTTPConnection("127.0.0.1", stand.screen_port, timeout=PATIENCE_S)
    connection.putrequest("POST", "/positioning/upload?name=x.csv")
    for name, value in {
        "Origin": stand.address,
        "Cookie": person.cookie,
        "X-Thermaxis-Token": person.token,
        "Content-Length": "20000001",
    }.items():
        connection.putheader(name, value)
    connection.endheaders()
    assert connection.getresponse().status == 413
    connection.close()
