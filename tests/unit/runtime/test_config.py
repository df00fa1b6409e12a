"""Configuration of a machine: what is read, and that every mistake is said in words."""

import re
from contextlib import suppress
from dataclasses import MISSING, fields, replace
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from tests.unit.runtime.machine_files import TEXT, machine_file, model
from thermaxis.codes import Message
from thermaxis.compensation import Limits, SensorRules, SupervisorRules
from thermaxis.errors import ConfigurationError
from thermaxis.files import model_sha256, write_model
from thermaxis.messages import text_of
from thermaxis.runtime import (
    LoopSettings,
    MachineConfiguration,
    ServerSettings,
    examine_machine,
    read_machine,
)
from thermaxis.runtime.sinks.opcua import OpcUaOutput, _asked


def problems_of(path: Path) -> tuple[Message, ...]:
    found = examine_machine(path)
    assert not isinstance(found, MachineConfiguration)
    return found


def only_problem(path: Path) -> Message:
    (problem,) = problems_of(path)
    return problem


def line_of(path: Path, text: str) -> int:
    lines = path.read_text(encoding="utf-8").splitlines()
    return next(number for number, line in enumerate(lines, start=1) if text in line)


# ---- what is read -------------------------------------------------------------------------------


def test_a_whole_configuration_becomes_a_compensation(tmp_path: Path) -> None:
    found = read_machine(machine_file(tmp_path))
    compensation = found.compensation
    assert compensation.model == model()
    assert compensation.cycle_s == 1.0
    assert compensation.sensors["T_spindle_C"] == SensorRules(lowest_c=5.0, highest_c=90.0)
    assert compensation.sensors["T_column_C"] == SensorRules(
        lowest_c=5.0, highest_c=60.0, largest_rate_k_per_s=0.05
    )
    assert compensation.limits == {"Z_um": Limits(100.0, 0.5)}
    assert compensation.supervisor == SupervisorRules(hold_input_s=120.0)
    assert compensation.redundant == {"T_spindle_C"}
    assert compensation.interlocks == ("referenced", "emergency_stop")
    assert (compensation.validity_margin_k, compensation.lowest_weight) == (4.0, 0.0)
    assert found.model.sha256 == model_sha256(model())


def test_paths_count_from_the_folder_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = machine_file(tmp_path)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    found = read_machine(Path("..") / path.name)
    assert found.model.path.resolve() == tmp_path / "models" / "lathe.json"
    assert found.machine.model_folder is not None
    assert found.machine.model_folder.resolve() == tmp_path / "models"
    assert found.state_file.resolve() == tmp_path / "machine.state.json"
    assert Path(found.historian.url.removeprefix("sqlite:///")).resolve() == (
        tmp_path / "history" / "lathe.db"
    )


def test_the_rest_of_the_program_gets_names_nodes_units_and_signs(tmp_path: Path) -> None:
    found = read_machine(machine_file(tmp_path))
    assert found.inputs["T_column_C"].node == "ns=2;s=T_column"
    assert found.inputs["T_column_C"].unit == "K"
    assert found.inputs["T_spindle_C"].redundant_node == "ns=2;s=T_spindle_2"
    assert found.interlocks["emergency_stop"].value is False
    assert found.other_compensation is not None
    assert found.other_compensation.value is True
    assert found.diameter is not None
    assert found.diameter.unit == "mm"
    output = found.outputs["Z_um"]
    assert (output.node, output.read_back_node) == ("ns=2;s=Z_offset", "ns=2;s=Z_accepted")
    assert (output.unit, output.sign) == ("mm", "positive moves the tool away from the workpiece")
    assert found.sink.heartbeat_node == "ns=2;s=Heartbeat"
    assert found.connections["control"].url == "opc.tcp://127.0.0.1:4840/lathe"
    assert found.historian.retention_days == 30.0
    assert (found.server, found.metrics) == (None, None)
    with pytest.raises(TypeError):
        found.outputs["Z_um"] = output


def test_without_a_node_for_it_the_written_node_is_read_back(tmp_path: Path) -> None:
    path = machine_file(tmp_path, ('read_back_node = "ns=2;s=Z_accepted"\n', ""))
    output = read_machine(path).outputs["Z_um"]
    assert output.read_back_node == ""
    node = OpcUaOutput(node=output.node, unit=output.unit, sign=output.sign)
    assert set(_asked({"Z_um": node})) == {"ns=2;s=Z_offset"}


