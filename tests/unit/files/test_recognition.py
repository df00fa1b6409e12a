import hashlib
import io
from pathlib import Path

import numpy as np
import pytest

from tests.refusals import check_refusals
from tests.unit.files.builders import MADE, example
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.files import read_positioning, read_positioning_with_sha256


@pytest.mark.parametrize("name", MADE)
def test_the_format_is_told_from_the_content_whatever_the_name(tmp_path: Path, name: str) -> None:
    content = MADE[name]()
    for suffix in (".csv", ".rtl", ".xlsx", ""):
        path = tmp_path / f"run{suffix}"
        path.write_bytes(content)
        test, sha256 = read_positioning_with_sha256(str(path))
        np.testing.assert_allclose(test.deviation, example().deviation, atol=1e-6)
        assert sha256 == hashlib.sha256(content).hexdigest()
    read = read_positioning(tmp_path / "run", fallback_encoding="cp1250")
    np.testing.assert_array_equal(read.deviation, test.deviation)


def test_what_is_no_measurement_gets_one_error_that_names_the_file(tmp_path: Path) -> None:
    wrong = {
        b"": "file_empty",
        b"\x89PNG\r\n\x1a\n" + bytes(50): "not_text",
        b"HEADER::\nOwner : CARTO-Dynamic\nData:\n" + bytes(800): "not_text",
        b"Dear colleague,\nplease find attached the run.\n": "line 1: run_headings_incomplete",
        b"PK\x03\x04 not really": "file_damaged",
        b'{"targets": [1, 2], "cycles": 5}': "line 1: run_headings_incomplete",
        b"CHANDATA(1)\n$AA_ENC_COMP[0,0,X1]=0.001\nM17\n": "run_is_table",
    }
    check_refusals(read_positioning, tmp_path / "run.csv", wrong)


def test_the_fallback_encoding_can_be_named(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes("# location: 北京\n".encode("gbk") + MADE["wide"]())
    assert read_positioning(path, fallback_encoding="gbk").header["location"] == "北京"
    with pytest.raises(ConfigurationError, match="klingon"):
        read_positioning(path, fallback_encoding="klingon")


@pytest.mark.real_data
def test_other_real_files_are_refused(real_data: Path) -> None:
    for name, code in {
        "positioning/linuxcnc/screwcompX.dat": "run_is_table",
        "positioning/siemens/REN_raw_row_from_data.sqlite.csv": "",
        "positioning/psi_ecmccfg/psi_fat_sat_2023/report.md": "run_is_report",
        "SOURCES.md": "",
    }.items():
        with pytest.raises(MeasurementFileError) as caught:
            read_positioning(real_data / name)
        assert caught.value.code == (code or caught.value.code)


def test_the_hash_is_that_of_the_bytes_that_were_read_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run"
    path.write_bytes(MADE["tidy"]())
    opened: list[object] = []
    really_open = io.open

    def spy(file: object, *arguments: object, **named: object) -> object:
        if file == path:
            opened.append(file)
        return really_open(file, *arguments, **named)

    monkeypatch.setattr(io, "open", spy)
    read_positioning_with_sha256(path)
    assert opened == [path]
