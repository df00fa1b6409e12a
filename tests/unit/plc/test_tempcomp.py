"""The line through corrections at positions: least squares, bounded, taken over, read back.

`numpy.polyfit` and the law of the control, K(P) = K0 + slope (P - P0) with the axis moving
against K, are the second ways.
"""

import math
import re
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from tests.unit.plc.compiled import Compiled
from thermaxis.compensation import (
    STATED,
    Compensation,
    CompensationModel,
    Limits,
    Output,
    Part,
    Section,
    SensorRules,
    SupervisorRules,
    SupervisorState,
)
from thermaxis.plc import (
    Block,
    CallSequence,
    CycleBlock,
    GuideFacts,
    LineSettings,
    PlcSettings,
    PlcStep,
    Target,
    at_position,
    export_settings,
    guide_text,
    interface_of,
    line_bounds,
    vectors_of,
)
from thermaxis.plc.vectors import LINE_LIMITED

TOTAL_UM = 40.0


def settings_at(
    positions_mm: tuple[float, ...], *, double: bool = True, cycle_s: float = 1.0
) -> PlcSettings:
    outputs = tuple(
        Output(
            at_position(p),
            (Part(f"p{k}", "T", "", 1.0 + k, (Section(3.0 * k - 5.0, 100.0 + k),)),),
        )
        for k, p in enumerate(positions_mm)
    )
    model = CompensationModel(outputs=outputs, reference=STATED, reference_c={"T": 20.0})
    quick = SupervisorRules(settle_s=5.0, hold_operator_s=60.0, at_limit_s=60.0)
    compensation = Compensation(
        model=model,
        sensors={"T": SensorRules(lowest_c=1.0, highest_c=90.0)},
        limits={output.name: Limits(TOTAL_UM, 1.0) for output in outputs},
        supervisor=quick,
    )
    return export_settings(compensation, cycle_s=cycle_s, name="x axis", double=double)


POSITIONS = st.lists(st.integers(-2000, 2000), min_size=2, max_size=6, unique=True).map(
    lambda found: tuple(float(p) for p in found)
)


@settings(max_examples=60, deadline=None)
@given(POSITIONS, st.data(), st.booleans(), st.integers(-500, 500))
def test_the_line_is_that_of_polyfit_and_the_axis_that_moves_against_it_is_corrected(
    positions: tuple[float, ...], data: st.DataObject, away: bool, reference: int
) -> None:
    line = LineSettings(positions_mm=positions, away=away, reference_mm=float(reference))
    corrections_um = np.array([data.draw(st.floats(-300.0, 300.0)) for _ in positions])
    k0_weights, slope_weights = (np.array(w) for w in line.weights())
    k0_mm, slope = k0_weights @ corrections_um, slope_weights @ corrections_um
    at = np.array(positions)
    steepness, level = np.polyfit(at - reference, corrections_um, 1)
    moved_mm = -(k0_mm + slope * (at - reference))  # the control moves the axis against K
    tool_um = moved_mm * 1000.0 * (1.0 if away else -1.0)
    scale = 1e-9 * (1.0 + 1e3 * np.max(np.abs(corrections_um)))
    assert tool_um == pytest.approx(level + steepness * (at - reference), abs=scale)
    if len(positions) == 2:
        assert tool_um == pytest.approx(corrections_um, abs=scale)


def course_of(block: CycleBlock, exported: PlcSettings) -> Iterator[PlcStep]:
    return CallSequence(exported, most_calls=1500, block=block).steps()


def with_line(exported: PlcSettings, line: LineSettings, language: str = "st") -> Compiled:
    return Compiled(Block(settings=exported, line=line), language=language)


@pytest.mark.parametrize(
    "positions",
    [(100.0, 900.0), pytest.param((-50.5, 300.3, 1200.0), marks=pytest.mark.proof)],
)
def test_the_block_with_a_line_is_the_cycle_with_the_line_as_its_law_says(
    positions: tuple[float, ...],
) -> None:
    exported = settings_at(positions, cycle_s=8.0)
    line = LineSettings(positions_mm=positions, away=False, reference_mm=50.1)
    cycle, blocks = CycleBlock(exported, line), [with_line(exported, line, x) for x in ("st", "c")]
    names = exported.names.outputs
    states: set[int] = set()
    for _ in course_of(cycle, exported):
        wanted = cycle.values()
        for block in blocks:
            block.tell({v.name: wanted[v.name] for v in interface_of(exported, line).inputs})
            said = block.values()
            assert said == {name: wanted[name] for name in said}
        laid_mm = [said["k0_mm"] + said["slope"] * (p - said["reference_mm"]) for p in positions]
        away_um = [said[f"correction_{n}"] - 1e3 * mm for n, mm in zip(names, laid_mm, strict=True)]
        assert max(map(abs, away_um)) == pytest.approx(said["residual_um"], abs=1e-9)
        assert said["line_limited"] is False
        states.add(said["state"])
    assert states == set(range(len(SupervisorState)))


