"""Where the real measurements lie; they are read in place and are no part of the project."""

from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("same", derandomize=True, deadline=None)  # the same cases everywhere
settings.load_profile("same")

ROOT = Path(__file__).resolve().parent.parent

TOGETHER = {
    "linuxcnc": ("test_linuxcnc", "test_linuxcnc_offset", "test_loop_is_killed"),
    "node-opcua": ("test_foreign_opcua", "test_foreign_opcua_loop", "test_foreign_status_client"),
}
"""System tests that would wait for each other: a computer has one LinuxCNC, and packages are
installed once."""


@pytest.hookimpl(tryfirst=True)  # before the names of the groups are read
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep a file of system tests, and what would wait for each other, in one worker."""
    group_of = {file: group for group, files in TOGETHER.items() for file in files}
    for item in items:
        if item.get_closest_marker("system") is not None:
            group = group_of.get(item.path.stem, item.path.stem)
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
