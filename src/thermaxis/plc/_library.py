"""The library: readable text in ``plc/library``, the same for every model, and its dialects.

SCL is the ST text with other heads, quotes around names of blocks, and ``#`` before variables.
"""

import re
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.resources import files
from typing import Literal, TypeAlias

LIBRARY = "thermaxis_lib"
"""Name of the library, and of its files."""
TOUCH = "thermaxis_touch"
"""Name of the library for touches of a probe, and of its files."""
SINUMERIK = "thermaxis_sinumerik"
"""Name of the library for one offset of a SINUMERIK, and of its file."""
LIBRARY_VERSION = 3
"""Version of the library that model blocks are made for; a block refuses to run with another."""

StFlavour: TypeAlias = Literal["iec", "twincat", "codesys"]
"""Who reads Structured Text."""
SclCpu: TypeAlias = Literal["s7-1500", "s7-300"]
"""Class of the CPU: that of SINUMERIK ONE, or that of SINUMERIK 840D sl."""

NOT_CHECKED = (
    "(* Syntax and numbers checked through equivalent IEC text. Acceptance by STEP 7 or TIA *)\n"
    "(* Portal not checked. *)\n"
)
"""What the head says of every SCL file."""
_CLASSIC = (
    "(* STEP 7 V5: enter every quoted name in the symbol table, each as a function block of *)\n"
    "(* its own, before the source is compiled. CPUs of this class keep instance data over *)\n"
    "(* power-off as a rule: the input init is TRUE in the first call, by OB100 as the guide *)\n"
    "(* says. From the trade, not checked. *)\n"
)
_PANES = {"twincat": "TwinCAT 3", "codesys": "CODESYS"}
MARK = "(* ---- statements: the lower pane ---- *)\n"
"""What stands between declarations and statements for editors with two panes."""

_BLOCK = re.compile(
    r"^FUNCTION_BLOCK (\w+)\n((?:.*\n)*?END_VAR\n)((?!.*?VAR)(?:.*\n)*?)^END_FUNCTION_BLOCK\n",
    re.MULTILINE,
)
_CONSTANTS = re.compile(r"^VAR CONSTANT\n((?:.*\n)*?)END_VAR\n", re.MULTILINE)
_DECLARED = re.compile(r"^    (\w+) : (\w+)", re.MULTILINE)
_WORDS = re.compile(r"\(\*.*?\*\)|[A-Za-z]\w*(?:\.\w+)?(?:\s*:=)?|[()]|.|\n", re.DOTALL)


@cache
def library_file(name: str) -> str:
    """Return a file of the library as it lies there."""
    return (files("thermaxis.plc") / "library" / name).read_text("ascii")


def st_library(name: str = LIBRARY, *, double: bool) -> str:
    """Return the library as Structured Text.

    Parameters
    ----------
    name : str
        Which one. Default: the library itself.
    double : bool
        Whether numbers are LREAL; in REAL the lag keeps what its sum loses.
    """
    text = library_file(f"{name}.st")
    if double:
        return text
    lag = re.compile(r"^FUNCTION_BLOCK tx_lag\n(?:.*\n)*?END_FUNCTION_BLOCK\n", re.MULTILINE)
    return lag.sub(library_file("lag_real.st"), text, count=1).replace("LREAL", "REAL")


def sinumerik_library(*, double: bool, cpu: SclCpu | None = None) -> str:
    """Return the block that brings a correction to a SINUMERIK, as SCL of a CPU, else as ST.

    Not protected: FB2 and FB3 were a stand-in whenever it ran; no control has run it.
    """
    text = library_file(f"{SINUMERIK}.st")
    text = text if double else text.replace("LREAL", "REAL")
    return text if cpu is None else scl_text(text, cpu)


