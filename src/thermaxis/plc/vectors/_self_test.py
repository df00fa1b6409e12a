"""The self-test: a few dozen rows that run on the PLC itself, with an instance of their own.

The offset that is reported is the one that the instance has written, so that few rows lead through
every state. What must come out is what `cycle` says.
"""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any, NamedTuple, TypeAlias, final

from thermaxis.compensation import Reason
from thermaxis.plc._block import Block
from thermaxis.plc._library import SclCpu, StFlavour, folded, scl_text, with_panes
from thermaxis.plc._names import LONGEST_NAME
from thermaxis.plc._numbers import number_text
from thermaxis.plc._template import rendered
from thermaxis.plc.vectors._reference import JudgedBlock
from thermaxis.plc.vectors._simulated_plant import SimulatedPlant

_MOST_CALLS = 5_500
"""Most calls besides the first settling: what a task of 10 ms does in less than a minute. [1]"""
_MOST_SETTLING = 30_000
"""Most calls of the first settling, which an INT counts. [1]"""
_LIMIT_S = 60.0
"""Time in which a model comes near its end. [s]"""
_SETTLING = 2 ** list(Reason).index(Reason.SETTLING)
_MORE_CALLS = 20
"""Most calls by which a row is longer in REAL. [1]"""
_LEAST = 1e-30
_ENDING = "_selftest"
_Course: TypeAlias = Iterator[tuple[float, dict[str, Any]]]


class _Row(NamedTuple):
    """Some calls with the same inputs, and what must be said after the last; cells as texts."""

    calls: int
    inputs: Mapping[str, str]
    """Inputs that differ from those of the row before, by name, without the reported offset; with
    `away_um`, by which it is away from the one that stands, and `judged`, whether the outputs are
    compared."""
    outputs: Mapping[str, str]
    """Outputs after the last call that differ from those of the row before, by name."""
    stands: str
    """Offset that somebody puts into the control before the row; empty for none. [µm], or [mm]
    with a line"""


@final
class SelfTest(NamedTuple):
    """A test of a block that runs on the PLC: one truth, and the row that failed.

    Not protected: it says that this CPU computes what the cycle says in these rows, nothing of the
    wiring, and nothing of what is in the vectors alone.
    """

    name: str
    """Name of its block or function."""
    rows: int
    """Rows. [1]"""
    calls: int
    """Calls that they stand for. [1]"""
    missing: tuple[str, ...]
    """What this block cannot reach, or for which there were not calls enough, in words."""
    values: Mapping[str, Any]
    """What its templates are filled with."""

    def st(self, flavour: StFlavour = "iec") -> dict[str, str]:
        """Return it as Structured Text, a block that is called in every scan, by file."""
        text = folded(rendered("self_test.st.j2", {**self.values, "test": self}))
        return {f"{self.name}.st": with_panes(text, flavour)}

    def scl(self, cpu: SclCpu = "s7-1500") -> dict[str, str]:
        """Return the same as SCL, by file."""
        return {f"{self.name}.scl": scl_text(self.st()[f"{self.name}.st"], cpu)}

    def c(self) -> dict[str, str]:
        """Return it as a function in C, which returns the row that failed or 0, by file."""
        text = folded(rendered("self_test.h.j2", {**self.values, "test": self}))
        return {f"{self.name}.h": text}


def self_test_of(block: Block, *, most_calls: int = _MOST_CALLS) -> SelfTest:
    """Return the self-test of a block.

    Parameters
    ----------
    most_calls : int
        Calls that its rows share, besides the first settling: a wait for which they do not
        suffice, such as that for a frozen value, is left out, and `missing` says so. Default:
        5500. [1]

    Returns
    -------
    SelfTest
        The test; the same block gives the same text.
    """
    face, line, double = block.interface, block.line, block.settings.double
    cycle = JudgedBlock(block.settings, line)
    plant = SimulatedPlant(block.settings, cycle)
    settling = round(plant.rules.settle_s / plant.cycle_s)
    plant.calls_left = most_calls + (settling if settling <= _MOST_SETTLING else 0)
    rows = list(_rows(block, cycle, plant))
    name = block.name[: LONGEST_NAME - len(_ENDING)].rstrip("_") + _ENDING
    values = {
        "name": block.name,
        "face": face,
        "number": "LREAL" if double else "REAL",
        "line": line,
        "rows": rows,
        "wanted": {v.name: f"want{k}" for k, v in enumerate(face.outputs, 1)},
        "fed": [("read_k0_mm", "k0_mm"), ("read_slope", "slope")]
        if line
        else [(f"read_{stem}", f"correction_{stem}") for stem in block.settings.names.outputs],
        "mm_per_um": _cell(1.0 / line.um_per_mm, double=double) if line else "",
        "origin_mm": _cell(line.origin_mm, double=double) if line else "",
        "within": "1.0E-09" if double else "1.0E-06",
        "within_um": "1.0E-09" if double else "0.002",
    }
    calls = sum(row.calls for row in rows)
    return SelfTest(name, len(rows), calls, tuple(plant.missing()), values)


