"""``thermaxis check``: a configuration in plain words, and the virtual lathe looked at."""

import argparse
import asyncio
import json
import math
import re
import socket
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from shutil import copytree

import pytest

from tests.unit.runtime.machine_files import machine_file
from thermaxis import runtime
from thermaxis.cli import main
from thermaxis.cli.machine import check
from thermaxis.cli.machine._machine_parts import (
    PacedClock,
    build_parts,
    loop_settings,
    nodes_read,
    sole_runner,
)
from thermaxis.compensation import Request, RequestKind
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.runtime import (
    DIAMETER,
    OTHER_COMPENSATION,
    AtStop,
    CompensationLoop,
    SystemClock,
    VirtualClock,
    interlock_name,
    read_machine,
    redundant_name,
    run_in_virtual_time,
)
from thermaxis.runtime.sources import ReplayClock
from thermaxis.virtual import FAULTY, LatheServer, LatheServerSettings, VirtualLathe, parse_fault


def checked(path: Path, *words: str) -> int:
    """Run the command on a file and return its exit code."""
    parser = argparse.ArgumentParser()
    check.add_arguments(parser)
    return check.run(parser.parse_args([str(path), *words]))


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    (tmp_path / "history").mkdir()
    return machine_file(tmp_path)


# ---- the configuration alone --------------------------------------------------------------------


def words_of(text: str) -> str:
    return re.sub(r"\s+", " ", text)


def test_a_configuration_is_told_in_plain_words(machine, capsys):
    assert checked(machine, "--offline") == 0
    told = words_of(capsys.readouterr().out)
    for sentence in (
        "vertical lathe: every 1 s the temperatures are read",
        "Z_um is the sum of spindle (T_spindle_C - T_column_C, +10 µm/K in the end).",
        "referenced (ns=2;s=Z_referenced is true), emergency_stop (ns=2;s=EmergencyStop is false)",
        "the correction is -10 µm, and -0.01 in mm is written to ns=2;s=Z_offset",
        "for there positive moves the tool away from the workpiece.",
        "A lost input is bridged for 2 s, then Holding for 2 min, then Fading to zero",
        "the machine was not looked at",
    ):
        assert sentence in told


def test_the_sign_is_told_by_an_example(tmp_path, capsys):
    (tmp_path / "history").mkdir()
    path = machine_file(
        tmp_path, ('unit = "mm"\nsign', 'unit = "um"\nsign'), ("away from", "towards")
    )
    assert checked(path, "--offline") == 0
    assert "and +10 in um is written" in words_of(capsys.readouterr().out)


def test_every_mistake_is_told_on_a_line_of_its_own_and_the_code_is_two(tmp_path, capsys):
    path = machine_file(
        tmp_path, ("largest_um = 100.0", "largest_um = -1.0"), ("hold_input_s", "hold_inputs_s")
    )
    assert checked(path, "--offline", "--json", str(tmp_path / "found.json")) == check.WRONG
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert "hold_inputs_s" in lines[1]
    path = machine_file(
        tmp_path, ("largest_um = 100.0", "largest_um = -1.0"), ("lowest_c = 5.0", "lowest_c = 99.0")
    )
    assert checked(path, "--offline", "--json", str(tmp_path / "found.json")) == check.WRONG
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert all(re.match(r"thermaxis: error: .*machine\.toml, line \d+, \w", s) for s in lines)
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert found["machine"] is None
    assert len(found["configuration"]) == 3
    path.write_text("a." * 4_000 + "b = 1")
    assert checked(path, "--offline", "--json", str(tmp_path / "found.json")) == check.WRONG
    assert "not TOML" in capsys.readouterr().err
    (one,) = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))["configuration"]
    assert one["code"] == "error-not_toml"


def test_a_folder_that_is_missing_makes_the_code_one(tmp_path, capsys):
    assert checked(machine_file(tmp_path), "--offline") == check.FOUND
    assert "1 error: to be mended" in capsys.readouterr().out


def test_json_alone_goes_to_standard_output(machine, capsys):
    assert checked(machine, "--offline", "--json", "-") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["machine"]["outputs"]["Z_um"]["largest_um"] == 100.0
    assert found["machine"]["interlocks"]["emergency_stop"]["met"] is False
    assert found["self_test"] is None
    assert {entry["level"] for entry in found["warnings"]} == {"warning"}