def test_an_input_that_the_model_does_not_need_is_read_all_the_same(tmp_path: Path) -> None:
    more = '\n[input.T_hall_C]\nnode = "ns=2;s=T_hall"\nunit = "degC"\n'
    more += "lowest_c = 0\nhighest_c = 50\n"
    found = read_machine(machine_file(tmp_path, ("[supervisor]", more + "[supervisor]")))
    assert set(found.inputs) == {"T_spindle_C", "T_column_C", "T_hall_C"}
    assert set(found.compensation.sensors) == {"T_spindle_C", "T_column_C"}


def test_an_input_and_its_source_are_called_as_people_call_it_in_their_language(
    tmp_path: Path,
) -> None:
    def named(text: str) -> Path:
        heads = [f"[input.{name}]\n" for name in ("T_spindle_C", "T_column_C")]
        changes = ((heads[0], f"{heads[0]}name = {text}\n"),)
        return machine_file(tmp_path, *changes)

    found = read_machine(named('{en = "Spindle", cs = "Vřeteno"}'))
    assert found.shown_names("cs") == dict.fromkeys(("T_spindle_C", "spindle"), "Vřeteno")
    assert found.shown_names("cs", "of another model") == {"T_spindle_C": "Vřeteno"}
    english = dict.fromkeys(("T_spindle_C", "spindle"), "Spindle")
    assert found.shown_names("de") == found.shown_names("en") == english
    assert read_machine(named('{de = "Spindel"}')).shown_names("cs") == {}
    for wrong in ('"Spindle"', '{fr = "Broche"}', '{en = ""}', '{en = "a\\u001b"}', "{en = 1}"):
        assert problems_of(named(wrong)), wrong
    (problem,) = problems_of(named(f'{{en = "{"x" * 41}"}}'))
    assert problem.place.key == "input.T_spindle_C.name.en"


def test_an_interlock_is_called_as_people_call_it(tmp_path: Path) -> None:
    head = "[interlock.emergency_stop]\n"
    path = machine_file(tmp_path, (head, f'{head}name.de = "Not-Halt"\n'))
    found = read_machine(path)
    assert found.shown_names("de") == {"emergency_stop": "Not-Halt"}
    assert found.shown_names("en") == {}


def test_a_source_keeps_its_name_where_that_of_its_input_would_name_two(tmp_path: Path) -> None:
    head = "[input.T_spindle_C]\n"
    path = machine_file(tmp_path, (head, f'{head}name.en = "Spindle"\n'))
    (output,) = model().outputs
    parts = (*output.parts, replace(output.parts[0], name="chuck"))
    two = replace(model(), outputs=(replace(output, parts=parts),))
    write_model(two, tmp_path / "models" / "lathe.json")
    assert read_machine(path).shown_names("en") == {"T_spindle_C": "Spindle"}


def test_no_number_of_the_rules_has_an_unlimited_default() -> None:
    for rules in (SensorRules, Limits, SupervisorRules):
        for entry in fields(rules):
            if entry.init and entry.default is not MISSING:
                assert isinstance(entry.default, bool | str) or 0.0 <= entry.default <= 86_400.0


def test_what_is_not_stated_of_start_and_end_is_what_the_loop_takes_by_itself(
    tmp_path: Path,
) -> None:
    found = read_machine(machine_file(tmp_path))
    loop = LoopSettings(machine="", model_file="", model_sha256="")
    for name in ("resume_enabled", "resume_within_s", "at_stop", "stop_within_s"):
        assert getattr(found.supervisor, name) == getattr(loop, name)


# ---- mistakes -----------------------------------------------------------------------------------


def test_an_unknown_key_is_named_with_its_line_and_the_nearest_known_one(tmp_path: Path) -> None:
    for right, wrong, advice in (
        ("highest_c = 60.0", "higest_c = 60.0", "highest_c"),
        ("largest_um = 100.0", "largest_mm = 100.0", "largest_um"),
        ("[supervisor]", "[superviser]", "supervisor"),
    ):
        path = machine_file(tmp_path, (right, wrong))
        problem = next(p for p in problems_of(path) if p.code == "error-unknown_key_near")
        assert problem.values == {"name": wrong.strip("[]").split(" ")[0], "near": advice}
        assert problem.place.line == line_of(path, wrong)


def test_the_line_of_a_mistake_is_found_beside_a_list_of_long_numbers(tmp_path: Path) -> None:
    wrong = "higest_c = 60.0\nnumbers = [\n[" + "1" * 4_000 + ", 1],\n]"
    path = machine_file(tmp_path, ("highest_c = 60.0", wrong))
    problem = next(p for p in problems_of(path) if p.code == "error-unknown_key_near")
    assert problem.place.line == line_of(path, "higest_c")


