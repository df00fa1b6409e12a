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
    "runtime/_halcmd",
    "runtime/sinks/linuxcnc",
    "runtime/users",
    "runtime/status/_server",
    "runtime/status/_metrics",
    "runtime/status/_fields",
    "runtime/status/_headline",
    "runtime/history/_database",
    "runtime/history/_historian",
    "runtime/config/_warnings",
)
"""What the acting process of a run with an OPC UA source and sink loads nothing of."""


def test_a_run_loads_no_reader_of_logs_no_page_and_few_lines(root: Path) -> None:
    acting, beside = loaded(root / "examples" / "machine" / "lathe.toml")
    assert {place for place in acting if place.startswith(NOT_NEEDED)} == set()
    assert {"runtime/status/_server.py", "runtime/history/_historian.py"} <= set(beside)
    assert acting.total() < 8_950  # some 340 of them for touches of a probe
