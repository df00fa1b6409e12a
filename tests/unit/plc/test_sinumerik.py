"""The block that brings a correction to SD43900, with a stand-in of the NC-variable service.

The service answers late, with an error, or never, and a job that is done may have written nothing.
Whatever it does, an offset counts as read only where the setting data held it a moment ago.
"""

import random
from collections import deque
from functools import cache
from itertools import pairwise
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import pytest

from tests.proofs import quick_first
from tests.unit.compensation import bench
from tests.unit.plc.compiled import Compiled
from tests.unit.plc.equal_parts import CBlock, CLibrary, c_library
from tests.unit.plc.plc_scenarios import quiet_inputs
from tests.unit.plc.st_to_c import bare, st_as_c
from thermaxis.compensation import Limits, Part, Section, SupervisorState
from thermaxis.plc import (
    Block,
    GuideFacts,
    Target,
    export_settings,
    guide_text,
    sinumerik_library,
)

CYCLE_S, SCAN_S = 2.0, 0.25
LIMITS = Limits(40.0, 0.25)
STEP_UM = LIMITS.largest_rate_um_per_s * CYCLE_S
OFF, ACTIVE, HOLDING, FADING, FAULT = (
    list(SupervisorState).index(SupervisorState(name))
    for name in ("Off", "Active", "Holding", "Fading", "Fault")
)
INPUTS = (
    *("init", "elapsed_s", "cycle_s", "um_per_mm", "total_um", "step_um", "correction_um"),
    *("linked", "state", "heartbeat", "get_done", "get_error", "got_mm", "put_done", "put_error"),
)
OUTPUTS = (
    *("get_request", "put_request", "put_mm", "read_um", "read_ok", "stopped", "slow"),
    "errors",
)


@cache
def library(*, double: bool) -> CLibrary:
    c = st_as_c([sinumerik_library(double=double)], "offset")
    block = CBlock((("offset.h", c.header), ("offset.c", c.source)), INPUTS, OUTPUTS)
    return CLibrary(c_library({"offset": block}, Path(mkdtemp(prefix="plcw-")), "-O0"))


class Job:
    """FB2 or FB3: an answer stands until the request has gone.

    A job whose request has gone before its answer is done all the same, and nothing tells of it,
    unless the next request takes its place.
    """

    def __init__(self) -> None:
        self.request = self.done = self.error = False
        self.end, self.left, self.taken = "good", 0, 0.0
        self.ends: deque[tuple[str, int]] = deque()
        """How the next jobs end, and after how many scans; good ones after two, then."""

    def scan(self, value: float, *, request: float) -> bool:
        """Return whether it has an effect in this scan, with the value of when it began."""
        if request and not self.request:
            if self.left == 0:
                self.end, self.left = self.ends.popleft() if self.ends else ("good", 2)
            self.taken = value
        self.request = bool(request)
        self.done, self.error = self.done and self.request, self.error and self.request
        if self.left == 0 or self.end == "never":
            return False
        self.left -= 1
        if self.left == 0:
            failed = self.end == "error"
            self.done, self.error = self.request and not failed, self.request and failed
        return self.left == 0 and self.end == "good"


