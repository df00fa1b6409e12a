"""Thermal logs of every format: what is read, what is refused, and that writing keeps it."""

import datetime as dt
import itertools
import struct
import tempfile
import zlib
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import polars as pl
import pytest
from hypothesis import given, settings, strategies as st
from nptdms import ChannelObject, TdmsWriter
from scipy import io

from tests.refusals import refusal_of
from thermaxis.codes import remark
from thermaxis.errors import MeasurementFileError, ThermaxisError
from thermaxis.files import (
    ColumnMapping,
    ThermalMapping,
    format_thermal_log,
    read_thermal_log,
    write_thermal_log,
)
from thermaxis.files.logs import csv_log as thermal_csv
from thermaxis.messages import sentence_of
from thermaxis.thermal import ThermalLog

TIME_S = np.arange(50.0) * 2.0
SPINDLE = 20.0 + np.round(np.sin(TIME_S / 9.0), 3)
HEIGHT = np.where(np.arange(50) % 7 == 3, np.nan, TIME_S / 10.0)
START = dt.datetime(2026, 11, 20, 8, 0, tzinfo=dt.UTC)


def frame() -> pl.DataFrame:
    return pl.DataFrame({"time_s": TIME_S, "T_spindle_C": SPINDLE, "Z_um": HEIGHT})


def write_csv(path: Path) -> None:
    frame().with_columns(pl.col("Z_um").fill_nan(None)).write_csv(path)


def write_german_csv(path: Path) -> None:
    lines = ["Zeit;Spindel [°C];Z [µm]"]
    for t, c, z in zip(TIME_S, SPINDLE, HEIGHT, strict=True):
        moment = (START + dt.timedelta(seconds=float(t))).strftime("%d.%m.%Y %H:%M:%S")
        height = "" if np.isnan(z) else f"{z:.3f}".replace(".", ",")
        lines.append(f"{moment};{c:.3f};{height}".replace(f"{c:.3f}", f"{c:.3f}".replace(".", ",")))
    path.write_bytes("\r\n".join([*lines, ""]).encode("cp1250"))


def write_parquet(path: Path) -> None:
    frame().write_parquet(path)


def write_dated_parquet(path: Path) -> None:
    times = [START + dt.timedelta(seconds=float(t)) for t in TIME_S]
    frame().drop("time_s").with_columns(pl.Series("timestamp", times)).write_parquet(path)


def write_xlsx(path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["A machine, a title above the table"])
    sheet.append(["time", "T_spindle_C", "Z_um"])
    for t, c, z in zip(TIME_S, SPINDLE, HEIGHT, strict=True):
        moment = (START + dt.timedelta(seconds=float(t))).replace(tzinfo=None)
        sheet.append([moment, float(c), None if np.isnan(z) else float(z)])
    book.save(path)


def write_mat(path: Path) -> None:
    io.savemat(path, {"time_s": TIME_S, "log": {"T_spindle_C": SPINDLE[:, None], "Z_um": HEIGHT}})


def write_mat_73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        file["time_s"] = TIME_S[None, :]
        file["log/T_spindle_C"] = SPINDLE[None, :]
        file["log/Z_um"] = HEIGHT[None, :]
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(512, b" "))


def write_tdms(path: Path) -> None:
    waveform = {"wf_increment": 2.0, "wf_start_time": START.replace(tzinfo=None)}
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("log", "T_spindle_C", SPINDLE, waveform),
                ChannelObject("log", "Z", HEIGHT, {**waveform, "unit_string": "um"}),
            ]
        )


WRITERS = {
    "plain.csv": write_csv,
    "german.csv": write_german_csv,
    "numbers.parquet": write_parquet,
    "dates.parquet": write_dated_parquet,
    "book.xlsx": write_xlsx,
    "variables.mat": write_mat,
    "hdf5.mat": write_mat_73,
    "labview.tdms": write_tdms,
}


