"""The operator's page against the lathe's own record, in faults drawn at random."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.system.screen.truth import FAULTS, campaign


@pytest.mark.real_time
@pytest.mark.timeout(900)
def test_the_page_never_contradicts_the_machine_and_names_what_is_wrong(
    tmp_path: Path, browser: Browser
) -> None:
    """Two hundred are drawn by ``python -m benchmarks.screen_truth``."""
    seen = campaign(tmp_path, browser, 10, 18)
    print(seen.looks, seen.missed, seen.named_s)
    assert seen.contradictions == []
    assert set(seen.named_s) == set(FAULTS)
