"""The operator's page against the lathe's own record, in faults drawn at random."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.system.screen.truth import FAULTS, drawn, trial


@pytest.mark.real_time
@pytest.mark.timeout(900)
def test_the_page_never_contradicts_the_machine_and_names_what_is_wrong(
    tmp_path: Path, browser: Browser
) -> None:
    """Each kind once; two hundred are drawn by ``python -m benchmarks.screen_truth``."""
    with trial(tmp_path, browser, 18) as one:
        for name in drawn(len(FAULTS), 18):
            one.suffer(name)
            one.settle()
    assert one.contradictions == []
    assert set(one.named_s) == set(FAULTS)