class Control:
    """Setting data 43900 of an axis, the two jobs, and the block between them and a model block.

    No write moves the axis by more than a step, but for one that overtakes somebody else: between
    the moment of a GET, and that of the PUT that follows it at once, nobody can tell.
    """

    def __init__(
        self, *, um_per_mm: float = -1000.0, double: bool = True, scan_s: float = SCAN_S
    ) -> None:
        self.get, self.put = Job(), Job()
        self.k0_mm = self.got_mm = 0.0
        self.um_per_mm, self.library = um_per_mm, library(double=double)
        self.said = dict.fromkeys(OUTPUTS, 0.0)
        self.first = True
        self.scan_s = scan_s
        self.held_um: deque[float] = deque(maxlen=round(3.0 * CYCLE_S / scan_s) + 1)
        self.since_get, self.overtaken = 0, False

    @property
    def offset_um(self) -> float:
        """Correction that the setting data means. [µm]"""
        return self.k0_mm * self.um_per_mm

    def set_by_somebody(self, k0_mm: float) -> None:
        """Write the setting data as an operator or a part program does."""
        self.k0_mm, self.overtaken = k0_mm, True

    def scan(self, *, init: bool = False, elapsed_s: float | None = None, **block: Any) -> Any:
        """Do one scan of OB1: the block, then FB2 and FB3."""
        self.since_get += 1
        if self.get.done:
            self.since_get = 0
        self.held_um.append(self.offset_um)
        told = {"total_um": LIMITS.largest_um, "step_um": STEP_UM} | block
        told |= {
            "init": init,
            "elapsed_s": self.scan_s if elapsed_s is None else elapsed_s,
            "cycle_s": CYCLE_S,
            "got_mm": self.got_mm,
            "um_per_mm": self.um_per_mm,
            "get_done": self.get.done,
            "get_error": self.get.error,
            "put_done": self.put.done,
            "put_error": self.put.error,
        }
        asked = self.said["put_request"]
        row = tuple(told[name] for name in INPUTS)
        (out,) = self.library.called("offset", [row], [self.first], len(OUTPUTS))
        self.first, self.said = False, dict(zip(OUTPUTS, out.tolist(), strict=True))
        if self.said["put_request"] and not asked:
            assert self.said["read_ok"], "nothing is written before the control was read"
            assert block["state"] != OFF, "nothing is written in Off"
            moved_um = self.said["put_mm"] * self.um_per_mm - self.said["read_um"]
            assert abs(moved_um) <= STEP_UM + 1e-5, "no job moves more than a step"
            assert self.since_get == 1, "it is taken from what was read just before"
        assert not (self.said["get_request"] and self.said["put_request"]), "one job at a time"
        if self.said["read_ok"]:
            read_um = self.said["read_um"]
            assert any(abs(read_um - um) < 1e-5 for um in self.held_um), "it is what was there"
        if self.said["get_request"] and not self.get.request:
            self.overtaken = False
        if self.get.scan(self.k0_mm, request=self.said["get_request"]):
            self.got_mm = self.get.taken
        if self.put.scan(self.said["put_mm"], request=self.said["put_request"]):
            moved_um = (self.put.taken - self.k0_mm) * self.um_per_mm
            assert abs(moved_um) <= STEP_UM + 1e-5 or self.overtaken, "it moves by a step"
            self.k0_mm = self.put.taken
        return self.said


def told(correction_um: float, beat: int, *, state: int = ACTIVE, linked: bool = True) -> Any:
    return {"correction_um": correction_um, "heartbeat": beat, "state": state, "linked": linked}


