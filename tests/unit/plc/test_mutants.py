"""Mutants of the exported text: one number or one transition is changed, and it is noticed.

Gains, shares of a cycle, references and the like change to the next number of their kind,
thresholds by one percent, durations by a cycle; every condition of the supervisor is negated, and
every transition leads to every other state. Noticed is a difference in any output in any call.
"""

import math
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.unit.plc.equal_parts import (
    CBlock,
    CLibrary,
    Record,
    Row,
    c_block,
    c_library,
    columns,
    difference,
    next_number,
    recorded,
    shuffled,
    st_block,
)
from tests.unit.plc.plc_scenarios import CycleBlock, CycleDriver, MoodPlant, quiet_inputs
from thermaxis.compensation import (
    STATED,
    Compensation,
    CompensationModel,
    GainPoint,
    Limits,
    Output,
    Part,
    Section,
    SensorRules,
    SupervisorRules,
    SupervisorState,
)
from thermaxis.plc import (
    BlockInstance,
    CallSequence,
    CText,
    PlcSettings,
    PlcStep,
    Program,
    build_program,
    export_settings,
    print_c,
    print_st,
)
from thermaxis.plc.tree import number_text

CYCLE_S = 1.0


@lru_cache
def settings_with_everything(*, double: bool = True) -> PlcSettings:
    """Return a model in which every rule has numbers of its own, in whole cycles."""
    model = CompensationModel(
        outputs=(
            Output(
                "Z_um",
                (
                    Part(
                        "spindle",
                        "spindle",
                        "bed",
                        1.37,
                        (Section(5.3, 700.0), Section(-2.1, 37.0)),
                        delay_s=3.0,
                        gain_by_diameter=(GainPoint(20.0, 0.41), GainPoint(333.0, 1.7)),
                        tool_gain=0.83,
                        lowest_k=-2.0,
                        highest_k=4.5,
                    ),
                    Part("bed", "bed", "", 0.0, (Section(1.9, 240.0),)),
                ),
                offset_um=0.31,
            ),
            Output("X_um", (Part("cross", "bed", "", -0.7, (Section(0.9, 90.0),)),)),
        ),
        reference=STATED,
        reference_c={"spindle": 20.13, "bed": 19.87},
        input_filter_s=4.4,
        longest_hold_s=4.0,
    )
    compensation = Compensation(
        model=model,
        sensors={
            "spindle": SensorRules(
                lowest_c=5.0, highest_c=60.0, largest_rate_k_per_s=0.11, step_k=0.5, frozen_s=19.0
            ),
            "bed": SensorRules(
                lowest_c=4.0, highest_c=55.0, largest_rate_k_per_s=0.13, step_k=0.7, frozen_s=23.0
            ),
        },
        limits={
            "Z_um": Limits(9.0, 0.37, 11.0, 0.4, largest_trim_um=3.0),
            "X_um": Limits(4.0, 0.23, 4.9, 0.3, largest_trim_um=2.0),
        },
        supervisor=SupervisorRules(
            settle_s=7.0,
            recovery_delay_s=3.0,
            input_timeout_s=2.0,
            hold_input_s=9.0,
            hold_connection_s=8.0,
            hold_interlock_s=5.0,
            hold_operator_s=13.0,
            at_limit_s=12.0,
            read_back_s=6.0,
            longest_trim_s=15.0,
        ),
        interlocks=("plc",),
        validity_margin_k=3.0,
        lowest_weight=0.2,
    )
    return export_settings(compensation, cycle_s=CYCLE_S, name="mutant", double=double)


class Stand:
    """Calls the block by hand: everything is well but for what is stated, and the machine obeys."""

    def __init__(self, settings: PlcSettings) -> None:
        self.settings = settings
        self.names, self.outputs = columns(build_program(settings).blocks[-1])
        self.rows: list[Row] = []
        self.wanted: list[Row] = []
        self.starts: list[bool] = []
        self.switch_on()

    def switch_on(self) -> None:
        self.driver = CycleDriver(self.settings)
        self.sent = (0.0,) * len(self.settings.names.outputs)
        self.begins = True

    def calls(self, number: int, **different: float) -> SupervisorState:
        said = None
        for _ in range(number):
            noise_c = 0.01 * (len(self.rows) % 2)  # else the sensors would count as frozen
            quiet = quiet_inputs(self.settings, [21.0 + noise_c, 20.0 + noise_c], self.sent)
            told = quiet | {"enable": not self.begins} | different
            said = self.driver.told(told)
            by_name = self.driver.by_name(said)
            self.rows.append(tuple(told[name] for name in self.names))
            self.wanted.append(tuple(by_name[name] for name in self.outputs))
            self.starts.append(self.begins)
            self.begins = False
            self.sent = said.correction_um
        assert said is not None
        return said.state

    def record(self) -> Record:
        return Record(self.outputs, self.rows, self.starts, np.array(self.wanted, np.float64))


