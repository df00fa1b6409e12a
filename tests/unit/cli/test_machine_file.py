"""``thermaxis machine-file``: what a server shows becomes a configuration."""

import asyncio
from pathlib import Path

import pytest

from tests.opcua_server import KINDS, NAMESPACE, start_machine
from thermaxis.cli import main
from thermaxis.cli.machine.machine_file import _connection, _lines
from thermaxis.compensation import CompensationModel, Output, Part, Section
from thermaxis.files import write_model
from thermaxis.runtime import AWAY, MachineConfiguration, examine_machine, read_machine
from thermaxis.runtime.opcua import FoundNode


async def written(folder: Path, *words: str) -> tuple[Path, int]:
    """Write the file of the small machine; return it and the server's port."""
    kinds = {name: kind for name, kind in KINDS.items() if name not in {"OffsetInt", "OffsetFloat"}}
    machine = await start_machine(other_namespaces=1, kinds=kinds)
    before = {name: machine.value(name) for name in kinds}
    path, url = folder / "new.toml", f"opc.tcp://127.0.0.1:{machine.port}/machine"
    code = await asyncio.to_thread(main, ["machine-file", url, "-o", str(path), *words])
    assert code == 0
    assert {name: machine.value(name) for name in kinds} == before
    await machine.stop()
    return path, machine.port


def decided(text: str) -> str:
    """Put in what a person decides, four lines of each output."""
    return (
        text.replace('sign = ""', f'sign = "{AWAY}"')
        .replace('unit = ""', 'unit = "mm"')
        .replace("largest_um = 0 ", "largest_um = 20.0 ")
        .replace("largest_rate_um_per_s = 0 ", "largest_rate_um_per_s = 0.5 ")
    )


def test_a_machine_is_found_but_for_sign_limit_and_rate_which_check_refuses(
    tmp_path: Path,
) -> None:
    part = Part("spindle", "T1", "T3", sections=(Section(1.0, 60.0),))
    write_model(CompensationModel(outputs=(Output("Z_um", (part,)),)), tmp_path / "model.json")
    path, port = asyncio.run(written(tmp_path, "--model", str(tmp_path / "model.json")))
    assert 'model = "model.json"' in path.read_text(encoding="utf-8")
    refused = examine_machine(path)
    assert not isinstance(refused, MachineConfiguration)
    assert all(one.place.key.startswith("output.Z_um") for one in refused)
    assert "# not used: Machine.Probe, Double, holds 0.0125" in path.read_text(encoding="utf-8")
    path.write_text(decided(path.read_text(encoding="utf-8")), encoding="utf-8")
    found = read_machine(path)
    assert found.connections["control"].port == port
    assert {name: (one.node, one.scale) for name, one in found.inputs.items()} == {
        "T1": (f"nsu={NAMESPACE};s=T1", 1.0),
        "T3": (f"nsu={NAMESPACE};s=T3", 0.1),  # 225 in a whole number
    }
    output = found.outputs["Z_um"]
    assert output.node == f"nsu={NAMESPACE};s=Offset"
    assert output.read_back_node == f"nsu={NAMESPACE};s=Accepted"
    assert output.effective_node == f"nsu={NAMESPACE};s=Effective"
    assert found.sink.heartbeat_node == f"nsu={NAMESPACE};s=Beat"
    assert {name: flag.value for name, flag in found.interlocks.items()} == {"Referenced": True}


@pytest.mark.parametrize("form", ["Offset{}_{}", "{}_Offset_{}"])
def test_nodes_of_an_axis_are_found_where_its_letter_and_the_words_are_glued_together(
    tmp_path: Path, form: str
) -> None:
    names = [form.format(axis, what) for axis in "ZX" for what in ("set", "act", "eff")]
    names += ["Temp_Spindle_act", "Coefficient_set"]
    nodes = [FoundNode(f"ns=2;s={n}", f"PLC.{n}", "Double", True, 22.0, "") for n in names]
    model = tmp_path / "model.json"
    part = Part("spindle", "T_Spindle_C", sections=(Section(1.0, 60.0),))
    outputs = (Output("Z_um", (part,)), Output("X_um", (part,)))
    write_model(CompensationModel(outputs=outputs), model)
    for of in (None, model):
        text = "\n".join(_lines(nodes, {"security": "none"}, of, tmp_path))
        for axis in "ZX":
            table = text.partition(f'[output."{axis}_um"]')[2].partition("\n\n")[0]
            for key, what in (
                ("node", "set"),
                ("read_back_node", "act"),
                ("effective_node", "eff"),
            ):
                assert f'\n{key} = "ns=2;s={form.format(axis, what)}"' in table
        assert 'node = "ns=2;s=Temp_Spindle_act"' in text.partition("[output")[0]
    bare = "\n".join(_lines(nodes[:1], {"security": "none"}, None, tmp_path))
    assert 'read_back_node = ""  # not found\neffective_node = ""  # not found' in bare


def test_touches_of_a_probe_are_found_by_value_and_counter_and_their_limits_are_left(
    tmp_path: Path,
) -> None:
    names = ("offset_mm", "touch_um", "touch_count", "T_spindle_C")
    nodes = [FoundNode(f"ns=2;s={n}", f"Lathe.{n}", "Double", True, 22.0, "") for n in names]
    nodes[1] = nodes[1]._replace(unit="um")
    text = "\n".join(_lines(nodes, {"security": "none"}, None, tmp_path))
    table = text.partition('[probe."offset_mm_um"]')[2]
    assert [line.partition("  #")[0] for line in table.split("\n") if line] == [
        'node = "ns=2;s=touch_um"',
        'counter_node = "ns=2;s=touch_count"',
        'unit = "um"',
        "largest_um = 0",
        "largest_rate_um_per_s = 0",
    ]
    alone = "\n".join(_lines(nodes[:2], {"security": "none"}, None, tmp_path))
    assert "[probe" not in alone, "a probe that counts nothing is named as not used"


def test_files_are_named_as_they_count_from_the_folder_of_the_output(tmp_path: Path) -> None:
    file = tmp_path / "a" / "connection.toml"
    file.parent.mkdir()
    file.write_text(
        "[connection.x]\nsecurity = 'Basic256Sha256'\ncertificate = 'own.der'\n"
        "private_key = 'own.pem'\nserver_certificate = '/c/it.der'\n",
        encoding="utf-8",
    )
    for folder, own in ((tmp_path, "a/own.der"), (tmp_path / "b", f"{tmp_path}/a/own.der")):
        table, _ = _connection(file, "opc.tcp://127.0.0.1:1", folder)
        assert (table["certificate"], table["server_certificate"]) == (own, "/c/it.der")


def test_what_is_there_already_is_kept(tmp_path: Path) -> None:
    (tmp_path / "new.toml").write_text("mine", encoding="utf-8")
    assert main(["machine-file", "opc.tcp://127.0.0.1:1", "-o", str(tmp_path / "new.toml")]) == 2
    assert (tmp_path / "new.toml").read_text(encoding="utf-8") == "mine"


def test_a_connection_file_with_mistakes_is_refused_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "connection.toml"
    for text, said in (
        ("[connection.a]\nsecurity = 'open'\n", "Basic256Sha256"),
        ("[connection.a]\nsecurity = 'none'\n[connection.b]\n", "no second one"),
    ):
        file.write_text(text, encoding="utf-8")
        words = ["machine-file", "opc.tcp://127.0.0.1:1", "--connection", str(file)]
        assert main(words) == 2
        assert said in capsys.readouterr().err
