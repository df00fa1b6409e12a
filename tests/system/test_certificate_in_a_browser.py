"""The certificate's page in a real browser: it shows, loads nothing and runs nothing."""

import shutil
import subprocess
from pathlib import Path

import pytest

from thermaxis.cli import main

pytestmark = pytest.mark.system

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")
HOSTILE = "</title><script>document.body.innerHTML='owned'</script><img src=x onerror=alert(1)>"


def browse(page: Path, folder: Path, *options: str) -> str:
    assert BROWSER is not None, "Debian's chromium is needed; .ci/run installs it"
    done = subprocess.run(
        [
            BROWSER,
            *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
            *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
            f"--user-data-dir={folder / 'profile'}",
            *options,
            page.as_uri(),
        ],
        capture_output=True,
        encoding="utf-8",
        timeout=120,
        check=True,
    )
    return done.stdout


def test_charts_and_a_hostile_title_are_shown_and_nothing_is_run(
    root: Path, tmp_path: Path
) -> None:
    lines = (root / "examples" / "x_axis_100_cycles.csv").read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not line.startswith("# header title")]
    run = tmp_path / "run.csv"
    run.write_text(f"# header title: {HOSTILE}\n" + "\n".join(kept) + "\n", encoding="utf-8")
    page = tmp_path / "certificate.html"
    assert main(["evaluate", str(run), "--json", "-", "--report", str(page)]) == 0
    shown = browse(page, tmp_path, "--dump-dom")
    assert "owned&lt;" not in shown.replace("innerHTML='owned'&lt;", "")
    assert "&lt;script&gt;document.body.innerHTML='owned'&lt;/script&gt;" in shown
    assert "<script" not in shown
    assert '<img src="x"' not in shown
    assert "Raw data" in shown or "raw data" in shown.lower()
    picture = tmp_path / "page.png"
    browse(page, tmp_path, f"--screenshot={picture}", "--window-size=1200,1600")
    assert picture.stat().st_size > 50_000  # with its charts
