"""`thermal-test plan` and `places`, a plan's program, and what is told while it is recorded."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.unit.cli.refusals import code_of, refusal
from tests.unit.runtime.simulated import VirtualClock, run_in_virtual_time
from thermaxis.cli import main
from thermaxis.cli._planned_test import told_of_plan
from thermaxis.cli.machine.record import tell_of_plan
from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.files import (
    read_heating_conditions,
    read_thermal_test_plan,
    thermal_test_plan_sha256,
    write_thermal_log,
)
from thermaxis.thermal import HeatingConditions, HeatSource, ThermalLog

HEAT = """
enough_um = {enough}
[sources.spindle]
levels = [0, 3000]
input = "T_spindle_C-T_column_C"
switch = {{ kind = "spindle" }}
[noise]
every_s = 30
"""


class EnoughToldError(Exception):
    """Ends what goes on without end."""


@pytest.fixture
def planned(tmp_path: Path) -> Callable[[float], Path]:
    def of(enough_um: float) -> Path:
        heat, plan = tmp_path / "heat.toml", tmp_path / "plan.json"
        heat.write_text(HEAT.format(enough=enough_um))
        words = ["thermal-test", "plan", "--machine", heat, "--duration", "3h", "-o", plan]
        assert main([*map(str, words), "--json", str(tmp_path / "said.json")]) == 0
        return plan

    return of


def log_of(path: Path, plan_file: Path, hours: float) -> Path:
    """Write the log of a machine on which the plan ran for so long."""
    plan, step_s, rng = read_thermal_test_plan(plan_file), 30.0, np.random.default_rng(1)
    time_s = np.arange(0.0, 3600.0 * hours, step_s)
    rise, slow, t, z = 0.0, 0.0, np.zeros(time_s.size), np.zeros(time_s.size)
    for k, now_s in enumerate(time_s):
        step = [one for one in plan.steps if one.begin_s <= now_s][-1]
        t[k], z[k] = 10.0 * rise, 8.0 * rise + 20.0 * slow
        rise += step_s / 1200.0 * (float(step.levels[0] > 0) - rise)
        slow += step_s / 4000.0 * (rise - slow)
    columns = {
        "T_spindle_C": 22.0 + t,
        "T_column_C": np.full(time_s.size, 22.0),
        "Z_um": z + rng.normal(0.0, 0.4, time_s.size),
    }
    write_thermal_log(ThermalLog.from_columns(columns, time_s=time_s, name="log.csv"), path)
    return path


def test_a_plan_says_what_it_foresees_and_is_read_as_written(
    planned: Callable[[float], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = planned(1000.0)
    shown, said = capsys.readouterr().out, json.loads((tmp_path / "said.json").read_text())
    plan = read_thermal_test_plan(path)
    assert said["foreseen_um"] == list(plan.foreseen_um)
    assert said["customary_um"]["heat_and_cool"] >= said["foreseen_um"][-1]
    assert "reached after 0.67 h" in shown
    assert "one source after another, heat and cool" in shown
    content = json.loads(path.read_text())
    assert content["sha256"] == thermal_test_plan_sha256(plan)
    content["blocks"][0] = [3000.0 - content["blocks"][0][0]]
    path.write_text(json.dumps(content))
    with pytest.raises(ConfigurationError, match="sha256"):
        read_thermal_test_plan(path)


def test_a_program_is_written_of_a_plan(planned: Callable[[float], Path], tmp_path: Path) -> None:
    path, program = planned(1.0), tmp_path / "test.mpf"
    assert main(["program", str(path), "--control", "sinumerik", "-o", str(program)]) == 0
    text = program.read_text()
    assert thermal_test_plan_sha256(read_thermal_test_plan(path)) in text
    assert "S1=3000 M1=3" in text
    words = ["program", path, "--control", "sinumerik", "-o", program, "--axis", "X"]
    assert code_of(*words) == "option_belongs_to"


def test_every_switch_comes_from_the_plan_into_the_program(tmp_path: Path) -> None:
    heat, plan, program = (tmp_path / name for name in ("heat.toml", "plan.json", "test.mpf"))
    heat.write_text(
        "[sources.spindle]\nlevels = [0, 3000]\nswitch = { kind = 'spindle' }\n"
        "[sources.pump]\nswitch = { kind = 'function', on = 51, off = 52 }\n"
        "[sources.slide]\nlevels = [0, 5000]\n"
        "switch = { kind = 'axis', axis = 'X', from_mm = 10, to_mm = 300 }\n"
    )
    planned = ["thermal-test", "plan", "--machine", heat, "--duration", "3h", "-o", plan]
    assert main([*map(str, planned)]) == 0
    written = ["program", plan, "--control", "sinumerik", "-o", program]
    assert main([*map(str, written)]) == 0
    lines = program.read_text().splitlines()
    assert {"M51", "M52"} <= set(lines)
    assert lines.index("M52") < lines.index("M51")  # it begins at rest
    assert lines[::-1].index("M52") < lines[::-1].index("M51")  # and ends at rest
    assert {"SUPA G1 X=300.000 F5000", "SUPA G1 X=10.000 F5000"} <= set(lines)


def test_after_a_test_the_next_begins_where_it_ended(
    planned: Callable[[float], Path], tmp_path: Path
) -> None:
    plan = planned(1.0)
    before = json.loads((tmp_path / "said.json").read_text())
    log = log_of(tmp_path / "log.csv", plan, 3.0)
    words = ["thermal-test", "plan", "--machine", tmp_path / "heat.toml", "--after", log]
    words += ["--duration", "2h", "--json", tmp_path / "next.json"]
    assert main([*map(str, words)]) == 0
    said = json.loads((tmp_path / "next.json").read_text())
    (reached_um,) = said["reached_um"]
    assert 0.3 * before["foreseen_um"][-1] < reached_um < 2.0 * before["foreseen_um"][-1]
    assert said["foreseen_um"][-1] < reached_um
    assert code_of(*words, "--after", log) == "same_log_twice"


def test_what_is_reached_is_told_while_it_runs_and_when_it_is_enough(
    planned: Callable[[float], Path], tmp_path: Path
) -> None:
    file = planned(1000.0)
    plan = read_thermal_test_plan(file)
    assert told_of_plan(plan, []) is None
    assert told_of_plan(plan, [log_of(tmp_path / "a.csv", file, 0.5)]) is None  # no block yet
    enough = told_of_plan(plan, [log_of(tmp_path / "b.csv", file, 2.0)])
    assert enough is not None
    assert enough.code == "recording-plan_enough"
    strict = read_thermal_test_plan(planned(1e-3))
    told = [told_of_plan(strict, [log_of(tmp_path / "c.csv", file, h)]) for h in (1.0, 3.0)]
    assert [one.code for one in told if one] == ["recording-plan_reached"] * 2
    first, last = (float(str(one.values["reached_um"])) for one in told if one)
    assert last < first
    both = [tmp_path / "a.csv", tmp_path / "b.csv"]
    assert told_of_plan(strict, both) == Message("recording-plan_over_files")
    (tmp_path / "d.csv").write_text("time_s,Q_um\n0,1\n4000,2\n8000,3\n")
    unread = told_of_plan(strict, [tmp_path / "d.csv"])
    assert unread is not None
    assert unread.code == "recording-plan_unread"


def test_it_is_told_every_ten_minutes(planned: Callable[[float], Path], tmp_path: Path) -> None:
    file = planned(1000.0)
    logs, told = [log_of(tmp_path / "b.csv", file, 2.0)], list[tuple[float, str]]()

    async def watched() -> None:
        clock = VirtualClock()
        plan, end = read_thermal_test_plan(file), 3
        begin_s = clock.monotonic_s()

        def tell(message: Message) -> None:
            told.append((clock.monotonic_s() - begin_s, message.code))
            if len(told) == end:
                raise EnoughToldError

        with pytest.raises(EnoughToldError):
            await tell_of_plan(plan, logs, clock, tell)

    run_in_virtual_time(watched())
    assert [time_s for time_s, _ in told] == pytest.approx([600.0, 1200.0, 1800.0], abs=1.0)


def test_sources_without_an_input_can_be_planned_but_not_followed(tmp_path: Path) -> None:
    heat, plan = tmp_path / "heat.toml", tmp_path / "plan.json"
    heat.write_text("[sources.spindle]\nlevels = [0, 3000]\n")
    words = ["thermal-test", "plan", "--machine", heat, "--duration", "2h"]
    assert main([*map(str, words), "-o", str(plan)]) == 0
    record = tmp_path / "record.toml"
    record.write_text(
        '[connection.a]\nurl = "opc.tcp://127.0.0.1:4840"\nsecurity = "none"\n'
        '[channel.T]\nnode = "ns=2;s=T"\nunit = "degC"\n'
    )
    log = log_of(tmp_path / "log.csv", plan, 1.0)
    assert code_of(*words, "--after", log) == "missing_key"
    recorded = ("record", record, "-o", tmp_path / "test", "--plan", plan)
    assert code_of(*recorded) == "missing_key"
    heat.write_text(HEAT.format(enough=1.0))
    assert main([*map(str, words), "-o", str(plan)]) == 0
    error = refusal(*recorded)
    assert (error.code, error.place.key) == ("unknown_name", "--plan")


def _heat_of(page: Path, to: Path) -> Path:
    text = page.read_text("utf-8").split("```toml\n# heat.toml\n")[1].split("```")[0]
    to.write_text(text, encoding="utf-8")
    return to


def test_the_pages_show_files_that_are_read_and_its_defaults(tmp_path: Path) -> None:
    docs = Path(__file__).parents[3] / "docs"
    short, shown = (
        read_heating_conditions(_heat_of(docs / page, tmp_path / "heat.toml"))
        for page in ("how-to/thermal-test.md", "settings.md")
    )
    assert set(short.sources) < set(shown.sources)
    plain = HeatingConditions(sources={"spindle": HeatSource()})
    for key in ("lags", "noise", "use", "block_min", "rest_min", "cool_min", "output", "wanted"):
        assert getattr(shown, key) == getattr(plain, key), key
    for key in ("temperature_k", "displacement_um", "rise_min"):
        assert getattr(shown.sources["spindle"], key) == getattr(HeatSource(), key), key


def test_a_mistake_is_named_with_its_source(tmp_path: Path) -> None:
    heat = tmp_path / "heat.toml"
    words = ["thermal-test", "plan", "--machine", heat, "--duration", "2h"]
    for text, code, key in (
        ("[sources.a]\nlevels = [1, 2]\n", "levels_not_from_zero", "sources.a.levels"),
        ("[sources.a]\nlevel = 3\n", "unknown_key_near", "sources.a.level"),
        ("[sources.a]\nrise_min = [9, 3]\n", "span_not_possible", "sources.a.rise_min"),
        ("sources = 3\n", "not_a_table", "sources"),
        ("[sources.a]\n[noise]\nreading_um = 0\n", "not_positive_up_to", "noise.reading_um"),
    ):
        heat.write_text(text)
        error = refusal(*words)
        assert (error.code, error.place.key) == (code, key)


def test_places_are_chosen_from_logs(tmp_path: Path) -> None:
    rng, n = np.random.default_rng(3), 1200
    t = np.zeros((n, 5))
    heat = rng.integers(0, 2, (n // 40, 5)).repeat(40, axis=0)
    for k in range(1, n):
        t[k] = t[k - 1] + 0.06 * (8.0 * heat[k] - t[k - 1])
    columns = {f"T{k}_C": 20.0 + t[:, k] + rng.normal(0.0, 0.02, n) for k in range(5)}
    columns["Z_um"] = 2.0 * t[:, 1] - 1.5 * t[:, 3] + rng.normal(0.0, 0.2, n)
    log = ThermalLog.from_columns(columns, time_s=60.0 * np.arange(n), name="log.csv")
    write_thermal_log(log, tmp_path / "log.csv")
    words = ["thermal-test", "places", tmp_path / "log.csv", "--places", "2"]
    assert main([*map(str, words), "--json", str(tmp_path / "p.json")]) == 0
    said = json.loads((tmp_path / "p.json").read_text())
    assert said["best"] == ["T1_C", "T3_C"]
    assert min(said["without_um"].values()) > 3.0 * said["error_um"]
    assert code_of(*words, "--place", "a=T1_C") == "outside_range"
    bare = tmp_path / "bare.csv"
    bare.write_text("time_s,Z_um\n0,1\n10,2\n20,3\n")
    assert code_of("thermal-test", "places", bare) == "outside_count"
    error = refusal("thermal-test", "places", bare, "--place", "a=T1_C")
    assert (error.code, error.place.file) == ("unknown_column", str(bare))


def test_a_negative_duration_is_told_from_an_option(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["thermal-test", "plan", "--machine", "heat.toml", "--duration", "-3h"])
    assert "'-3h' is no positive time" in capsys.readouterr().err
