"""SCL to the Structured Text that the interpreter reads: what differs is stripped, and checked.

Only what `thermaxis.plc` prints for a CPU is known; anything else is an error, here or in the
interpreter. Lines keep their numbers, and remarks stay.
"""

import re
from typing import Literal, TypeAlias

from tests.unit.plc.st_syntax import StError

Cpu: TypeAlias = Literal["s7-1500", "s7-300"]

_REMARK = re.compile(r"\(\*.*?\*\)", re.DOTALL)
_HEADING = re.compile(r'FUNCTION_BLOCK "([A-Za-z][A-Za-z0-9_]*)"')
_INSTANCE = re.compile(r'(\s*[A-Za-z]\w* : )"([A-Za-z]\w*)";\s*')
_CONSTANT = re.compile(r"(\s*[A-Za-z]\w*) := ([^;]+);(.*)")
_WORD = re.compile(r"(?<![\w.])#?[A-Za-z_]\w*")
_ATTRIBUTES: dict[Cpu, tuple[str, ...]] = {
    "s7-1500": (r"\{ S7_Optimized_Access := 'TRUE' \}", r"VERSION : [0-9]+\.[0-9]+"),
    "s7-300": (
        r"TITLE = '[A-Za-z0-9_ .-]*'",
        r"VERSION : '[0-9]{1,2}\.[0-9]{1,2}'",
        r"(AUTHOR : [A-Za-z0-9_]{1,8})?",
        r"(FAMILY : [A-Za-z0-9_]{1,8})?",
        r"(NAME : [A-Za-z0-9_]{1,8})?",
    ),
}
# Words of statements that are no variables.
_KEYWORDS = frozenset(
    {"IF", "THEN", "ELSIF", "ELSE", "END_IF", "AND", "OR", "NOT", "TRUE", "FALSE"}
)


def scl_normal(text: str, cpu: Cpu = "s7-1500") -> str:
    """Return SCL as Structured Text.

    Quotes around the names of blocks, the lines of attributes behind a block's name, ``BEGIN``,
    and for ``s7-1500`` the ``#`` before every variable in a statement are stripped; for ``s7-300``
    constants get the type of their literal.

    Parameters
    ----------
    text : str
        SCL as it is printed for an external source.
    cpu : {'s7-1500', 's7-300'}
        Class of the CPU.

    Returns
    -------
    str
        Structured Text, line by line the same.

    Raises
    ------
    StError
        If an attribute is missing, unknown or in another order, a variable in a statement has no
        ``#`` where it must or one where it must not, or a sign stands where SCL has none.
    """
    remarks = list(_REMARK.finditer(text))
    bare = _REMARK.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)
    normal = list("\n".join(_Normal(cpu).lines(bare.split("\n"))))
    for remark in remarks:
        normal[remark.start() : remark.end()] = remark.group()
    lines = "".join(normal).split("\n")
    return "\n".join(_typed(lines) if cpu == "s7-300" else lines)


class _Normal:
    """Goes through the lines of a file; every line keeps its length."""

    def __init__(self, cpu: Cpu) -> None:
        self._cpu: Cpu = cpu
        self._attributes: list[str] = []
        self._read = self._outside
        self._number = 0
        self._next = ""
        self._depth = 0

    def lines(self, lines: list[str]) -> list[str]:
        normal: list[str] = []
        for number, line in enumerate(lines, start=1):
            self._number = number
            self._next = lines[number] if number < len(lines) else ""
            normal.append(self._read(line) if line.strip() else line)
        if self._read != self._outside:
            raise self._error("END_FUNCTION_BLOCK is missing")
        return normal

    def _error(self, what: str) -> StError:
        return StError(what, self._number)

    def _outside(self, line: str) -> str:
        heading = _HEADING.fullmatch(line.rstrip())
        if heading is None:
            raise self._error(f"FUNCTION_BLOCK with a quoted name is expected: {line.strip()!r}")
        self._attributes = list(_ATTRIBUTES[self._cpu])
        self._read = self._heading
        return line.replace('"', " ")

    def _heading(self, line: str) -> str:
        while self._attributes:
            pattern = self._attributes.pop(0)
            if re.fullmatch(pattern, line.strip()):
                return " " * len(line)
            if not re.fullmatch(pattern, ""):
                raise self._error(f"{line.strip()!r} stands where {pattern} must")
        self._read = self._declarations
        return self._declarations(line)

    def _declarations(self, line: str) -> str:
        if line.strip() == "BEGIN":
            self._read = self._statements
            return " " * len(line)
        if _INSTANCE.fullmatch(line):
            return line.replace('"', " ")
        if self._cpu == "s7-300" and re.search(r"\b(LREAL|CONSTANT)\b", line, re.IGNORECASE):
            raise self._error("this class of CPU knows neither LREAL nor VAR CONSTANT")
        self._refuse(line, "\"#'{}")
        return line

    def _statements(self, line: str) -> str:
        if line.strip() == "END_FUNCTION_BLOCK":
            self._read = self._outside
            return line
        self._refuse(line, "\"'{}")
        if self._cpu == "s7-300":
            self._refuse(line, "#")
            return line
        if re.search(r"#(?![A-Za-z])|[\w.#]#", line):
            raise self._error("# stands before no variable")
        for word in _WORD.finditer(line):
            marked, argument = word.group().startswith("#"), self._is_argument(line, word)
            if marked == argument and word.group() not in _KEYWORDS:
                raise self._error(f"{word.group()}: # stands before variables, and only there")
        self._depth += line.count("(") - line.count(")")
        return line.replace("#", " ")

    def _is_argument(self, line: str, word: re.Match[str]) -> bool:
        """Whether a word is the name of an input in a call; long calls are broken into lines."""
        before = line[: word.start()]
        depth = self._depth + before.count("(") - before.count(")")
        behind = (line[word.end() :].strip() or self._next.strip()).lstrip()
        return depth > 0 and behind.startswith(":=")

    def _refuse(self, line: str, signs: str) -> None:
        for sign in signs:
            if sign in line:
                raise self._error(f"the sign {sign} does not stand here")


def _typed(lines: list[str]) -> list[str]:
    """Return lines with the section of constants as Structured Text has it."""
    typed: list[str] = []
    inside = False
    for number, line in enumerate(lines, start=1):
        word = line.strip()
        if word in {"CONST", "END_CONST"}:
            if inside == (word == "CONST"):
                raise StError(f"{word} does not stand here", number)
            inside = not inside
            typed.append("VAR CONSTANT" if inside else "END_VAR")
        elif inside and word and not _REMARK.fullmatch(word):
            typed.append(_typed_constant(line, number))
        else:
            typed.append(line)
    return typed


def _typed_constant(line: str, number: int) -> str:
    constant = _CONSTANT.fullmatch(line)
    if constant is None:
        raise StError(f"name := value; is expected: {line.strip()!r}", number)
    name, value, rest = constant.groups()
    kind = "BOOL" if value in {"TRUE", "FALSE"} else "REAL" if "." in value else "INT"
    return f"{name} : {kind} := {value};{rest}"
