"""Checks of a program before it is text: every rule of the tree, in words where one is broken.

What is checked here: names, texts, starts, kinds, that a number is computed alone, and that blocks
stand before those that call them. `_check_flow` checks that everything is written before it is
read, `_check_ranges` that no whole number overflows and no index leaves its array.
"""

import math
import re
from collections.abc import Mapping

from thermaxis.codes import Place
from thermaxis.plc.tree._check_flow import check_flow
from thermaxis.plc.tree._check_ranges import LARGEST_INT, SMALLEST_INT, check_ranges
from thermaxis.plc.tree._names import REMARK, is_legal
from thermaxis.plc.tree._numbers import stored
from thermaxis.plc.tree._tree import (
    Assign,
    Block,
    Call,
    Count,
    Element,
    Expression,
    If,
    Kind,
    Minus,
    Name,
    Not,
    Operation,
    OutputOf,
    Program,
    Remark,
    Statement,
    Truth,
    Two,
    Variable,
)
from thermaxis.plc.tree._walk import ProgramError, Scope, branches_of, walk

LONGEST_ARRAY = 10_000
"""Longest array. Origin: 80 000 bytes of LREAL, what small controls still give to one block. [1]"""
BLOCK_PREFIX = "tx_"
"""What the name of every block begins with, and that of no variable."""
ARITHMETIC = frozenset({Operation.ADD, Operation.SUBTRACT, Operation.MULTIPLY, Operation.DIVIDE})
"""Operations that give a number."""

_TEXT = re.compile(r"[A-Za-z0-9 \-_.,:()=/\[\]]*")
_ENDINGS = ("_step", "_init")
# In C inner blocks are named behind the main one: tx_lag of tx_z is the type tx_z_lag.
_TAKEN = frozenset({"tx_number", "tx_step", "tx_init"})


def check_program(program: Program) -> None:
    """Check every rule of the tree.

    Parameters
    ----------
    program : Program
        The program.

    Raises
    ------
    ProgramError
        If a rule is broken; the error names the block and the statement.
    ConfigurationError
        If the target cannot keep a number.
    """
    for line in program.head:
        _require_text(_TEXT, line, "the head")
    known: dict[str, Block] = {}
    scopes: list[Scope] = []
    for block in program.blocks:
        scope = _scope(block, known, double=program.double)
        _check_block_name(block.name, known)
        known[block.name] = block
        scopes.append(scope)
        for statement, where in walk(block.body, f"block {block.name}"):
            _check_statement(scope, statement, where)
        check_flow(scope)
    if not program.blocks or program.blocks[-1].name != program.name:
        raise ProgramError("last_block_not_main", place=Place(key=program.name))
    check_ranges(tuple(scopes))


# ---- declarations -------------------------------------------------------------------------------


def _check_block_name(name: str, known: Mapping[str, Block]) -> None:
    where = f"block {name}"
    if not is_legal(name) or not name.startswith(BLOCK_PREFIX):
        raise ProgramError("block_name_illegal", place=Place(key=where))
    if name in known:
        raise ProgramError("stated_twice", name=name, place=Place(key=where))
    taken = {other + ending for other in known for ending in _ENDINGS}
    if name in _TAKEN or name in taken or any(name + e in known for e in _ENDINGS):
        raise ProgramError("block_name_taken_in_c", place=Place(key=where))


