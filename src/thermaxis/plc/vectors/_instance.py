"""An instance of the exported block: the tree, executed in the arithmetic of the target."""

from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple, TypeAlias, final

from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks import LineSettings, build_line_program, build_program
from thermaxis.plc.tree import PlcNames, Variable, check_program, executable

Cell: TypeAlias = float | bool | int
"""A value of the block."""
_Floats = tuple[float, ...]


class PlcInputs(NamedTuple):
    """Inputs of the block in one call. Numbers may be NaN or infinite."""

    cycle_time_s: float
    """Measured time since the last call; the nominal one in the first. [s]"""
    enable: bool
    """Level: a rising edge enables, a falling one disables; no level of the first call, nor a
    trim, asks for anything."""
    hold: bool
    """Level: while it is TRUE a compensation that is enabled and without a fault is held, also one
    that is enabled meanwhile; a falling edge resumes."""
    reset: bool
    """A rising edge acknowledges."""
    diameter_mm: float
    """Clamping diameter of the workpiece. [mm]"""
    diameter_known: bool
    """Whether it is stated; else the gain at the tool centre point is used."""
    temperatures_c: _Floats
    """By channel of the model. [degC]"""
    ok: tuple[bool, ...]
    """Whether the status of each is good."""
    trims_um: _Floats
    """By output; a value that differs from that of the last call is a request. [µm]"""
    interlocks_met: bool
    """Whether every condition is met."""
    connected: bool
    """Whether the machine can be written to."""
    other_compensation: bool
    """Whether another compensation is active on an axis."""
    read_um: _Floats
    """What the machine reports as the offset that was written last, by output. [µm]"""
    read_ok: bool
    """Whether that could be read."""
    restart: bool = False
    """No input of the block: whether the PLC was switched off and on before this call, so that
    nothing of the block's memory is left."""


class PlcOutputs(NamedTuple):
    """Outputs of the block after one call."""

    correction_um: _Floats
    """What is to be written, by output. [µm]"""
    model_um: _Floats
    """Displacement by output. [µm]"""
    wanted_um: _Floats
    """The correction before rate and supervisor, by output. [µm]"""
    weight: _Floats
    """Weight of the model by output. [1]"""
    at_limit: tuple[bool, ...]
    """Whether the model asks for more than the magnitude, by output."""
    added_um: _Floats
    """Trim in force, by output; 0 once it has expired. [µm]"""
    parts_um: _Floats
    """What every part contributes, in the order of the outputs. [µm]"""
    qualities: tuple[int, ...]
    """What was wrong with each channel: place in `SampleQuality`. [1]"""
    state: int
    """Place in `SupervisorState`. [1]"""
    enabled: bool
    """Whether it was enabled."""
    held: bool
    """Whether the hold of an operator is in force, or has expired."""
    linked: bool
    """Whether the corrections may be written: the machine can be reached, and the offset that
    stood there was taken over."""
    fault_word: int
    """Sum of 2**k over the reasons, k the place in `Reason`. [1]"""
    model_quality: int
    """0 good, 1 held, 2 bad. [1]"""
    outcome_word: int
    """Sum of 2**k over the outcomes, k the place in `Outcome`. [1]"""
    refused: bool
    """Whether a request of this call was refused."""
    heartbeat: int
    """Counts the calls to 32767, then begins at 0 again. [1]"""


_STEMS = {
    "temperatures_c": ("t", "channels"),
    "ok": ("ok", "channels"),
    "trims_um": ("trim", "outputs"),
    "read_um": ("read", "outputs"),
    "correction_um": ("correction", "outputs"),
    "model_um": ("model", "outputs"),
    "wanted_um": ("wanted", "outputs"),
    "weight": ("weight", "outputs"),
    "at_limit": ("limit", "outputs"),
    "added_um": ("added", "outputs"),
    "parts_um": ("part", "parts"),
    "qualities": ("quality", "channels"),
}