def driven(block: Compiled, **inputs: object) -> None:
    """Call a block once with these inputs; those not named keep their values."""
    for name, value in inputs.items():
        assert hasattr(block, name), name
        setattr(block, name, value)
    block.call()


WELL = {
    "cycle_time_s": 1.0,
    "enable": True,
    "t_t": 20.0,
    "ok_t": True,
    "interlocks_met": True,
    "connected": True,
    "read_ok": True,
}


def started(block: Compiled, **inputs: object) -> None:
    """Call a block for the first time: it is not enabled yet."""
    driven(block, **WELL | {"enable": False}, **inputs)


def test_a_line_that_stands_in_the_control_is_taken_over_and_not_jumped() -> None:
    positions = (0.0, 500.0, 1000.0)
    exported = settings_at(positions)
    line = LineSettings(positions_mm=positions, away=True)
    block = with_line(exported, line)
    standing = {"read_k0_mm": 0.012, "read_slope": 1e-5, "read_reference_mm": 250.0}
    driven(block, **WELL, **standing)
    there_mm = [0.012 + 1e-5 * (p - 250.0) for p in positions]
    here_mm = [block.k0_mm + block.slope * (p - block.reference_mm) for p in positions]
    assert here_mm == pytest.approx(there_mm, abs=1e-12)
    assert block.correction_at_500 == pytest.approx(-1000.0 * there_mm[1], abs=1e-9)


def test_a_line_that_is_changed_while_it_is_off_is_taken_over_though_it_is_beyond_its_bounds() -> (
    None
):
    line = LineSettings(positions_mm=(0.0, 1000.0), away=True)
    block = with_line(settings_at((0.0, 1000.0)), line)
    driven(block, **{**WELL, "enable": False}, read_slope=0.0, read_reference_mm=500.0)
    for k0_mm in (5.0, 5.0, 0.25, 0.0):
        driven(block, read_k0_mm=k0_mm)
        assert block.k0_mm == pytest.approx(k0_mm, abs=1e-12)
        assert block.line_limited is False
    assert (block.k0_mm, block.state) == (0.0, 0)


def test_a_control_that_keeps_another_slope_is_a_fault_and_one_that_follows_is_none() -> None:
    positions = (0.0, 1000.0)
    line = LineSettings(positions_mm=positions, away=True)
    for factor, expected in ((1.0, SupervisorState.ACTIVE), (0.5, SupervisorState.FAULT)):
        block = with_line(settings_at(positions), line)
        started(block, read_k0_mm=0.0, read_slope=0.0, read_reference_mm=500.0)
        for k in range(120):
            driven(
                block,
                enable=True,
                t_t=20.0 + min(0.05 * k, 4.0),
                read_k0_mm=block.k0_mm,
                read_slope=factor * block.slope,
            )
        assert block.state == list(SupervisorState).index(expected)


@pytest.mark.parametrize(
    ("name", "odd"),
    [("read_k0_mm", math.nan), ("read_slope", math.inf), ("read_reference_mm", -1e30)],
)
def test_what_is_no_line_counts_as_not_read(name: str, odd: float) -> None:
    line = LineSettings(positions_mm=(0.0, 1000.0), away=True)
    block = with_line(settings_at((0.0, 1000.0)), line)
    read = {"read_k0_mm": 0.01, "read_slope": 1e-5, "read_reference_mm": 500.0}
    started(block, **{**read, name: odd})
    assert (block.k0_mm, block.slope, block.linked) == (0.0, 0.0, False)
    driven(block, **read, enable=True)
    assert block.linked
    assert (block.k0_mm, block.slope) == pytest.approx((0.01, 1e-5), rel=1e-12)
    for _ in range(20):
        driven(block, **{name: odd})
    assert block.state == list(SupervisorState).index(SupervisorState.FAULT)