def test_an_unknown_key_never_shows_its_value(tmp_path: Path) -> None:
    path = machine_file(tmp_path, ("[sink]", '[sink]\npasword = "hunter2"'))
    with pytest.raises(ConfigurationError) as caught:
        read_machine(path)
    assert "pasword" in str(caught.value)
    assert "hunter2" not in str(caught.value)


def test_a_file_that_is_no_configuration_is_refused(tmp_path: Path) -> None:
    for wrong, line in (('name = "vertical', "line 2"), ("cycle_s = 1\ncycle_s = 2", "line 6")):
        right = 'name = "vertical lathe"' if line == "line 2" else "cycle_s = 1.0"
        with refused("not_toml") as caught:
            read_machine(machine_file(tmp_path, (right, wrong)))
        assert line in str(caught.value)
    path = tmp_path / "machine.toml"
    for content, code in (
        *((b"\xff\xfe", "not_utf8"), (b"a = [" * 1_900, "not_toml")),
        (b"a = 0x" + b"f" * 9_000, "not_toml"),
        (b"x" * 1_000_001, "file_too_large"),
        *((b"a = " + b"9" * 900_000, "not_toml"), (b"a = " + b"9" * 9_000, "not_toml")),
        *((b"a." * 300_000 + b"b = 1", "not_toml"), (b"a." * 4_000 + b"b = 1", "not_toml")),
    ):
        path.write_bytes(content)
        with refused(code) as caught:
            read_machine(path)
        assert caught.value.place.file == str(path)
    missing = tmp_path / "missing.toml"
    with refused("file_not_found", file=missing):
        read_machine(missing)


WRONG_KEYS = [
    "input.T_column_C.lowest_c, highest_c",
    "output.Z_um.largest_um",
    "supervisor.hold_input_s",
]


def test_several_mistakes_are_told_at_once(tmp_path: Path) -> None:
    path = machine_file(
        tmp_path,
        ("lowest_c = 5.0\nhighest_c = 60.0", "lowest_c = 70.0\nhighest_c = 60.0"),
        ("largest_um = 100.0", "largest_um = -1.0"),
        ("hold_input_s = 120.0", "hold_input_s = 1e9"),
    )
    found = problems_of(path)
    assert [problem.place.key for problem in found] == WRONG_KEYS
    with pytest.raises(ConfigurationError) as caught:
        read_machine(path)
    assert caught.value.code == "several_problems"
    assert caught.value.values == {"problems": found, "count": 3}
    for key in WRONG_KEYS:
        assert key in str(caught.value)


def test_all_that_is_left_to_decide_of_an_output_is_told_at_once(tmp_path: Path) -> None:
    path = machine_file(
        tmp_path,
        (f'sign = "{SIGN}"', 'sign = ""'),
        ('unit = "mm"\nsign', 'unit = ""\nsign'),
        ("largest_um = 100.0", "largest_um = 0"),
        ("largest_rate_um_per_s = 0.5", "largest_rate_um_per_s = 0"),
        ('node = "ns=2;s=T_spindle"\n', ""),
    )
    told = {one.place.key + "." + str(one.values.get("name", "")) for one in problems_of(path)}
    assert told == {
        "output.Z_um.largest_um.",
        "output.Z_um.largest_rate_um_per_s.",
        "output.Z_um.unit",
        "output.Z_um.sign",
        "input.T_spindle_C.node",
    }


