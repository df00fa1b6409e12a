"""A program as C99: a header and a source, without allocation and without a library."""

from typing import NamedTuple, final

from thermaxis.plc.printers._text import (
    INDENT,
    Wording,
    broken,
    declared,
    expression_text,
    joined,
    remark_lines,
    start_text,
)
from thermaxis.plc.tree import (
    BLOCK_PREFIX,
    Assign,
    Block,
    Call,
    Element,
    Expression,
    If,
    Kind,
    Name,
    Not,
    Operation,
    Program,
    Remark,
    Statement,
    Two,
    Variable,
    check_program,
    names_read,
    reachable,
    walk,
)

REMARK = ("/*", "*/")
"""What opens and closes a remark; no remark may have these signs."""

# No name of the tree ends in an underscore, so neither can be that of a variable.
_SELF, _COUNTER = "b_", "k_"
_TRUTHS = ("false", "true")
_SIGNS = {operation: operation.value for operation in Operation} | {
    Operation.EQUAL: "==",
    Operation.AND: "&&",
    Operation.OR: "||",
}


@final
class CText(NamedTuple):
    """The two files of C."""

    header: str
    """``<name>.h``."""
    source: str
    """``<name>.c``."""


def print_c(program: Program) -> CText:
    """Return a program as C99.

    The main block is a struct with its inputs, outputs, states and instances as members, and two
    functions: ``<name>_init(b)`` sets everything to its start, ``<name>_step(b)`` is one call.
    Types of inner blocks have the main block's name before theirs, so that two programs can stand
    in one.

    The source refuses a compiler that computes wider than the type (``FLT_EVAL_METHOD``) or with
    fast math. It cannot see whether a product and a sum are contracted to one operation, which
    gcc does by default where the target can: compile with ``-ffp-contract=off``.

    Not protected: a struct that was not initialised, a step that two threads call at once, and a
    task that calls at another cycle than the one exported without saying so.

    Parameters
    ----------
    program : Program
        The program.

    Returns
    -------
    CText
        Header and source: ASCII, lines of at most 100 signs.

    Raises
    ------
    ProgramError
        If the program breaks a rule of the tree.
    ConfigurationError
        If the target cannot keep a number.

    References
    ----------
    ISO/IEC 9899:1999, 5.2.4.2.2 (FLT_EVAL_METHOD), 6.5 (contraction).
    """
    check_program(program)
    needed = reachable(program)
    blocks = tuple(block for block in program.blocks if block.name in needed)
    return CText(_header(program, blocks), _source(program, blocks))


# ---- header -------------------------------------------------------------------------------------


def _header(program: Program, blocks: tuple[Block, ...]) -> str:
    guard = f"{program.name.upper()}_H"
    number, other = ("double", "float") if program.double else ("float", "double")
    lines = [line for text in program.head for line in remark_lines(text, "", REMARK)]
    lines += [
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        "#include <stdbool.h>",
        "#include <stdint.h>",
        "",
        "#ifdef __cplusplus",
        'extern "C" {',
        "#endif",
        "",
        "/* Numbers of every program of this kind that stands in one with this. */",
        f"#ifdef TX_NUMBER_IS_{other.upper()}",
        f'#error "this program computes in {number}, another one included before in {other}"',
        "#endif",
        f"#ifndef TX_NUMBER_IS_{number.upper()}",
        f"#define TX_NUMBER_IS_{number.upper()}",
        f"typedef {number} tx_number;",
        "#endif",
    ]
    for block in blocks:
        lines += ["", *_struct(program, block)]
    name = program.name
    lines += [
        "",
        "/* Sets everything to its start; to be called before the first step. */",
        f"void {name}_init({name} *b);",
        "",
        "/* One call: reads the inputs, sets the outputs. */",
        f"void {name}_step({name} *b);",
        "",
        "#ifdef __cplusplus",
        "}",
        "#endif",
        "",
        f"#endif /* {guard} */",
    ]
    return joined(lines)


def _struct(program: Program, block: Block) -> list[str]:
    name = _c_name(program, block.name)
    lines = [line for text in block.remarks for line in remark_lines(text, "", REMARK)]
    lines += [f"typedef struct {name} {{"]
    for title, variables in (
        ("inputs", block.inputs),
        ("outputs", block.outputs),
        ("states", block.states),
    ):
        if variables:
            lines += remark_lines(title, INDENT, REMARK)
        for variable in variables:
            length = f"[{variable.length}]" if variable.length else ""
            line = f"{INDENT}{_type(variable.kind)} {variable.name}{length};"
            lines += declared(line, variable.text, REMARK)
    if block.instances:
        lines += remark_lines("instances", INDENT, REMARK)
    lines += [f"{INDENT}{_c_name(program, i.block)} {i.name};" for i in block.instances]
    return [*lines, f"}} {name};"]


def _c_name(program: Program, name: str) -> str:
    return name if name == program.name else f"{program.name}_{name.removeprefix(BLOCK_PREFIX)}"


def _type(kind: Kind) -> str:
    return {Kind.NUMBER: "tx_number", Kind.BOOL: "bool", Kind.INT: "int16_t"}[kind]


# ---- source -------------------------------------------------------------------------------------