def written(folder: Path, name: str) -> Path:
    path = folder / name
    WRITERS[name](path)
    return path


def from_text(folder: Path, text: str, **keywords: object) -> ThermalLog:
    path = folder / "log.csv"
    path.write_bytes(text.encode())
    return read_thermal_log(path, **keywords)


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_gives_the_same_log_whole_and_reduced_while_reading(
    tmp_path: Path, name: str
) -> None:
    path = written(tmp_path, name)
    log = read_thermal_log(path)
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-6)
    spindle, height = log.columns
    assert (log.units[spindle], log.units[height]) == ("degC", "um")
    np.testing.assert_allclose(log.columns[spindle], SPINDLE, atol=1e-12)
    np.testing.assert_allclose(log.columns[height], HEIGHT, atol=1e-12)
    assert log.name == Path(name).stem
    if name in {"german.csv", "dates.parquet", "book.xlsx", "labview.tdms"}:
        assert log.start is not None
        assert log.start.replace(tzinfo=dt.UTC) == START
    reduced, expected = read_thermal_log(path, sample_time_s=12.0), log.resample(12.0)
    np.testing.assert_array_equal(reduced.time_s, expected.time_s)
    for column in log.columns:
        np.testing.assert_allclose(reduced.columns[column], expected.columns[column], rtol=1e-14)
    assert reduced.start == log.start


@pytest.mark.parametrize("name", WRITERS)
def test_a_damaged_file_is_an_error_with_its_name_never_a_traceback(
    tmp_path: Path, name: str
) -> None:
    content = written(tmp_path, name).read_bytes()
    dice = np.random.default_rng(len(content))
    path = tmp_path / f"damaged{Path(name).suffix}"
    for turn in range(12):
        broken = bytearray(content)
        if path.suffix != ".parquet":  # its reader can end the program on a damaged page
            for _ in range(dice.integers(1, 12)):
                broken[dice.integers(len(broken))] = dice.integers(256)
        if turn % 4 == 0 or path.suffix == ".parquet":
            broken = broken[: dice.integers(1, len(broken))]
        path.write_bytes(bytes(broken))
        found = log_or_error(path)
        if isinstance(found, ThermaxisError):
            assert found.place.file == str(path)
        else:
            assert found.rows > 0


def log_or_error(path: Path) -> ThermalLog | ThermaxisError:
    try:
        return read_thermal_log(path)
    except ThermaxisError as error:
        return error


HOSTILE = {
    b"": "file_empty",
    b" \n\n": "file_empty",
    b"\x00" * 600: "not_text",
    b"lorem ipsum\ndolor sit amet\n": "line 1: no_time_column",
    b"time_s,T_C\n": "no_rows",
    b"time_s,\n1,\n": "no_channel_in_log",
    b"time_s,T_C\n0,1\n1,2,3\n": "line 3: cells_and_headings",
    b"time_s,T_C,x\n0,1,2\n1,2\n2,3,4\n": "line 3: cells_and_headings",
    b"time_s,T_C,T_C\n0,1,2\n": "columns_of_same_name",
    b"time_s,T_C\n0,1\n1,warm\n2,3\n3,4\n": "line 3, column T_C: not_a_number",
    b'time_s,T_C\n0,"1\n1,2\n': "line 2: quotation_marks",
    b"time_s,T_C\n,1\n,2\n": "column time_s: ",
    b"time_s,T_C\n1e300,1\n2e300,2\n": "column time_s: ",
    b"time,T_C\n2026-13-45T00:00:00,1\n": "line 2, column time: not_a_moment_of_log",
    b"time,T_C\n2026-01-01T00:00:00,1\n2026-01-01T25:00:00,1\n": (
        "line 3, column time: not_a_moment_of_log"
    ),
    b"time,T_C\n2026-01-01T00:00:00,1\n2026-01-01T00:00:01+01:00,2\n": (
        "line 3, column time: zones_mixed"
    ),
    b"PAR1" + b"x" * 100 + b"PAR1": "file_damaged",
    b"TDSm" + b"\xff" * 100: "no_channel_in_log",
    b"MATLAB 5.0 MAT-file" + b"\xff" * 500: "file_damaged",
    b"\x89HDF\r\n\x1a\n" + b"\xff" * 600: "file_damaged",
    b"PK\x03\x04" + b"\xff" * 100: "file_damaged",
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\x00" * 600: "not_a_workbook",
    b"time_s,T_C\n0," + b"1" * 2_000_000 + b"\n": "line 1: line_too_long",
    "time_s,T_C\n0,1\n".encode("utf-16")[:-1]: "cut_short",
    b"time_s,T_C\n0,=1+1\n1,2\n2,3\n": "line 2, column T_C: not_a_number",
    b"# a comment\n\ntime_s,T_C\n0,1\n# another\n1,warm\n2,3\n3,4\n": (
        "line 6, column T_C: not_a_number"
    ),
}