COLUMN, SIGN = 'node = "ns=2;s=T_column"', "positive moves the tool away from the workpiece"
SPINDLE, SINK = "input.T_spindle_C.lowest_c", 'connection = "control"\n\n[sink]'
HAL = 'kind = "opcua"\nconnection = "control"\nheart', 'kind = "linuxcnc"\nheart'
FLAG = "[interlock.referenced]"
WRONG = (
    ("cycle_s = 1.0", "cycle_s = 0.01", "outside_range", "machine.cycle_s"),
    ("cycle_s = 1.0", 'cycle_s = "1"', "no_number", "machine.cycle_s"),
    ("cycle_s = 1.0", "cycle_s = true", "no_number", "machine.cycle_s"),
    ("cycle_s = 1.0", "cycle_s = nan", "not_finite", "machine.cycle_s"),
    ("largest_um = 100.0", "largest_um = inf", "not_finite", "output.Z_um.largest_um"),
    ("largest_um = 100.0", "largest_um = 100000.0", "", "output.Z_um.largest_um"),
    ("largest_um = 100.0\n", "", "key_needed", "output.Z_um.largest_um"),
    ("largest_rate_um_per_s = 0.5\n", "", "key_needed", "output.Z_um.largest_rate_um_per_s"),
    ("lowest_c = 5.0\nhighest_c = 90.0\n", "highest_c = 90.0\n", "key_needed", SPINDLE),
    ('unit = "K"', 'unit = "C"', "value_unknown", "input.T_column_C.unit"),
    ('unit = "mm"\nsign', 'unit = "nm"\nsign', "unknown_choice", "output.Z_um.unit"),
    ('unit = "mm"\nsign', "sign", "key_needed_here", "output.Z_um"),
    (f'sign = "{SIGN}"\n', "", "key_needed_here", "output.Z_um"),
    ("away from the workpiece", "up", "unknown_sign", "output.Z_um.sign"),
    (COLUMN, 'node = "T_column"', "no_node_id", "input.T_column_C.node"),
    (COLUMN, 'node = "ns=2;s=T_spindle"', "node_twice", "input.T_column_C.node"),
    (COLUMN, 'node = "ns=2;s=Z_offset"', "node_twice", "input.T_column_C.node"),
    (f"{COLUMN}\n", "", "key_needed_here", "input.T_column_C"),
    ("[input.T_column_C]", "[input.T_colunm_C]", "channel_without_table", "machine.model"),
    ("[output.Z_um]", "[output.Z_mm]", "output_without_table", "machine.model"),
    ("[output.Z_um]", "[output.Z_mm]", "not_of_model", "output.Z_mm"),
    (SINK, SINK.replace("control", "contol"), "unknown_name", "source.connection"),
    (FLAG, '[interlock."a b"]', "interlock_name", "interlock.a b"),
    (FLAG, f"{FLAG}\nmeet = 1", "unknown_key_near", "interlock.referenced.meet"),
    ("met = true", "met = 1", "no_boolean", "interlock.referenced.met"),
    ("met = true", "met = true\nbit = 64", "above_bound", "interlock.referenced.bit"),
    (
        "largest_rate_k_per_s = 0.05",
        "on_change = true",
        "key_needed_here",
        "source",
    ),
    (
        'connection = "control"\n\n[sink]',
        'connection = "control"\nlife_node = "ns=2;s=Diameter"\n\n[sink]',
        "node_twice",
        "diameter.node",
    ),
    (
        'node = "ns=2;s=Z_referenced"',
        'node = "ns=2;s=Z_offset"\nbit = 3',
        "node_twice",
        "interlock.referenced.node",
    ),
    (
        'heartbeat_node = "ns=2;s=Heartbeat"',
        'heartbeat_node = "ns=2;s=Life"\ntoken_node = "ns=2;s=Life"',
        "node_twice",
        "sink.token_node",
    ),
    ("models/lathe.json", "models/lath.json", "", ""),
    ('model_folder = "models"', 'model_folder = "modls"', "folder_not_found", ""),
    ("margin_k = 4.0", "margin_k = 0.0", "", "validity.margin_k"),
    ("retention_days = 30", "retention_days = 0", "below_bound", "historian.retention_days"),
    (*HAL, "key_needed_here", "output.Z_um"),
)
"""What stands in the file, what is put in its place, and what is said of it, at which key."""


def test_an_input_may_move_with_one_that_the_model_does_not_need(tmp_path: Path) -> None:
    column, hall = "largest_rate_k_per_s = 0.05\n", '[input.T_hall_C]\nunit = "degC"\n'
    hall += 'node = "ns=2;s=T_hall"\nlowest_c = 5.0\nhighest_c = 60.0\n'
    rests = column + 'moves_with = "T_hall_C"\nrests_k = 0.5\n'
    found = read_machine(machine_file(tmp_path, (column, rests + hall)))
    assert found.compensation.judged == ("T_spindle_C", "T_column_C", "T_hall_C")
    assert found.compensation.witnesses == (-1, 2, -1)
    two = rests + hall + 'redundant_node = "ns=2;s=T_hall_2"\n'
    found = read_machine(machine_file(tmp_path, (column, two)))
    assert "T_hall_C" not in found.compensation.redundant
    (lacking,) = problems_of(machine_file(tmp_path, (column, rests)))
    assert (lacking.code, lacking.place.key) == ("error-entries_missing", "input")


def test_a_value_that_cannot_be_is_refused_at_its_place(tmp_path: Path) -> None:
    for right, wrong, code, key in WRONG:
        path = machine_file(tmp_path, (right, wrong))
        found = problems_of(path)
        told = {(one.code.removeprefix("error-"), one.place.key) for one in found}
        assert any(c == (code or c) and k == (key or k) for c, k in told), (wrong, found)
        assert all(one.place.line for one in found if one.place.file == str(path)), (wrong, found)


