"""Co-simulation units: valid by another's rules, and equal to `cycle` in both versions of FMI."""

import subprocess
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from tests.unit.plc.equal_parts import FLAGS, Row, difference, require_gcc, short_record
from tests.unit.plc.test_block import one_section
from tests.unit.plc.test_library import EVERY
from tests.unit.plc.test_tempcomp import settings_at
from thermaxis.plc import FMI_VERSIONS, Block, Kind, LineSettings, fmu_files

HEADERS = Path(fmpy.__file__).parent / "c-code"
LINE = Block(
    settings=settings_at((100.0, 500.0)),
    line=LineSettings(positions_mm=(100.0, 500.0), away=True),
)


class Unit:
    """A unit that was compiled from its sources, as one that imports it does, and stepped."""

    def __init__(self, block: Block, fmi: int, folder: Path) -> None:
        require_gcc()
        path = folder / f"{block.name}.fmi{fmi}.fmu"
        path.write_bytes(fmu_files(block)[path.name])
        whole = Path(fmpy.extract(path, folder / f"fmi{fmi}"))
        self.described = fmpy.read_model_description(whole, validate=True)
        place = fmpy.platform if fmi == 2 else fmpy.platform_tuple
        binary = whole / "binaries" / place / f"{block.name}{fmpy.sharedLibraryExtension}"
        binary.parent.mkdir(parents=True)
        sources = self.described.buildConfigurations[0].sourceFileSets[0].sourceFiles
        built = subprocess.run(
            ["gcc", *FLAGS, "-Wno-unused-parameter", "-fPIC", "-shared", "-I", str(HEADERS),
             f"-DFMI{fmi}_OVERRIDE_FUNCTION_PREFIX", "-o", str(binary), *sources],
            cwd=whole / "sources", capture_output=True, text=True, check=False, timeout=300,
        )  # fmt: skip
        assert (built.returncode, built.stderr) == (0, "")
        number = "Float64" if block.settings.double else "Float32"
        kinds = ("Real", "Boolean", "Integer") if fmi == 2 else (number, "Boolean", "Int16")
        references = {v.name: v.valueReference for v in self.described.modelVariables}
        made = {2: FMU2Slave, 3: FMU3Slave}[fmi]
        self.slave: Any = made(
            guid=self.described.guid or self.described.instantiationToken,
            unzipDirectory=str(whole),
            modelIdentifier=block.name,
            instanceName="axis",
        )
        self.slave.instantiate()
        if fmi == 2:
            self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.seconds = 0.0
        self.sets, self.gets = (
            [
                (getattr(self.slave, verb + name),
                 [(k, references[v.name], v.name) for k, v in enumerate(of) if v.kind is kind])
                for kind, name in zip(Kind, kinds, strict=True)
            ]
            for verb, of in (("set", block.interface.inputs), ("get", block.interface.outputs))
        )  # fmt: skip

    def step(self, step_s: float, row: Row | None = None) -> dict[str, float]:
        for setter, places in self.sets if row else ():
            if places:
                setter([r for _, r, _ in places], [row[k] for k, _, _ in places])
        self.slave.doStep(self.seconds, step_s)
        self.seconds += step_s
        return self.outputs()

    def outputs(self) -> dict[str, float]:
        return {
            name: float(value)
            for getter, places in self.gets
            for (_, _, name), value in zip(places, getter([r for _, r, _ in places]), strict=True)
        }


@pytest.mark.parametrize("fmi", FMI_VERSIONS)
def test_a_unit_says_what_the_cycle_says_to_the_last_bit_whatever_comes(
    fmi: int, tmp_path: Path
) -> None:
    block, record = short_record(3, double=True)
    unit = Unit(block, fmi, tmp_path)
    said = [unit.step(block.settings.cycle_s, row) for row in record.rows]
    assert difference(record, np.array([[row[n] for n in record.outputs] for row in said])) == ""
    assert len({row["state"] for row in said}) > 3


@pytest.mark.parametrize("fmi", FMI_VERSIONS)
def test_a_step_of_some_cycles_is_so_many_calls_and_another_one_is_refused(
    fmi: int, tmp_path: Path
) -> None:
    block = Block(settings=one_section(double=False, cycle_s=0.125))
    unit = Unit(block, fmi, tmp_path)
    said = unit.step(3 * 0.125)
    # Inputs are missing; the clock is right without anybody telling it.
    assert (said["heartbeat"], said["outcome_word"]) == (3, 258)
    for step_s in (0.0, 0.1, -0.125, float("nan"), float("inf")):
        with pytest.raises(FMICallException):
            unit.step(step_s)
    assert unit.outputs() == said


def test_a_step_that_is_refused_is_logged_by_the_name_of_the_instance_or_by_nobody(
    tmp_path: Path,
) -> None:
    unit = Unit(Block(settings=one_section(double=True, cycle_s=0.125)), 2, tmp_path)
    said: list[bytes] = []
    asked = fmi2CallbackFunctions()
    asked.logger = fmi2CallbackLoggerTYPE(lambda *told: said.append(told[1]))
    for callbacks in (asked, fmi2CallbackFunctions()):
        unit.slave.instantiate(callbacks=callbacks)
        with pytest.raises(FMICallException):
            unit.step(0.1)
    assert said == [b"axis"]


@pytest.mark.parametrize("block", [*EVERY, LINE])
def test_every_unit_is_valid_and_the_same_bytes_come_again(block: Block, tmp_path: Path) -> None:
    files = fmu_files(block)
    assert files == fmu_files(block)
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        assert validate_fmu(str(tmp_path / name)) == []
