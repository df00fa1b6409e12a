import hashlib
import io
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from tests.refusals import check_refusals
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.files import (
    format_tidy_csv,
    read_positioning,
    read_positioning_with_sha256,
    write_rtl,
)
from thermaxis.positioning import PositioningTest
from thermaxis.quantities import AxisKind

TARGET = (0.0, 10.0, 20.0)
RUN = PositioningTest(
    AxisKind.LINEAR, np.array(TARGET), np.round(np.arange(12.0).reshape(3, 2, 2) / 7, 3)
)


def tidy_bytes() -> bytes:
    return format_tidy_csv(RUN).encode()


def wide_rows() -> list[list[float | str]]:
    rows: list[list[float | str]] = [["target_mm", "1", "2", "3", "4"]]
    runs = RUN.deviation.reshape(3, 4).tolist()
    return rows + [[target, *row] for target, row in zip(TARGET, runs, strict=True)]


def wide_bytes() -> bytes:
    return "".join(";".join(map(str, row)) + "\r\n" for row in wide_rows()).encode("utf-16")


def dat_bytes() -> bytes:
    lines = ["TEST_DATA=# a comment", "CYCLES=2", "POSITIONS=3"]
    for (i, j, a), value in np.ndenumerate(RUN.deviation):
        lines.append(
            f"REF_DATA_{('FWD', 'BWD')[a]}[{i + 1},{j + 1}]={TARGET[i] + value / 1000:.6f}"
        )
    lines += [f"TGT_DATA[{i + 1}]={target}" for i, target in enumerate(TARGET)]
    return "".join(f"{line}\n" for line in lines).encode()


def write(path: Path, kind: str) -> None:
    if kind == "rtl":
        write_rtl(RUN, path)
    elif kind == "xlsx":
        book = openpyxl.Workbook()
        for row in wide_rows():
            book.worksheets[0].append(row)
        book.save(path)
    else:
        path.write_bytes({"tidy": tidy_bytes, "wide": wide_bytes, "dat": dat_bytes}[kind]())


@pytest.mark.parametrize("kind", ["tidy", "wide", "dat", "rtl", "xlsx"])
def test_the_format_is_told_from_the_content_whatever_the_name(tmp_path: Path, kind: str) -> None:
    for name in ("run.csv", "run.rtl", "run.xlsx", "run"):
        path = tmp_path / name
        write(path, kind)
        test, sha256 = read_positioning_with_sha256(str(path))
        np.testing.assert_allclose(test.deviation, RUN.deviation, atol=1e-9)
        np.testing.assert_array_equal(read_positioning(path).deviation, test.deviation)
        assert sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_what_is_no_measurement_gets_one_error_that_names_the_file(tmp_path: Path) -> None:
    wrong = {
        b"": "file_empty",
        b"\x89PNG\r\n\x1a\n" + bytes(50): "not_text",
        b"HEADER::\nOwner : CARTO-Dynamic\nData:\n" + bytes(800): "not_text",
        b"Dear colleague,\nplease find attached the run.\n": "line 1: run_headings_incomplete",
        b"PK\x03\x04 not really": "file_damaged",
        b'{"targets": [1, 2], "cycles": 5}': "line 1: run_headings_incomplete",
    }
    check_refusals(read_positioning, tmp_path / "run.csv", wrong)


def test_the_fallback_encoding_can_be_named(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes("# location: 北京\n".encode("gbk") + tidy_bytes())
    assert read_positioning(path, fallback_encoding="gbk").header["location"] == "北京"
    with pytest.raises(ConfigurationError, match="klingon"):
        read_positioning(path, fallback_encoding="klingon")


@pytest.mark.real_data
def test_the_real_runs_are_recognised(real_data: Path) -> None:
    shapes = {
        path.parent.name + "/" + path.name: read_positioning(path).deviation.shape
        for folder in ("psi_ecmccfg", "ess_target_b02_x")
        for pattern in ("*_ISO230.dat", "*.csv")
        for path in (real_data / "positioning" / folder).rglob(pattern)
    }
    assert shapes == {
        "psi_fat_sat_2023/report.md_ISO230.dat": (5, 5, 2),
        "ess_mcu1025_2021/report.md_ISO230.dat": (5, 5, 2),
        "ess_target_b02_x/target_x_ISO230.dat": (9, 5, 2),
        "ess_target_b02_x/x_positioning_with_times.csv": (9, 5, 2),
    }


@pytest.mark.real_data
def test_other_real_files_are_refused(real_data: Path) -> None:
    for name in (
        "positioning/linuxcnc/screwcompX.dat",
        "positioning/siemens/REN_raw_row_from_data.sqlite.csv",
        "positioning/psi_ecmccfg/psi_fat_sat_2023/report.md",
        "SOURCES.md",
    ):
        with pytest.raises(MeasurementFileError):
            read_positioning(real_data / name)


def test_the_hash_is_that_of_the_bytes_that_were_read_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run"
    write(path, "tidy")
    opened: list[object] = []
    really_open = io.open

    def spy(file: object, *arguments: object, **named: object) -> object:
        if file == path:
            opened.append(file)
        return really_open(file, *arguments, **named)

    monkeypatch.setattr(io, "open", spy)
    read_positioning_with_sha256(path)
    assert opened == [path]
