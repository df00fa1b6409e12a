"""The benchmark that ends loop and screen again and again, twice each: the page comes back."""

import subprocess
import sys
from pathlib import Path


def test_the_page_recovers_by_itself_after_restarts_of_the_loop_and_the_screen(root: Path) -> None:
    ended = subprocess.run(
        [sys.executable, root / "benchmarks" / "screen_restarts.py", "--times", "2"],
        capture_output=True,
        text=True,
        timeout=380,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "the loop: 2 restarts, 2 times back by itself" in ended.stdout
    assert "the screen: 2 restarts, 2 times back by itself" in ended.stdout
