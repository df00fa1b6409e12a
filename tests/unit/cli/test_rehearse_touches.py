"""A rehearsal with touches: what the lathe's probe shows moves the tool within the limits."""

import csv
from itertools import pairwise
from pathlib import Path

import pytest

from tests.refusals import refused
from thermaxis.cli import build_parser, main
from thermaxis.cli.machine import rehearse

LARGEST_UM, RATE_UM_PER_S, CYCLE_S = 12.0, 0.05, 3.8
PROBE = f"""\
[probe.Z_um]
node = "nsu=urn:thermaxis:lathe;s=touch_um"
counter_node = "nsu=urn:thermaxis:lathe;s=touch_count"
unit = "um"
largest_um = {LARGEST_UM}
largest_rate_um_per_s = {RATE_UM_PER_S}
acts = true

"""


@pytest.fixture
def machine(root: Path, tmp_path: Path) -> Path:
    """Return the configuration of the example, with touches."""
    text = (root / "examples" / "machine" / "lathe.toml").read_text(encoding="utf-8")
    text = text.replace('"models', f'"{root}/examples/machine/models')
    before, _, rest = text.partition("[probe.Z_um]")
    _, output, after = rest.partition("[output.Z_um]")
    text = f"{before}{PROBE}{output}{after}".replace("cycle_s = 1.0", f"cycle_s = {CYCLE_S}")
    (tmp_path / "machine.toml").write_text(text, encoding="utf-8")
    return tmp_path / "machine.toml"


def offsets_of(machine: Path, *faults: str) -> list[float]:
    """Return what touches every ten minutes add while the spindle warms up, cycle by cycle. [µm]"""
    words = ["--scenario", "calibration-spindle", "--hours", "1.25", "--touch-every", "10min"]
    file = machine.with_name("cycles.csv")
    words += [word for fault in faults for word in ("--fault", fault)]
    assert main(["rehearse", str(machine), *words, "-o", str(file)]) == 0
    with file.open(encoding="utf-8", newline="") as lines:
        offset_um = [float(row["offset_um"]) for row in csv.DictReader(lines)]
    assert max(map(abs, offset_um)) <= LARGEST_UM
    assert max(abs(b - a) for a, b in pairwise(offset_um)) <= RATE_UM_PER_S * CYCLE_S + 1e-8
    return offset_um


def test_touches_that_the_configuration_does_not_read_are_refused(machine: Path) -> None:
    text = machine.read_text(encoding="utf-8")
    machine.write_text(text.replace("counter_node", "# counter_node"), encoding="utf-8")
    words = build_parser(["rehearse"]).parse_args(["rehearse", str(machine), "--touch-every", "1h"])
    with refused("touches_not_read"):
        rehearse.run(words)


@pytest.mark.proof
def test_what_touches_show_moves_the_tool_within_the_limits_and_a_chip_does_not(
    machine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    well = offsets_of(machine)
    printed = " ".join(capsys.readouterr().out.split())
    assert "touches: 7 believed true mean error at the TCP" in printed
    chip = offsets_of(machine, "jump touch_um by 50 at 50min for 1s")
    assert "touches: 7 believed, 1 excluded\n" in capsys.readouterr().out, "and touched again"
    assert max(abs(a - b) for a, b in zip(well, chip, strict=True)) < 1.5
    assert offsets_of(machine, "jump touch_um by 17 at 40min")[-1] == -LARGEST_UM, "a wrong datum"
    printed = " ".join(capsys.readouterr().out.split())
    assert "1 confirmed" in printed
    assert "at its limit of 12 um" in printed
    assert "medium: Touches of Z show that the model lacks" in printed
    assert offsets_of(machine, "jump touch_um by 50 at 50min")[-1] == 0.0, "or another workpiece"
    assert "high: Z: touches show more than one and a half" in " ".join(
        capsys.readouterr().out.split()
    )
    worn = offsets_of(machine, "drift touch_um by 8")
    assert -10.0 < worn[-1] - well[-1] < -5.0


@pytest.mark.proof
@pytest.mark.parametrize("fault", ["scale touch_um by -1", "scale touch_um by 1000"])
def test_a_wrong_sign_and_another_unit_are_found_and_named(
    machine: Path, capsys: pytest.CaptureFixture[str], fault: str
) -> None:
    assert offsets_of(machine, fault)[-1] == 0.0
    printed = " ".join(capsys.readouterr().out.split())
    assert "alarms:" in printed
    assert "it is off until somebody" in printed or "their offset is off until" in printed


def test_a_cycle_longer_than_the_watchdog_of_the_lathe_is_compensated(
    machine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = machine.read_text(encoding="utf-8")
    machine.write_text(text.replace(f"= {CYCLE_S}", "= 10.0"), encoding="utf-8")
    assert main(["rehearse", str(machine), "--hours", "1"]) == 0
    states = capsys.readouterr().out.partition("states: ")[2].partition("\n")[0]
    assert "Active" in states
    assert "Fault" not in states
