"""What somebody should know of a configuration before it runs."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.refusals import refused
from tests.unit.runtime.machine_files import machine_file, model
from thermaxis.codes import Message
from thermaxis.compensation import CompensationModel, GainPoint, Output, Part, Section
from thermaxis.files import write_model
from thermaxis.runtime import Finding, Level, read_machine, warnings_of
from thermaxis.runtime.config import certificate_ends
from thermaxis.runtime.config._warnings import largest_of_training
from thermaxis.runtime.opcua import NewCertificate, make_pair

NOW = datetime(2026, 11, 21, 12, 0, tzinfo=UTC)


def warned(
    folder: Path, *changes: tuple[str, str], compensation: CompensationModel | None = None
) -> tuple[Finding, ...]:
    (folder / "history").mkdir(exist_ok=True)
    path = machine_file(folder, *changes)
    if compensation is not None:
        write_model(compensation, folder / "models" / "lathe.json")
    return warnings_of(read_machine(path), NOW)


def codes(findings: Sequence[Finding]) -> dict[str, Message]:
    """Return what is said by its code."""
    return {one.message.code.removeprefix("advice-"): one.message for one in findings}


def stated(of: CompensationModel) -> CompensationModel:
    """Return a model whose reference is stated, so that nothing is said of it."""
    return replace(of, reference="stated", reference_c=dict.fromkeys(of.channels, 20.0))


def test_a_configuration_with_everything_in_it_has_no_warning(tmp_path: Path) -> None:
    limit = ("largest_um = 100.0", "largest_um = 250.0")
    stop = ("hold_input_s = 120.0", "stop_within_s = 600.0")
    assert warned(tmp_path, limit, stop, compensation=stated(model())) == ()


def test_what_protects_less_than_it_could_is_said(tmp_path: Path) -> None:
    before = codes(warned(tmp_path))
    for change, said in (
        (('heartbeat_node = "ns=2;s=Heartbeat"\n', ""), "no_heartbeat"),
        (('read_back_node = "ns=2;s=Z_accepted"\n', ""), "no_read_back"),
        (
            ('[other_compensation]\nnode = "ns=2;s=OwnCompensation"\nactive = true\n', ""),
            "other_compensation_unread",
        ),
        (
            ("lowest_c = 5.0\nhighest_c = 90.0", "lowest_c = -5.0\nhighest_c = 90.0"),
            "zero_plausible",
        ),
        (("rate_um_per_s = 0.5", "rate_um_per_s = 2.0"), "visible_step"),
        (("cycle_s = 1.0", "cycle_s = 20.0"), "age_below_cycle"),
        (("127.0.0.1:4840", "192.168.214.241:4840"), "connection_unencrypted"),
        (("largest_um = 100.0", "largest_um = 50.0"), "limit_below_model"),
        (("largest_um = 100.0", "largest_um = 900.0"), "limit_wide"),
    ):
        found = warned(tmp_path, change)
        assert codes(found)[said] != before.get(said), said
        assert all(finding.level is Level.WARNING for finding in found)


def test_what_hides_a_loss_or_a_wrong_unit_is_said(tmp_path: Path) -> None:
    before = codes(warned(tmp_path))
    for right, wrong, said in (
        ("hold_input_s = 120.0", "read_back_tolerance_um = 100.0", "tolerance_wide"),
        ("hold_input_s = 120.0", "input_timeout_s = 86400.0", "time_long"),
        ("hold_input_s = 120.0", "read_back_s = 86400.0", "time_long"),
        ("hold_input_s = 120.0", "hold_input_s = 86400.0", "time_long"),
        ("hold_input_s = 120.0", "hold_connection_s = 86400.0", "time_long"),
        ("highest_c = 60.0", "highest_c = 60.0\nfrozen_s = 0.0", "frozen_unseen"),
    ):
        assert said not in before
        assert said in codes(warned(tmp_path, (right, wrong))), wrong


def test_a_disk_that_the_history_fills_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=1e15))
    assert "disk_short" not in codes(warned(tmp_path))
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=50e6))
    found = codes(warned(tmp_path))["disk_short"].values
    assert found["day_mb"] * found["left_days"] == pytest.approx(50.0)
    assert found["days"] == 30
    assert found["day_mb"] == pytest.approx(86_400.0 * (30.0 + 1.5 * 7) / 1e6)
    file = tmp_path / "taken"
    file.write_text("no folder")
    database = (
        'url = "sqlite:///history/lathe.db"',
        f'url = "postgresql://anna@127.0.0.1/lathe"\nfolder = "{file}"',
    )
    place = codes(warned(tmp_path, database))["error-folder_not_found"].place
    assert (place.file, place.key) == (str(file), "historian.folder")


def test_state_and_history_are_no_other_file_of_the_configuration(tmp_path: Path) -> None:
    for change, other in (
        ('state_file = "machine.toml"', "machine.toml"),
        ('state_file = "models/../models/lathe.json"', "machine.model"),
        ('state_file = "history/lathe.db"', "machine.state_file"),
    ):
        path = machine_file(tmp_path, ("cycle_s = 1.0", f"cycle_s = 1.0\n{change}"))
        with refused("file_overwritten", other=other):
            read_machine(path)
    path = machine_file(tmp_path, ("cycle_s = 1.0", 'cycle_s = 1.0\nstate_file = "day1.csv"'))
    state = f'{"0" * 64}\n{{"format":"thermaxis-loop-state"}}\n'
    for text, is_state in (("", True), (state, True), ("\0" * 99, True), ("t_s,T\n0,20\n", False)):
        (tmp_path / "day1.csv").write_text(text)
        with nullcontext() if is_state else refused("no_state_file"):
            read_machine(path)


def test_a_fade_that_the_end_does_not_wait_for_is_said(tmp_path: Path) -> None:
    values = codes(warned(tmp_path))["fade_too_long"].values
    assert values == {"longest_s": 200.0, "stop_within_s": 120.0}
    longer = ("hold_input_s = 120.0", "stop_within_s = 201.0")
    assert "fade_too_long" not in codes(warned(tmp_path, longer))
    left = ("hold_input_s = 120.0", 'at_stop = "leave"')
    assert "fade_too_long" not in codes(warned(tmp_path, left))


def test_no_interlock_at_all_is_said(tmp_path: Path) -> None:
    found = warned(
        tmp_path,
        ('[interlock.referenced]\nnode = "ns=2;s=Z_referenced"\nmet = true\n', ""),
        ('[interlock.emergency_stop]\nnode = "ns=2;s=EmergencyStop"\nmet = false\n', ""),
    )
    assert "no_interlock" in codes(found)


def test_a_dry_run_needs_none_of_the_machines_protection(tmp_path: Path) -> None:
    found = warned(tmp_path, ('[sink]\nkind = "opcua"', '[sink]\nkind = "dry"'))
    assert not {"no_heartbeat", "no_interlock", "no_read_back"} & set(codes(found))


def test_a_model_without_ranges_or_references_is_said_with_its_own_warnings(
    tmp_path: Path,
) -> None:
    part = Part("spindle", "T_spindle_C", "T_column_C", sections=(Section(10.0, 600.0),))
    bare = CompensationModel(
        outputs=(Output("Z_um", (part,)),), warnings=("the paper states no sample time",)
    )
    found = codes(warned(tmp_path, compensation=bare))
    assert {"range_unknown", "reference_at_start"} <= set(found)
    assert found["said_of_model"].values == {"said": "the paper states no sample time"}


def test_gains_by_diameter_without_a_node_are_said(tmp_path: Path) -> None:
    part = replace(model().outputs[0].parts[0], gain_by_diameter=(GainPoint(0.0, 1.0),))
    gains = CompensationModel(outputs=(Output("Z_um", (part,)),))
    table = ('[diameter]\nnode = "ns=2;s=Diameter"\nunit = "mm"\n', "")
    assert "diameter_unread" in codes(warned(tmp_path, table, compensation=gains))
    assert "diameter_unread" not in codes(warned(tmp_path, compensation=gains))


def test_an_input_that_is_only_recorded_is_said(tmp_path: Path) -> None:
    more = (
        '[input.T_hall_C]\nnode = "ns=2;s=T_hall"\nunit = "degC"\nlowest_c = 5\nhighest_c = 50\n\n'
    )
    found = warned(tmp_path, ("[supervisor]", more + "[supervisor]"))
    assert codes(found)["input_unused"].place.key == "input.T_hall_C"
    rests = ("= 0.05\n", '= 0.05\nmoves_with = "T_hall_C"\nrests_k = 0.5\n')
    found = warned(tmp_path, ("[supervisor]", more + "[supervisor]"), rests)
    assert not {"input_unused", "rests_wide"} & {*codes(found)}
    wide = rests[0], rests[1].replace("rests_k = 0.5", "rests_k = 50.0")
    found = codes(warned(tmp_path, ("[supervisor]", more + "[supervisor]"), wide))
    assert found["rests_wide"].values == {"rests_k": 50.0}


def test_the_largest_displacement_of_the_training_takes_the_worst_of_every_part() -> None:
    spindle = Part(
        "spindle", "A", direct_gain_um_per_k=2.0, sections=(Section(8.0, 60.0),),
        lowest_k=-1.0, highest_k=20.0,
    )  # fmt: skip
    table = Part(
        "table", "B", sections=(Section(-5.0, 60.0),), lowest_k=-3.0, highest_k=4.0,
        gain_by_diameter=(GainPoint(0.0, 1.0), GainPoint(3000.0, 2.0)), tool_gain=1.0,
    )  # fmt: skip
    # upward 10 * 20 and 2 * 5 * 3; downward 10 * 1 and 2 * 5 * 4
    assert largest_of_training(Output("Z_um", (spindle, table), offset_um=1.0)) == 231.0
    assert largest_of_training(Output("Z_um", (Part("x", "A"),))) is None


def test_a_database_that_does_not_prove_who_it_is_is_said(tmp_path: Path) -> None:
    for address, said in (
        ("a@plant.example/x?sslmode=require", True),
        ("a@127.0.0.1/x?host=plant.example&sslmode=require", True),
        ("a@plant.example/x?sslmode=verify-full", False),
        ("a@127.0.0.1/x?sslmode=require", False),
        ("/x?host=%2Frun%2Fpostgresql", False),
    ):
        change = 'url = "sqlite:///history/lathe.db"', f'url = "postgresql://{address}"'
        assert ("database_unproven" in codes(warned(tmp_path, change))) is said, address


def test_a_folder_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    found = warnings_of(read_machine(machine_file(tmp_path)), NOW)
    errors = [finding for finding in found if finding.level is Level.ERROR]
    assert [finding.message.place.key for finding in errors] == ["historian.url"]


def test_a_folder_of_the_state_is_made_where_it_can_be(tmp_path: Path) -> None:
    inside = ("cycle_s = 1.0", 'cycle_s = 1.0\nstate_file = "a/b/state.json"')
    assert "error-folder_not_found" not in codes(warned(tmp_path, inside))
    (tmp_path / "file").write_text("", encoding="utf-8")
    below_a_file = ("cycle_s = 1.0", 'cycle_s = 1.0\nstate_file = "file/state.json"')
    found = codes(warned(tmp_path, below_a_file))["error-folder_not_found"]
    assert (found.place.key, found.place.file) == ("machine.state_file", str(tmp_path / "file"))


# ---- certificates -------------------------------------------------------------------------------


def certified(folder: Path, begin: datetime, days: int = 365, uri: str = "urn:thermaxis:client"):
    """Write certificates that begin at a time; return the change of the configuration."""
    certificate, key = make_pair(
        NewCertificate(application_uri=uri, hosts=("localhost",), days=days), begin
    )
    for name, content in (("own.der", certificate), ("own.pem", key), ("server.der", certificate)):
        (folder / name).write_bytes(content)
        (folder / name).chmod(0o600)
    files = 'certificate = "own.der"\nprivate_key = "own.pem"\nserver_certificate = "server.der"'
    return 'security = "none"', f'security = "Basic256Sha256"\n{files}'


def of_certificates(findings: Sequence[Finding]) -> list[Finding]:
    return [
        finding
        for finding in findings
        if "certificate" in finding.message.code + finding.message.place.key
    ]


def test_users_whom_nobody_could_log_in_as_are_an_error(tmp_path: Path) -> None:
    certified(tmp_path, NOW)
    users = tmp_path / "users.toml"
    users.write_text("[[users]]\n", encoding="utf-8")
    users.chmod(0o600)
    files = 'users = "users.toml"\ncertificate = "own.der"\nprivate_key = "own.pem"'
    found = codes(warned(tmp_path, ("[supervisor]", f"[server]\n{files}\n\n[supervisor]")))
    assert found["error-not_a_user_table"].place.file == str(users)


@pytest.mark.parametrize(
    ("age_days", "level"),
    [(330, None), (340, Level.WARNING), (400, Level.ERROR), (-2, Level.ERROR)],
)
def test_certificates_that_expire_are_said_in_time(
    tmp_path: Path, age_days: int, level: Level | None
) -> None:
    change = certified(tmp_path, NOW - timedelta(days=age_days))
    found = of_certificates(warned(tmp_path, change))
    if level is None:
        assert found == []
    else:
        assert {finding.level for finding in found} == {level}
        assert {finding.message.place.key.rpartition(".")[2] for finding in found} == {
            "certificate",
            "server_certificate",
        }


def test_the_loop_is_told_the_ends_of_the_certificates_that_it_can_read(tmp_path: Path) -> None:
    configuration = read_machine(machine_file(tmp_path, certified(tmp_path, NOW)))
    (name,) = configuration.connections
    keys = [f"connection.{name}.{one}" for one in ("server_certificate", "certificate")]
    end = (NOW + timedelta(days=365)).replace(microsecond=0)
    assert certificate_ends(configuration) == dict.fromkeys(keys, end)
    (tmp_path / "server.der").write_bytes(b"none")
    assert certificate_ends(configuration) == {keys[1]: end}


def test_a_certificate_with_another_address_is_an_error_before_the_server_says_so(
    tmp_path: Path,
) -> None:
    change = certified(tmp_path, NOW - timedelta(days=1), uri="urn:other")
    found = warned(tmp_path, change)
    assert codes(found)["error-application_uri_differs"].values["found"] == ("urn:other",)
    assert Level.ERROR in {finding.level for finding in found}


def test_what_is_no_certificate_is_an_error(tmp_path: Path) -> None:
    change = certified(tmp_path, NOW - timedelta(days=1))
    (tmp_path / "server.der").write_bytes(b"no certificate")
    (finding,) = of_certificates(warned(tmp_path, change))
    assert finding.level is Level.ERROR