def _rows(block: Block, cycle: JudgedBlock, plant: SimulatedPlant) -> Iterator[_Row]:
    settings, line, face = block.settings, block.line, block.interface
    names = [v.name for v in face.inputs if not v.name.startswith("read_") or v.name == "read_ok"]
    told: dict[str, str] = {}
    said: dict[str, str] = {}
    for seconds, different in _course(plant):
        if not plant.fits(seconds, f"a wait of {seconds:g} s"):
            continue
        away_um, stands_um = different.pop("away_um", 0.0), different.pop("stands_um", None)
        if stands_um is not None:
            plant.stand([stands_um] * len(plant.bounds))
        least, calls = max(1, round(seconds / plant.cycle_s)), 0
        while True:
            read_um = [offset_um + away_um for offset_um in plant.offset_um]
            plant.step(**plant.told("read", read_um), **different)
            calls += 1
            # A row of REAL ends where no rounding moves a change of state, if that comes soon.
            if calls >= least and (cycle.judged or calls >= least + _MORE_CALLS):
                break
        plant.calls_left -= calls
        cells = {**cycle.values(), "away_um": away_um, "judged": cycle.judged}
        texts = {name: _cell(cell, double=settings.double) for name, cell in cells.items()}
        now = {name: texts[name] for name in ("judged", "away_um", *names)}
        then = {v.name: texts[v.name] for v in face.outputs}
        stands = 0.0 if stands_um is None else stands_um / (line.um_per_mm if line else 1.0)
        yield _Row(
            calls,
            {name: text for name, text in now.items() if told.get(name) != text},
            {name: text for name, text in then.items() if said.get(name) != text},
            _cell(stands, double=settings.double) if stands else "",
        )
        told, said = now, then


def _cell(value: float, *, double: bool) -> str:
    if isinstance(value, int):
        return str(value).upper()
    # What REAL does not hold is far below what is compared.
    return number_text(value if abs(value) > _LEAST else 0.0, double=double)


def _course(plant: SimulatedPlant) -> _Course:
    """Yield how long a row lasts, and in which inputs it differs from the usual."""
    cycle_s, rules = plant.cycle_s, plant.rules
    channels = len(plant.base_c)
    total_um = min(bounds.total_um for bounds in plant.bounds)
    near_um, away_um = 0.99 * rules.read_back_tolerance_um, 1.01 * rules.read_back_tolerance_um
    yield 0.0, {"init": True, "stands_um": 0.25 * total_um}
    yield 0.0, {"cycle_time_s": 1.105 * cycle_s, "enable": True}
    plant.usual["enable"] = True
    yield 0.0, {"cycle_time_s": 0.895 * cycle_s, "hold": True}
    yield 0.0, plant.told("ok", [k > 0 for k in range(channels)])
    yield plant.ready_s(), {"cycle_time_s": 1.095 * cycle_s}
    for share in (1.01, 0.99):
        yield 0.0, _jumped(plant, share)
    plant.apart()
    plant.now_c = list(plant.goal_c)
    yield 20.0 * cycle_s, {"reset": True, "cycle_time_s": 0.905 * cycle_s}
    yield 200.0 * cycle_s, {"away_um": near_um}
    yield 5.0 * cycle_s, plant.trims(1.0)
    yield 0.0, plant.trims(1.01)
    edges = {p.diameter_mm for x in plant.model.layout.parts for p in x.gain_by_diameter}
    for a, b in pairwise(sorted(edges | {50.0})):
        yield 2.0 * cycle_s, {"diameter_known": True, "diameter_mm": 0.5 * (a + b)}
    for outside_c in (
        [rule.lowest_c - 0.01 for rule in plant.sensors],
        [rule.highest_c + 0.01 for rule in plant.sensors],
    ):
        yield 0.0, plant.told("t", outside_c)
    yield from _ready(plant)
    open_s, open_ = rules.hold_interlock_s, {"interlocks_met": False}
    yield from _for_longer(plant, open_s, "an open interlock", open_)
    yield 3.0 * cycle_s, {"connected": False, "read_ok": False, "stands_um": -0.125 * total_um}
    yield from _ready(plant)
    yield 0.0, {"enable": False}
    yield from _ready(plant)
    away = {"away_um": away_um}
    yield from _for_longer(plant, rules.read_back_s, "another offset than was written", away)
    yield 0.0, {**away, "reset": True}
    yield 0.0, {}
    yield 0.0, {"reset": True, "enable": False}
    yield from _ready(plant)
    if plant.touched:
        for more_um, calls in ((3.0, 2), (60.0, 2), (60.0, 20), (2.0, 20), (2.5, 20)):
            yield calls * cycle_s, plant.touch(more_um, 0.5 * cycle_s)
        yield 0.0, plant.touch(0.0, 100.0 * cycle_s)
    yield from _limits(plant)
    yield 0.0, {"other_compensation": True}
    yield 0.0, {"other_compensation": True, "reset": True}
    yield 0.0, {}
    yield 0.0, {"reset": True, "enable": False}
    yield from _ready(plant)
    yield from _anew(plant)
    lost_s, hold_s = rules.hold_connection_s, rules.hold_operator_s
    yield from _for_longer(plant, lost_s, "a lost connection", {"connected": False})
    yield from _for_longer(plant, hold_s, "the hold of an operator", {"hold": True})
    lasting_s = max(rules.longest_trim_s, *(sensor.frozen_s for sensor in plant.sensors))
    yield from _for_longer(plant, lasting_s, "a trim and frozen values", plant.trims(1.0))


