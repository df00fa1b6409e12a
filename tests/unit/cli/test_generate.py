"""The command ``generate`` writes the virtual axes, and the shipped examples are what it writes."""

from pathlib import Path

import numpy as np
import pytest

from thermaxis.cli import execute
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_positioning
from thermaxis.positioning import TimeSource
from thermaxis.virtual import paper_x_axis, paper_y_axis

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


def run(*words):
    return execute(["generate", *map(str, words)])


@pytest.mark.parametrize(
    ("axis", "name"), [("x-axis", "x_axis_100_cycles.csv"), ("y-axis", "y_axis_50_cycles.rtl")]
)
def test_the_shipped_example_is_what_the_command_writes(axis, name, tmp_path):
    run(axis, "-o", tmp_path / name)
    assert (tmp_path / name).read_bytes() == (EXAMPLES / name).read_bytes()


def test_a_csv_keeps_every_reading_with_its_time(tmp_path, capsys):
    file = tmp_path / "run.CSV"
    assert run("x-axis", "--seed", "7", "--cycles", "4", "-o", file) == 0
    assert capsys.readouterr().out == f"{file}: 16 targets, 4 cycles, generated with seed 7\n"
    made, read = paper_x_axis(7, cycles=4).test, read_positioning(file)
    assert read.time_source is TimeSource.FILE
    for name in ("target", "deviation", "time_s", "order"):
        assert np.allclose(getattr(read, name), getattr(made, name), rtol=0, atol=1e-9), name
    assert read.header["title"] == made.header["title"]
    assert read.start == made.start


def test_an_rtl_keeps_every_reading_to_the_recorded_digit(tmp_path):
    file = tmp_path / "run.rtl"
    run("y-axis", "--cycles", "6", "--noise-um", "0.5", "-o", file)
    made, read = paper_y_axis(cycles=6, noise_um=0.5).test, read_positioning(file)
    assert np.array_equal(read.target, made.target)
    assert np.array_equal(read.deviation, made.deviation)
    assert read.time_source is TimeSource.INTERPOLATED
    assert "no machine was measured" in read.header["title"]


def test_the_noise_can_be_taken_away(tmp_path):
    run("y-axis", "--noise-um", "0", "--cycles", "3", "-o", tmp_path / "still.csv")
    still = paper_y_axis(cycles=3, noise_um=0.0)
    assert not still.noise.any()
    assert np.array_equal(read_positioning(tmp_path / "still.csv").deviation, still.test.deviation)


def test_what_cannot_be_is_one_error_and_leaves_no_file(tmp_path, monkeypatch):
    for words in [
        ("x-axis", "-o", "run.txt"),
        ("x-axis", "-o", "run"),
        ("x-axis", "--cycles", "0", "-o", "run.csv"),
        ("x-axis", "--cycles", "1000000000", "-o", "run.csv"),
        ("x-axis", "--seed", "-1", "-o", "run.csv"),
        ("y-axis", "--noise-um", "-1", "-o", "run.csv"),
        ("y-axis", "--noise-um", "nan", "-o", "run.csv"),
    ]:
        monkeypatch.chdir(tmp_path)
        with pytest.raises(ConfigurationError):
            run(*words)
        assert list(tmp_path.iterdir()) == []
