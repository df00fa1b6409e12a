"""Runs Structured Text of the subset: strict kinds, and the arithmetic of LREAL or of REAL.

A program is turned into one Python generator: every variable of every instance is a local name of
it, so that it lasts from call to call, and every operation on numbers is one operation of Python's
floats or of `numpy.float32`. What a PLC could do otherwise is an error: overflow, an index outside
of its array, an element that was never written, an INT beyond 16 bits, a division by zero.
"""

import inspect
import math
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import CodeType, TracebackType
from typing import Any, TypeAlias

import numpy as np

from tests.unit.plc.st_program import (
    BOOL,
    CONSTANT,
    INPUT,
    INT,
    NUMBER,
    OUTPUT,
    STATE,
    Assignment,
    Binary,
    Choice,
    Expression,
    Invocation,
    Literal,
    Opposite,
    Place,
    Read,
    ReadElement,
    ReadOutput,
    Statement,
    StBlock,
    StProgram,
    Value,
    Variable,
    read_program,
)
from tests.unit.plc.st_syntax import StError

MOST_LINES = 300_000
"""Most lines of Python that a program is turned into. [1]"""

Row: TypeAlias = tuple[Value, ...]
_PYTHON = {"AND": "and", "OR": "or", "=": "==", "<>": "!="}
_FILE = "<structured text>"
_SHOWN: Mapping[type, Callable[[Any], Value]] = {
    float: float,
    np.float32: float,
    bool: bool,
    np.bool_: bool,
    int: int,
}


class StRunError(Exception):
    """A program did while it ran what a PLC must not do.

    Parameters
    ----------
    what : str
        What it did.
    line : int
        Line of the text, from 1; 0 for its inputs. [1]
    """

    def __init__(self, what: str, line: int = 0) -> None:
        self.what = what
        self.line = line
        super().__init__(f"line {line}: {what}" if line else what)


class _FaultError(Exception):
    """What went wrong in a statement; the line is found from the traceback."""


# ---- what the generated code calls --------------------------------------------------------------


def _unusual(result: float, *operands: float) -> None:
    """Refuse an infinite result of finite operands, and NaN of others than NaN."""
    if math.isinf(result) and all(math.isfinite(x) for x in operands):
        raise _FaultError("a result is beyond the range of the numbers")
    if math.isnan(result) and not any(math.isnan(x) for x in operands):
        raise _FaultError("a result is no number although the operands are")


def _int(value: int) -> int:
    if not -32768 <= value <= 32767:
        raise _FaultError(f"INT overflow: {value}")
    return value


def _at(array: list[Value | None], index: int) -> Value:
    """Return an element; the index counts from the lower bound."""
    if not 0 <= index < len(array):
        raise _FaultError("the index is outside of the array")
    value = array[index]
    if value is None:
        raise _FaultError("an element is read that was never written")
    return value


def _put(array: list[Value | None], index: int, value: Value) -> None:
    if not 0 <= index < len(array):
        raise _FaultError("the index is outside of the array")
    array[index] = value


def _both(a: bool, b: bool) -> bool:
    return a and b


def _either(a: bool, b: bool) -> bool:
    return a or b


def _wrong(name: str, value: object) -> None:
    raise _FaultError(f"the input {name} got {value!r} of {type(value).__name__}")


# ---- Python of a program ------------------------------------------------------------------------


