"""The library and the blocks that call it, in every dialect: forms, equality, mutants."""

import math
import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blark.parse import parse_source_code

from tests.proofs import quick_first
from tests.unit.plc.compiled import Compiled, compiled
from tests.unit.plc.equal_parts import (
    FLAGS,
    CLibrary,
    Seen,
    Task,
    c_block,
    c_library,
    compared_together,
    difference,
    recorded,
    short_record,
    texts_of,
)
from tests.unit.plc.mutants import courses, every_mutant, unnoticed
from tests.unit.plc.plc_scenarios import (
    paper_model,
    quiet_inputs,
    random_settings,
    scenario_steps,
    wide,
    with_touches,
)
from tests.unit.plc.st_to_c import bare, st_as_c
from tests.unit.plc.test_block import a_large_model, one_section
from thermaxis.compensation import Limits
from thermaxis.errors import ConfigurationError
from thermaxis.plc import (
    LIBRARY,
    LIBRARY_VERSION,
    TOUCH,
    Block,
    CycleBlock,
    c_library as library_in_c,
    st_library,
)

HOURS = 1.0 / 3.0
MUTANTS = int(os.environ.get("PLC_MUTANTS", "16"))
"""Mutants of the library that are looked at. [1]"""


# ---- equality -----------------------------------------------------------------------------------


@pytest.mark.proof
@pytest.mark.parametrize("double", [True, False])
def test_every_text_says_the_same_to_the_last_bit_and_in_lreal_what_the_cycle_says(
    double: bool, tmp_path: Path
) -> None:
    tasks = [Task(40 + k, 1.0 if k == 0 else 10.0, double, HOURS) for k in range(6)]
    seen = Seen()
    for found in compared_together(tasks, tmp_path):
        assert not any(found.differences.values()), (found.task.label, found.differences)
        seen.merge(found.seen)
    assert (seen.states, seen.model_qualities) == (set(range(6)), {0, 1, 2})
    assert min(seen.refused, seen.at_limit, seen.weighted, seen.restarts) > 0


@pytest.mark.proof
def test_the_c_text_says_in_every_stated_call_with_touches_what_the_cycle_says(
    tmp_path: Path,
) -> None:
    stated = [one for one in courses(TOUCH) if "stated" in one[0].name]
    assert len(stated) == 6
    made = {block.name: c_block(block) for block, _ in stated}
    library = CLibrary(c_library(made, tmp_path, "-O0"))
    for block, record in stated:
        assert difference(record(), library.run(block.name, record())) == ""