def borders() -> Record:
    """Meet what chance does not: values between a threshold and the same by one percent more."""
    stand = Stand(settings_with_everything())
    stand.calls(1, read_z_um=7e5)
    # Found in Off a little beyond a total: nobody can enable.
    for name, total_um in (("read_z_um", 11.0), ("read_x_um", 4.9)):
        stand.switch_on()
        assert stand.calls(3, **{name: 1.005 * total_um}) is SupervisorState.OFF
    stand.switch_on()
    assert stand.calls(20) is SupervisorState.ACTIVE
    # Trims a little too large, a diameter a little beyond the last point.
    stand.calls(2, trim_z_um=3.01, trim_x_um=2.01)
    stand.calls(2, diameter_known=True, diameter_mm=next_number(333.0, double=True, up=True))
    # Jumps a little too large, and just out of range.
    for spindle_c, bed_c in ((21.6105, 20.8306), (5.02, 4.02)):
        stand.calls(1, t_spindle=spindle_c, t_bed=bed_c)
        stand.calls(2)
    # Refused for so long that no more is allowed; then a little more than that.
    stand.calls(40, t_spindle=30.0, t_bed=30.0)
    stand.calls(2, t_spindle=22.615, t_bed=22.237)
    stand.calls(60)
    # A connection that comes back again and again, never for long.
    assert stand.calls(20) is SupervisorState.ACTIVE
    for _ in range(12):
        stand.calls(2)
        stand.calls(1, connected=False)
    assert stand.calls(60) is SupervisorState.ACTIVE
    # A read-back that differs a little, then what is no offset.
    assert stand.calls(9, read_z_um=stand.sent[0] + 0.502) is SupervisorState.FAULT
    stand.calls(2, read_z_um=math.copysign(7e5, stand.sent[0]))
    # Acknowledged and enabled in one call, while the correction is on its way.
    stand.calls(1, enable=False)
    assert any(stand.sent)
    stand.calls(1, reset=True)
    stand.calls(60)
    # An offset beyond its total after a lost connection: a fault until it has come back.
    assert stand.calls(20) is SupervisorState.ACTIVE
    stand.calls(2, connected=False)
    assert stand.calls(1, read_z_um=12.0) is SupervisorState.FAULT
    assert stand.calls(1, reset=True) is SupervisorState.FAULT
    stand.calls(4)
    assert stand.calls(1, reset=True, enable=False) is not SupervisorState.FAULT
    stand.calls(60)
    return stand.record()


@lru_cache
def records() -> tuple[Record, ...]:
    """Return what a mutant is run over: borders, moods, and the sequence of the test vectors."""
    settings = settings_with_everything()
    moods = [
        recorded(settings, MoodPlant(settings, 40 + k).steps(CycleBlock(settings), 1500))
        for k in range(6)
    ]
    sequence = CallSequence(settings, seed=5, block=CycleBlock(settings)).steps()
    return borders(), *moods, recorded(settings, sequence)


@lru_cache
def records_in_real() -> tuple[Record, ...]:
    """Return moods and the sequence in REAL, where the executed tree says what must come out.

    Before them comes a beginning with a diameter a little beyond the last point.
    """
    settings = settings_with_everything(double=False)
    steps = list(CallSequence(settings, seed=5).steps())
    beyond_mm = next_number(333.0, double=False, up=True)
    block = BlockInstance(settings)
    told = [s.inputs._replace(diameter_known=True, diameter_mm=beyond_mm) for s in steps[:60]]
    beginning = [PlcStep(inputs, block.step(inputs)) for inputs in told]
    moods = MoodPlant(settings, 44).steps(BlockInstance(settings), 1500)
    return tuple(recorded(settings, some) for some in (beginning, moods, steps))