def test_options_that_mean_nothing_are_refused(machine):
    with pytest.raises(ConfigurationError):
        checked(machine, "--offline", "--write")
    for seconds in ("0", "nan", "1e9"):
        with pytest.raises(SystemExit):
            checked(machine, "--wait", seconds)


def test_a_secret_is_never_told(tmp_path, capsys):
    (tmp_path / "history").mkdir()
    secret = tmp_path / "secret"
    secret.write_text("hunter2\n", encoding="utf-8")
    secret.chmod(0o600)
    path = machine_file(
        tmp_path,
        (
            'url = "sqlite:///history/lathe.db"',
            'url = "postgresql://lathe@127.0.0.1/x"\npassword_file = "secret"',
        ),
    )
    assert checked(path, "--offline", "--json", str(tmp_path / "found.json")) == 0
    printed = capsys.readouterr()
    written = (tmp_path / "found.json").read_text(encoding="utf-8")
    assert "hunter2" not in printed.out + printed.err + written


# ---- with the virtual lathe ---------------------------------------------------------------------


async def _served(lathe: VirtualLathe, folder: Path, words: Sequence[str]) -> int:
    settings = LatheServerSettings(port=0)
    started: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    serving = asyncio.create_task(LatheServer(lathe, settings, SystemClock()).run(started))
    try:
        await asyncio.wait({serving, started}, return_when=asyncio.FIRST_COMPLETED)
        path = folder / "lathe.toml"
        text = path.read_text(encoding="utf-8")
        path.write_text(
            re.sub(r'url = "opc.tcp[^"]*"', f'url = "{started.result()}"', text), encoding="utf-8"
        )
        return await asyncio.to_thread(checked, path, *words)
    finally:
        serving.cancel()
        with suppress(asyncio.CancelledError):
            await serving


@pytest.fixture
def example(root: Path, tmp_path: Path) -> Path:
    """Return a copy of the example's folder."""
    return Path(copytree(root / "examples" / "machine", tmp_path / "machine"))


def looked_at(folder: Path, *words: str, faults: Sequence[str] = ()) -> tuple[int, dict]:
    """Check the example against a lathe with faults; return the code and the result."""
    lathe = VirtualLathe("verification", 1, faults=[parse_fault(s, FAULTY) for s in faults])
    found = folder / "found.json"
    code = asyncio.run(_served(lathe, folder, (*words, "--json", str(found))))
    return code, json.loads(found.read_text(encoding="utf-8"))


def not_ok(result: dict) -> dict[str, tuple[str, str]]:
    return {
        entry["place"]["key"]: (entry["level"], entry["code"].removeprefix("self_test-"))
        for entry in result["self_test"]
        if entry["level"] != "ok"
    }


def test_the_example_fits_the_virtual_lathe_and_its_offset_is_written_back(example, capsys):
    code, result = looked_at(example, "--write")
    assert not_ok(result) == {}
    assert code == 0
    assert result["self_test"][-1]["code"] == "self_test-offset_written_back"
    assert "Nothing forbids a correction" in capsys.readouterr().out


def test_what_is_wrong_with_the_lathe_is_found(example):
    code, result = looked_at(
        example,
        faults=(
            "bad T_spindle_C",
            "jump T_table_C by 273.15",
            "jump T_column_2_C by 8",
            "set emergency_stop to 1",
            "set own_compensation to 1",
        ),
    )
    found = not_ok(result)
    assert code == check.FOUND
    assert found["input.T_spindle_C"] == ("warning", "input_no_value")
    assert found["input.T_table_C"] == ("error", "input_other_unit")
    assert found["input.T_column_C"] == ("warning", "redundant_differs")
    assert found["interlock.no_emergency_stop"] == ("warning", "interlock_open")
    assert found["other_compensation"] == ("error", "other_compensation_active")