def c_library(names: Iterable[str] = (LIBRARY,), *, double: bool) -> dict[str, str]:
    """Return header and source of the library by file.

    Parameters
    ----------
    names : iterable of str
        Which ones. Default: the library itself.
    double : bool
        Whether numbers are ``double``, else ``float``.
    """
    every = [f"{name}.{ending}" for name in names for ending in ("h", "c")]
    texts = {name: library_file(name) for name in every}
    if not double:
        header = texts[f"{LIBRARY}.h"]
        texts[f"{LIBRARY}.h"] = header.replace("#define TX_REAL 0", "#define TX_REAL 1")
    return texts


def with_panes(text: str, flavour: StFlavour) -> str:
    """Return Structured Text as an editor with two panes needs it."""
    if flavour == "iec":
        return text
    hint = (
        f"(* For {_PANES[flavour]}: make one function block per block of this file, in its *)\n"
        "(* order. From FUNCTION_BLOCK to the mark goes into the upper pane, the rest without *)\n"
        "(* END_FUNCTION_BLOCK into the lower pane. Not checked with that editor. *)\n"
    )
    return hint + _BLOCK.sub(
        lambda found: f"FUNCTION_BLOCK {found[1]}\n{found[2]}{MARK}{found[3]}END_FUNCTION_BLOCK\n",
        text,
    )


def scl_text(text: str, cpu: SclCpu) -> str:
    """Return Structured Text as SCL."""
    classic = cpu == "s7-300"
    head = NOT_CHECKED + (_CLASSIC if classic else "")

    def block(found: re.Match[str]) -> str:
        name, declarations, statements = found.groups()
        first = "{ S7_Optimized_Access := 'TRUE' }\nVERSION : 0.1\n"
        if classic:
            first = f"TITLE = '{name}'\nVERSION : '0.1'\n"
            constants = "".join(_CONSTANTS.findall(declarations))
            if constants:
                bare = re.sub(r"^(    \w+) : \w+", r"\1", constants, flags=re.MULTILINE)
                first += f"CONST\n{bare}END_CONST\n"
                declarations = _CONSTANTS.sub("", declarations)
        else:
            names = {n for n, _ in _DECLARED.findall(declarations)}
            lines = "".join(_marked(statements, names)).splitlines()
            statements = "".join(f"{row}\n" for line in lines for row in broken(line))
        declarations = re.sub(r" : (tx_\w+);", r' : "\1";', declarations)
        return (
            f'FUNCTION_BLOCK "{name}"\n{first}{declarations}BEGIN\n{statements}END_FUNCTION_BLOCK\n'
        )

    return head + _BLOCK.sub(block, text)


def _marked(statements: str, names: set[str]) -> Iterator[str]:
    """Yield statements with ``#`` before variables, but not before the inputs of a called block."""
    depth = 0
    for word in _WORDS.findall(statements):
        depth += (word == "(") - (word == ")")
        name = re.split(r"[.\s:]", word, maxsplit=1)[0]
        given = depth > 0 and word.endswith(":=")
        yield f"#{word}" if name in names and not given else word


LONGEST_LINE = 100
"""Longest line of a program: some editors of controls cut longer ones. [1]"""


_REMARK = re.compile(r"(?<=;) +(\(\*.*\*\)|/\*.*\*/)$")


def broken(line: str) -> Iterator[str]:
    """Yield a line of a program as lines that are not too long, broken at spaces."""
    begin = line[: len(line) - len(line.lstrip())]
    line = line.rstrip()
    remark = _REMARK.search(line)
    if len(line) > LONGEST_LINE and remark is not None:
        yield begin + remark[1]
        line = line[: remark.start()]
    begin += "    "
    while len(line) > LONGEST_LINE:
        cut = line.rfind(", ", len(begin), LONGEST_LINE) + 1
        cut = cut or line.rfind(" ", len(begin), LONGEST_LINE + 1)
        if cut < 0:
            break
        yield line[:cut].rstrip()
        line = begin + line[cut:].strip()
    yield line


def folded(text: str) -> str:
    """Return a program in lines that are not too long."""
    return "\n".join(line for whole in text.splitlines() for line in broken(whole)) + "\n"
