"""The command ``montecarlo``: words for people, JSON for programs, one error for a bad number."""

import json

import pytest

from thermaxis.cli import execute
from thermaxis.errors import ConfigurationError


def run(*words):
    return execute(["montecarlo", *words])


def test_the_result_is_told_in_words(capsys):
    assert run() == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "2000 experiments with 1000 normal random numbers each, seed 2017" in shown.out
    assert "1.4142" in shown.out
    assert shown.out.count(", with the expected value") == 2
    assert "The paper's 1.4076 from 1000 numbers lies inside" in shown.out


def test_json_on_standard_output_stands_there_alone(capsys):
    assert run("--json", "-", "--samples", "200", "--repetitions", "60", "--seed", "5") == 0
    shown = json.loads(capsys.readouterr().out)
    assert (shown["samples"], shown["repetitions"], shown["seed"]) == (200, 60, 5)
    assert shown["sigma_a"] == shown["sigma_b"] == 1.0
    ratio_keys = {
        "theory",
        "expected",
        "first",
        "mean",
        "mean_interval",
        "scatter",
        "single_interval",
    }
    for name in ("one_sequence", "two_sequences", "to_larger", "to_smaller"):
        assert set(shown[name]) == ratio_keys
    assert shown["paper_ratio"] == 1.4076
    assert shown["paper_ratio_allowed"] is True
    assert sum(shown["histogram"]["source"]) == 200
    assert sum(shown["histogram"]["derived"]) == 199
    assert len(shown["histogram"]["edges"]) == len(shown["histogram"]["source"]) + 1


def test_a_number_that_is_not_possible_is_one_error(capsys):
    for words in [
        ("--samples", "2"),
        ("--repetitions", "1"),
        ("--sigma-a", "0"),
        ("--sigma-a", "-1"),
        ("--sigma-a", "nan"),
        ("--sigma-b", "inf"),
        ("--seed", "-1"),
        ("--samples", "1000000", "--repetitions", "1000000"),
    ]:
        with pytest.raises(ConfigurationError):
            run(*words)
        assert capsys.readouterr().out == ""


@pytest.mark.proof
def test_the_distributions_are_drawn_when_asked_for(tmp_path, capsys):
    folder = tmp_path / "charts"
    run("--repetitions", "50", "--figures", str(folder))
    assert {file.suffix for file in folder.iterdir()} == {".png", ".svg", ".csv"}
    assert "How much more" in capsys.readouterr().out