def test_wrong_nodes_types_and_units_are_found_on_the_lathe(example):
    path = example / "lathe.toml"
    text = path.read_text(encoding="utf-8")
    for old, new in (
        (';s=T_spindle_C"\nredundant_node = "nsu=urn:thermaxis:lathe;s=T_spindle_2_C"', ';s=T_x"'),
        ("s=T_table_C", "s=coolant_on"),
        ('lathe;s=T_column_2_C"\nunit = "degC"', 'lathe;s=T_column_2_C"\nunit = "K"'),
        ("s=referenced", "s=T_hall_C"),
        ("s=offset_mm", "s=n_table_rpm"),
        ("nsu=urn:thermaxis:lathe;s=heartbeat", "nsu=urn:other;s=heartbeat"),
    ):
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    code, result = looked_at(example, "--write")
    found = not_ok(result)
    assert code == check.FOUND
    for key, finding in {
        "input.T_spindle_C": "no_node",
        "input.T_table_C": "node_no_number",
        "input.T_column_C": "input_other_unit",
        "interlock.referenced": "node_no_flag",
        "output.Z_um": "output_not_writable",
        "sink.heartbeat_node": "no_node",
    }.items():
        assert found[key] == ("error", finding)
    assert {level for level, _ in found.values()} == {"error"}


def test_nothing_is_written_back_while_another_program_runs_the_machine(example, tmp_path):
    path = example / "lathe.toml"
    copytree(example, tmp_path / "copy")
    with sole_runner(read_machine(path)):
        with pytest.raises(ConfigurationError, match=r"Another program .* already runs"):
            checked(path, "--write", "--wait", "0.1")
        with pytest.raises(
            ConfigurationError, match=r"already writes the offset localhost:\d+ nsu"
        ):
            checked(tmp_path / "copy" / "lathe.toml", "--write", "--wait", "0.1")


def test_a_machine_that_is_not_there_is_told_after_the_wait(example, capsys):
    path = example / "lathe.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("127.0.0.1:4840", "127.0.0.1:1"), encoding="utf-8")
    assert checked(path, "--wait", "0.3") == check.FOUND
    assert "Not connected" in capsys.readouterr().out


SCREEN = '[server]\nanonymous_role = "viewer"\n\n[screen]\nview_without_login = true'


# ---- the parts ----------------------------------------------------------------------------------


def test_a_port_that_is_taken_is_an_error_unless_it_is_that_of_the_running_loop(machine, tmp_path):
    found, file = tmp_path / "found.json", machine.with_name("taken.toml")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]

        def told(port: int, table: str = "[metrics]") -> list[tuple[str, str]]:
            file.write_text(f"{machine.read_text()}\n{table}\nport = {port}\n")
            checked(file, "--wait", "0.01", "--json", str(found))
            said = json.loads(found.read_text())["self_test"]
            keys = {"metrics.port", "screen.port"}
            return [(one["level"], one["code"]) for one in said if one["place"]["key"] in keys]

        assert told(port) == [("error", "error-cannot_listen")]
        assert told(0) == []
        assert told(port, SCREEN) == [("warning", "self_test-port_unusable")]  # may be its own
        configuration = read_machine(file)
        with runtime.sole_runner(configuration.state_file, configuration.name):
            assert told(port) == []
        assert told(port) == [("error", "error-cannot_listen")]  # the lock's file is left


def test_every_channel_flag_and_second_sensor_is_read_by_its_name(machine):
    nodes = nodes_read(read_machine(machine))
    assert set(nodes) == {
        "T_spindle_C",
        redundant_name("T_spindle_C"),
        "T_column_C",
        interlock_name("referenced"),
        interlock_name("emergency_stop"),
        OTHER_COMPENSATION,
        DIAMETER,
    }
    assert nodes["T_column_C"].unit == "K"
    assert nodes[interlock_name("referenced")].unit == "bool"
    assert nodes[DIAMETER].node == "ns=2;s=Diameter"


def test_the_loop_learns_what_the_flags_mean_and_source_and_sink_share_a_connection(machine):
    configuration = read_machine(machine)
    settings = loop_settings(configuration)
    assert settings.interlocks_met == {"referenced": True, "emergency_stop": False}
    assert (settings.other_active, settings.reads_diameter) == (True, True)
    assert (settings.at_stop, settings.model_file) == (AtStop.FADE, "lathe.json")
    parts = build_parts(configuration, SystemClock())
    assert list(parts.sessions) == ["control"]
    assert parts.ports.source.session is parts.sink.session is parts.sessions["control"]