class _Writer:
    """Writes the generator of a program; `lines` is its text, `places` the line of each."""

    def __init__(self, *, double: bool) -> None:
        self.lines: list[str] = []
        self.places: list[int] = []
        self.constants: list[float] = []
        self._double = double
        self._known: list[Mapping[str, Variable]] = []

    def program(self, block: StBlock) -> None:
        self._line(0, "def program():", 0)
        self._starts(block, "")
        outputs = "".join(f"{self._shown(v)}, " for v in block.of(OUTPUT))
        inputs = block.of(INPUT)
        names = ", ".join(f"v_{v.name}" for v in inputs)
        self._line(1, "while True:", 0)
        self._line(2, f"({names}{',' * bool(inputs)}) = yield ({outputs})", 0)
        for variable in inputs:
            self._input(variable)
        self._statements(block, "", block.body, 2)

    def _line(self, depth: int, text: str, place: Place | int) -> None:
        if len(self.lines) >= MOST_LINES:
            raise StError("the program is too long", 1)
        self.lines.append("\t" * depth + text)
        self.places.append(place if isinstance(place, int) else place.line)

    def _input(self, variable: Variable) -> None:
        kind = {NUMBER: "float", BOOL: "bool", INT: "int"}[variable.kind]
        name = f"v_{variable.name}"
        wrong = f"wrong({variable.name!r}, {name})"
        self._line(2, f"if type({name}) is not {kind}: {wrong}", 0)
        if variable.kind == NUMBER and not self._double:
            self._line(2, f"rounding[0] = {name}; {name} = rounded[0]", 0)
        elif variable.kind == INT:
            self._line(2, f"int16({name})", 0)

    def _shown(self, variable: Variable) -> str:
        if self._double or variable.kind == INT:
            return f"v_{variable.name}"
        kind = "float" if variable.kind == NUMBER else "bool"
        return f"{kind}(v_{variable.name})"

    def _starts(self, block: StBlock, prefix: str) -> None:
        # In an order of its own: that of the declarations means nothing, and dialects differ in it.
        for _, variable in sorted(block.variables.items()):
            name = f"v_{prefix}{variable.name}"
            if variable.length:
                self._line(1, f"{name} = [None] * {variable.length}", 0)
            elif variable.section in {INPUT, OUTPUT, STATE, CONSTANT}:
                self._line(1, f"{name} = {self._start(variable)}", 0)
        for instance, of in sorted(block.instances.items()):
            self._starts(of, f"{prefix}{instance}__")

    def _start(self, variable: Variable) -> str:
        if variable.kind != NUMBER:
            return repr(variable.start)
        self.constants.append(float(variable.start))
        return f"constants[{len(self.constants) - 1}]"

    # ---- statements ---------------------------------------------------------------------------

    def _statements(
        self, block: StBlock, prefix: str, body: tuple[Statement, ...], depth: int
    ) -> None:
        if not body:
            self._line(depth, "pass", 0)
        for statement in body:
            if isinstance(statement, Assignment):
                self._assignment(statement, prefix, depth)
            elif isinstance(statement, Invocation):
                inside = f"{prefix}{statement.instance}__"
                for name, value in statement.inputs:
                    text = self._expression(value, prefix)
                    self._line(depth, f"v_{inside}{name} = {text}", statement.place)
                called = block.instances[statement.instance]
                self._statements(called, inside, called.body, depth)
            else:
                self._choice(block, prefix, statement, depth)

    def _choice(self, block: StBlock, prefix: str, choice: Choice, depth: int) -> None:
        word = "if"
        for place, condition, body in choice.branches:
            self._line(depth, f"{word} {self._expression(condition, prefix)}:", place)
            self._statements(block, prefix, body, depth + 1)
            word = "elif"
        if choice.otherwise:
            self._line(depth, "else:", 0)
            self._statements(block, prefix, choice.otherwise, depth + 1)

    def _assignment(self, statement: Assignment, prefix: str, depth: int) -> None:
        value, place = statement.value, statement.place
        if self._double and isinstance(value, Binary) and value.kind == NUMBER:
            left = self._expression(value.left, prefix)
            right = self._expression(value.right, prefix)
            if any(isinstance(side, ReadElement) for side in (value.left, value.right)):
                self._line(depth, f"a = {left}; b = {right}", place)
                left, right = "a", "b"
            self._line(depth, f"r = {left} {value.operation} {right}", place)
            self._line(depth, f"if r - r != 0.0: unusual(r, {left}, {right})", place)
            text = "r"
        else:
            text = self._expression(value, prefix)
        target = statement.target
        if isinstance(target, Read):
            self._line(depth, f"v_{prefix}{target.name} = {text}", place)
        else:
            array, index = self._array(target, prefix)
            self._line(depth, f"put({array}, {index}, {text})", place)

    # ---- expressions --------------------------------------------------------------------------

    def _array(self, element: ReadElement, prefix: str) -> tuple[str, str]:
        index = self._expression(element.index, prefix)
        return f"v_{prefix}{element.name}", f"{index} - {element.lowest}"

    def _expression(self, value: Expression, prefix: str) -> str:
        if isinstance(value, Literal):
            return repr(value.value)
        if isinstance(value, Read):
            return f"v_{prefix}{value.name}"
        if isinstance(value, ReadOutput):
            return f"v_{prefix}{value.instance}__{value.name}"
        if isinstance(value, ReadElement):
            array, index = self._array(value, prefix)
            return f"at({array}, {index})"
        if isinstance(value, Opposite):
            sign = "-" if value.kind == NUMBER else "not "
            return f"({sign}{self._expression(value.of, prefix)})"
        return self._binary(value, prefix)

    def _binary(self, value: Binary, prefix: str) -> str:
        left = self._expression(value.left, prefix)
        right = self._expression(value.right, prefix)
        operation = _PYTHON.get(value.operation, value.operation)
        if value.of_kind == BOOL and (_may_fail(value.left) or _may_fail(value.right)):
            # Both sides are evaluated. Where neither can fail, nobody sees whether they are.
            return f"{'both' if operation == 'and' else 'either'}({left}, {right})"
        text = f"({left} {operation} {right})"
        return f"int16{text}" if value.kind == INT else text