def test_what_is_no_log_is_refused_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "file.csv"
    for content, said in HOSTILE.items():
        path.write_bytes(content)
        assert refusal_of(read_thermal_log, path).startswith(said)


@given(st.binary(max_size=300))
@settings(max_examples=40)
def test_any_bytes_give_a_log_or_an_error(content: bytes) -> None:
    any_bytes(b"time_s,T_C\n" + content)
    any_bytes(content)


def any_bytes(content: bytes) -> None:
    path = Path(tempfile.gettempdir()) / f"thermaxis_any_{hash(content)}.csv"
    path.write_bytes(content)
    try:
        found = log_or_error(path)
        assert isinstance(found, ThermalLog) or found.place.file == str(path)
    finally:
        path.unlink()


CELLS = ["0", "1", "2.5", "-3", "1e5", "1e308", "1e999", "nan", "NaN", "inf", "-", "x", "1,5"]
CELLS += ["''", '"2"', "2026-01-01", "#", ";", ",", "2026-01-01T00:00:00", "=1"]


@given(
    st.lists(st.lists(st.sampled_from(CELLS), min_size=1, max_size=4), max_size=12),
    st.sampled_from(",;\t"),
)
@settings(max_examples=40)
def test_any_rows_give_a_log_or_an_error(rows: list[list[str]], delimiter: str) -> None:
    lines = [delimiter.join(["time_s", "T_C", "Z_um"]), *(delimiter.join(row) for row in rows)]
    any_bytes("\n".join(lines).encode())


