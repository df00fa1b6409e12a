"""Where the real measurements lie; they are read in place and are no part of the project."""

from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("same", derandomize=True, deadline=None)  # the same cases everywhere
settings.load_profile("same")

ROOT = Path(__file__).resolve().parent.parent

TOGETHER = {
    "linuxcnc": ("test_linuxcnc", "test_linuxcnc_offset", "test_loop_is_killed", "test_rs274"),
    "node-opcua": ("test_foreign_opcua", "test_foreign_opcua_loop", "test_foreign_status_client"),
    "stand": (
        *("test_pages", "test_contrast", "test_access", "test_interventions", "test_history"),
        *("test_no_data", "test_old_values", "test_uploads"),
    ),
}
"""System tests of one group run one after the other, in one worker: a computer has one LinuxCNC,
packages are installed once, and the pages of one machine have one browser."""


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep what must not run side by side in one worker; every other file is a group of its own."""
    group_of = {file: group for group, files in TOGETHER.items() for file in files}
    for item in items:
        if item.get_closest_marker("system") is not None:
            group = group_of.get(item.path.stem, str(item.path))
            item.add_marker(pytest.mark.xdist_group(group))


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the project's root."""
    return ROOT


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Return the folder of real measurements beside the project; skip where there is none."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("no real measurements beside the project (../shared/data)")
    return folder