def _scope(block: Block, known: Mapping[str, Block], *, double: bool) -> Scope:
    where = f"block {block.name}"
    variables: dict[str, Variable] = {}
    for variable in (
        *block.inputs,
        *block.outputs,
        *block.states,
        *block.temporaries,
        *block.constants,
    ):
        _check_variable(variable, f"{where}, {variable.name}", double=double)
        if variable.name in variables:
            raise ProgramError("stated_twice", name=variable.name, place=Place(key=where))
        if variable.length and variable not in block.states:
            raise ProgramError("array_no_state", name=variable.name, place=Place(key=where))
        variables[variable.name] = variable
    if not block.outputs:
        raise ProgramError("block_without_output", place=Place(key=where))
    blocks: dict[str, Block] = {}
    for instance in block.instances:
        _check_name(instance.name, f"{where}, {instance.name}")
        if instance.name in variables or instance.name in blocks:
            raise ProgramError("stated_twice", name=instance.name, place=Place(key=where))
        if instance.block not in known:
            raise ProgramError(
                "instance_of_later_block",
                name=instance.name,
                block=instance.block,
                place=Place(key=where),
            )
        blocks[instance.name] = known[instance.block]
    for remark in block.remarks:
        _require_text(_TEXT, remark, where)
    return Scope(
        block,
        variables,
        blocks,
        frozenset(v.name for v in (*block.inputs, *block.constants)),
        frozenset(v.name for v in (*block.outputs, *block.temporaries)),
    )


def _check_name(name: str, where: str) -> None:
    if not is_legal(name) or name.startswith(BLOCK_PREFIX):
        raise ProgramError("name_illegal", place=Place(key=where))


def _check_variable(variable: Variable, where: str, *, double: bool) -> None:
    _check_name(variable.name, where)
    _require_text(_TEXT, variable.text, where)
    if not 0 <= variable.length <= LONGEST_ARRAY:
        raise ProgramError(
            "outside_count",
            count=variable.length,
            least=1,
            most=LONGEST_ARRAY,
            place=Place(key=where),
        )
    start = variable.start
    if variable.length:
        if start != 0:
            raise ProgramError("array_with_start", place=Place(key=where))
        return
    if variable.kind is Kind.BOOL:
        legal = isinstance(start, bool) or start == 0
    elif variable.kind is Kind.INT:
        whole = isinstance(start, int) and not isinstance(start, bool)
        legal = whole and SMALLEST_INT <= start <= LARGEST_INT
    else:
        legal = not isinstance(start, bool) and math.isfinite(start)
        if legal:
            stored(float(start), double=double, place=Place(key=where))
    if not legal:
        raise ProgramError(
            "wrong_start", start=str(start), kind=variable.kind.value, place=Place(key=where)
        )


def _require_text(pattern: re.Pattern[str], text: str, where: str) -> None:
    if pattern.fullmatch(text) is None:
        raise ProgramError("remark_signs", place=Place(key=where))


# ---- statements ---------------------------------------------------------------------------------


def _check_statement(scope: Scope, statement: Statement, where: str) -> None:
    match statement:
        case Assign():
            _check_assign(scope, statement, where)
        case If(branches):
            if not branches:
                raise ProgramError("if_without_branch", place=Place(key=where))
            for condition, _ in branches:
                _require_kind(scope, condition, Kind.BOOL, where)
            for body, place in branches_of(statement, where):
                if all(isinstance(inner, Remark) for inner in body):
                    raise ProgramError("branch_empty", place=Place(key=place))
        case Call():
            _check_call(scope, statement, where)
        case Remark(text):
            _require_text(REMARK, text, where)


def _check_assign(scope: Scope, statement: Assign, where: str) -> None:
    target, value = statement.target, statement.value
    name = target.name if isinstance(target, Name) else target.array
    kind = kind_of(scope, target, where)
    if name in scope.readonly:
        raise ProgramError("written_though_constant", name=name, place=Place(key=where))
    if kind is Kind.NUMBER and isinstance(value, Two) and value.operation in ARITHMETIC:
        _check_computation(scope, value, where)
    else:
        _require_kind(scope, value, kind, where)


def _check_computation(scope: Scope, value: Two, where: str) -> None:
    """Check the one operation on numbers that a statement may have."""
    for side in (value.left, value.right):
        if not isinstance(side, Name | OutputOf | Element | Minus):
            raise ProgramError("two_computations", place=Place(key=where))
        _require_kind(scope, side, Kind.NUMBER, where)
    if value.operation is Operation.DIVIDE:
        divisor = value.right
        constants = {c.name: c.start for c in scope.block.constants}
        if not isinstance(divisor, Name) or constants.get(divisor.name, 0) == 0:
            raise ProgramError("divisor_not_constant", place=Place(key=where))