def _may_fail(value: Expression) -> bool:
    if isinstance(value, Opposite):
        return _may_fail(value.of)
    if isinstance(value, Binary):
        computed = value.kind in {INT, NUMBER}
        return computed or _may_fail(value.left) or _may_fail(value.right)
    return isinstance(value, ReadElement)


# ---- execution ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Compiled:
    code: CodeType
    places: tuple[int, ...]
    constants: tuple[float, ...]


class Machine:
    """A program that can be run: compiled once, started as often as is wanted.

    Parameters
    ----------
    program : StProgram or str
        The program, or its text.
    block : str, optional
        Name of the block that is called. Default: the last one.

    Raises
    ------
    StError
        If the text is no program of the subset, or has no such block.
    """

    def __init__(self, program: StProgram | str, block: str | None = None) -> None:
        self.program = read_program(program) if isinstance(program, str) else program
        called = self.program.main if block is None else self.program.blocks.get(block)
        if called is None:
            raise StError(f"there is no block {block}", 1)
        self.block = called
        self.inputs = tuple(v.name for v in called.of(INPUT))
        self.outputs = tuple(v.name for v in called.of(OUTPUT))
        writer = _Writer(double=self.program.double)
        writer.program(called)
        self._python = "\n".join(writer.lines) + "\n"
        self._places, self._constants = tuple(writer.places), tuple(writer.constants)
        self.meaning = self._python, tuple(x.hex() for x in writer.constants), self.program.double
        """Every statement, number and kind, without the places in the text: two machines of which
        this is equal say the same of the same inputs."""

    def start(self) -> "Execution":
        """Return the block before its first call."""
        code = _code(self._python)
        return Execution(self, _Compiled(code, self._places, self._constants))


@lru_cache(maxsize=4)
def _code(python: str) -> CodeType:
    return compile(python, _FILE, "exec")