def test_the_line_goes_to_zero_at_the_rate_of_the_corrections_when_it_is_switched_off() -> None:
    positions = (0.0, 1000.0)
    line = LineSettings(positions_mm=positions, away=True)
    block = with_line(settings_at(positions), line)
    started(block, read_k0_mm=0.0, read_slope=0.0, read_reference_mm=500.0)
    largest_step_um, last_um, reached_um = 0.0, (0.0, 0.0), 0.0
    for k in range(200):
        at_rest = k > 120
        driven(
            block,
            enable=not at_rest,
            t_t=20.0 + min(0.05 * k, 6.0),
            read_k0_mm=block.k0_mm,
            read_slope=block.slope,
        )
        now_um = tuple(-1000.0 * (block.k0_mm + block.slope * (p - 500.0)) for p in positions)
        step_um = max(abs(a - b) for a, b in zip(now_um, last_um, strict=True))
        largest_step_um, last_um = max(largest_step_um, step_um), now_um
        reached_um = max(reached_um, *(abs(u) for u in now_um))
    assert largest_step_um == pytest.approx(1.0, abs=1e-9)  # reached, never passed
    assert reached_um > 5.0
    assert (block.k0_mm, block.slope, block.state) == (0.0, 0.0, 0)


def test_the_bounds_are_what_the_limits_of_the_corrections_allow_and_no_more() -> None:
    line = LineSettings(positions_mm=(0.0, 250.0, 1000.0), away=True, reference_mm=0.0)
    k0_mm, slope = line.bounds((TOTAL_UM,) * 3)
    corners = np.array(np.meshgrid(*[[-TOTAL_UM, TOTAL_UM]] * 3)).reshape(3, -1).T
    fits = np.array([np.polyfit(line.positions_mm, c, 1) for c in corners]) / 1000.0
    assert k0_mm == pytest.approx(np.max(np.abs(fits[:, 1])), rel=2e-6)
    assert slope == pytest.approx(np.max(np.abs(fits[:, 0])), rel=2e-6)
    assert k0_mm > np.max(np.abs(fits[:, 1]))


@pytest.mark.parametrize("double", [True, False])
def test_the_bounds_are_said_outward_with_the_same_digits_wherever_they_stand(double: bool) -> None:
    positions = (0.0, 533.0)
    exported = settings_at(positions, double=double)
    line = LineSettings(positions_mm=positions, away=True)
    block = Block(settings=exported, line=line)
    said = line_bounds(exported, line)
    whole = block.st()[f"{block.name}.st"]
    bounds = re.findall(r"(largest_k0_mm|largest_slope) : L?REAL := (.*);", whole)
    held = {name: float(value) for name, value in bounds}
    for text, name in zip(said, ("largest_k0_mm", "largest_slope"), strict=True):
        assert held[name] <= float(text) <= held[name] * (1.0 + 1.1e-5)
        assert len(text.strip("0.").replace(".", "")) <= 6
    target = Target("sinumerik-tempcomp", "s7-1500" if double else "s7-300")
    facts = GuideFacts(target, ("x",), "v", (), line)
    guide = " ".join(guide_text(exported, block, facts).split())
    k0_mm, slope = said
    head = " ".join(whole.replace("*)\n(*", "").split())
    assert f"Largest K0 {k0_mm} mm, largest slope {slope} mm/mm" in head
    assert f"larger than {k0_mm} mm and {slope} mm/mm" in guide
    assert f"| mm/mm | {slope} | DOUBLE" in guide
    assert f"| mm | {k0_mm} | DOUBLE" in guide


def test_the_guide_names_how_far_the_line_moves_in_one_call_and_it_moves_no_further() -> None:
    positions = (0.0, 250.0, 1000.0)
    exported = settings_at(positions, cycle_s=8.0)
    line = LineSettings(positions_mm=positions, away=True, reference_mm=0.0)
    block = Block(settings=exported, line=line)
    target = Target("sinumerik-tempcomp", "s7-1500")
    facts = GuideFacts(target, ("x",), "v", (), line)
    guide = " ".join(guide_text(exported, block, facts).split())
    (said,) = re.findall(r"at most ([0-9.]+) mm of K0 and ([0-9.]+) mm/mm of slope", guide)
    k0_step_mm, slope_step = map(float, said)
    corners = np.array(np.meshgrid(*[[-8.0, 8.0]] * 3)).reshape(3, -1).T
    fits = np.abs([np.polyfit(positions, c, 1) for c in corners]) / 1000.0
    assert k0_step_mm == pytest.approx(np.max(fits[:, 1]), rel=2e-5)
    assert slope_step == pytest.approx(np.max(fits[:, 0]), rel=2e-5)
    cycle = CycleBlock(exported, line)
    calls = [(inputs["init"], dict(cycle.values())) for inputs, _ in course_of(cycle, exported)]
    moved = [
        (abs(now["k0_mm"] - before["k0_mm"]), abs(now["slope"] - before["slope"]))
        for (_, before), (init, now) in pairwise(calls)
        if before["linked"] and now["linked"] and not init
        if before["state"] and now["state"]
    ]
    largest = np.max(np.array(moved), axis=0)
    assert 0.1 * k0_step_mm < largest[0] <= k0_step_mm
    assert 0.1 * slope_step < largest[1] <= slope_step


