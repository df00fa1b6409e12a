"""A syntax tree of Structured Text to a program whose names and kinds are checked.

The subset is that of `thermaxis.plc.tree`, read anew from the text: whatever is not known here is
an error with its line, and nothing is converted silently.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TypeAlias

import numpy as np
from tree_sitter import Node

from tests.unit.plc.st_syntax import StError, error_at, inner, syntax_tree, text_of

NUMBER, BOOL, INT = "NUMBER", "BOOL", "INT"
INPUT, OUTPUT, STATE, TEMPORARY, CONSTANT = "input", "output", "state", "temporary", "constant"
LONGEST_NAME = 24
LONGEST_ARRAY = 100_000

_NAME = re.compile(r"[a-z](_?[a-z0-9])*")
_REAL_LITERAL = re.compile(r"-?[0-9]+\.[0-9]+(E[+-]?[0-9]+)?", re.IGNORECASE)
_INT_LITERAL = re.compile(r"-?[0-9]+")
# What some compiler refuses as a name although the grammar takes it.
_WORDS = (
    "abs acos add and asin at atan bool by byte case concat constant continue cos ctd ctu "
    "ctud date delete dint div do dt dword else elsif en end eno eq exit exp expt f_edge "
    "f_trig false find for from function ge gt if insert int le left len limit lint ln log "
    "lreal lt lword max mid min mod move mul mux ne not of on or override r_edge r_trig "
    "real ref repeat replace resource retain return right rol ror rs sel shl shr sin single "
    "sint sqrt sr step string sub super tan task then this time to tod tof ton tp "
    "transition true trunc type udint uint ulint until usint using var while with word "
    "wstring xor "
)
_NO_NAMES = frozenset(_WORDS.split())

Value: TypeAlias = float | bool | int


@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands in the text."""

    line: int
    column: int


@dataclass(frozen=True, slots=True)
class Literal:
    """TRUE, FALSE or a whole number."""

    kind: str
    value: bool | int


@dataclass(frozen=True, slots=True)
class Read:
    """The value of a variable or a constant of the block."""

    kind: str
    name: str


@dataclass(frozen=True, slots=True)
class ReadOutput:
    """The value of an output of an instance."""

    kind: str
    instance: str
    name: str


@dataclass(frozen=True, slots=True)
class ReadElement:
    """The value of an element of an array."""

    kind: str
    name: str
    lowest: int
    highest: int
    index: "Expression"


@dataclass(frozen=True, slots=True)
class Opposite:
    """Minus a number, or NOT a BOOL."""

    kind: str
    of: "Expression"


@dataclass(frozen=True, slots=True)
class Binary:
    """An operation on two operands of one kind."""

    kind: str
    operation: str
    of_kind: str
    left: "Expression"
    right: "Expression"


Expression: TypeAlias = Literal | Read | ReadOutput | ReadElement | Opposite | Binary


@dataclass(frozen=True, slots=True)
class Assignment:
    """Give a variable or an element a value."""

    place: Place
    target: Read | ReadElement
    value: Expression


@dataclass(frozen=True, slots=True)
class Choice:
    """The first branch whose condition holds, or the last one."""

    branches: "tuple[tuple[Place, Expression, tuple[Statement, ...]], ...]"
    otherwise: "tuple[Statement, ...]"


@dataclass(frozen=True, slots=True)
class Invocation:
    """Call an instance; an input that is not named keeps its value."""

    place: Place
    instance: str
    inputs: tuple[tuple[str, Expression], ...]