def test_interlocks_may_be_bits_of_one_status_word(tmp_path: Path) -> None:
    word = 'node = "ns=2;s=Status"'
    path = machine_file(
        tmp_path,
        ('node = "ns=2;s=Z_referenced"', f"{word}\nbit = 3"),
        ('node = "ns=2;s=EmergencyStop"', f"{word}\nbit = 12"),
    )
    interlocks = read_machine(path).interlocks
    assert {name: (entry.bit, entry.value) for name, entry in interlocks.items()} == {
        "referenced": (3, True),
        "emergency_stop": (12, False),
    }


def test_a_misspelt_channel_leads_to_the_right_one(tmp_path: Path) -> None:
    path = machine_file(tmp_path, ("[input.T_column_C]", "[input.T_colunm_C]"))
    problem = only_problem(path)
    assert problem.values["table"] == "input.T_column_C"
    assert problem.code == "error-channel_without_table"


def test_a_table_that_is_needed_is_missed(tmp_path: Path) -> None:
    path = machine_file(tmp_path)
    parts = re.split(r"(?m)^(?=\[)", TEXT)
    for table in ("machine", "source", "sink", "input", "output"):
        rest = "".join(part for part in parts if not re.match(rf"\[{table}[.\]]", part))
        path.write_text(rest, encoding="utf-8")
        found = {(one.code, one.place.key) for one in problems_of(path)}
        assert ("error-key_needed", table) in found


# ---- source and sink of other kinds -------------------------------------------------------------

DRY = ('[sink]\nkind = "opcua"', '[sink]\nkind = "dry"')


def replayed(folder: Path, *more: tuple[str, str]) -> Path:
    (folder / "log.csv").write_text("time_s\n", encoding="utf-8")
    return machine_file(
        folder, ('[source]\nkind = "opcua"', '[source]\nkind = "replay"\nlog = "log.csv"'), *more
    )


def test_a_replay_reads_no_node_and_waits_for_no_interlock(tmp_path: Path) -> None:
    found = read_machine(replayed(tmp_path, DRY))
    assert found.source.log == tmp_path / "log.csv"
    assert {entry.node for entry in found.inputs.values()} == {""}
    assert found.compensation.interlocks == ()
    assert found.compensation.redundant == frozenset()
    assert (found.other_compensation, found.diameter, dict(found.interlocks)) == (None, None, {})
    assert dict(found.connections) == {}


def test_a_replayed_log_moves_no_machine_unless_that_is_said(tmp_path: Path) -> None:
    problem = only_problem(replayed(tmp_path))
    assert (problem.code, problem.place.key) == ("error-replay_moves_machine", "sink.kind")
    allowed = ("[sink]", "may_move_a_machine = true\n[sink]")
    assert read_machine(replayed(tmp_path, allowed)).sink.kind == "opcua"


def test_a_replay_needs_a_log_that_is_there(tmp_path: Path) -> None:
    path = replayed(tmp_path, DRY, ('log = "log.csv"', 'log = "other.csv"'))
    assert only_problem(path).code == "error-file_not_found"
    path = replayed(tmp_path, DRY, ('log = "log.csv"\n', ""))
    assert only_problem(path).values == {"name": "log"}


def test_a_dry_run_needs_no_connection_unit_or_sign(tmp_path: Path) -> None:
    path = replayed(
        tmp_path,
        DRY,
        ('unit = "mm"\nsign = "positive moves the tool away from the workpiece"\n', ""),
        ('[connection.control]\nurl = "opc.tcp://127.0.0.1:4840/lathe"\nsecurity = "none"\n', ""),
    )
    assert read_machine(path).sink.kind == "dry"


def test_linuxcnc_needs_a_joint_of_its_own_for_every_output(tmp_path: Path) -> None:
    changes = (
        (
            'kind = "opcua"\nconnection = "control"\nheartbeat_node = "ns=2;s=Heartbeat"',
            'kind = "linuxcnc"',
        ),
        ('node = "ns=2;s=Z_offset"\nread_back_node = "ns=2;s=Z_accepted"', "joint = 2"),
    )
    found = read_machine(machine_file(tmp_path, *changes))
    assert found.sink.kind == "linuxcnc"
    assert found.sink.linuxcnc is not None
    assert found.sink.linuxcnc.outputs["Z_um"].joint == 2
    assert found.sink.linuxcnc.outputs["Z_um"].limits == Limits(100.0, 0.5)
    um = ('unit = "mm"\nsign', 'unit = "um"\nsign')
    assert only_problem(machine_file(tmp_path, *changes, um)).values["name"] == "um"