def _anew(plant: SimulatedPlant) -> _Course:
    """Yield rows that start the model anew, which then settles; at last it does so in Off."""
    lost_s = max(plant.rules.input_timeout_s, plant.model.longest_hold_s)
    lost = plant.told("ok", [False] * len(plant.base_c))
    yield from _for_longer(plant, lost_s, "a lost temperature", lost)
    yield 0.0, {"cycle_time_s": 1.01 * plant.model.longest_gap_s}
    yield from _ready(plant)
    yield 0.0, {"init": True}
    yield 3.0 * plant.cycle_s, {}
    yield 0.0, {"enable": False}
    yield plant.ready_s(), {"enable": False}
    yield from _ready(plant)


def _ready(plant: SimulatedPlant) -> _Course:
    """Yield what it takes until everything is there again; settling only where it is asked for."""
    yield plant.beyond(max(plant.rules.recovery_delay_s, plant.rules.input_timeout_s)), {}
    if plant.said["fault_word"] & _SETTLING:
        yield plant.ready_s(), {}


def _limits(plant: SimulatedPlant) -> _Course:
    """Yield rows near both ends of the model, up to the fault of who stays there, and back."""
    for sign in (1.0, -1.0):
        plant.extreme_um(0, sign)
        plant.now_c = _inside(plant)
        yield 0.0, {}
        yield 0.0, {"reset": True}
        yield _LIMIT_S, {}
    yield from _for_longer(plant, plant.rules.at_limit_s, "a correction at its limit", {})
    plant.back()
    plant.now_c = list(plant.goal_c)
    yield 0.0, {"reset": True, "enable": False}
    yield from _ready(plant)


def _jumped(plant: SimulatedPlant, share: float) -> dict[str, Any]:
    """Return temperatures a share of the accepted jump away, each the other way than the last."""
    steps_k = [rule.step_k + rule.largest_rate_k_per_s * plant.cycle_s for rule in plant.sensors]
    jumps_k = [share * step_k * (-1) ** k for k, step_k in enumerate(steps_k)]
    pairs = zip(plant.base_c, jumps_k, strict=True)
    return plant.told("t", [base_c + jump_k for base_c, jump_k in pairs])


def _inside(plant: SimulatedPlant) -> list[float]:
    """Return the goals, moved to the edge of what is plausible on their side."""
    return [
        rule.highest_c - 0.01 if goal_c > base_c else rule.lowest_c + 0.01
        for goal_c, base_c, rule in zip(plant.goal_c, plant.base_c, plant.sensors, strict=True)
    ]


def _for_longer(
    plant: SimulatedPlant, seconds: float, what: str, different: dict[str, Any]
) -> _Course:
    """Yield a row that lasts for longer, and what comes after it, if there are calls left."""
    if plant.fits(plant.beyond(seconds), f"{what} for longer than {seconds:g} s"):
        yield plant.beyond(seconds), dict(different)
        yield from _ready(plant)