class Execution:
    """A block with its state. `step` calls it once, `run` for a number of rows."""

    def __init__(self, machine: Machine, compiled: _Compiled) -> None:
        self._machine = machine
        self._places = compiled.places
        double = machine.program.double
        rounded = np.zeros(1, np.float32)
        numbers = [x if double else np.float32(x) for x in compiled.constants]
        names: dict[str, Any] = {
            "constants": numbers,
            "rounded": rounded,
            "rounding": rounded.data,
            "unusual": _unusual,
            "int16": _int,
            "at": _at,
            "put": _put,
            "wrong": _wrong,
            "both": _both,
            "either": _either,
        }
        exec(compiled.code, names)  # noqa: S102 - our own text, made of checked names
        self._calls: Generator[Row, Sequence[Value], None] = names["program"]()
        self.first: Row = next(self._calls)
        """Outputs before the first call."""

    def step(self, inputs: Sequence[Value]) -> Row:
        """Call the block once.

        Parameters
        ----------
        inputs : sequence
            Values in the order of the block's inputs: float, bool and int, no others.

        Returns
        -------
        tuple
            Outputs in the order of the block.

        Raises
        ------
        StRunError
            If an input is of another kind, or the block does what a PLC must not do.
        """
        return self.run([inputs])[0]

    def call(self, **inputs: Value) -> dict[str, Value]:
        """Call the block once with inputs by name, every one of them; return its outputs."""
        if set(inputs) != set(self._machine.inputs):
            raise StRunError(f"the inputs are {', '.join(self._machine.inputs)}")
        row = self.step([inputs[name] for name in self._machine.inputs])
        return dict(zip(self._machine.outputs, row, strict=True))

    def run(self, rows: Iterable[Sequence[Value]]) -> list[Row]:
        """Call the block once for every row of inputs; return the outputs of every call."""
        send, many = self._calls.send, len(self._machine.inputs)
        said: list[Row] = []
        try:
            # In REAL numpy raises where `_unusual` would.
            with np.errstate(over="raise", divide="raise", invalid="raise", under="ignore"):
                for row in rows:
                    if len(row) != many:
                        raise StRunError(f"{len(row)} inputs instead of {many}")
                    said.append(send(row))
        except (_FaultError, ZeroDivisionError, FloatingPointError) as error:
            raise StRunError(str(error), self._line(error.__traceback__)) from error
        except StopIteration as error:
            raise StRunError("the program stopped at an earlier error") from error
        return said

    def value(self, path: str) -> Value:
        """Return a variable of the block, or of an instance as ``instance.variable``."""
        names: Mapping[str, object] = inspect.getgeneratorlocals(self._calls)
        found: object = names.get("v_" + path.replace(".", "__"))
        kind = _SHOWN.get(found.__class__)
        if kind is None:
            raise StRunError(f"there is no variable {path}, or it has no value")
        return kind(found)

    def _line(self, traceback: TracebackType | None) -> int:
        line = 0
        while traceback is not None:
            if traceback.tb_frame.f_code.co_filename == _FILE:
                line = self._places[traceback.tb_lineno - 1]
            traceback = traceback.tb_next
        return line


# ---- comparison ---------------------------------------------------------------------------------


def same(a: Value, b: Value) -> bool:
    """Whether two values are equal to the last bit; zeros of either sign are, and NaN is."""
    if isinstance(a, bool) != isinstance(b, bool):
        return False
    return a == b or (a != a and b != b)  # noqa: PLR0124 - NaN alone differs from itself


def first_difference(
    names: Sequence[str], expected: Iterable[Sequence[Value]], got: Iterable[Sequence[Value]]
) -> str | None:
    """Return the first step and variable that differ.

    Parameters
    ----------
    names : sequence of str
        Names of the columns.
    expected, got : iterable of rows
        What should be, and what is.

    Returns
    -------
    str or None
        Step from 0, name and both values, in hexadecimal too; None where all are equal.
    """
    step = -1
    rows = iter(got)
    for step, row in enumerate(expected):
        other = next(rows, None)
        if other is None:
            return f"step {step}: nothing is there"
        if tuple(row) == tuple(other) and len(row) == len(names):
            kinds = zip(row, other, strict=True)
            if all(isinstance(a, bool) == isinstance(b, bool) for a, b in kinds):
                continue
        if not len(row) == len(other) == len(names):
            return f"step {step}: {len(other)} values instead of {len(row)} of {len(names)}"
        for name, a, b in zip(names, row, other, strict=True):
            if not same(a, b):
                return f"step {step}: {name} is {_hex(b)} instead of {_hex(a)}"
    return None if next(rows, None) is None else f"step {step + 1}: nothing is expected"


def _hex(value: Value) -> str:
    return f"{value!r} ({value.hex()})" if isinstance(value, float) else repr(value)


def parse_with_blark(text: str) -> None:
    """Parse a text with another grammar, that of TwinCAT; slow.

    Parameters
    ----------
    text : str
        Structured Text.

    Raises
    ------
    StError
        If that grammar does not know it.
    """
    from blark.parse import parse_source_code  # noqa: PLC0415 - half a second, for few tests

    error = parse_source_code(text).exception
    if error is not None:
        place = [getattr(error, name, 0) for name in ("line", "column")]
        raise StError(f"blark: {str(error).splitlines()[0]}", place[0], place[1]) from error