# ---- secrets ------------------------------------------------------------------------------------


def encrypted(folder: Path, *lines: str) -> tuple[str, str]:
    """Return the change to a connection that is encrypted, and write its files."""
    for name, mode in (("own.der", 0o644), ("own.pem", 0o600), ("server.der", 0o644)):
        (folder / name).write_bytes(b"x")
        (folder / name).chmod(mode)
    files = 'certificate = "own.der"\nprivate_key = "own.pem"\nserver_certificate = "server.der"'
    return 'security = "none"', "\n".join(('security = "Basic256Sha256"', files, *lines))


def secret_file(folder: Path, text: str = "hunter2", mode: int = 0o600) -> Path:
    path = folder / "secret"
    path.write_text(text + "\n", encoding="utf-8")
    path.chmod(mode)
    return path


def test_a_password_is_read_from_a_file_and_never_shown(tmp_path: Path) -> None:
    secret_file(tmp_path)
    change = encrypted(tmp_path, 'user = "thermaxis"', 'password_file = "secret"')
    found = read_machine(machine_file(tmp_path, change))
    assert found.connections["control"].password.reveal() == "hunter2"
    assert "hunter2" not in repr(found)
    assert "hunter2" not in f"{found}"


def test_a_secret_in_the_file_itself_is_refused_with_the_way_to_do_it(tmp_path: Path) -> None:
    path = machine_file(tmp_path)
    for table, key in (
        *(("[connection.control]", "password"), ("[historian]", "password")),
        *(("[metrics]", "token"), ("[metrics]", "password"), ("[server]", "password")),
    ):
        text = TEXT if table in TEXT else f"{TEXT}\n{table}\n"
        path.write_text(text.replace(table, f'{table}\n{key} = "hunter2"'), encoding="utf-8")
        problem = next(p for p in problems_of(path) if p.code == "error-secret_in_file")
        assert problem.values == {"name": key}
        assert problem.place.line == line_of(path, "hunter2")
        assert "hunter2" not in str(problem)


# ---- historian, servers -------------------------------------------------------------------------

SQLITE = 'url = "sqlite:///history/lathe.db"'


def test_without_a_table_the_history_is_a_file_beside_the_configuration(tmp_path: Path) -> None:
    path = machine_file(tmp_path, (f"[historian]\n{SQLITE}\nretention_days = 30\n", ""))
    found = read_machine(path)
    assert found.historian.url == f"sqlite:///{tmp_path / 'machine.history.db'}"
    assert found.historian.retention_days == 90.0


def test_an_absolute_path_of_a_database_stays(tmp_path: Path) -> None:
    path = machine_file(tmp_path, (SQLITE, f'url = "sqlite:///{tmp_path}/x.db"'))
    assert read_machine(path).historian.url == f"sqlite:///{tmp_path}/x.db"


def test_a_database_that_forgets_or_tells_is_refused(tmp_path: Path) -> None:
    remote = "postgresql://a@plant.example/x"
    for url, code in (
        ("sqlite://", "no_file_in_url"),
        ("sqlite:///:memory:", "no_file_in_url"),
        ("sqlite:///file:x?mode=memory", "no_file_in_url"),
        ("mysql://127.0.0.1/x", "unknown_database"),
        ("postgresql://a:hunter2@127.0.0.1/x", "password_in_address"),
        ("postgresql://a@127.0.0.1/x?password=hunter2", "password_in_address"),
        (remote, "database_unencrypted"),
        (f"{remote}?sslmode=prefer", "database_unencrypted"),
        ("postgresql://a@127.0.0.1/x?host=plant.example", "database_unencrypted"),
        ("postgresql://a@127.0.0.1,plant.example/x", "database_unencrypted"),
        (f"{remote}?sslmode=verify-full&sslmode=disable", "database_unencrypted"),
        ("postgresql://[::1/x", "no_database_url"),
    ):
        problem = only_problem(machine_file(tmp_path, (SQLITE, f'url = "{url}"')))
        assert (problem.code, problem.place.key) == (f"error-{code}", "historian.url"), url
        assert "hunter2" not in str(problem)


def with_tables(folder: Path, text: str) -> Path:
    path = machine_file(folder)
    path.write_text(f"{TEXT}\n{text}\n", encoding="utf-8")
    return path


