"""What acts on a machine is small enough to be read: a bound on what a run loads."""

from pathlib import Path

import pytest

from benchmarks.loaded import loaded

pytestmark = pytest.mark.system
NOT_NEEDED = (
    "positioning",
    "thermal",
    "report",
    "controls",
    "plc",
    "screen",
    "virtual",
    "files/logs",
)
"""Folders of which a run with an OPC UA source and sink loads nothing."""


def test_a_run_loads_no_reader_of_logs_no_page_and_few_lines(root: Path) -> None:
    found = loaded(root / "examples" / "machine" / "lathe.toml")
    assert {place for place in found if place.startswith(NOT_NEEDED)} == set()
    assert not any(
        place.startswith(("runtime/_halcmd", "runtime/sinks/linuxcnc")) for place in found
    )
    assert found.total() < 12_000