@pytest.mark.parametrize("compiler", ["clang", "tcc"])
def test_another_compiler_says_the_same(compiler: str, tmp_path: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not on this computer")
    block, record = short_record(3, double=True)
    path = c_library({block.name: c_block(block)}, tmp_path, compiler=compiler)
    assert difference(record, CLibrary(path).run(block.name, record)) == ""


@pytest.mark.proof
@pytest.mark.parametrize("name", ["eps1", "eps2"])
def test_real_stays_near_lreal_in_the_first_hour_of_the_papers_models(
    name: str, tmp_path: Path
) -> None:
    largest_um, span_um = real_away_from_lreal(name, 1.0, tmp_path)
    assert span_um > 10.0
    assert 0.0 < largest_um < 0.002


def real_away_from_lreal(name: str, hours: float, folder: Path) -> tuple[float, float]:
    """Return how far the model in REAL is from `cycle`, and its span. [µm]"""
    model = paper_model(name)
    settings = wide(model, double=False)
    block = Block(settings=settings)
    record = recorded(settings, scenario_steps(wide(model, double=True), hours=hours, seed=1))
    rows = CLibrary(c_library({block.name: c_block(block)}, folder)).run(block.name, record)
    column = record.outputs.index("model_z_um")
    wanted = record.wanted[:, column]
    return float(np.max(np.abs(rows[:, column] - wanted))), float(np.ptp(wanted))


def test_the_lag_in_real_moves_on_where_a_plain_increment_would_be_lost() -> None:
    """Ten hours and an eighth of a second: each step is a thousandth of the sum's last place."""
    settings = one_section(double=False, tau_s=36_000.0, cycle_s=0.125)
    warm_c = float(np.float32(30.0002))
    assert np.float32(10.0) + np.float32((warm_c - 30.0) * 0.125 / 36_000.0) == np.float32(10.0)
    block = compiled(settings)
    block.tell(quiet_inputs(settings, [30.0], (0.0,)))
    for _ in range(20_004):
        block.tell(quiet_inputs(settings, [warm_c], (0.0,)))
    moved_k = (block.model_z_um - 2.0 * (warm_c - 20.0)) / 8.0 - 10.0
    wanted_k = (warm_c - 30.0) * -np.expm1(-20_000 * 0.125 / 36_000.0)
    assert moved_k == pytest.approx(wanted_k, abs=2e-6)
    assert wanted_k > 1e-5


# ---- one library, one block per model -----------------------------------------------------------


def test_another_limit_changes_one_line_of_the_block_and_nothing_of_the_library() -> None:
    settings = one_section(double=True)
    limits = {"Z_um": Limits(999.0, 1000.0, 1000.0)}
    other = replace(settings, compensation=replace(settings.compensation, limits=limits))
    texts, others = (Block(settings=one).st() for one in (settings, other))
    assert [*texts] == [f"{LIBRARY}.st", "tx_z_axis.st"]
    assert texts[f"{LIBRARY}.st"] == others[f"{LIBRARY}.st"]
    pairs = zip(*(t["tx_z_axis.st"].splitlines() for t in (texts, others)), strict=True)
    assert [b.strip() for a, b in pairs if a != b] == ["largest_um := 999.0);"]


def test_the_block_of_a_model_with_one_lag_is_short_and_the_library_is_what_one_can_review() -> (
    None
):
    block, library = (
        Block(settings=one_section(double=True)).st()["tx_z_axis.st"],
        st_library(double=True),
    )
    assert block.count("\n") < 216
    assert len(re.findall(r":=[^;:]*;", bare(library))) < 520
    own = Block(settings=one_section(double=True), model_only=True).st()["tx_z_axis.st"]
    statements = bare(own).split("END_VAR\n")[-1]
    assert statements.count("\n") < 60


def test_a_block_for_another_version_of_the_library_never_becomes_active() -> None:
    settings = one_section(double=True)
    block = Block(settings=settings)
    texts = block.st()
    own = texts[f"{block.name}.st"]
    other = own.replace(
        f"for_library := {LIBRARY_VERSION}", f"for_library := {LIBRARY_VERSION + 1}"
    )
    assert other != own
    ran = {}
    for name, text in (("right", own), ("wrong", other)):
        instance = compiled(settings, texts={**texts, f"{block.name}.st": text})
        for call in range(20):
            instance.tell(quiet_inputs(settings, [20.0], (0.0,)) | {"enable": call > 0})
        ran[name] = instance.state
    assert ran == {"right": 2, "wrong": 1}


def test_the_version_of_the_texts_is_that_of_the_exporter() -> None:
    assert f"library_version : INT := {LIBRARY_VERSION};" in st_library(double=True)
    assert (
        f"#define TX_LIBRARY_VERSION {LIBRARY_VERSION}\n"
        in library_in_c(double=True)[f"{LIBRARY}.h"]
    )


# ---- the model alone ----------------------------------------------------------------------------


@pytest.mark.parametrize("seed", quick_first(1, range(6)))
def test_the_model_alone_is_the_model_of_the_cycle_with_its_limits_and_its_rate(seed: int) -> None:
    """In both languages: in the first call of the cycle it starts, in every one of its own."""
    settings = random_settings(seed)
    channels, outputs = settings.names.channels, settings.names.outputs
    cycle, whole = CycleBlock(settings), Block(settings=settings, model_only=True)
    blocks = [Compiled(whole, language=language) for language in ("st", "c")]
    sent = (0.0,) * len(outputs)
    before = [0.0] * len(outputs)
    settled = 0
    for call in range(400):
        values = [
            20.0 + (0.01 * call if call < 250 else 2.5) + 0.3 * k for k in range(len(channels))
        ]
        told = quiet_inputs(settings, values, sent) | {"enable": False, "diameter_known": False}
        said = cycle.step(told)
        enable = 5 < call < 350
        given = {f"t_{stem}": v for stem, v in zip(channels, values, strict=True)}
        for block in blocks:
            block.tell({**given, "enable": enable, "start": False})
        first = blocks[0]
        for k, (stem, bounds) in enumerate(zip(outputs, settings.compensation.bounds, strict=True)):
            got = getattr(first, f"correction_{stem}")
            assert getattr(first, f"model_{stem}") == said[f"model_{stem}"]
            step_um = bounds.largest_rate_um_per_s * settings.cycle_s
            assert abs(got - before[k]) <= step_um * (1.0 + 1e-12)
            assert abs(got) <= bounds.largest_um
            if first.settled:
                settled += 1
                asked_um = -said[f"weight_{stem}"] * said[f"model_{stem}"]
                assert abs(got - asked_um) <= bounds.deadband_um + 1.0
            before[k] = got
        assert first.values() == blocks[1].values()
    assert before == [0.0] * len(outputs)  # it was switched off, and went to zero
    assert settled > 0


@pytest.mark.parametrize("language", ["st", "c"])
def test_the_model_alone_keeps_the_last_plausible_diameter_and_says_that_it_does(
    language: str,
) -> None:
    settings = next(
        s for s in map(random_settings, range(20)) if s.compensation.model.layout.gained
    )
    whole = Block(settings=settings, model_only=True)
    odd, twin = Compiled(whole, language=language), Compiled(whole, language=language)
    warm = {f"t_{stem}": 24.0 for stem in settings.names.channels}
    for block in (odd, twin):
        block.tell({**warm, "enable": True, "diameter_known": True, "diameter_mm": 120.0})
    for k in range(300):
        values = dict.fromkeys(warm, 24.0 + 0.002 * k)
        diameter_mm = (math.nan, math.inf, -1.0, 1.0e30)[k % 4]
        odd.tell({**values, "diameter_mm": diameter_mm})
        twin.tell(values)
        said, meant = odd.values(), twin.values()
        assert (said.pop("inputs_ok"), meant.pop("inputs_ok")) == (False, True)
        assert not said.pop("settled")
        assert said == {name: value for name, value in meant.items() if name != "settled"}


# ---- forms --------------------------------------------------------------------------------------

EVERY = (
    Block(settings=one_section(double=True)),
    Block(settings=one_section(double=False)),
    Block(settings=a_large_model()),
    Block(settings=random_settings(3), model_only=True),
    Block(settings=with_touches(random_settings(3, double=False), 3)),
)


@pytest.mark.parametrize("block", EVERY)
def test_every_text_is_ascii_in_lines_of_a_hundred_signs(block: Block) -> None:
    for text in every_text(block):
        assert text.isascii()
        assert text.endswith("\n")
        assert max(map(len, text.splitlines())) <= 100
        assert not any(line != line.rstrip() for line in text.splitlines())


def every_text(block: Block) -> list[str]:
    flavours = [block.st(flavour) for flavour in ("iec", "twincat", "codesys")]
    every = [*flavours, block.c(), *texts_of(block).values()]
    return [text for texts in every for text in texts.values()]


@pytest.mark.parametrize("block", EVERY)
def test_every_literal_is_one_that_every_compiler_takes(block: Block) -> None:
    """With a point in the mantissa, at most 1.0E+30; nothing negates a compound condition."""
    code = bare("\n".join(block.st().values()))
    literals = re.findall(r"(?<![\w.])\d[\d.]*(?:[Ee][-+]?\d+)?", re.sub(r"ARRAY.*", "", code))
    assert literals
    for literal in literals:
        assert re.fullmatch(r"\d+|\d+\.\d+(E[-+]\d\d)?", literal), literal
        assert float(literal) <= 1.0e30
    assert not re.search(r"NOT\s*\((?!-)", code)
    assert not re.search(r"[*/+<>-]=?\s+-", code)


@pytest.mark.parametrize("block", EVERY)
def test_every_remark_is_one_line_and_none_is_nested(block: Block) -> None:
    for text in every_text(block):
        for line in text.splitlines():
            assert line.count("(*") == line.count("*)") <= 1 or "/*" in line


def test_scl_means_what_the_structured_text_means_and_a_changed_one_does_not() -> None:
    block = Block(settings=one_section(double=False))
    st, *others = (st_as_c(texts.values(), "tx") for texts in texts_of(block).values())
    assert len(others) == 2
    assert all(other == st for other in others)
    changed = {n: t.replace("- #x_k", "+ #x_k") for n, t in block.scl("s7-1500").items()}
    assert st_as_c(changed.values(), "tx") != st


def test_the_newer_class_has_quotes_and_number_signs_and_the_older_neither() -> None:
    block = Block(settings=one_section(double=False))
    new, old = block.scl("s7-1500")["tx_z_axis.scl"], block.scl("s7-300")["tx_z_axis.scl"]
    head = "FUNCTION_BLOCK \"tx_z_axis\"\n{ S7_Optimized_Access := 'TRUE' }\nVERSION : 0.1\n"
    assert head in new
    assert 'fb_begin : "tx_begin";' in new
    assert "#fb_begin(init := #init, cycle_time_s := #cycle_time_s, cycle_s := #cycle_s," in new
    assert "FUNCTION_BLOCK \"tx_z_axis\"\nTITLE = 'tx_z_axis'\nVERSION : '0.1'\nCONST\n" in old
    assert "    cycle_s := 1.0;" in old
    assert "#" not in old
    assert "VAR CONSTANT" not in old
    for text in (new, old):
        assert "TIA *)\n(* Portal not checked" in text


def test_the_older_class_refuses_lreal() -> None:
    with pytest.raises(ConfigurationError):
        Block(settings=one_section(double=True)).scl("s7-300")


def test_editors_with_two_panes_get_marks_and_nothing_else_differs() -> None:
    block = Block(settings=one_section(double=True))
    for flavour in ("twincat", "codesys"):
        for name, text in block.st(flavour).items():
            marked = [i for i, x in enumerate(text.splitlines()) if "the lower pane ----" in x]
            lines = text.splitlines()
            assert len(marked) == text.count("\nEND_FUNCTION_BLOCK")
            assert all(lines[i - 1] == "END_VAR" for i in marked)
            assert bare(text) == bare(block.st()[name])


@pytest.mark.proof
def test_another_grammar_reads_library_and_block() -> None:
    """It takes seconds for ten thousand signs: it reads what is the same but for names once."""
    texts = EVERY[0].st("twincat") | EVERY[3].st("twincat")
    assert len(texts) == 3
    assert parse_source_code(forms("".join(texts.values()))).exception is None


def test_another_grammar_reads_a_block_and_refuses_one_that_is_cut() -> None:
    short = st_library(double=True).partition("\nEND_FUNCTION_BLOCK")[0] + "\nEND_FUNCTION_BLOCK\n"
    assert parse_source_code(short).exception is None
    assert parse_source_code(short.replace("END_IF;", "", 1)).exception is not None


def forms(text: str) -> str:
    """Return a text whose names are all the same, with every declaration and assignment once."""
    lines: list[str] = []
    for line in re.sub(r"\b[a-z]\w*", "x", bare(text)).splitlines():
        whole = lines and re.search(r"(;|\bTHEN|\bELSE|VAR\w*)$", lines[-1])
        if not (whole and re.fullmatch(r" *x :.*;", line) and line in lines):
            lines.append(line)
    return "\n".join(lines) + "\n"


def compiler(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["gcc", *map(str, words)], capture_output=True, text=True, check=False, timeout=120
    )


def written(files: dict[str, str], folder: Path) -> list[Path]:
    for name, text in files.items():
        (folder / name).write_text(text, encoding="ascii")
    return [folder / name for name in files if name.endswith(".c")]


@pytest.mark.parametrize("block", quick_first(1, EVERY))
def test_each_source_compiles_alone_without_a_warning(block: Block, tmp_path: Path) -> None:
    for source in written(block.c(), tmp_path):
        built = compiler(*FLAGS, "-O1", "-c", source, "-o", tmp_path / "block.o")
        assert (built.returncode, built.stderr) == (0, "")


def test_two_blocks_share_the_library_and_mixed_numbers_or_versions_are_refused(
    tmp_path: Path,
) -> None:
    settings = one_section(double=True)
    files = Block(settings=settings).c() | Block(settings=replace(settings, name="other")).c()
    sources = written(files, tmp_path)
    both = tmp_path / "both.c"
    both.write_text(
        '#include "tx_z_axis.h"\n#include "tx_other.h"\n'
        "int main(void) { static tx_z_axis a; static tx_other b; tx_z_axis_init(&a);\n"
        "tx_other_init(&b); tx_z_axis_step(&a); tx_other_step(&b); return 0; }\n",
        encoding="ascii",
    )
    built = compiler(*FLAGS, both, *sources, "-o", tmp_path / "program")
    assert (built.returncode, built.stderr) == (0, "")
    header = files[f"{LIBRARY}.h"]
    version = f"TX_LIBRARY_VERSION {LIBRARY_VERSION}"
    for changed in (
        header.replace("#define TX_REAL 0", "#define TX_REAL 1"),
        header.replace(version, "TX_LIBRARY_VERSION 99"),
    ):
        written({f"{LIBRARY}.h": changed}, tmp_path)
        mixed = compiler(*FLAGS, "-c", both, "-o", tmp_path / "both.o")
        assert "made for another version of thermaxis_lib, or for other numbers" in mixed.stderr


def test_a_compiler_that_computes_otherwise_is_refused(tmp_path: Path) -> None:
    macros = compiler("-dM", "-E", "-x", "c", "/dev/null").stdout
    for source in written(EVERY[1].c(), tmp_path):
        fast = compiler(*FLAGS, "-ffast-math", "-c", source, "-o", tmp_path / "block.o")
        assert "fast math" in fast.stderr
        if "__x86_64__" in macros:
            wider = compiler(*FLAGS, "-mfpmath=387", "-c", source, "-o", tmp_path / "block.o")
            assert "does not compute in the type" in wider.stderr


def test_cplusplus_reads_the_headers(tmp_path: Path) -> None:
    if shutil.which("g++") is None:
        pytest.skip("g++ is not on this computer")
    written(EVERY[0].c(), tmp_path)
    user = tmp_path / "user.cpp"
    user.write_text('#include "tx_z_axis.h"\nvoid f(tx_z_axis *b) { tx_z_axis_step(b); }\n')
    built = compiler("-x", "c++", "-std=c++17", "-Wall", "-Werror", "-fsyntax-only", user)
    assert (built.returncode, built.stderr) == (0, "")


# ---- mutants ------------------------------------------------------------------------------------


@pytest.mark.proof
@pytest.mark.parametrize(("library", "count"), [(LIBRARY, MUTANTS), (TOUCH, MUTANTS // 2)])
def test_a_sample_of_the_mutants_of_the_library_is_noticed(
    library: str, count: int, tmp_path: Path
) -> None:
    sample = [one for one in every_mutant(library)[:count] if not excused(one.name)]
    assert unnoticed(sample, tmp_path, library) == []


def excused(name: str) -> bool:
    """Whether nothing can notice a mutant, for the reason that stands beside its line."""
    return any(line in name for line in NOT_NOTICED)


NOT_NOTICED = {
    "elapsed_s > read_back_s) THEN | > -> >=": "where they are equal both say the same time",
    "elapsed_s > longest_at_limit_s) THEN | > -> >=": "the same",
    "running_s := settle_s; |": "how far beyond the limit is counted does not matter",
    "ready_s := recovery_delay_s; |": "the same",
    "running_s > settle_s THEN | > -> >=": "where they are equal it stays as it is",
    "ready_s > recovery_delay_s THEN | > -> >=": "the same",
    "IF fault > 0 THEN | 0 -> 1": "every fault is larger",
    "unseen_k := 1.0E+06; |": "every temperature is allowed long before",
    "IF excluded < 3 THEN | 3 -> 4": "three in a row are enough",
    "IF since_s > 0.0 THEN | > -> >=": "nothing grows in no time",
    "elapsed_s := 1.0E+09; |": "every time counts as over long before",
    "elapsed_s > 1.0E+09 THEN | > -> >=": "the same",
    "late := (cycle_time_s > longest_s) AND right; | > -> >=": "a call that is just in time passes",
    "IF behind_s > gap_s THEN | > -> >=": "where they are equal it stays as it is",
    "IF cycle_time_s > 0.0 THEN | > -> >=": "no time is added where it is none",
    "share := elapsed_s / (3600.0 + elapsed_s); | + -> -": "by name in test_a_column_that_stands",
    "heartbeat := 0; | 0 -> 1": "by name in test_the_heartbeat_counts_to_32767",
    "heartbeat := 0; | heartbeat": "the same",
    "heartbeat >= 32767 THEN | 32767 -> 32768": "the same",
}
"""Parts of the names of mutants that change nothing here, each with its reason."""
