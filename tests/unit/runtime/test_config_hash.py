"""Loop and screen see by a hash whether they were started with the same configuration."""

import json
import re
import shutil
from pathlib import Path

import pytest

from tests.unit.runtime.status_server_parts import status
from thermaxis import __version__
from thermaxis.cli.machine._machine_parts import loop_settings
from thermaxis.runtime import read_machine
from thermaxis.runtime.config import configuration_sha256
from thermaxis.runtime.status import as_json

EXAMPLE = Path(__file__).parents[3] / "examples" / "machine" / "lathe.toml"


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """The example in a folder of its own."""
    shutil.copytree(EXAMPLE.parent / "models", tmp_path / "models")
    return Path(shutil.copy(EXAMPLE, tmp_path / EXAMPLE.name))


def hash_of(path: Path) -> str:
    return configuration_sha256(read_machine(path))


def changed(path: Path, pattern: str, by: str) -> str:
    """Return the hash after a change of the file's text, which must be one."""
    text = path.read_text("utf-8")
    after, count = re.subn(pattern, by, text, count=1, flags=re.MULTILINE)
    assert count == 1
    assert after != text
    path.write_text(after, "utf-8")
    return hash_of(path)


def test_it_is_the_same_for_the_same_rules_wherever_the_file_lies(machine: Path) -> None:
    assert re.fullmatch("[0-9a-f]{64}", hash_of(machine))
    assert hash_of(machine) == hash_of(EXAMPLE)


def test_it_is_that_of_the_state_which_an_earlier_version_has_kept() -> None:
    assert hash_of(EXAMPLE) == "e1815904cf1f80c0017bd233bce42ae869fc88f3ebac1219d6491a1ba938d33f", (
        "a loop and a screen of two versions would not know each other"
    )


def test_remarks_blanks_nodes_and_places_do_not_count(machine: Path) -> None:
    for pattern, by in (
        (r"\Z", "\n# a remark\n"),
        (r"^cycle_s = 1.0", "cycle_s   =  1.00"),
        (r"s=T_spindle_C\"", 's=T_nose_C"'),
        (r"lathe\.history\.db", "elsewhere.db"),
    ):
        assert changed(machine, pattern, by) == hash_of(EXAMPLE), by


def test_every_rule_counts(machine: Path) -> None:
    seen = [hash_of(machine)]
    for pattern, by in (
        (r'^name = "virtual lathe"', 'name = "another lathe"'),
        (r"^cycle_s = 1.0", "cycle_s = 0.5"),
        (r"^highest_c = 80.0", "highest_c = 79.0"),
        (r"^lowest_c = 5.0 ", "frozen_s = 60.0\nlowest_c = 5.0 "),
        (r'^redundant_node = "nsu=urn:thermaxis:lathe;s=T_table_2_C"\n', ""),
        (r"^met = true", "met = false"),
        (r"^active = true", "active = false"),
        (r'^\[diameter\]\n.*\nunit = "mm"\n', ""),
        (r"^\[probe\.Z_um\].*\n", "[probe.Z_um]\nlargest_um = 5.0\nlargest_rate_um_per_s = 0.1\n"),
        (r"^largest_um = 5.0", "oldest_s = 300.0\nlargest_um = 5.0"),
        (r"^\[probe\.Z_um\].*\n(?:[a-z].*\n)*", ""),
        (r"^largest_um = 280.0", "largest_um = 279.0"),
        (r"^deadband_um = 0.5", "deadband_um = 0.6"),
        (r"^hold_input_s = 300.0", "hold_input_s = 299.0"),
        (r"^margin_k = 5.0", "margin_k = 4.0"),
    ):
        seen.append(changed(machine, pattern, by))
        assert len(set(seen)) == len(seen), pattern


def test_the_model_has_a_hash_of_its_own(machine: Path) -> None:
    path = machine.parent / "models" / "lathe.json"
    content = json.loads(path.read_text("utf-8"))
    del content["sha256"]
    content["warnings"] = ["this is another one"]
    path.write_text(json.dumps(content), "utf-8")
    assert read_machine(machine).model.sha256 != read_machine(EXAMPLE).model.sha256
    assert hash_of(machine) == hash_of(EXAMPLE)


def test_the_loop_is_started_with_it_and_tells_it_to_the_screen() -> None:
    found = loop_settings(read_machine(EXAMPLE)).configuration_sha256
    assert found == hash_of(EXAMPLE)
    now = status(configuration_sha256=found)
    assert json.loads(as_json(now))["configuration_sha256"] == found
    assert json.loads(as_json(now))["program_version"] == __version__, "which may tell another"