# ---- making mutants -----------------------------------------------------------------------------


class Mutant(NamedTuple):
    """A text with one mistake."""

    name: str
    text: str


_CONSTANTS = {
    "st": re.compile(r"^ +(?P<name>\w+) : (L?REAL|INT) := (?P<value>-?[0-9.E+-]+);", re.MULTILINE),
    "c": re.compile(r"static const (tx_number|int16_t) (?P<name>\w+) = (?P<value>-?[0-9.E+-]+);"),
}
_BLOCKS = {
    "st": re.compile(
        r"^FUNCTION_BLOCK (?P<name>\w+)\n(?P<body>.*?)^END_FUNCTION_BLOCK", re.MULTILINE | re.DOTALL
    ),
    "c": re.compile(
        r"^(?:static )?void (?P<name>\w+)_step\(.*?\)\n\{(?P<body>.*?)^\}", re.MULTILINE | re.DOTALL
    ),
}
_CONDITIONS = {
    "st": re.compile(r"\b(?:IF|ELSIF) (?P<condition>(?:(?!\bTHEN\b).)+?) THEN", re.DOTALL),
    "c": re.compile(r"\bif \((?P<condition>.*?)\) \{$", re.MULTILINE | re.DOTALL),
}
_TRANSITIONS = {
    "st": re.compile(r"^ +state := (?P<value>\w+);", re.MULTILINE),
    "c": re.compile(r"b_->state = (?P<value>[\w>-]+);"),
}
_FINE = re.compile(r"alpha|gain|direct|reference|offset|slope|^g\d|_mm$|span|rate_step\d")


def changed_number(name: str, value: float, *, double: bool) -> float:
    """Return the smallest change that must be noticed: of a threshold a little more."""
    if value == 0.0:
        return 1e-9
    if name == "largest_number":
        return 1e299 if double else 1e37
    if name in {"largest_read_um", "largest_mm", "most_allowance_k"}:
        return 0.5 * value
    if _FINE.search(name):
        return next_number(value, double=double, up=True)
    if name.endswith("_s") or "frozen_s" in name:
        return value + CYCLE_S
    return 1.01 * value


def constants(text: str, dialect: str, *, double: bool = True) -> Iterator[Mutant]:
    """Yield a mutant for every number with a name."""
    for block in _BLOCKS[dialect].finditer(text):
        first = block["body"].find("VAR CONSTANT") if dialect == "st" else 0
        for found in _CONSTANTS[dialect].finditer(block["body"], first if first >= 0 else 10**9):
            begin, end = (block.start("body") + k for k in found.span("value"))
            whole = "." not in found["value"]
            if whole:
                new = str(int(found["value"]) + 1)
            else:
                value = changed_number(found["name"], float(found["value"]), double=double)
                new = number_text(value, double=double)
            name = f"{block['name']}: {found['name']} {found['value']} is {new}"
            yield Mutant(name, text[:begin] + new + text[end:])


def supervisor(text: str, dialect: str) -> tuple[int, str]:
    """Return where the block of the supervisor begins, and its text."""
    for block in _BLOCKS[dialect].finditer(text):
        if block["name"].endswith("supervisor"):
            return block.start("body"), block["body"]
    raise AssertionError("there is no supervisor")


def negated(text: str, dialect: str) -> Iterator[Mutant]:
    """Yield a mutant for every condition of the supervisor."""
    start, body = supervisor(text, dialect)
    word = "NOT" if dialect == "st" else "!"
    for found in _CONDITIONS[dialect].finditer(body):
        begin, end = (start + k for k in found.span("condition"))
        condition = found["condition"]
        new = f"({word} ({condition}))"
        line = body[: found.start()].count("\n") + 1
        name = f"line {line} of the supervisor: not {' '.join(condition.split())}"
        yield Mutant(name, text[:begin] + new + text[end:])


def retargeted(text: str, dialect: str) -> Iterator[Mutant]:
    """Yield a mutant for every transition and every other state that it could lead to."""
    start, body = supervisor(text, dialect)
    conditions = list(_CONDITIONS[dialect].finditer(body))
    for found in _TRANSITIONS[dialect].finditer(body):
        begin, end = (start + k for k in found.span("value"))
        before = [c["condition"] for c in conditions if c.start() < found.start()]
        where = " ".join(before[-1].split()) if before else "the start"
        for target in range(6):
            if str(target) != found["value"]:
                name = f"after {where}: state {found['value']} is {target}"
                yield Mutant(name, text[:begin] + str(target) + text[end:])