@pytest.mark.proof
def test_a_bound_that_never_acts_is_named_among_what_is_not_in_the_rows() -> None:
    exported = settings_at((0.0, 500.0), cycle_s=8.0)
    line = LineSettings(positions_mm=(0.0, 500.0), away=True)
    found = vectors_of(exported, line)
    assert LINE_LIMITED in found.missing
    assert f"# not in the rows: {LINE_LIMITED}" in found.text
    assert not any("line_limited" in text for text in vectors_of(exported, most_calls=100).missing)


def test_the_residual_is_the_largest_distance_from_the_line() -> None:
    positions = (0.0, 500.0, 1000.0)
    line = LineSettings(positions_mm=positions, away=True)
    block = with_line(settings_at(positions), line)
    started(block, read_k0_mm=0.0, read_slope=0.0, read_reference_mm=500.0)
    driven(block, enable=True)
    trims = dict(zip((f"trim_at_{p:g}" for p in positions), (-2.0, 4.0, -2.0), strict=True))
    for _ in range(40):
        driven(block, **trims, read_k0_mm=block.k0_mm, read_slope=block.slope)
    corrections = [getattr(block, f"correction_at_{p:g}") for p in positions]
    fit = np.polyfit(positions, corrections, 1)
    away = np.abs(np.array(corrections) - np.polyval(fit, positions))
    assert corrections == pytest.approx([-2.0, 4.0, -2.0], abs=1e-9)
    assert block.residual_um == pytest.approx(np.max(away), abs=1e-9)
    assert block.residual_um == pytest.approx(4.0, abs=1e-9)


@pytest.mark.parametrize("double", [True, False])
def test_the_block_is_written_in_every_dialect(double: bool) -> None:
    exported = settings_at((-100.5, 250.25), double=double)
    block = Block(settings=exported, line=LineSettings(positions_mm=(-100.5, 250.25), away=True))
    st = block.st()
    cpu = "s7-1500" if double else "s7-300"
    for text in (*st.values(), *block.scl(cpu).values(), *block.c().values()):
        assert text.isascii()
        assert max(map(len, text.splitlines())) <= 100
    assert "correction_at_m100_5" in st[f"{block.name}.st"]


def test_vectors_have_a_column_for_everything_and_are_the_same_twice() -> None:
    exported = settings_at((0.0, 500.0))
    line = LineSettings(positions_mm=(0.0, 500.0), away=True)
    text = vectors_of(exported, line, most_calls=100).text
    assert text == vectors_of(exported, line, most_calls=100).text
    lines = [row for row in text.splitlines() if not row.startswith("#")]
    names = lines[0].split(",")
    face = interface_of(exported, line)
    assert names[:3] == ["call", "calls", "compare"]
    assert names[3:] == [v.name for v in (*face.inputs, *face.outputs)]
    assert {len(row.split(",")) for row in lines} == {len(names)}
    assert len(lines) > 50


def test_positions_that_make_no_line_are_refused() -> None:
    for positions, code in [
        ((100.0,), "too_few_positions"),
        ((100.0, 100.5), "positions_too_close"),
        ((100.0, math.nan), "outside_range"),
        ((100.0, 2e5), "outside_range"),
    ]:
        with refused(code):
            LineSettings(positions_mm=positions, away=True)


def test_limits_that_allow_a_slope_which_the_control_does_not_follow_are_refused() -> None:
    exported = settings_at((0.0, 2.0))
    with refused("slope_too_large"):
        Block(settings=exported, line=LineSettings(positions_mm=(0.0, 2.0), away=True))
    with refused("one_position_per_output"):
        Block(
            settings=exported,
            line=LineSettings(positions_mm=(0.0, 200.0, 400.0), away=True),
        )