@pytest.mark.parametrize(
    ("text", "time_s", "columns", "units", "start", "remarks"),
    [
        (
            "time,T_C\n2026-10-25T02:59:50+02:00,1\n2026-10-25T01:00:10Z,2\n",
            *([0.0, 20.0], {"T_C": [1, 2]}, ["degC"]),
            *("2026-10-25T00:59:50+00:00", []),
        ),
        (
            "time_ms,T_C\n1763625600000,1\n1763625610000,2\n",
            *([0.0, 10.0], {"T_C": [1, 2]}, ["degC"], "2025-11-20T08:00:00+00:00", []),
        ),
        (
            "time_us,T_C\n1763625600000000,1\n1763625610000000,2\n",
            *([0.0, 10.0], {"T_C": [1, 2]}, ["degC"], "2025-11-20T08:00:00+00:00", []),
        ),
        (
            "Datum;Zeit;T [°C]\n20.11.2026;23:59:50;1,5\n21.11.2026;00:00:00;2,5\n",
            *([0.0, 10.0], {"T": [1.5, 2.5]}, ["degC"], "2026-11-20T23:59:50", []),
        ),
        (
            "time;T1;Z\ns;°C;µm\n0;1,0;2\n1;2,0;3\n",
            *([0.0, 1.0], {"T1": [1, 2], "Z": [2, 3]}, ["degC", "um"], None, []),
        ),
        (
            "time_s,T_C,Z_um\n0,1,1\n1,NaN,3e38\n2,Overflow,\n3,,2\n4,5,6\n5,6,7\n",
            [0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
            {"T_C": [1, np.nan, np.nan, np.nan, 5, 6], "Z_um": [1, np.nan, np.nan, 2, 6, 7]},
            *(["degC", "um"], None, ["'Overflow' stands in one cell", "1 values beyond 1e9"]),
        ),
        (
            "time_s;T_C;Z_um\n0;1,5;0.25\n1;2;\N{MINUS SIGN}0,5\n2;inf;1\n",
            *([0.0, 1.0, 2.0], {"T_C": [1.5, 2, np.nan], "Z_um": [0.25, -0.5, 1]}),
            *(["degC", "um"], None, ["'inf' stands in one cell"]),
        ),
        (
            "time_s,T_C,state\n0,1,idle\n1,2,run\n",
            *([0.0, 1.0], {"T_C": [1, 2]}, ["degC"], None),
            ["columns without numbers were left out: state"],
        ),
        (
            "time_s,T_C,Z_um\n0,1,1\n1,2,2\n2,3",
            *([0.0, 1.0], {"T_C": [1, 2], "Z_um": [1, 2]}, ["degC", "um"], None, ["cut short"]),
        ),
    ],
)
def test_what_recorders_write_is_understood(
    tmp_path: Path,
    text: str,
    time_s: list[float],
    columns: dict[str, list[float]],
    units: list[str],
    start: str | None,
    remarks: list[str],
) -> None:
    log = from_text(tmp_path, text)
    np.testing.assert_array_equal(log.time_s, time_s)
    assert list(log.columns) == list(columns)
    for name, values in columns.items():
        np.testing.assert_array_equal(log.columns[name], values)
    assert list(log.units.values()) == units
    if start is None:
        assert log.start is None
    else:
        moment = dt.datetime.fromisoformat(start)
        assert (log.start, log.start.tzinfo is None) == (moment, moment.tzinfo is None)
    said = [sentence_of(one) for one in log.remarks]
    assert len(said) == len(remarks)
    assert all(part in one for part, one in zip(remarks, said, strict=True))


def test_files_that_are_not_there_or_too_large_are_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for path in (tmp_path, tmp_path / "none.csv", tmp_path / "none.parquet", "a\x00b"):
        with pytest.raises(MeasurementFileError):
            read_thermal_log(path)
    path = written(tmp_path, "plain.csv")
    limits = (("MOST_VALUES", "log_too_large"), ("FILE_LIMIT_BYTES", "file_too_large"))
    for limit, code in limits:
        monkeypatch.setattr(thermal_csv, limit, 100)
        assert refusal_of(read_thermal_log, path) == code


def test_the_hour_that_comes_twice_without_a_zone_is_named_and_carried_on(tmp_path: Path) -> None:
    start = dt.datetime(2026, 10, 25, 1, 0, tzinfo=dt.UTC)
    steps = [*range(0, 7200, 60), *range(3600, 10_800, 60)]
    rows = [f"{(start + dt.timedelta(seconds=s)).strftime('%Y-%m-%dT%H:%M:%S')},1" for s in steps]
    log = from_text(tmp_path, "time,T_C\n" + "\n".join(rows) + "\n")
    np.testing.assert_allclose(log.time_s, np.arange(240) * 60.0)
    assert log.remarks[0].code == "remark-daylight_saving_ended"


@pytest.mark.parametrize(
    ("first", "hours", "nights"), [(18.5, 12, 1), (22.0, 12, 1), (18.5, 72, 3)]
)
def test_times_of_day_go_on_past_midnight(
    tmp_path: Path, first: float, hours: int, nights: int
) -> None:
    start = dt.datetime(2026, 3, 2, tzinfo=dt.UTC) + dt.timedelta(hours=first)
    moments = [start + dt.timedelta(minutes=k) for k in range(60 * hours)]
    text = "time,T_C\n" + "".join(f"{m:%H:%M:%S},{k / 100}\n" for k, m in enumerate(moments))
    mapping = ThermalMapping(time_format="%H:%M:%S")
    log = from_text(tmp_path, text, mapping=mapping)
    np.testing.assert_allclose(log.time_s, np.arange(60 * hours) * 60.0)
    np.testing.assert_allclose(log.columns["T_C"], np.arange(60 * hours) / 100)
    assert log.remarks == (remark("midnights_passed", count=nights),)


def test_dates_are_read_as_people_write_them_and_refused_where_they_mean_two_days(
    tmp_path: Path,
) -> None:
    def log_of(*times: str, mapping: ThermalMapping | None = None) -> ThermalLog:
        rows = "".join(f"{time},{k}\n" for k, time in enumerate(times))
        return from_text(tmp_path, f"time,T_C\n{rows}", mapping=mapping)

    for first, second in (
        ("2021/06/05-13:24:41", "2021/06/05-13:25:41"),
        ("06/13/2021 01:24:41 pm", "06/13/2021 01:25:41 pm"),
        ("05.06.2021 13:24", "05.06.2021 13:25"),
    ):
        assert log_of(first, second).duration_s == 60.0
    unclear = ("03/04/2026 08:00", "03/04/2026 08:01")
    with pytest.raises(MeasurementFileError) as caught:
        log_of(*unclear)
    assert caught.value.code == "date_order_unclear"
    for order, month in (("day", 4), ("month", 3)):
        start = log_of(*unclear, mapping=ThermalMapping(date_order=order)).start
        assert start == dt.datetime(2026, month, 7 - month, 8)  # noqa: DTZ001 - the file has none


def test_a_few_words_among_empty_cells_are_a_column_of_words(tmp_path: Path) -> None:
    rows = [f"{k},{20 + 0.1 * k:.1f},{'door open' if k in {3, 4} else ''}" for k in range(30)]
    for header in ("time_s,T_C,alarm", 'time_s,T_C,"alarm"'):
        log = from_text(tmp_path, "\n".join([header, *rows]) + "\n")
        assert list(log.columns) == ["T_C"]
        assert remark("columns_left_out", names="alarm") in log.remarks
    with pytest.raises(MeasurementFileError) as caught:
        from_text(
            tmp_path, "\n".join(["time_s,T_C,alarm", *rows, "30,1,2", "31,1,2", "32,1,2"]) + "\n"
        )
    assert (caught.value.code, caught.value.values["text"]) == ("not_a_number", "door open")


@pytest.mark.parametrize("quoted", [False, True])
def test_a_column_that_a_mapping_leaves_out_is_never_looked_at(
    tmp_path: Path, quoted: bool
) -> None:
    cells = ["1", "fault 7", "3", "4,5" if quoted else "4", "5", "6"]
    note = '"{}"' if quoted else "{}"
    rows = [f"{k},{20 + k},{note.format(cell)}" for k, cell in enumerate(cells)]
    text = "\n".join(["time_s,T_C,code", *rows]) + "\n"
    with pytest.raises(MeasurementFileError) as caught:
        from_text(tmp_path, text)
    assert (caught.value.code, caught.value.place.column) == ("not_a_number", "code")
    mapping = ThermalMapping(columns={"code": ColumnMapping(leave_out=True)})
    log = from_text(tmp_path, text, mapping=mapping)
    assert log.columns["T_C"].tolist() == [20.0, 21.0, 22.0, 23.0, 24.0, 25.0]
    assert list(log.columns) == ["T_C"]


def test_a_file_read_in_small_pieces_gives_the_same_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("plain.csv", "german.csv"):
        path = written(tmp_path, name)
        whole = format_thermal_log(read_thermal_log(path))
        for chunk in (40, 1000):
            with monkeypatch.context() as patch:
                patch.setattr(thermal_csv, "_CHUNK_BYTES", chunk)
                assert format_thermal_log(read_thermal_log(path)) == whole


def test_line_ends_and_encodings_make_no_difference(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    for ends in ("\n", "\r\n", "\r"):
        for encoding in ("utf-8-sig", "utf-16", "cp1250"):
            for last in ("", "2"):  # the second one is cut short
                content = ends.join(["time_s\tT [°C]", "0\t1.5", "1\t2.5", last])
                path.write_bytes(content.encode(encoding))
                log = read_thermal_log(path)
                assert log.units == {"T": "degC"}
                np.testing.assert_array_equal(log.columns["T"], [1.5, 2.5])


def test_values_that_stand_for_a_fault_are_masked_before_means_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{k},{850.0 if k % 10 > 6 else 21.0 + k / 60}" for k in range(60)]
    path.write_text("\n".join(["time_s,T_C", *rows]) + "\n")
    log = read_thermal_log(path, sample_time_s=10.0)
    assert [one.code for one in log.remarks] == ["remark-values_no_measurement"]
    np.testing.assert_allclose(log.columns["T_C"], 21.0 + (10.0 * np.arange(6) + 3.0) / 60)


def test_matrices_and_other_lengths_in_a_file_of_matlab(tmp_path: Path) -> None:
    path = tmp_path / "m.mat"
    matrix = np.arange(15.0).reshape(5, 3)
    io.savemat(path, {"t": np.arange(5.0), "T_C": matrix, "gain": 3.0, "time_s": 7.0})
    log = read_thermal_log(path)
    assert list(log.columns) == ["T_1_C", "T_2_C", "T_3_C"]
    np.testing.assert_array_equal(log.columns["T_2_C"], [1, 4, 7, 10, 13])
    assert [one.code for one in log.remarks[:2]] == [
        "remark-seconds_assumed",
        "remark-variables_left_out",
    ]
    assert log.remarks[1].values == {"names": "gain, time_s"}
    path.write_bytes(path.read_bytes() + b"\x0e")  # the begin of one more element
    assert refusal_of(read_thermal_log, path) == "file_damaged"


def matlab_5(order: str, *, packed: bool, kind: int = 9) -> bytes:
    """Return a file of MATLAB with time_s and T_C in a byte order, as a machine of it writes it."""

    def element(kind: int, content: bytes) -> bytes:
        return struct.pack(f"{order}II", kind, len(content)) + content + bytes(-len(content) % 8)

    content = (b"MATLAB 5.0".ljust(124) + struct.pack(f"{order}HH", 0x100, 0x4D49))[:128]
    for name, values in (("time_s", [0.0, 1.0, 2.0]), ("T_C", [20.5, 21.0, 22.25])):
        parts = element(6, struct.pack(f"{order}II", 6, 0))
        parts += element(5, struct.pack(f"{order}ii", 3, 1)) + element(1, name.encode())
        matrix = element(14, parts + element(kind, struct.pack(f"{order}3d", *values)))
        if packed:
            matrix = zlib.compress(matrix)
            matrix = struct.pack(f"{order}II", 15, len(matrix)) + matrix
        content += matrix
    return content


def test_the_byte_order_of_a_file_of_matlab_makes_no_difference(tmp_path: Path) -> None:
    path = tmp_path / "m.mat"
    for order, packed in itertools.product("<>", (False, True)):
        path.write_bytes(matlab_5(order, packed=packed))
        log = read_thermal_log(path)
        np.testing.assert_array_equal(log.time_s, [0.0, 1.0, 2.0])
        np.testing.assert_array_equal(log.columns["T_C"], [20.5, 21.0, 22.25])
        path.write_bytes(matlab_5(order, packed=packed, kind=99))
        assert refusal_of(read_thermal_log, path) == "file_damaged"


def test_groups_of_different_rates_share_the_union_of_times(tmp_path: Path) -> None:
    path = tmp_path / "g.tdms"
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("fast", "Z_um", np.arange(5.0), {"wf_increment": 1.0}),
                ChannelObject("slow", "T_C", np.arange(3.0), {"wf_increment": 2.0}),
                ChannelObject("slow", "Z_um", np.arange(3.0), {"wf_increment": 2.0}),
            ]
        )
    log = read_thermal_log(path)
    assert set(log.columns) == {"fast.Z_um", "T_C", "slow.Z_um"}
    np.testing.assert_array_equal(log.columns["T_C"], [0, np.nan, 1, np.nan, 2])


