"""The command of the virtual lathe: lists, logs, serving, and options that do not go together."""

import argparse
from pathlib import Path

import numpy as np
import pytest

from thermaxis.cli.machine import machine
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_thermal_log
from thermaxis.virtual import SCENARIOS, SIGNALS


def run(*words: object) -> int:
    parser = argparse.ArgumentParser()
    machine.add_arguments(parser)
    return machine.run(parser.parse_args([str(word) for word in words]))


def test_the_list_names_every_scenario_and_signal(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--list") == 0
    printed = capsys.readouterr().out
    for name in (*SCENARIOS, *SIGNALS):
        assert f"  {name}" in printed
    assert printed.count("may be written") == sum(s.writable for s in SIGNALS.values())


def test_a_log_of_hours_is_written_as_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "log.parquet"
    fault = "bad T_table at 30min for 10min"
    words = ("--log", "2h", "--seed", 4, "-o", path, "--every", "30s", "--truth", "--fault", fault)
    assert run(*words) == 0
    assert f"{path}: 240 rows, 2 h of day, seed 4" in capsys.readouterr().out
    log = read_thermal_log(path)
    assert log.usual_step_s == 30.0
    assert np.flatnonzero(np.isnan(log.column("T_table_C"))).tolist() == list(range(60, 80))
    assert "Z_D3000_uncorrected_um" in log.columns


def test_a_whole_scenario_is_logged(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    run("--log", "all", "--scenario", "verification", "-o", path, "--every", "2min")
    assert read_thermal_log(path).rows == 16 * 30


def test_it_serves_on_a_free_port_and_ends_by_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--port", 0, "--speed", 60, "--stop-after", "100ms") == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("endpoint: opc.tcp://127.0.0.1:")
    assert first.endswith("/lathe")
    assert not first.endswith(":0/lathe")
    assert second.startswith("day, seed 1")


def test_what_does_not_go_together_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for words, key in (
        (("--log", "1h"), "--log"),
        (("--log", "1h", "-o", "log.txt"), ""),
        (("--log", "1h", "-o", "log.csv", "--port", "0"), "--port"),
        (("--log", "1h", "-o", "log.csv", "--watchdog", "off"), "--watchdog"),
        (("-o", "log.csv"), "--output"),
        (("--truth",), "--truth"),
        (("--scenario", "turret"), "scenario"),
        (("--seed", "-1"), "seed"),
        (("--fault", "stuck T_turret"), "fault 'stuck T_turret'"),
        (("--clamp", "0"), "largest_um"),
        (("--rate", "-1"), "rate_um_per_s"),
        (("--port", "99999"), "--port"),
        (("--speed", "0"), "--speed"),
        (("--address", "0.0.0.0"), "--address"),  # noqa: S104 - refused
        (("--user", "anna"), "--user, --password-file"),
    ):
        with pytest.raises(ConfigurationError) as caught:
            run(*words)
        assert caught.value.place.key == key
        assert not list(tmp_path.iterdir())


def test_a_password_comes_from_a_file_that_holds_one(tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    empty.write_text("\n", encoding="ascii")
    empty.chmod(0o600)
    with pytest.raises(ConfigurationError):
        run("--user", "anna", "--password-file", empty, "--port", "0")
    empty.write_text("word\n", encoding="ascii")
    empty.chmod(0o644)
    with pytest.raises(ConfigurationError):
        run("--user", "anna", "--password-file", empty, "--port", "0")


def test_times_that_are_none_are_refused_by_the_parser() -> None:
    for words in (("--log", "-1h"), ("--every", "0s"), ("--watchdog", "never")):
        with pytest.raises(SystemExit):
            run(*words)


def test_clamp_rate_and_watchdog_reach_the_machine() -> None:
    parser = argparse.ArgumentParser()
    machine.add_arguments(parser)
    words = ["--clamp", "50", "--rate", "0.5", "--watchdog", "off"]
    rules = machine._settings(parser.parse_args(words)).offset
    assert (rules.largest_um, rules.rate_um_per_s, rules.watchdog_s) == (50.0, 0.5, None)
    rules = machine._settings(parser.parse_args(["--watchdog", "5s"])).offset
    assert rules.watchdog_s == 5.0