def test_servers_are_on_this_computer_unless_said_otherwise(tmp_path: Path) -> None:
    found = read_machine(with_tables(tmp_path, '[server]\nanonymous_role = "viewer"\n[metrics]'))
    assert found.server is not None
    assert found.metrics is not None
    assert found.server.address == found.metrics.address == "127.0.0.1"


def test_the_file_is_refused_exactly_where_the_server_would_refuse_to_start(
    tmp_path: Path,
) -> None:
    encrypted(tmp_path)
    (tmp_path / "users.toml").write_text("", encoding="utf-8")
    every = ("127.0.0.1", "10.0.0.5"), ("none", "viewer"), (True, False), (True, False)
    for address, role, users, certificate in product(*every):
        lines = ["[server]", f'address = "{address}"', f'anonymous_role = "{role}"']
        lines += ['users = "users.toml"'] if users else []
        lines += ['certificate = "own.der"', 'private_key = "own.pem"'] if certificate else []
        found = examine_machine(with_tables(tmp_path, "\n".join(lines)))
        server = None
        with suppress(ConfigurationError):
            server = ServerSettings(
                address=address,
                port=4850,
                users=tmp_path / "users.toml" if users else None,
                anonymous_role="viewer" if role == "viewer" else "none",
                certificate=tmp_path / "own.der" if certificate else None,
                private_key=tmp_path / "own.pem" if certificate else None,
            )
        stated = found.server if isinstance(found, MachineConfiguration) else None
        assert stated == server, lines


def test_a_server_for_other_computers_needs_users_and_certificates(tmp_path: Path) -> None:
    for address in ("0.0.0.0", "::", "lathe.plant.example"):  # noqa: S104 - not bound
        tables = f'[server]\naddress = "{address}"\n[metrics]\naddress = "{address}"'
        found = [problem.code for problem in problems_of(with_tables(tmp_path, tables))]
        assert found == ["error-users_needed", "error-token_needed"], address


def test_a_token_is_read_from_a_file_and_is_long_enough(tmp_path: Path) -> None:
    table = '[metrics]\ntoken_file = "secret"'
    for token, right in (("0123456789abcdef", True), ("short", False), ("ä" * 16, False)):
        secret_file(tmp_path, token)
        found = examine_machine(with_tables(tmp_path, table))
        if right:
            assert isinstance(found, MachineConfiguration)
            assert found.metrics is not None
            assert found.metrics.token.reveal() == token
            assert token not in repr(found)
        else:
            assert [one.place.key for one in found] == ["metrics"]
            assert token not in str(found)


def test_nobody_without_a_name_looks_in_from_another_computer(tmp_path: Path) -> None:
    encrypted(tmp_path)
    (tmp_path / "users.toml").write_text("", encoding="utf-8")
    tables = (
        '[server]\naddress = "192.168.1.5"\nusers = "users.toml"\ncertificate = "own.der"\n'
        'private_key = "own.pem"\nanonymous_role = "viewer"'
    )
    problem = only_problem(with_tables(tmp_path, tables))
    assert (problem.code, problem.place.key) == ("error-anonymous_from_outside", "server")
    right = tables.replace('"viewer"', '"none"')
    assert read_machine(with_tables(tmp_path, right)).server is not None


# ---- models that an operator chooses ------------------------------------------------------------


def test_another_model_of_the_folder_takes_the_rules_of_the_machine(tmp_path: Path) -> None:
    found = read_machine(machine_file(tmp_path))
    other = model(gain=20.0)
    write_model(other, tmp_path / "models" / "other.json")
    compensation, sha256 = found.other_model("other.json")
    assert compensation.model == other
    assert sha256 == model_sha256(other)
    assert compensation.limits == found.compensation.limits
    assert found.models_to_choose() == ("lathe.json", "other.json")


def test_a_model_with_fewer_channels_may_be_chosen(tmp_path: Path) -> None:
    found = read_machine(machine_file(tmp_path))
    write_model(model("T_spindle_C", ""), tmp_path / "models" / "one.json")
    compensation, _ = found.other_model("one.json")
    assert set(compensation.sensors) == {"T_spindle_C"}


def test_no_model_outside_of_the_folder_can_be_chosen(tmp_path: Path) -> None:
    folder = tmp_path / "machine"
    folder.mkdir()
    found = read_machine(machine_file(folder))
    outside = tmp_path / "outside.json"
    write_model(model(), outside)
    write_model(model(), folder / "outside.json")
    (folder / "models" / "link.json").symlink_to(outside)
    (folder / "models" / "folder_link").symlink_to(tmp_path)
    (folder / "models" / "loop.json").symlink_to(folder / "models" / "loop.json")
    (folder / "models" / "below").mkdir()
    for name in (
        *("../outside.json", "below/../../outside.json", "link.json", "folder_link/outside.json"),
        *("..", ".", "", "missing.json", "loop.json", "C:/outside.json", "..\\outside.json"),
        *("a\x00.json", "a\n.json", str(outside), "x" * 5000),
    ):
        with pytest.raises(ConfigurationError):
            found.other_model(name)
    assert found.models_to_choose() == ("lathe.json",)


