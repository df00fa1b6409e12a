"""Function blocks as ST and SCL print them: the same lines but for heads, quotes and ``#``."""

from dataclasses import dataclass
from typing import final

from thermaxis.plc.printers._text import (
    INDENT,
    Wording,
    broken,
    declared,
    expression_text,
    remark_lines,
    start_text,
)
from thermaxis.plc.tree import (
    Assign,
    Block,
    Call,
    If,
    Instance,
    Kind,
    Operation,
    Remark,
    Statement,
    Variable,
)

REMARK = ("(*", "*)")
"""What opens and closes a remark; never nested, since no remark may have these signs."""
TRUTHS = ("FALSE", "TRUE")
"""How both say FALSE and TRUE."""
SIGNS = {operation: operation.value for operation in Operation}
"""How both say the operations."""


@final
@dataclass(frozen=True, slots=True)
class Dialect:
    """In what ST and SCL differ."""

    double: bool
    """Whether numbers are LREAL, or REAL."""
    prefix: str = ""
    """What stands before the name of a variable in a statement."""
    quote: str = ""
    """What stands around the name of a block."""
    before_declarations: tuple[str, ...] = ()
    """Lines behind the name of the block."""
    before_statements: tuple[str, ...] = ()
    """Lines between declarations and statements."""
    typed_constants: bool = True
    """Whether constants stand in ``VAR CONSTANT`` with their type, or in ``CONST`` without."""

    @property
    def wording(self) -> Wording:
        """How it says what stands in an expression."""
        prefix = self.prefix
        return Wording(
            lambda name: prefix + name,
            lambda instance, output: f"{prefix}{instance}.{output}",
            SIGNS,
            "NOT ",
            TRUTHS,
        )


def block_lines(block: Block, dialect: Dialect) -> list[str]:
    """Return a function block."""
    quoted = f"{dialect.quote}{block.name}{dialect.quote}"
    lines = [line for remark in block.remarks for line in remark_lines(remark, "", REMARK)]
    lines += [f"FUNCTION_BLOCK {quoted}", *dialect.before_declarations]
    if not dialect.typed_constants:
        lines += _constants(block.constants, dialect)
    lines += _section("VAR_INPUT", block.inputs, (), dialect)
    lines += _section("VAR_OUTPUT", block.outputs, (), dialect)
    # One section: two with the same heading are not taken everywhere.
    lines += _section("VAR", (*block.states, *block.temporaries), block.instances, dialect)
    if dialect.typed_constants:
        lines += _section("VAR CONSTANT", block.constants, (), dialect)
    lines += dialect.before_statements or ("",)
    lines += body_lines(block.body, dialect.wording, INDENT)
    return [*lines, "END_FUNCTION_BLOCK"]


def _section(
    heading: str,
    variables: tuple[Variable, ...],
    instances: tuple[Instance, ...],
    dialect: Dialect,
) -> list[str]:
    if not variables and not instances:
        return []
    lines = [heading]
    for variable in variables:
        kind = _type(variable.kind, dialect)
        if variable.length:
            line = f"{INDENT}{variable.name} : ARRAY[0..{variable.length - 1}] OF {kind};"
        else:
            start = start_text(variable, double=dialect.double, truths=TRUTHS)
            line = f"{INDENT}{variable.name} : {kind} := {start};"
        lines += declared(line, variable.text, REMARK)
    quote = dialect.quote
    lines += [f"{INDENT}{i.name} : {quote}{i.block}{quote};" for i in instances]
    return [*lines, "END_VAR"]


def _constants(constants: tuple[Variable, ...], dialect: Dialect) -> list[str]:
    if not constants:
        return []
    lines = ["CONST"]
    for constant in constants:
        value = start_text(constant, double=dialect.double, truths=TRUTHS)
        lines += declared(f"{INDENT}{constant.name} := {value};", constant.text, REMARK)
    return [*lines, "END_CONST"]


def _type(kind: Kind, dialect: Dialect) -> str:
    if kind is Kind.NUMBER:
        return "LREAL" if dialect.double else "REAL"
    return kind.value


def body_lines(body: tuple[Statement, ...], wording: Wording, begin: str) -> list[str]:
    """Return statements."""
    lines: list[str] = []
    for statement in body:
        match statement:
            case Assign(target, value):
                left, right = expression_text(target, wording), expression_text(value, wording)
                lines += broken(f"{begin}{left} := {right};")
            case If():
                lines += _choice_lines(statement, wording, begin)
            case Call(instance, inputs):
                given = ", ".join(f"{n} := {expression_text(v, wording)}" for n, v in inputs)
                lines += broken(f"{begin}{wording.name(instance)}({given});")
            case Remark(text):
                lines += remark_lines(text, begin, REMARK)
    return lines


def _choice_lines(choice: If, wording: Wording, begin: str) -> list[str]:
    lines: list[str] = []
    word = "IF"
    for condition, body in choice.branches:
        lines += broken(f"{begin}{word} {expression_text(condition, wording)} THEN")
        lines += body_lines(body, wording, begin + INDENT)
        word = "ELSIF"
    if choice.otherwise:
        lines += [f"{begin}ELSE", *body_lines(choice.otherwise, wording, begin + INDENT)]
    return [*lines, f"{begin}END_IF;"]