def mutants(text: str, dialect: str) -> list[Mutant]:
    """Return every mutant of a text."""
    made = [constants, negated, retargeted]
    return [mutant for make in made for mutant in make(text, dialect)]


# ---- which of them are noticed ------------------------------------------------------------------

NOT_NOTICED = {
    r"sensor: most_allowance_k": "no two temperatures that are plausible are so far apart",
}
"""What no input can show, with the reason."""


def excused(name: str) -> bool:
    return any(re.search(pattern, name) for pattern in NOT_NOTICED)


def excuses_used(names: Sequence[str]) -> set[str]:
    """Return the excuses that some names need."""
    return {pattern for pattern in NOT_NOTICED if any(re.search(pattern, n) for n in names)}


def unnoticed(
    chosen: Sequence[Mutant], folder: Path, dialect: str, *, double: bool = True
) -> list[str]:
    """Return the mutants of a text that no record shows; all are compiled in one go."""
    program = build_program(settings_with_everything(double=double))
    shown = records() if double else records_in_real()
    texts = {"tx_mutant": text_of(dialect, double=double)}
    texts |= {f"tx_m{k}": mutant.text for k, mutant in enumerate(chosen)}
    blocks = {name: _block(program, text, name, dialect) for name, text in texts.items()}
    library = CLibrary(c_library(blocks, folder, "-O0"))
    assert [difference(r, library.run("tx_mutant", r)) for r in shown] == [""] * len(shown)
    return [
        mutant.name
        for k, mutant in enumerate(chosen)
        if not any(difference(r, library.run(f"tx_m{k}", r)) for r in shown)
    ]


def _block(program: Program, text: str, name: str, dialect: str) -> CBlock:
    if dialect == "st":
        return st_block(program, text, name)
    texts = (
        one.replace("tx_mutant", name).replace("TX_MUTANT", name.upper())
        for one in (print_c(program).header, text)
    )
    return c_block(program)._replace(text=CText(*texts))


def text_of(dialect: str, *, double: bool = True) -> str:
    """Return the text of the model with everything that has the statements."""
    program = build_program(settings_with_everything(double=double))
    return print_st(program) if dialect == "st" else print_c(program).source


def every_mutant(dialect: str) -> list[Mutant]:
    """Return every mutant of the model with everything, in a seeded order."""
    return shuffled(mutants(text_of(dialect), dialect), 8)


def coefficients_in_real() -> list[Mutant]:
    """Return a mutant of Structured Text in REAL for every number that is no threshold."""
    made = constants(text_of("st", double=False), "st", double=False)
    return [m for m in made if _FINE.search(m.name.split()[1]) and " 0.0 " not in m.name]


def test_there_is_a_mutant_of_every_coefficient_and_every_transition() -> None:
    program = build_program(settings_with_everything())
    for dialect in ("st", "c"):
        names = [m.name for m in every_mutant(dialect)]
        assert len(set(names)) > 0.95 * len(names)
        for block in program.blocks:
            for constant in block.constants:
                if constant.name != "zero":
                    assert any(f": {constant.name} " in name for name in names), constant.name
        for target in range(6):
            assert any(name.endswith(f" is {target}") for name in names)
        assert sum(": state " in name for name in names) >= 60
        assert sum(name.startswith("line ") for name in names) >= 40


@pytest.mark.parametrize(("dialect", "sample"), [("st", 8), ("c", 6)])
def test_a_sample_of_the_mutants_is_noticed_and_a_change_that_changes_nothing_is_not(
    dialect: str, sample: int, tmp_path: Path
) -> None:
    text = text_of(dialect)
    same = Mutant("the same", text.replace("1.0;", "1.00;"))
    assert same.text != text
    missed = unnoticed([*every_mutant(dialect)[:sample], same], tmp_path, dialect)
    assert [name for name in missed if not excused(name)] == [same.name]


def test_a_sample_of_the_coefficients_in_real_is_noticed(tmp_path: Path) -> None:
    chosen = shuffled(coefficients_in_real(), 3)[:6]
    assert unnoticed(chosen, tmp_path, "st", double=False) == []