@cache
def variable_names(names: PlcNames, fields: tuple[str, ...]) -> dict[str, tuple[str, ...] | str]:
    """Return the variables of the block, one or several, by the field that has their values."""
    made: dict[str, tuple[str, ...] | str] = {}
    for field in fields:
        prefix, stems = _STEMS.get(field, ("", ""))
        several: tuple[str, ...] = getattr(names, stems) if stems else ()
        made[field] = tuple([f"{prefix}_{stem}" for stem in several]) if prefix else field
    return made


def by_variable(names: PlcNames, values: PlcInputs | PlcOutputs) -> dict[str, Cell]:
    """Return inputs or outputs by the names of the block's variables."""
    made: dict[str, Cell] = {}
    for field, variable in variable_names(names, values._fields).items():
        value: Any = getattr(values, field)
        made.update(
            [(variable, value)] if isinstance(variable, str) else zip(variable, value, strict=True)
        )
    made.pop("restart", None)
    return made


@final
class BlockInstance:
    """An instance of the function block: one `step` is one call.

    It executes the tree that is printed, so it proves nothing about the rules in it: that they are
    those of `cycle`, and that the printed texts mean the same, is shown by comparing them.

    Not protected: as `cycle`; and whether a PLC's compiler rounds every operation as IEEE 754
    says is what the comparison with these outputs shows.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    line : LineSettings, optional
        The line in the control: then the reported corrections are those that the control's line
        means, and a call returns what is in force there. Default: there is none.

    Raises
    ------
    ConfigurationError
        As `build_program` and `build_line_program` say.
    """

    def __init__(self, settings: PlcSettings, line: LineSettings | None = None) -> None:
        program = build_program(settings) if line is None else build_line_program(settings, line)
        check_program(program)
        main = program.blocks[-1]
        self.variables: tuple[Variable, ...] = (
            *main.inputs,
            *(v for v in main.outputs if not v.name.startswith("model_id")),
        )
        """Inputs and outputs, without the model's identity."""
        self._make = executable(program)
        self._names, self._line = settings.names, line
        self._said = tuple(variable_names(settings.names, PlcOutputs._fields).values())
        self._block = self._make()

    def step(self, inputs: PlcInputs) -> PlcOutputs:
        """Do what one call of the block does.

        Parameters
        ----------
        inputs : PlcInputs
            Inputs of the call.

        Returns
        -------
        PlcOutputs
            Outputs after the call.
        """
        if inputs.restart:
            self._block = self._make()
        block = self._block
        told = by_variable(self._names, inputs)
        if self._line is not None:
            told |= _line_inputs(self._line, inputs.read_um)
        for name, value in told.items():
            setattr(block, name, value)
        block.step()
        said: list[Any] = [
            getattr(block, name)
            if isinstance(name, str)
            else tuple([getattr(block, n) for n in name])
            for name in self._said
        ]
        outputs = PlcOutputs(*said)
        if self._line is None:
            return outputs
        return outputs._replace(correction_um=_in_force_um(self._line, self.values()))

    def values(self) -> dict[str, Cell]:
        """Return every variable of `variables` after the last call, by its name.

        Returns
        -------
        dict of str to float, bool or int
            The values, in the order of the variables.
        """
        return {v.name: getattr(self._block, v.name) for v in self.variables}


def _line_inputs(line: LineSettings, read_um: _Floats) -> dict[str, Cell]:
    """Return the line by which the control reports corrections at the positions."""
    k0_mm = slope = 0.0
    for to_k0, to_slope, read in zip(*line.weights(), read_um, strict=True):
        k0_mm += to_k0 * read
        slope += to_slope * read
    return {"read_k0_mm": k0_mm, "read_slope": slope, "read_reference_mm": line.origin_mm}


def _in_force_um(line: LineSettings, values: Mapping[str, Cell]) -> _Floats:
    """Return the corrections at the positions that the line in the control means. [µm]"""
    k0_mm, slope = values["k0_mm"], values["slope"]
    return tuple(
        [line.um_per_mm * (k0_mm + slope * (p - line.origin_mm)) for p in line.positions_mm]
    )