@pytest.mark.parametrize(("um_per_mm", "k0_mm"), [(-1000.0, 0.025), (1000.0, -0.025)])
def test_the_axis_moves_against_k_so_that_the_tool_point_moves_by_the_correction(
    um_per_mm: float, k0_mm: float
) -> None:
    control = Control(um_per_mm=um_per_mm)
    for k in range(800):
        said = control.scan(**told(-25.0, k // 8))
    away = -1.0 if um_per_mm > 0.0 else 1.0  # of the tool point, where the axis moves positively
    assert control.k0_mm == pytest.approx(k0_mm, abs=1e-12)
    assert -1000.0 * control.k0_mm * away == pytest.approx(-25.0, abs=1e-9)
    assert (said["read_um"], said["errors"]) == (pytest.approx(-25.0, abs=1e-9), 0)
    for k in range(800, 900):
        assert not control.scan(**told(-25.0, k // 8))["put_request"], "what stands is not written"


@pytest.mark.parametrize(("double", "total_um"), [(True, 40.0), (False, -40.0)])
def test_a_correction_is_reached_as_fast_as_its_steps_allow_and_never_beyond_its_total(
    double: bool, total_um: float
) -> None:
    control = Control(double=double)
    beats = 0
    while abs(control.offset_um - total_um) > 1e-4:
        for _ in range(8):
            control.scan(**told(1e4 * total_um, beats))
        beats += 1
    assert beats == pytest.approx(40.0 / STEP_UM, abs=2)
    for k in range(80):
        said = control.scan(**told(1e4 * total_um, beats + k // 8))
        assert said["read_um"] == pytest.approx(total_um, abs=1e-4)


def test_a_block_that_is_called_too_often_is_followed_no_more_than_twice_a_cycle() -> None:
    control = Control()
    asked: list[int] = []
    for k in range(400):
        before = control.said["put_request"]
        if control.scan(**told(40.0, k), elapsed_s=SCAN_S / 2.0)["put_request"] and not before:
            asked.append(k)
    apart_s = {(b - a) * SCAN_S / 2.0 for a, b in pairwise(asked)}
    assert 0.5 * CYCLE_S <= min(apart_s) <= max(apart_s) < CYCLE_S


@pytest.mark.parametrize("odd", [float("nan"), float("inf"), -float("inf")])
def test_what_is_no_number_goes_to_zero_by_steps_and_an_unstated_direction_does_nothing(
    odd: float,
) -> None:
    control = Control()
    control.k0_mm = -0.004
    for k in range(200):
        control.scan(**told(odd, k // 8))
    assert control.k0_mm == pytest.approx(0.0, abs=1e-9)
    unstated = Control(um_per_mm=0.0)
    unstated.k0_mm = 0.004
    for k in range(200):
        assert not unstated.scan(**told(5.0, k // 8))["read_ok"]
    assert unstated.k0_mm == 0.004


@pytest.mark.parametrize("number", ["step_um", "total_um"])
@pytest.mark.parametrize("odd", [float("nan"), -0.5, 0.0])
def test_a_limit_that_cannot_be_is_no_limit_so_that_nothing_is_written(
    number: str, odd: float
) -> None:
    control = Control()
    control.k0_mm = -0.02
    for k in range(200):
        said = control.scan(**told(0.0, k // 8), **{number: odd})
        assert not said["read_ok"]
        assert not said["put_request"]
    assert control.k0_mm == -0.02


def test_a_model_block_that_stops_has_its_offset_taken_back_and_one_that_is_off_has_not() -> None:
    for state, linked, left_mm in ((ACTIVE, True, 0.0), (HOLDING, False, 0.0), (OFF, True, 0.02)):
        control = Control()
        control.k0_mm = 0.02
        for k in range(80):
            said = control.scan(**told(-20.0, k // 8, state=state, linked=linked))
        assert not said["stopped"]
        for _ in range(800):
            said = control.scan(**told(-20.0, 10, state=state, linked=linked))
        assert said["stopped"]
        assert control.k0_mm == pytest.approx(left_mm, abs=1.1e-5)


def test_a_model_block_that_stops_is_told_after_three_cycles_and_zero_follows_32767() -> None:
    control = Control()
    for beat in (32766, 32767, 0, 1):
        for _ in range(round(2.5 * CYCLE_S / SCAN_S)):
            assert not control.scan(**told(0.0, beat))["stopped"]
    scans = 0
    while not control.scan(**told(0.0, 1))["stopped"]:
        scans += 1
    assert scans == round(0.5 * CYCLE_S / SCAN_S) + 1  # three cycles, and no longer
    assert not control.scan(**told(0.0, 2))["stopped"]


@pytest.mark.parametrize("job", ["", "get", "put"])
def test_a_start_forgets_jobs_and_what_was_read_whatever_was_retained(job: str) -> None:
    control = Control()
    control.get.ends.append(("error", 1))
    for k in range(80):
        control.scan(**told(-2.0 - 0.02 * k, k // 8))
    assert control.said["errors"] == 1
    if job:
        getattr(control, job).ends.append(("never", 2))
    for _ in range(80 if job else 30):
        said = control.scan(**told(-5.0, 11))
    assert said["stopped"]
    assert said[f"{job}_request"] if job else said["read_ok"]
    control.k0_mm = 0.0  # what a machine does that puts its offsets to zero
    control.get, control.put = Job(), Job()
    said = control.scan(**told(-5.0, 11), init=True)
    names = ("get_request", "put_request", "read_ok", "stopped", "slow", "errors")
    assert [said[name] for name in names] == [0.0] * 6
    said = control.scan(**told(-5.0, 11))
    assert (said["get_request"], said["put_request"]) == (1.0, 0.0)
    while not said["read_ok"]:
        said = control.scan(**told(-5.0, 11))
    assert said["read_um"] == 0.0


def test_nothing_is_written_after_a_start_before_the_model_block_has_been_called() -> None:
    control = Control()
    for k in range(8):
        control.scan(**told(-5.0, k, state=OFF))
    control.k0_mm = 0.02
    control.scan(**told(-5.0, 7), init=True)  # what was retained says Active and linked
    for _ in range(400):
        said = control.scan(**told(-5.0, 7))
    assert (control.k0_mm, said["stopped"]) == (0.02, 1.0)
    for k in range(400):
        control.scan(**told(-5.0, 8 + k // 8))
    assert control.k0_mm == pytest.approx(0.005, abs=1e-5)


@pytest.mark.parametrize("wrong_s", [-2147483.0, float("nan")])
def test_a_clock_that_begins_anew_or_is_none_makes_nothing_younger(wrong_s: float) -> None:
    control = Control()
    for k in range(80):
        control.scan(**told(-2.0, k // 8))
    control.get.ends.append(("never", 1))
    assert not control.scan(**told(-2.0, 9), elapsed_s=wrong_s)["stopped"]
    for _ in range(round(3.5 * CYCLE_S / SCAN_S)):
        said = control.scan(**told(-2.0, 9))
    assert (said["read_ok"], said["stopped"]) == (0.0, 1.0)


@pytest.mark.parametrize(("get", "put"), quick_first(1, [(1, 1), (2, 2), (8, 3), (3, 18), (30, 1)]))
def test_what_somebody_writes_is_read_and_goes_back_by_steps_at_every_moment_of_a_cycle(
    get: int, put: int
) -> None:
    scans, seen = 40, 0
    for moment in range(4 * scans, 5 * scans):
        control = Control(scan_s=CYCLE_S / scans)
        control.set_by_somebody(0.02)
        read_um: set[float] = set()
        for k in range(10 * scans):
            for job, after in ((control.get, get), (control.put, put)):
                job.ends.append(("good", after))
            if k == moment:
                control.set_by_somebody(0.0)
            said = control.scan(**told(-20.0 - 0.3 * (k // scans), k // scans))
            if k > moment:
                read_um.add(said["read_um"])
        assert said["slow"] == (get > scans / 2)
        if abs(control.offset_um) < 6.0 * STEP_UM:
            seen += 1
            assert 0.0 in read_um
    # Overwritten it is between GET and PUT alone; a GET that takes too long is followed by none.
    assert seen == (scans if get > scans / 2 else scans - get - put - 1)


@pytest.mark.parametrize("job", ["get", "put"])
def test_a_job_that_is_never_answered_and_one_that_takes_too_long_are_told(job: str) -> None:
    control = Control()
    for k in range(80):
        assert not control.scan(**told(-0.1 * k, k // 8))["slow"]
    stuck: Job = getattr(control, job)
    stuck.ends.append(("never", 2))
    said = [control.scan(**told(-8.0, 10 + k // 8))["slow"] for k in range(800)]
    assert said.index(1.0) <= 3 * 8
    assert said[-1]
    stuck.end, stuck.left = "good", 1
    said = [control.scan(**told(-8.0, 110 + k // 8))["slow"] for k in range(16)]
    assert not said[-1]


@pytest.mark.parametrize("seed", quick_first(2, range(6)))
def test_whatever_the_service_does_only_what_stood_there_counts_as_read(seed: int) -> None:
    rng = random.Random(seed)  # noqa: S311 - a test that can be repeated
    control = Control(double=seed % 2 == 0)
    correction_um, beat, state, linked, lost, read = 0.0, 0, OFF, True, 0, 0
    for k in range(6000):
        if k % 8 == 0:
            beat += rng.random() < 0.95
            state = rng.choice((OFF, ACTIVE, FADING)) if rng.random() < 0.02 else state
            linked = rng.random() < 0.9
            goal_um = rng.choice((-60.0, 0.0, 60.0))
            correction_um += max(-STEP_UM, min(STEP_UM, goal_um - correction_um))
            for job in (control.get, control.put):
                if rng.random() < 0.3 and not job.ends:
                    end = rng.choice(("good", "error", "nothing"))
                    if job is control.get and end == "nothing":
                        end = "good"  # a GET that is done has read
                    job.ends.append((end, rng.choice((1, 3, 10, 60))))
        if rng.random() < 0.002:
            control.set_by_somebody(control.k0_mm + rng.uniform(-0.02, 0.02))
        init = rng.random() < 0.001
        said = control.scan(**told(correction_um, beat, state=state, linked=linked), init=init)
        read, lost = read + bool(said["read_ok"]), lost + (not said["read_ok"])
    assert read > 1000
    assert lost > 100


# ---- with a model block -------------------------------------------------------------------------


class Machine:
    """A model block every second, the block of the control in every scan between."""

    def __init__(self) -> None:
        part = Part("s", "s", "", 2.0, (Section(1.0, 60.0),))
        compensation = bench.lathe(LIMITS, part, read_back_s=5.0 * CYCLE_S)
        settings = export_settings(compensation, cycle_s=CYCLE_S, name="axis")
        self.settings, self.control = settings, Control()
        self.block, self.warm_k = Compiled(Block(settings=settings)), 0.0
        self.cycle(enable=False)

    def cycle(self, **more: Any) -> Compiled:
        told_um = (self.control.said["read_um"],)
        answers = bool(self.control.said["read_ok"])
        inputs = quiet_inputs(self.settings, [20.0 + self.warm_k], told_um)
        inputs |= {"init": False, "read_ok": answers, "connected": answers}
        self.block.tell(inputs | more)
        self.scans()
        return self.block

    def scans(self) -> None:
        b = self.block
        for _ in range(8):
            self.control.scan(
                **told(b.correction_z_um, b.heartbeat, state=b.state, linked=b.linked)
            )

    def warm(self) -> None:
        """Warm up by 5 K until the correction is what the model asks for."""
        self.warm_k = 5.0
        for _ in range(600):
            self.cycle()
        assert self.block.settled
        assert self.control.offset_um == pytest.approx(-15.0, abs=0.05)


def test_a_warm_machine_has_minus_its_displacement_in_the_setting_data() -> None:
    machine = Machine()
    machine.warm()
    assert machine.control.k0_mm == pytest.approx(0.015, abs=5e-5)
    assert machine.block.read_z_um == pytest.approx(machine.block.correction_z_um, abs=0.05)


@pytest.mark.parametrize("job", quick_first(1, ["get", "put"]))
def test_a_service_that_never_answers_holds_then_fades_and_an_answer_at_last_goes_on(
    job: str,
) -> None:
    machine = Machine()
    machine.warm()
    stuck = getattr(machine.control, job)
    stuck.ends.append(("never", 2))
    machine.warm_k = 6.0
    states = [machine.cycle().state for _ in range(400)]
    assert states[-1] in {HOLDING, FADING}
    assert not machine.block.linked
    assert not machine.block.settled
    assert machine.control.offset_um == pytest.approx(-15.0, abs=1.0)
    stuck.end, stuck.left = "good", 1
    for _ in range(400):
        machine.cycle()
    assert machine.block.settled
    assert machine.control.offset_um == pytest.approx(-18.0, abs=0.1)


@pytest.mark.parametrize("end", quick_first(1, ["nothing", "error"]))
def test_jobs_that_write_nothing_are_a_fault_and_never_taken_for_written(end: str) -> None:
    machine = Machine()
    machine.warm()
    machine.control.put.ends.extend([(end, 2)] * 400)
    machine.warm_k = 12.0
    states = [machine.cycle().state for _ in range(300)]
    assert FAULT in states
    assert not machine.block.settled
    assert machine.control.offset_um == pytest.approx(-15.0, abs=0.05)


@pytest.mark.parametrize(
    ("job", "errors", "state"), quick_first(1, [("get", 5, HOLDING), ("put", 2, ACTIVE)])
)
def test_jobs_with_errors_are_counted_and_tried_again(job: str, errors: int, state: int) -> None:
    machine = Machine()
    machine.warm()
    getattr(machine.control, job).ends.extend([("error", 3)] * errors)
    machine.warm_k = 6.0
    states = [machine.cycle().state for _ in range(60)]
    assert machine.control.said["errors"] == errors
    assert state in states
    for _ in range(400):
        machine.cycle()
    assert machine.block.settled
    assert machine.control.offset_um == pytest.approx(-18.0, abs=0.1)


def test_an_offset_that_somebody_puts_to_zero_is_a_fault_and_does_not_come_back_at_once() -> None:
    machine = Machine()
    machine.warm()
    machine.warm_k = 6.0
    for _ in range(3):
        machine.cycle()
    machine.control.set_by_somebody(0.0)
    states: list[int] = []
    while FAULT not in states:
        states.append(machine.cycle().state)
        assert abs(machine.control.offset_um) <= STEP_UM * len(states)
    assert len(states) <= 8


def test_a_plc_that_starts_takes_over_what_stands_there_and_writes_nothing() -> None:
    machine = Machine()
    machine.control.k0_mm = 0.012
    for _ in range(20):
        machine.cycle(init=True, enable=False)
    assert machine.block.standing
    assert (machine.block.correction_z_um, machine.control.k0_mm) == (pytest.approx(-12.0), 0.012)


# ---- its text, and the guide ---------------------------------------------------------------------


def test_scl_of_both_classes_means_what_the_structured_text_means() -> None:
    for double, cpu in ((True, "s7-1500"), (False, "s7-1500"), (False, "s7-300")):
        st, scl = (sinumerik_library(double=double, cpu=x) for x in (None, cpu))
        assert st_as_c([scl], "x") == st_as_c([st], "x")
        for text in (st, scl):
            assert text.isascii()
            assert max(map(len, text.splitlines())) <= 100
            assert "NOT (" not in bare(text).replace("NOT (still", "")


@pytest.mark.parametrize("away", [True, False])
def test_the_guide_wires_every_input_of_the_block_with_the_numbers_of_the_export(
    away: bool,
) -> None:
    settings = export_settings(bench.lathe(LIMITS), cycle_s=4.0, name="axis", double=False)
    target = Target("sinumerik-tempcomp", "s7-300")
    facts = GuideFacts(target, ("x",), "v", away=(away,))
    text = guide_text(settings, Block(settings=settings), facts)
    call = text.partition('"offset_z_um"(')[2].partition(");")[0]
    wired = dict(one.split(" := ") for one in " ".join(call.split()).split(", "))
    assert tuple(sorted(wired)) == tuple(sorted(INPUTS))
    numbers = ("cycle_s", "um_per_mm", "total_um", "step_um")
    said = ["4.0", "-1000.0" if away else "1000.0", "40.0", "1.0"]
    assert [wired[name] for name in numbers] == said
    assert f"| {'away from' if away else 'towards'} the workpiece |" in text
    for word in ("SD43900", "MD32750", "MD32760", "DBX60.4", "**Not verified:**"):
        assert word in text
    assert "SD43910" not in text
