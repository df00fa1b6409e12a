"""The mapping of the page on own logs does what the page says."""

import re
from pathlib import Path

import numpy as np
import pytest

from thermaxis.files import read_thermal_log

LOG = """Zeitstempel;Spindel vorn;Saeule;Alarmtext;Z_um
02.03.2026 06:00:00;215;21,0;aus;0,0
02.03.2026 06:00:10;216;21,0;Tuer;0,4
02.03.2026 06:00:20;218;21,1;aus;0,9
"""


@pytest.fixture
def mapping(root: Path, tmp_path: Path) -> Path:
    page = (root / "docs" / "how-to" / "use-my-own-logs.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    path = tmp_path / "columns.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_printed_mapping_reads_a_log_with_other_headings(mapping, tmp_path):
    path = tmp_path / "tag1.csv"
    path.write_text(LOG, encoding="utf-8")
    log = read_thermal_log(path, mapping=mapping)
    assert list(log.columns) == ["T_spindle_C", "T_column_C", "Z_um"]
    assert log.units["T_spindle_C"] == "degC"
    np.testing.assert_allclose(log.columns["T_spindle_C"], [21.5, 21.6, 21.8])
    np.testing.assert_allclose(log.columns["T_column_C"], [21.0, 21.0, 21.1])
    assert log.time_s.tolist() == [0.0, 10.0, 20.0]
    assert log.start is not None
    assert log.start.isoformat() == "2026-03-02T06:00:00"