def _check_call(scope: Scope, statement: Call, where: str) -> None:
    if statement.instance not in scope.blocks:
        raise ProgramError("unknown_instance", name=statement.instance, place=Place(key=where))
    wanted = scope.blocks[statement.instance].inputs
    given = tuple(name for name, _ in statement.inputs)
    if given != tuple(variable.name for variable in wanted):
        raise ProgramError("call_inputs_differ", name=statement.instance, place=Place(key=where))
    for (_, value), variable in zip(statement.inputs, wanted, strict=True):
        if not isinstance(value, Name | Truth | Count):
            raise ProgramError("call_input_computed", place=Place(key=where))
        _require_kind(scope, value, variable.kind, where)


# ---- kinds --------------------------------------------------------------------------------------


def _require_kind(scope: Scope, expression: Expression, kind: Kind, where: str) -> None:
    found = kind_of(scope, expression, where)
    if found is not kind:
        raise ProgramError(
            "wrong_kind", kind=found.value, expected=kind.value, place=Place(key=where)
        )


def kind_of(scope: Scope, expression: Expression, where: str) -> Kind:
    """Return the kind of an expression."""
    match expression:
        case Name() | OutputOf() | Element():
            return _kind_of_term(scope, expression, where)
        case Truth():
            return Kind.BOOL
        case Count(value):
            if not SMALLEST_INT <= value <= LARGEST_INT:
                raise ProgramError(
                    "wrong_start", start=str(value), kind=Kind.INT.value, place=Place(key=where)
                )
            return Kind.INT
        case Minus(of):
            _require_kind(scope, of, Kind.NUMBER, where)
            return Kind.NUMBER
        case Not(of):
            _require_kind(scope, of, Kind.BOOL, where)
            return Kind.BOOL
        case Two():
            return _kind_of_two(scope, expression, where)


def _kind_of_term(scope: Scope, term: Name | OutputOf | Element, where: str) -> Kind:
    match term:
        case Name(name):
            variable = _variable(scope, name, where)
            if variable.length:
                raise ProgramError("array_without_index", name=name, place=Place(key=where))
            return variable.kind
        case Element(array, index):
            variable = _variable(scope, array, where)
            if not variable.length:
                raise ProgramError("index_without_array", name=array, place=Place(key=where))
            _require_kind(scope, Name(index), Kind.INT, where)
            return variable.kind
        case OutputOf(instance, output):
            block = scope.blocks.get(instance)
            if block is None:
                raise ProgramError("unknown_instance", name=instance, place=Place(key=where))
            kinds = [variable.kind for variable in block.outputs if variable.name == output]
            if not kinds:
                raise ProgramError(
                    "unknown_output", name=instance, output=output, place=Place(key=where)
                )
            return kinds[0]


def _variable(scope: Scope, name: str, where: str) -> Variable:
    variable = scope.variables.get(name)
    if variable is None:
        raise ProgramError("undeclared", name=name, place=Place(key=where))
    return variable


def _kind_of_two(scope: Scope, two: Two, where: str) -> Kind:
    left = kind_of(scope, two.left, where)
    _require_kind(scope, two.right, left, where)
    operation = two.operation
    if operation in {Operation.AND, Operation.OR}:
        if left is not Kind.BOOL:
            raise ProgramError(
                "wrong_kind", kind=left.value, expected=Kind.BOOL.value, place=Place(key=where)
            )
        return Kind.BOOL
    if left is Kind.BOOL:
        raise ProgramError("bool_computed", operation=operation.value, place=Place(key=where))
    if operation in ARITHMETIC:
        if left is Kind.NUMBER:
            raise ProgramError("computation_not_alone", place=Place(key=where))
        if operation is Operation.DIVIDE:
            raise ProgramError("whole_numbers_divided", place=Place(key=where))
        return Kind.INT
    if operation is Operation.EQUAL and any(isinstance(s, Minus) for s in (two.left, two.right)):
        raise ProgramError("computed_number_compared", place=Place(key=where))
    return Kind.BOOL
