"""Matrices of temperatures are read whatever separates them, and errors name line and column."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

from benchmarks.virtual_table import format_field_csv
from tests.refusals import check_refusals, refusal_of
from thermaxis.codes import remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files import read_field_csv
from thermaxis.files.images import field_csv

EXPECTED = np.array([[20.5, 21.0, -0.25], [22.0, np.nan, 23.125]])


def read(tmp_path, content, name="image.csv"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_field_csv(path)


def test_every_separator_and_decimal_sign_gives_the_same_image(tmp_path):
    for text in (
        "20.5,21,-0.25\n22.0,,23.125\n",
        "20.5;21;-0.25\n22.0;;23.125\n",
        "20,5;21;-0,25\n22,0;;23,125\n",
        "20.5\t21\t-0.25\n22.0\t\t23.125\n",
        "20,5\t21\t-0,25\n22,0\t\t23,125\n",
        '"20,5","21","-0,25"\n"22,0",,"23,125"\n',
        "20.5, 21 , -.25\n22.,  ,+23.125\n",
        "2.05e1,21,-25E-2\n22,,23.125",
    ):
        assert np.array_equal(read(tmp_path, text).temperature_c, EXPECTED, equal_nan=True)


def test_line_ends_and_encodings_do_not_matter(tmp_path):
    for end, encoding in (("\n", "utf-8"), ("\r\n", "utf-8-sig"), ("\r", "utf-16")):
        text = "# Tisch: 24 °C\n20.5;21;-0.25\n\n22.0;;23.125\n".replace("\n", end)
        found = read(tmp_path, text.encode(encoding))
        assert np.array_equal(found.temperature_c, EXPECTED, equal_nan=True)
        assert found.name == "image.csv"


def test_comments_in_any_encoding_are_left_out(tmp_path):
    found = read(tmp_path, b"# teplota \xe8esky\n1,2\n# mezi\n3.5,4\n")
    assert found.temperature_c.tolist() == [[1.0, 2.0], [3.5, 4.0]]


def test_an_empty_last_column_of_separators_is_left_out_and_said(tmp_path):
    found = read(tmp_path, "1.5;2;\n3;4;\n")
    assert found.temperature_c.tolist() == [[1.5, 2.0], [3.0, 4.0]]
    assert found.remarks == (remark("empty_last_column"),)


def test_whole_numbers_between_commas_may_be_halves_of_decimals_and_this_is_said(tmp_path):
    suspected = (remark("decimal_commas_suspected"),)
    assert read(tmp_path, "20,5,21,3\n20,6,21,4\n").remarks == suspected
    assert read(tmp_path, "20.5,21\n20,6\n").remarks == ()


def test_kelvin_are_suspected(tmp_path):
    found = read(tmp_path, "297.1,297.2\n297.3,297.4\n")
    assert found.remarks == (remark("kelvin_suspected"),)


def test_a_wrong_cell_is_an_error_with_its_line_and_column(tmp_path):
    wrong = {
        "1,2\n3,x\n": "line 2, column 2: not_a_number",
        "# c\n1,2\n\n3,nan\n": "line 4, column 2: not_a_number",
        "1;2\n3;1_0\n": "line 2, column 2: not_a_number",
        "1;2\n3;0x10\n": "line 2, column 2: not_a_number",
        "1;2,5\n3;4.5\n": "line 2, column 2: not_a_number",
        "1.5;2\n3;4,5\n": "line 2, column 2: not_a_number",
        "1;2\n3;1.234,5\n": "line 2, column 2: not_a_number",
        "1,2\n3,-274\n": "line 2, column 2: outside_range",
        "1,2\n14000,3\n": "line 2, column 1: outside_range",
        "1,2\n1e400,3\n": "line 2, column 1: magnitude_too_large",
        "1,2,3\n4,5\n": "line 2, column 3: row_of_other_length",
        "1,2\n4,5,6\n": "line 2, column 3: row_of_other_length",
        '1,2\n3,"4\n': "line 2: quotation_marks",
        "x y\n1,2\n": "line 1, column 1: not_a_number",
        "1,2\n٣,4\n": "line 2, column 1: not_a_number",
    }
    check_refusals(read_field_csv, tmp_path / "image.csv", wrong)


def test_what_is_no_matrix_is_an_error(tmp_path):
    wrong = {
        b"": "file_empty",
        b"\n \n": "file_empty",
        b"# only a comment\n": "no_temperature_in_image",
        b"1,2,3\n": "image_too_small",
        b"1\n2\n": "image_too_small",
        b",\n,\n": "no_temperature_in_image",
        b"\x89PNG\r\n\x1a\n": "not_text",
        b"\xff\xd8\xff\xe0": "not_text",
        b"1,2\x00\n3,4\n": "not_text",
    }
    check_refusals(read_field_csv, tmp_path / "image.csv", wrong)


def test_a_file_that_is_not_there_or_a_folder_is_an_error(tmp_path):
    for path in (tmp_path / "nothing.csv", tmp_path):
        with pytest.raises(MeasurementFileError):
            read_field_csv(path)


def test_an_image_of_more_than_100_megapixel_is_refused_before_it_is_read_whole(tmp_path):
    path = tmp_path / "large.csv"
    line = (b"," * 50_000 + b"\n") * 20
    with path.open("wb") as stream:
        for _ in range(101):
            stream.write(line)
    assert path.stat().st_size > 100e6
    assert refusal_of(read_field_csv, path) == "line 2000: image_too_large"


def test_a_file_larger_than_any_image_is_refused_by_its_size(tmp_path):
    path = tmp_path / "huge.csv"
    with path.open("wb") as stream:
        stream.write(b"1,2\n")
        stream.truncate(field_csv.FIELD_LIMIT_BYTES + 1)  # sparse: takes no room
    assert refusal_of(read_field_csv, path) == "file_too_large"


def test_lines_and_sides_are_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(field_csv, "LONGEST_LINE", 100)
    monkeypatch.setattr(field_csv, "MOST_SIDE", 20)
    wrong = {
        "1" * 101: "line 1: line_too_long",
        ",\n" * 21: "line 21: image_too_large",
        "," * 21 + "\n": "line 1: image_too_large",
    }
    check_refusals(read_field_csv, tmp_path / "image.csv", wrong)


@settings(derandomize=True, max_examples=25, deadline=None)
@given(
    hnp.arrays(np.int64, hnp.array_shapes(min_dims=2, max_dims=2, min_side=2, max_side=8)).map(
        lambda a: (a % 200_001 - 20_000) / 100.0
    ),
    st.booleans(),
)
def test_what_is_written_is_read_back(tmp_path_factory, values, hole):
    values = values.copy()
    if hole:
        values[0, 0] = np.nan
    path = tmp_path_factory.mktemp("round") / "image.csv"
    text = format_field_csv(values, comments=("made by a test\nin one line",))
    path.write_text(text, encoding="utf-8")
    assert path.read_bytes().startswith(b"# made by a test in one line\n")
    if not np.isnan(values[:, -1]).all():
        assert np.array_equal(read_field_csv(path).temperature_c, values, equal_nan=True)