def test_a_model_that_cannot_be_used_is_refused_without_saying_where_it_lies(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "somebodys_folder"
    folder.mkdir()
    found = read_machine(machine_file(folder))
    write_model(model("T_bed_C", "T_column_C"), folder / "models" / "channel.json")
    write_model(model(output="X_um"), folder / "models" / "output.json")
    (folder / "models" / "broken.json").write_bytes(b"{")
    (folder / "models" / "odd.json").write_bytes(b"\xff\xfe")
    without_folder = replace(found, machine=replace(found.machine, model_folder=None))
    for name in (
        *("channel.json", "output.json", "broken.json", "odd.json"),
        *("missing.json", "../lathe.json"),
    ):
        for configuration in (found, without_folder):
            with pytest.raises(ConfigurationError) as caught:
                configuration.other_model(name)
            said = str(caught.value)
            assert "somebodys_folder" not in said
            assert str(tmp_path) not in said
            assert configuration is without_folder or name in said


def test_without_a_folder_no_other_model_can_be_chosen(tmp_path: Path) -> None:
    found = read_machine(machine_file(tmp_path, ('model_folder = "models"\n', "")))
    assert found.models_to_choose() == ()
    with refused("no_model_folder"):
        found.other_model("lathe.json")


# ---- whatever stands in the file ----------------------------------------------------------------

_VALUES = st.one_of(
    st.booleans(),
    st.integers(-(2**40), 2**40),
    st.floats(allow_nan=False, allow_infinity=False, width=32).map(float),
    st.text(
        st.characters(min_codepoint=32, max_codepoint=126, exclude_characters='"\\'), max_size=12
    ),
)


def _as_toml(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else repr(value)


@settings(max_examples=12, deadline=None)
@given(place=st.integers(0, 10_000), value=_VALUES)
def test_any_value_at_any_key_gives_a_configuration_or_a_sentence(
    tmp_path_factory: pytest.TempPathFactory, place: int, value: object
) -> None:
    folder = tmp_path_factory.getbasetemp() / "any-value"
    folder.mkdir(exist_ok=True)
    path = machine_file(folder)
    lines = TEXT.splitlines()
    keys = [number for number, line in enumerate(lines) if "=" in line]
    chosen = keys[place % len(keys)]
    lines[chosen] = f"{lines[chosen].split('=')[0]}= {_as_toml(value)}"
    path.write_text("\n".join(lines), encoding="utf-8")
    found = examine_machine(path)
    if not isinstance(found, MachineConfiguration):
        assert found
        assert all(text_of(problem).endswith((".", "?")) for problem in found)
        assert all(problem.place.line or problem.place.file != str(path) for problem in found)


def test_a_name_that_a_terminal_would_obey_is_refused(tmp_path: Path) -> None:
    text = Path("examples/machine/lathe.toml")
    source = (Path(__file__).resolve().parents[3] / text).read_text(encoding="utf-8")
    hostile = source.replace('name = "virtual lathe"', r'name = "\u001b[31mRED\u0007"')
    file = tmp_path / "lathe.toml"
    file.write_text(hostile, encoding="utf-8")
    with refused("control_character") as caught:
        read_machine(file)
    assert "\x1b" not in str(caught.value)


def test_a_connection_that_nothing_uses_is_checked_and_its_secrets_are_not_read(
    tmp_path: Path,
) -> None:
    path = machine_file(tmp_path)
    spare = """
[connection.other]
url = "opc.tcp://{user}127.0.0.1:4840"
security = "Basic256Sha256"
user = "operator"
password_file = "nowhere"
certificate = "nowhere.der"
private_key = "nowhere.pem"
server_certificate = "nowhere.crt"
"""
    text = path.read_text(encoding="utf-8")
    path.write_text(text + spare.format(user=""), encoding="utf-8")
    assert isinstance(examine_machine(path), MachineConfiguration)
    path.write_text(text + spare.format(user="user:hunter2@"), encoding="utf-8")
    problem = only_problem(path)
    assert (problem.code, problem.place.key) == ("error-user_in_address", "connection.other")
    assert "hunter2" not in text_of(problem)
