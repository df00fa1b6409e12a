"""``thermaxis hal`` writes what the running machine is compared with."""

from tests.unit.cli.refusals import code_of, refusal
from tests.unit.runtime.machine_files import machine_file
from thermaxis.cli import execute
from thermaxis.runtime import read_machine
from thermaxis.runtime.sinks import hal_text

OPC_UA_SINK = """\
[sink]
kind = "opcua"
connection = "control"
heartbeat_node = "ns=2;s=Heartbeat"
"""
OPC_UA_OUTPUT = """\
node = "ns=2;s=Z_offset"
read_back_node = "ns=2;s=Z_accepted"
"""
TO_LINUXCNC = ((OPC_UA_SINK, '[sink]\nkind = "linuxcnc"\n'), (OPC_UA_OUTPUT, "joint = 2\n"))


def run(*words: object) -> int:
    return execute(["hal", *map(str, words)])


def test_the_file_has_the_limits_of_the_configuration(tmp_path, capsys):
    path, output = machine_file(tmp_path, *TO_LINUXCNC), tmp_path / "z.hal"
    assert run(str(path), "-o", str(output)) == 0
    text = output.read_text(encoding="ascii")
    assert "source z.hal\n" in text
    assert "setp thermaxis-limit-2.max 0.1\n" in text
    assert "setp thermaxis-limit-2.maxv 0.0005\n" in text
    said = capsys.readouterr().out
    assert "Z_um: joint 2, at most 100 µm and 0.5 µm/s; positive moves the tool away" in said
    assert "without a write for 2 s" in said


def test_without_a_file_the_lines_go_to_standard_output(tmp_path, capsys):
    path = machine_file(tmp_path, *TO_LINUXCNC)
    assert run(str(path)) == 0
    settings = read_machine(path).sink.linuxcnc
    assert settings is not None
    assert capsys.readouterr().out == hal_text(settings)


def test_a_configuration_with_another_sink_is_refused(tmp_path):
    error = refusal("hal", machine_file(tmp_path))
    assert (error.code, error.place.key) == ("sink_not_linuxcnc", "sink.kind")


def test_the_configuration_is_not_overwritten(tmp_path):
    path = machine_file(tmp_path, *TO_LINUXCNC)
    before = path.read_bytes()
    assert code_of("hal", path, "-o", path) == "output_is_input"
    assert path.read_bytes() == before