LOG = "time_s,T_spindle_C,T_column_C\n" + "".join(
    f"{10 * k},{20.0 + 0.5 * min(k, 20):.1f},20.0\n" for k in range(120)
)


def replayed(folder: Path, *more: tuple[str, str]) -> Path:
    (folder / "history").mkdir(exist_ok=True)
    (folder / "log.csv").write_text(LOG, encoding="utf-8")
    return machine_file(
        folder,
        (
            '[source]\nkind = "opcua"',
            '[source]\nkind = "replay"\nlog = "log.csv"\nas_fast_as_possible = true',
        ),
        ('[sink]\nkind = "opcua"', '[sink]\nkind = "dry"'),
        *more,
    )


async def _replay(path: Path) -> CompensationLoop:
    configuration = read_machine(path)
    parts = build_parts(configuration, SystemClock())
    loop = CompensationLoop(configuration.compensation, loop_settings(configuration), parts.ports)
    running = asyncio.create_task(loop.run(asyncio.Event()))
    outcome = await loop.submit(Request(RequestKind.ENABLE, who="the test"))
    assert outcome.accepted
    await running
    return loop


def test_a_log_is_replayed_through_the_whole_chain_into_a_dry_sink(tmp_path):
    loop = asyncio.run(_replay(replayed(tmp_path)))
    assert loop.status is not None
    assert loop.status.number == 1191
    # the same by hand: one lag of 600 s behind 10 um/K, each row held until the next
    state_k, alpha = 0.0, 1.0 - math.exp(-1.0 / 600.0)
    for second in range(1190):
        state_k += alpha * (0.5 * min(second // 10, 20) - state_k)
    assert loop.status.output.correction_um[0] == pytest.approx(-10.0 * state_k, abs=1e-6)
    assert loop.status.offsets["Z_um"].accepted.um == loop.status.output.correction_um[0]
    assert (tmp_path / "history" / "lathe.db").stat().st_size > 0


@pytest.mark.proof
def test_any_machine_is_rehearsed_by_a_log_of_its_own(tmp_path, capfd):
    assert main(["run", str(replayed(tmp_path)), "--enable"]) == 0
    said = capfd.readouterr()
    assert "Z Active; correction: Z_um -" in said.out
    assert said.err == ""


def test_a_witness_that_the_model_does_without_is_replayed_where_the_log_has_it(tmp_path):
    more = '[input.T_hall_C]\nunit = "degC"\nlowest_c = 5.0\nhighest_c = 60.0\n\n[supervisor]'
    rests = ("= 0.05\n", '= 0.05\nmoves_with = "T_hall_C"\nrests_k = 0.5\n')
    path = replayed(tmp_path, ("[supervisor]", more), rests)
    source = build_parts(read_machine(path), SystemClock()).ports.source
    assert "T_hall_C" not in asyncio.run(source.read(1.0))
    rows = [f"{line},{'T_hall_C' if not i else 20}" for i, line in enumerate(LOG.splitlines())]
    (tmp_path / "log.csv").write_text("\n".join(rows), encoding="utf-8")
    source = build_parts(read_machine(path), SystemClock()).ports.source
    assert asyncio.run(source.read(1.0))["T_hall_C"].value == 20.0


def test_a_replay_of_a_log_that_lacks_a_channel_is_refused(tmp_path):
    path = replayed(tmp_path)
    log = tmp_path / "log.csv"
    log.write_text(LOG.replace("T_column_C", "T_bed_C"), encoding="utf-8")
    with pytest.raises(DataError, match="T_column_C"):
        build_parts(read_machine(path), SystemClock())


def test_a_replay_at_the_pace_of_the_day_waits_as_long_as_the_day_did():
    async def work() -> tuple[float, float]:
        real = VirtualClock()
        await real.sleep_until(real.monotonic_s() + 100.0)
        replay = ReplayClock()
        paced = PacedClock(replay, real)
        begin_s = real.monotonic_s()
        for second in range(1, 31):
            await paced.sleep_until(float(second))
            assert paced.monotonic_s() == second == replay.monotonic_s()
        await paced.sleep_until(3.0)
        return real.monotonic_s() - begin_s, paced.monotonic_s()

    waited_s, now_s = run_in_virtual_time(work())
    assert waited_s == pytest.approx(30.0)
    assert now_s == 30.0