NAMES = st.text(min_size=1, max_size=12).filter(lambda s: s.isprintable() and s.strip() == s)
WITH_SUFFIX = st.builds(str.__add__, NAMES, st.sampled_from(["", "_C", "_um", "_rpm", "_K", "_s"]))
NUMBERS = st.one_of(st.floats(-1e9, 1e9), st.just(float("nan")))


@given(
    names=st.lists(WITH_SUFFIX, min_size=1, max_size=4, unique=True),
    units=st.lists(st.sampled_from([None, "", "degC", "um", "°", "%"]), min_size=4, max_size=4),
    steps=st.lists(st.floats(1e-3, 1e5), min_size=0, max_size=8),
    values=st.lists(NUMBERS, min_size=40, max_size=40),
    dated=st.booleans(),
    noticed=st.text(max_size=30),
)
@settings(max_examples=30)
def test_what_was_written_reads_back_the_same(
    names: list[str],
    units: list[str | None],
    steps: list[float],
    values: list[float],
    dated: bool,
    noticed: str,
) -> None:
    if "time_s" in names:
        return
    time_s = np.concatenate(([0.0], np.cumsum(steps)))
    columns = {name: np.array(values[k * 9 : k * 9 + time_s.size]) for k, name in enumerate(names)}
    stated = {n: u for n, u in zip(names, units, strict=False) if u is not None}
    stated = {n: "deg" if u == "°" else u for n, u in stated.items()}
    log = ThermalLog(
        time_s=time_s,
        columns=columns,
        units=stated,
        start=START if dated else None,
        origin_s=0.0 if dated else 12.3456789,
        name="written",
        remarks=(remark("of_file", said=noticed),),
    )
    path = Path(tempfile.gettempdir()) / f"thermaxis_trip_{hash(log)}" / "written.csv"
    path.parent.mkdir()
    try:
        write_thermal_log(log, path)
        assert path.read_bytes().isascii()
        back = read_thermal_log(path)
    finally:
        path.unlink(missing_ok=True)
        path.parent.rmdir()
    assert list(back.columns) == list(log.columns)
    assert dict(back.units) == dict(log.units)
    assert (back.start, back.origin_s, back.name) == (log.start, log.origin_s, log.name)
    assert [*map(sentence_of, back.remarks)] == [*map(sentence_of, log.remarks)]
    np.testing.assert_array_equal(back.time_s, log.time_s)
    for name in log.columns:
        np.testing.assert_array_equal(back.columns[name], log.columns[name])


@pytest.mark.parametrize(
    "heading", ["minutes", "Time/min", "elapsed_min", "Elapsed time (min)", "Zeit in Minuten"]
)
def test_a_heading_in_minutes_is_known(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(f"{heading},T_C\n0,20\n2,21\n4,22\n")
    log = read_thermal_log(path)
    assert (log.duration_s, log.remarks) == (240.0, ())


def test_times_without_a_unit_are_seconds_and_it_is_said_how_long_the_log_is_then(
    tmp_path: Path,
) -> None:
    path = tmp_path / "log.csv"
    path.write_text("elapsed,T_C\n0,20\n3600,21\n28800,22\n")
    (said,) = read_thermal_log(path).remarks
    assert (said.code, said.values) == (
        "remark-seconds_assumed",
        {"column": "elapsed", "lasts": "8 h"},
    )
    path.write_text("time_s,T_C\n0,20\n3600,21\n")
    assert read_thermal_log(path).remarks == ()