def _source(program: Program, blocks: tuple[Block, ...]) -> str:
    widths = (0, 1) if program.double else (0,)
    wider = " && ".join(f"FLT_EVAL_METHOD != {width}" for width in widths)
    lines: list[str] = []
    for text in (
        *program.head[:1],
        f"Model, units, signs and what is not protected stand in {program.name}.h.",
        "Compile with -ffp-contract=off: a product and a sum in one operation round otherwise.",
    ):
        lines += remark_lines(text, "", REMARK)
    lines += [
        f'#include "{program.name}.h"',
        "",
        "#include <float.h>",
        "",
        f"#if !defined(FLT_EVAL_METHOD) || ({wider})",
        '#error "this compiler does not compute in the type that is declared"',
        "#endif",
        "#ifdef __FAST_MATH__",
        '#error "fast math changes the numbers of this program"',
        "#endif",
    ]
    called = {
        instance.block
        for block in blocks
        for statement, _ in walk(block.body, "")
        for instance in block.instances
        if isinstance(statement, Call) and statement.instance == instance.name
    }
    for block in blocks:
        lines += ["", *_init_lines(program, block)]
        if block.name in called or block.name == program.name:
            lines += ["", *_step_lines(program, block)]
    return joined(lines)


def _function(program: Program, block: Block, what: str) -> list[str]:
    name = _c_name(program, block.name)
    static = "" if block.name == program.name else "static "
    return [f"{static}void {name}_{what}({name} *{_SELF})", "{"]


def _init_lines(program: Program, block: Block) -> list[str]:
    lines = _function(program, block, "init")
    for variable in (*block.inputs, *block.outputs, *block.states):
        start = _literal(variable, double=program.double)
        if variable.length:
            k = _COUNTER
            lines += [
                f"{INDENT}for (int {k} = 0; {k} < {variable.length}; {k}++) {{",
                f"{INDENT * 2}{_SELF}->{variable.name}[{k}] = {start};",
                f"{INDENT}}}",
            ]
        else:
            lines.append(f"{INDENT}{_SELF}->{variable.name} = {start};")
    for instance in block.instances:
        lines.append(f"{INDENT}{_c_name(program, instance.block)}_init(&{_SELF}->{instance.name});")
    return [*lines, "}"]


def _literal(variable: Variable, *, double: bool) -> str:
    text = start_text(variable, double=double, truths=_TRUTHS)
    return text + "F" if variable.kind is Kind.NUMBER and not double else text


def _step_lines(program: Program, block: Block) -> list[str]:
    read = names_read(block)
    lines = _function(program, block, "step")
    for constant in block.constants:
        if constant.name in read:
            value = _literal(constant, double=program.double)
            line = f"{INDENT}static const {_type(constant.kind)} {constant.name} = {value};"
            lines += declared(line, constant.text, REMARK)
    for variable in block.temporaries:
        start = _literal(variable, double=program.double)
        line = f"{INDENT}{_type(variable.kind)} {variable.name} = {start};"
        lines += declared(line, variable.text, REMARK)
    lines += [f"{INDENT}(void){v.name};" for v in block.temporaries if v.name not in read]
    lines.append("")
    lines += _Body(program, block).lines(block.body, INDENT)
    return [*lines, "}"]


@final
class _Body:
    """Statements of a block as C."""

    def __init__(self, program: Program, block: Block) -> None:
        members = {v.name for v in (*block.inputs, *block.outputs, *block.states)}
        own = (*block.inputs, *block.outputs, *block.states, *block.temporaries)
        self._kinds = {v.name: v.kind for v in own}
        self._types = {i.name: _c_name(program, i.block) for i in block.instances}
        self._wording = Wording(
            lambda name: f"{_SELF}->{name}" if name in members else name,
            lambda instance, output: f"{_SELF}->{instance}.{output}",
            _SIGNS,
            "!",
            _TRUTHS,
        )

    def lines(self, body: tuple[Statement, ...], begin: str) -> list[str]:
        """Return the lines of some statements."""
        lines: list[str] = []
        for statement in body:
            match statement:
                case Assign(target, value):
                    lines += self._assign(target, value, begin)
                case If():
                    lines += self._choice(statement, begin)
                case Call(instance, inputs):
                    place = f"{_SELF}->{instance}"
                    for name, value in inputs:
                        lines += broken(f"{begin}{place}.{name} = {self._text(value)};")
                    lines.append(f"{begin}{self._types[instance]}_step(&{place});")
                case Remark(text):
                    lines += remark_lines(text, begin, REMARK)
        return lines

    def _assign(self, target: Name | Element, value: Expression, begin: str) -> list[str]:
        name = target.name if isinstance(target, Name) else target.array
        right = self._text(value)
        if self._kinds[name] is Kind.INT and isinstance(value, Two):
            # C computes with int; the checks have shown that the result fits.
            right = f"(int16_t){right}"
        return broken(f"{begin}{self._text(target)} = {right};")

    def _choice(self, choice: If, begin: str) -> list[str]:
        lines: list[str] = []
        word = "if"
        for condition, body in choice.branches:
            text = self._text(condition)
            # Two parentheses around a comparison are a warning of some compilers.
            whole = text if isinstance(condition, Two | Not) else f"({text})"
            lines += broken(f"{begin}{word} {whole} {{")
            lines += self.lines(body, begin + INDENT)
            word = "} else if"
        if choice.otherwise:
            lines += [f"{begin}}} else {{", *self.lines(choice.otherwise, begin + INDENT)]
        return [*lines, f"{begin}}}"]

    def _text(self, expression: Expression) -> str:
        return expression_text(expression, self._wording)
