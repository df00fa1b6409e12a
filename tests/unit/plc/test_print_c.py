"""C99 says what the tree says; where gcc is, it is compiled and run."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from tests.unit.plc.equal_parts import FLAGS
from tests.unit.plc.small_programs import let, number, small, truth
from thermaxis.plc import CText, Program, print_c

MORE_FLAGS = (
    "-Wconversion", "-Wfloat-conversion", "-Wdouble-promotion", "-Wshadow", "-Wstrict-prototypes",
    "-Wmissing-prototypes", "-Wsign-conversion", "-Wundef", "-Wcast-qual",
)  # fmt: skip

# ---- the text -----------------------------------------------------------------------------------


def test_the_text_is_ascii_in_lines_of_a_hundred_signs() -> None:
    for double in [True, False]:
        for text in print_c(small(double=double)):
            assert text.isascii()
            assert max(map(len, text.splitlines())) <= 100
            assert not any(line != line.rstrip() for line in text.splitlines())
            assert text.count("/*") == text.count("*/")
            assert "//" not in text


def test_nothing_is_included_but_types_and_nothing_is_called_but_its_own() -> None:
    for double in (True, False):
        header, source = print_c(small(double=double))
        assert set(re.findall(r"#include (.*)", header + source)) == {
            "<stdbool.h>", "<stdint.h>", "<float.h>", '"tx_small.h"',
        }  # fmt: skip
        code = re.sub(r"/\*.*?\*/|#.*", "", source)
        called = set(re.findall(r"\b(\w+)\(", code)) - {"if", "for"}
        assert called == {
            "tx_small_init", "tx_small_step", "tx_small_lag_init", "tx_small_lag_step",
        }  # fmt: skip


def test_real_is_float_and_no_literal_is_a_double() -> None:
    header, source = print_c(small(double=False))
    assert "typedef float tx_number;" in header
    assert "double" not in source
    code = re.sub(r"/\*.*?\*/", "", source)
    literals = re.findall(r"[0-9]+\.[0-9]+\w*(?:[+-][0-9]+F)?", code)
    assert literals
    assert all(literal.endswith("F") for literal in literals)
    assert "static const tx_number alpha = 0.142857149F;" in source


def test_what_is_not_used_makes_no_warning_and_a_block_nobody_calls_is_left_out() -> None:
    header, source = print_c(with_unused())
    assert "spare_constant" not in source
    assert "    (void)spare;" in source.splitlines()
    assert "tx_small_spare" not in header + source
    assert "tx_small_idle_init(&b_->never);" in source
    assert "tx_small_idle_step" not in source


def with_unused() -> Program:
    program = small()
    lag, main = program.blocks
    main = replace(
        main,
        temporaries=(*main.temporaries, number("spare"), truth("unset")),
        constants=(*main.constants, number("spare_constant", 2.5)),
        instances=(*main.instances, replace(main.instances[0], name="never", block="tx_idle")),
        body=(let("spare", "u_um"), *main.body),
    )
    idle = replace(lag, name="tx_idle")
    return replace(program, blocks=(lag, replace(lag, name="tx_spare"), idle, main))


# ---- compiled -----------------------------------------------------------------------------------


def compiler(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Call gcc; the answer says whether it was content."""
    command = ["gcc", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def written(text: CText, folder: Path, name: str) -> Path:
    """Write header and source; return the source."""
    (folder / f"{name}.h").write_text(text.header, encoding="ascii")
    (folder / f"{name}.c").write_text(text.source, encoding="ascii")
    return folder / f"{name}.c"


@pytest.mark.system
def test_it_is_compiled_without_a_warning_whatever_is_not_used(tmp_path: Path) -> None:
    for program in (small(), small(double=False), with_unused()):
        source = written(print_c(program), tmp_path, "tx_small")
        for level in ("-O0", "-O2", "-O3"):
            built = compiler(*FLAGS, *MORE_FLAGS, level, "-c", source, "-o", tmp_path / "block.o")
            assert (built.returncode, built.stderr) == (0, "")


@pytest.mark.system
def test_two_programs_stand_in_one_and_mixed_numbers_are_refused(tmp_path: Path) -> None:
    other = small()
    main = replace(other.blocks[-1], name="tx_other")
    other = replace(other, name="tx_other", blocks=(*other.blocks[:-1], main))
    written(print_c(small()), tmp_path, "tx_small")
    written(print_c(other), tmp_path, "tx_other")
    both = tmp_path / "both.c"
    both.write_text(
        '#include "tx_small.h"\n#include "tx_other.h"\n#include "tx_small.h"\n'
        "int main(void) { tx_small a; tx_other b; tx_small_init(&a); tx_other_init(&b);\n"
        "tx_small_step(&a); tx_other_step(&b); return 0; }\n",
        encoding="ascii",
    )
    sources = (both, tmp_path / "tx_small.c", tmp_path / "tx_other.c")
    built = compiler(*FLAGS, *sources, "-o", tmp_path / "program")
    assert (built.returncode, built.stderr) == (0, "")
    written(print_c(replace(other, double=False)), tmp_path, "tx_other")
    mixed = compiler(*FLAGS, "-c", both, "-o", tmp_path / "both.o")
    assert mixed.returncode != 0
    assert "computes in float, another one included before in double" in mixed.stderr


@pytest.mark.system
def test_a_compiler_that_computes_otherwise_is_refused(tmp_path: Path) -> None:
    macros = compiler("-dM", "-E", "-x", "c", "/dev/null").stdout
    for double in (True, False):
        source = written(print_c(small(double=double)), tmp_path, "tx_small")
        fast = compiler(*FLAGS, "-ffast-math", "-c", source, "-o", tmp_path / "block.o")
        assert "fast math" in fast.stderr
        if "__x86_64__" in macros:
            wide = compiler(*FLAGS, "-mfpmath=387", "-c", source, "-o", tmp_path / "block.o")
            assert "does not compute in the type" in wide.stderr


@pytest.mark.system
def test_cplusplus_reads_the_header(tmp_path: Path) -> None:
    if shutil.which("g++") is None:
        pytest.fail("g++ is missing: install it (Debian: apt-get install g++)")
    written(print_c(small()), tmp_path, "tx_small")
    user = tmp_path / "user.cpp"
    user.write_text('#include "tx_small.h"\nvoid f(tx_small *b) { tx_small_step(b); }\n')
    built = compiler("-x", "c++", "-std=c++17", "-Wall", "-Werror", "-fsyntax-only", user)
    assert (built.returncode, built.stderr) == (0, "")