Statement: TypeAlias = Assignment | Choice | Invocation


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable or constant of a block; an array where ``length`` is not 0."""

    name: str
    section: str
    kind: str
    start: Value = 0
    lowest: int = 0
    length: int = 0

    @property
    def highest(self) -> int:
        """Highest index of an array."""
        return self.lowest + self.length - 1


@dataclass(slots=True)
class StBlock:
    """A function block. Names are folded to lower case, in the order of the text."""

    name: str
    variables: dict[str, Variable] = field(default_factory=dict[str, Variable])
    instances: "dict[str, StBlock]" = field(default_factory=dict[str, "StBlock"])
    body: tuple[Statement, ...] = ()

    def of(self, section: str) -> tuple[Variable, ...]:
        """Return the variables of a section."""
        return tuple(v for v in self.variables.values() if v.section == section)


@dataclass(frozen=True, slots=True)
class StProgram:
    """Every block of a file; the last one is what a user calls."""

    double: bool
    blocks: Mapping[str, StBlock]

    @property
    def main(self) -> StBlock:
        """The last block."""
        return list(self.blocks.values())[-1]


def binary32(text: str) -> float:
    """Return the binary32 nearest to a decimal number, rounded once.

    Parameters
    ----------
    text : str
        The number.

    Returns
    -------
    float
        The nearest one; of two that are as near, the even one; infinite beyond the range.
    """
    exact = Fraction(text)
    if abs(exact) >= Fraction(2) ** 128 - Fraction(2) ** 103:
        return float("inf") if exact > 0 else float("-inf")
    largest = np.finfo(np.float32).max
    near = np.float32(min(max(float(text), -float(largest)), float(largest)))
    tried = [near, np.nextafter(near, -largest), np.nextafter(near, largest)]
    even = [(abs(Fraction(float(x)) - exact), int(x.view(np.uint32)) & 1, x) for x in tried]
    return float(min(even, key=lambda row: row[:2])[2])


def read_program(text: str) -> StProgram:
    """Read a file of Structured Text.

    Parameters
    ----------
    text : str
        The file.

    Returns
    -------
    StProgram
        Its blocks, checked.

    Raises
    ------
    StError
        If anything in it is not in the subset, with line and column.
    """
    root = syntax_tree(text)
    numbers = _NumberType()
    blocks: dict[str, StBlock] = {}
    for _, node in inner(root):
        if node.type != "function_block_declaration":
            raise error_at(node, f"{node.type} is not in the subset")
        block = _BlockReader(node, blocks, numbers).block
        blocks[block.name] = block
    if not blocks:
        raise StError("there is no block", 1)
    return StProgram(double=numbers.name != "REAL", blocks=blocks)


class _NumberType:
    """LREAL or REAL: the first one that is read, for the whole file."""

    def __init__(self) -> None:
        self.name = ""

    def kind(self, node: Node) -> str:
        name = text_of(node).upper()
        if name in {"BOOL", "INT"}:
            return name
        if name not in {"REAL", "LREAL"}:
            raise error_at(node, f"the type {name} is not in the subset")
        if self.name not in {"", name}:
            raise error_at(node, f"{name} in a file of {self.name}")
        self.name = name
        return NUMBER

    def number(self, node: Node) -> float:
        text = text_of(node)
        if not _REAL_LITERAL.fullmatch(text):
            raise error_at(node, f"{text!r} is no number with a point between digits")
        value = binary32(text) if self.name == "REAL" else float(text)
        if value in (float("inf"), float("-inf")):
            raise error_at(node, f"{text} is beyond the range of {self.name}")
        return value


def _whole(node: Node) -> int:
    text = text_of(node)
    if node.type != "integer_literal" or not _INT_LITERAL.fullmatch(text):
        raise error_at(node, f"{text!r} is no whole number")
    if not -32768 <= int(text) <= 32767:
        raise error_at(node, f"{text} is beyond the range of INT")
    return int(text)


_SECTIONS = {
    "var_input": INPUT,
    "var_output": OUTPUT,
    "var_block": STATE,
    "var_temp": TEMPORARY,
}
_OPERAND_TYPES = frozenset(
    {
        "identifier",
        "member_access_expression",
        "index_expression",
        "integer_literal",
        "boolean_literal",
        "parenthesized_expression",
    }
)
_ORDER = frozenset({"<", "<=", ">", ">="})
_EQUALITY = frozenset({"=", "<>"})
_LOGIC = frozenset({"AND", "OR"})
_ARITHMETIC: Mapping[str, frozenset[str]] = {
    NUMBER: frozenset({"+", "-", "*", "/"}),
    INT: frozenset({"+", "-", "*"}),
    BOOL: frozenset(),
}


class _BlockReader:
    """Reads one block; `block` is the result."""

    def __init__(self, node: Node, known: Mapping[str, StBlock], numbers: _NumberType) -> None:
        self._known = known
        self._numbers = numbers
        self._operations = 0
        self._headings: set[str] = set()
        self.block = StBlock("")
        body: list[Node] = []
        for name, child in inner(node):
            if child.type in {"FUNCTION_BLOCK", "END_FUNCTION_BLOCK"}:
                continue
            if name == "name":
                self.block.name = self._new_name(child)
            elif child.type in _SECTIONS:
                self._section(child)
            elif name == "body":
                body.append(child)
            else:
                raise error_at(child, f"{child.type} is not in the subset")
        end = node.children[-1]
        self.block.body = self._statements(body, end)
        _Flow(self.block).statements(self.block.body, frozenset())

    # ---- declarations -------------------------------------------------------------------------

    def _new_name(self, node: Node) -> str:
        name = text_of(node).lower()
        block = self.block
        if not _NAME.fullmatch(name) or len(name) > LONGEST_NAME or name in _NO_NAMES:
            raise error_at(node, f"{name} is no name that every target takes")
        taken = {block.name, *block.variables, *block.instances, *self._known}
        if name in taken:
            raise error_at(node, f"{name} is declared twice")
        return name

    def _section(self, node: Node) -> None:
        section = _SECTIONS[node.type]
        heading = node.type + "".join(c.type for c in node.children if "qualifier" in c.type)
        if heading in self._headings:
            raise error_at(node, "two sections with the same heading")
        self._headings.add(heading)
        for _, child in inner(node):
            if child.type == "var_qualifier_list":
                if section != STATE or text_of(child).upper() != "CONSTANT":
                    raise error_at(child, f"{text_of(child)} is not in the subset")
                section = CONSTANT
            elif child.type == "variable_declaration":
                self._declaration(child, section)
            elif child.is_named:
                raise error_at(child, f"{child.type} is not in the subset")

    def _declaration(self, node: Node, section: str) -> None:
        parts: dict[str, list[Node]] = {}
        for name, child in inner(node):
            if name:
                parts.setdefault(name, []).append(child)
            elif child.is_named or child.type not in {":", ":=", ";", ","}:
                raise error_at(child, f"{child.type} is not in the subset")
        unknown = set(parts) - {"names", "type", "initial_value"}
        if unknown:
            raise error_at(node, f"{min(unknown)} is not in the subset")
        starts = parts.get("initial_value", [])
        kind = parts["type"][0]
        for name in parts["names"]:
            if kind.type == "identifier":
                self._instance(name, kind, section, starts)
            elif kind.type == "array_type":
                self._array(name, kind, section, starts)
            else:
                self._scalar(name, kind, section, starts)

    def _instance(self, name: Node, kind: Node, section: str, starts: list[Node]) -> None:
        if starts or section != STATE:
            raise error_at(name, "an instance stands in VAR and has no initial value")
        block = self._known.get(text_of(kind).lower())
        if block is None:
            raise error_at(kind, f"the block {text_of(kind)} is not declared before")
        self.block.instances[self._new_name(name)] = block

    def _array(self, name: Node, kind: Node, section: str, starts: list[Node]) -> None:
        if starts or section != STATE:
            raise error_at(name, "an array stands in VAR and has no initial value")
        ranges = [c for field_name, c in inner(kind) if field_name == "range"]
        of = kind.child_by_field_name("element_type")
        if len(ranges) != 1 or of is None:
            raise error_at(kind, "only arrays with one index are in the subset")
        low, high = (ranges[0].child_by_field_name(end) for end in ("lower", "upper"))
        if low is None or high is None:
            raise error_at(kind, "an array without bounds")
        lowest, length = _whole(low), _whole(high) - _whole(low) + 1
        if not 1 <= length <= LONGEST_ARRAY:
            raise error_at(kind, "an array without elements, or with too many")
        key = self._new_name(name)
        element = self._numbers.kind(of)
        self.block.variables[key] = Variable(key, section, element, lowest=lowest, length=length)

    def _scalar(self, name: Node, kind: Node, section: str, starts: list[Node]) -> None:
        if kind.type != "elementary_type":
            raise error_at(kind, f"{kind.type} is not in the subset")
        of = self._numbers.kind(kind)
        key = self._new_name(name)
        if section == TEMPORARY:
            if starts:
                raise error_at(name, "a temporary has no initial value")
            self.block.variables[key] = Variable(key, section, of)
            return
        if len(starts) != 1:
            raise error_at(name, f"{key} has no initial value")
        self.block.variables[key] = Variable(key, section, of, self._start(of, starts[0]))

    def _start(self, kind: str, node: Node) -> Value:
        if kind == BOOL:
            return self._truth(node)
        if kind == INT:
            return _whole(node)
        if node.type != "real_literal":
            raise error_at(node, f"{text_of(node)} is no number with a point")
        return self._numbers.number(node)

    @staticmethod
    def _truth(node: Node) -> bool:
        word = text_of(node).upper()
        if node.type != "boolean_literal" or word not in {"TRUE", "FALSE"}:
            raise error_at(node, f"{text_of(node)} is not TRUE or FALSE")
        return word == "TRUE"

    # ---- statements ---------------------------------------------------------------------------

    def _statements(self, nodes: list[Node], end: Node) -> tuple[Statement, ...]:
        if not nodes:
            raise error_at(end, "there is no statement; one alone may be empty")
        if len(nodes) == 1 and nodes[0].type == "empty_statement":
            return ()
        read: list[Statement] = []
        open_end: Node | None = None
        for node in nodes:
            if (node.type == "empty_statement") != (open_end is not None):
                what = "a semicolon too many" if open_end is None else "a semicolon is missing"
                raise error_at(node if open_end is None else open_end, what)
            if open_end is not None:
                open_end = None
                continue
            read.append(self._statement(node))
            open_end = node.children[-1] if node.type == "if_statement" else None
        if open_end is not None:
            raise error_at(open_end, "a semicolon is missing")
        return tuple(read)

    def _statement(self, node: Node) -> Statement:
        self._operations = 0
        if node.type == "assignment_statement":
            return self._assignment(node)
        if node.type == "if_statement":
            return self._choice(node)
        if node.type == "invocation_statement":
            return self._invocation(node)
        raise error_at(node, f"{node.type} is not in the subset")

    def _assignment(self, node: Node) -> Assignment:
        left, right = _fields(node, "left", "right")
        target = self._target(left)
        value = self._expression(right)
        self._same_kind(right, value, target.kind)
        if self._operations and not (isinstance(value, Binary) and value.kind == NUMBER):
            raise error_at(right, "a result of numbers is not stored before it is used")
        return Assignment(_place(node), target, value)

    def _target(self, node: Node) -> Read | ReadElement:
        if node.type == "index_expression":
            target = self._element(node)
        elif node.type == "identifier":
            target = self._read(node)
        else:
            raise error_at(node, "only a variable of the block can be assigned")
        section = self.block.variables[target.name].section
        if section in {INPUT, CONSTANT}:
            raise error_at(node, f"{target.name} cannot be assigned: its section is {section}")
        return target

    def _choice(self, node: Node) -> Choice:
        branches: list[tuple[Place, Expression, tuple[Statement, ...]]] = []
        otherwise: tuple[Statement, ...] = ()
        fields = inner(node)
        own = [c for name, c in fields if name == "consequence"]
        branches.append(self._branch(node, own))
        for name, child in fields:
            if child.type == "elsif_clause":
                branches.append(self._branch(child, _bodies(child)))
            elif child.type == "else_clause":
                otherwise = self._statements(_bodies(child), child)
            elif not name and child.is_named:
                raise error_at(child, f"{child.type} is not in the subset")
        return Choice(tuple(branches), otherwise)

    def _branch(
        self, node: Node, body: list[Node]
    ) -> tuple[Place, Expression, tuple[Statement, ...]]:
        (condition,) = _fields(node, "condition")
        value = self._plain(condition, BOOL)
        return _place(condition), value, self._statements(body, node)

    def _invocation(self, node: Node) -> Invocation:
        call = next(c for _, c in inner(node) if c.type == "call_expression")
        function, arguments = _fields(call, "function", "arguments")
        name = text_of(function).lower()
        block = self.block.instances.get(name)
        if function.type != "identifier" or block is None:
            raise error_at(function, f"{text_of(function)} is no instance of this block")
        inputs: dict[str, Expression] = {}
        for _, argument in inner(arguments):
            if argument.is_named:
                key, value = self._argument(argument, block)
                if key in inputs:
                    raise error_at(argument, f"{key} is stated twice")
                inputs[key] = value
        return Invocation(_place(node), name, tuple(inputs.items()))

    def _argument(self, node: Node, block: StBlock) -> tuple[str, Expression]:
        if node.type != "named_argument" or not any(c.type == ":=" for c in node.children):
            raise error_at(node, "an argument is written as input := value")
        name, value = _fields(node, "name", "value")
        key = text_of(name).lower()
        variable = block.variables.get(key)
        if variable is None or variable.section != INPUT:
            raise error_at(name, f"{key} is no input of {block.name}")
        return key, self._plain(value, variable.kind)

    # ---- expressions --------------------------------------------------------------------------

    def _plain(self, node: Node, kind: str) -> Expression:
        """Read an expression of a kind in which no number is computed."""
        self._operations = 0
        value = self._expression(node)
        self._same_kind(node, value, kind)
        if self._operations:
            raise error_at(node, "a result of numbers is not stored before it is used")
        return value

    @staticmethod
    def _same_kind(node: Node, value: Expression, kind: str) -> None:
        if value.kind != kind:
            raise error_at(node, f"{value.kind} stands where {kind} must")

    def _expression(self, node: Node) -> Expression:
        readers: Mapping[str, Callable[[Node], Expression]] = {
            "identifier": self._read,
            "member_access_expression": self._member,
            "index_expression": self._element,
            "parenthesized_expression": self._inside,
            "unary_expression": self._unary,
            "binary_expression": self._binary,
            "boolean_literal": lambda n: Literal(BOOL, self._truth(n)),
            "integer_literal": lambda n: Literal(INT, _whole(n)),
        }
        reader = readers.get(node.type)
        if node.type == "real_literal":
            raise error_at(node, "a literal number in a statement; constants have names")
        if reader is None:
            raise error_at(node, f"{node.type} is not in the subset")
        return reader(node)

    def _inside(self, node: Node) -> Expression:
        (inside,) = [c for _, c in inner(node) if c.is_named]
        return self._expression(inside)

    def _read(self, node: Node) -> Read:
        name = text_of(node).lower()
        variable = self.block.variables.get(name)
        if variable is None:
            raise error_at(node, f"{name} is not declared, or is no variable")
        if variable.length:
            raise error_at(node, f"{name} is an array and has no index here")
        return Read(variable.kind, name)

    def _member(self, node: Node) -> ReadOutput:
        of, member = _fields(node, "object", "member")
        instance, name = text_of(of).lower(), text_of(member).lower()
        block = self.block.instances.get(instance)
        if of.type != "identifier" or block is None:
            raise error_at(of, f"{text_of(of)} is no instance of this block")
        variable = block.variables.get(name)
        if variable is None or variable.section != OUTPUT:
            raise error_at(member, f"{name} is no output of {block.name}")
        return ReadOutput(variable.kind, instance, name)

    def _element(self, node: Node) -> ReadElement:
        (of,) = _fields(node, "object")
        indices = [c for name, c in inner(node) if name == "index"]
        name = text_of(of).lower()
        variable = self.block.variables.get(name) if of.type == "identifier" else None
        if variable is None or not variable.length or len(indices) != 1:
            raise error_at(node, f"{text_of(of)} is no array with one index")
        index = self._expression(indices[0])
        self._same_kind(indices[0], index, INT)
        lowest, highest = variable.lowest, variable.highest
        if isinstance(index, Literal) and not lowest <= index.value <= highest:
            raise error_at(indices[0], f"the index is outside of {lowest} to {highest}")
        return ReadElement(variable.kind, name, lowest, highest, index)

    def _operand(self, node: Node) -> Expression:
        signed = node.type == "integer_literal" and text_of(node).startswith("-")
        if node.type == "real_literal":
            return self._expression(node)
        if node.type not in _OPERAND_TYPES or signed:
            raise error_at(node, "parentheses are missing: what binds first must be seen")
        return self._expression(node)

    def _unary(self, node: Node) -> Opposite:
        operator, operand = _fields(node, "operator", "operand")
        sign = text_of(operator).upper()
        kinds = {"-": NUMBER, "NOT": BOOL}
        if sign not in kinds:
            raise error_at(operator, f"{sign} is not in the subset")
        value = self._operand(operand)
        self._same_kind(operand, value, kinds[sign])
        return Opposite(kinds[sign], value)

    def _binary(self, node: Node) -> Binary:
        left, operator, right = _fields(node, "left", "operator", "right")
        sign = text_of(operator).upper()
        a, b = self._operand(left), self._operand(right)
        self._same_kind(right, b, a.kind)
        if sign in _LOGIC and a.kind == BOOL:
            return Binary(BOOL, sign, BOOL, a, b)
        if sign in _ORDER | _EQUALITY and a.kind != BOOL:
            return Binary(BOOL, sign, a.kind, a, b)
        if sign not in _ARITHMETIC[a.kind]:
            raise error_at(operator, f"{sign} of {a.kind} is not in the subset")
        if a.kind == NUMBER:
            self._operations += 1
            if self._operations > 1:
                raise error_at(operator, "a statement computes with numbers more than once")
        return Binary(a.kind, sign, a.kind, a, b)


class _Flow:
    """Finds temporaries that are read before they were written in the same call."""

    def __init__(self, block: StBlock) -> None:
        self._temporaries = {v.name for v in block.of(TEMPORARY)}

    def statements(self, body: tuple[Statement, ...], written: frozenset[str]) -> frozenset[str]:
        for statement in body:
            if isinstance(statement, Assignment):
                self._check(statement.value, written, statement.place)
                if isinstance(statement.target, ReadElement):
                    self._check(statement.target.index, written, statement.place)
                written |= {statement.target.name}
            elif isinstance(statement, Invocation):
                for _, value in statement.inputs:
                    self._check(value, written, statement.place)
            else:
                written = self._choice(statement, written)
        return written

    def _choice(self, choice: Choice, written: frozenset[str]) -> frozenset[str]:
        ends: list[frozenset[str]] = []
        for place, condition, body in choice.branches:
            self._check(condition, written, place)
            ends.append(self.statements(body, written))
        ends.append(self.statements(choice.otherwise, written))
        written = ends[0]
        for end in ends[1:]:
            written &= end
        return written

    def _check(self, value: Expression, written: frozenset[str], place: Place) -> None:
        if isinstance(value, Read | ReadElement):
            if value.name in self._temporaries - written:
                what = f"the temporary {value.name} is read before it is written"
                raise StError(what, place.line, place.column)
            if isinstance(value, ReadElement):
                self._check(value.index, written, place)
        elif isinstance(value, Opposite):
            self._check(value.of, written, place)
        elif isinstance(value, Binary):
            self._check(value.left, written, place)
            self._check(value.right, written, place)


def _fields(node: Node, *names: str) -> list[Node]:
    found = [node.child_by_field_name(name) for name in names]
    return [n if n is not None else _no_field(node) for n in found]


def _no_field(node: Node) -> Node:
    raise error_at(node, f"{node.type} is not complete")


def _bodies(node: Node) -> list[Node]:
    return [c for name, c in inner(node) if name == "body"]


def _place(node: Node) -> Place:
    return Place(node.start_point.row + 1, node.start_point.column + 1)
