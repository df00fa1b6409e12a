"""Probes beside the inputs: they are read and recorded, and nothing follows from them."""

import asyncio
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import copytree

import numpy as np
import polars as pl
import pytest
from asyncua import ua
from hypothesis import example, given, settings, strategies as st

from tests.opcua_server import NAMESPACE, Cable, Machine, until
from tests.proofs import quick_first
from tests.unit.runtime.machine_files import machine_file
from tests.unit.runtime.simulated import Rig, SimulatedMachine, SimulatedSource, ask
from thermaxis.cli import main
from thermaxis.cli.machine._machine_parts import build_parts, nodes_read, probes_read
from thermaxis.cli.machine._machine_words import describe_machine
from thermaxis.codes import Message
from thermaxis.compensation import RequestKind, SupervisorState
from thermaxis.files import read_thermal_log
from thermaxis.report.tables import as_text
from thermaxis.runtime import (
    NOT_READ,
    START_S,
    CompensationLoop,
    ConnectionSettings,
    Finding,
    Level,
    MachineConfiguration,
    NodeDescription,
    OpcUaSession,
    ProbeSettings,
    RuntimeStatus,
    Source,
    SourceSample,
    SystemClock,
    VirtualClock,
    examine_machine,
    probe_name,
    read_machine,
    run_in_virtual_time,
    self_test,
)
from thermaxis.runtime.checks._nodes import judge_probe
from thermaxis.runtime.history import HistoryReader, input_column
from thermaxis.runtime.sinks import DrySink
from thermaxis.runtime.sources import NodeSettings, OpcUaSource, ProbedSource

PROBE = probe_name("Z_um")
TICK_S = 2.0**-10
"""Delays are whole ticks, so that virtual time adds up to the same bit by any way. [s]"""
TABLE = '[probe.Z_um]\nnode = "ns=2;s=Probe"\nunit = "mm"\n'


class Probes(Source):
    """Probes that answer, late, wrongly, never or with an error."""

    def __init__(self, sample: SourceSample = NOT_READ, late_s: float = 0.0) -> None:
        self.sample, self.late_s = sample, late_s
        self.fails = False
        self.asked = self.answered = 0
        self.there = True
        self.opened = 0

    async def open(self) -> None:
        self.opened += 1

    @property
    def connected(self) -> bool:
        return self.there

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        self.asked += 1
        await asyncio.sleep(self.late_s)
        if self.fails:
            raise RuntimeError("the probe's driver fell over")
        self.answered += 1
        return {PROBE: self.sample}

    async def close(self) -> None:
        self.opened -= 1


# ---- two runs, one with and one without ---------------------------------------------------------


@dataclass
class Run:
    """What a run of the loop did."""

    written: list[dict[str, float]]
    cycles: list[tuple[object, ...]]
    events: list[tuple[object, ...]]
    told: list[tuple[object, ...]]
    seen: list[SourceSample | None]


def told_of(status: RuntimeStatus) -> tuple[object, ...]:
    """Return everything that a status says besides what was read."""
    return tuple(getattr(status, name) for name in RuntimeStatus.__slots__ if name != "samples")


def eventful(
    wrap: Callable[[SimulatedMachine, VirtualClock], Source] | None = None,
    before: Callable[[SimulatedMachine], None] = lambda _: None,
) -> Run:
    """Run the loop through a day of trouble in some minutes."""
    bench = Rig()
    machine, clock = bench.machine, bench.clock
    before(machine)
    told: list[tuple[object, ...]] = []

    async def script(_: Rig, loop: CompensationLoop) -> None:
        async def at(second: int) -> None:
            """Wait until between two cycles, so that no two things happen at one time."""
            await clock.sleep_until(START_S + second + 0.5)

        loop.listeners.append(lambda status: told.append(told_of(status)))
        await ask(loop, RequestKind.ENABLE)
        await at(60)
        await ask(loop, RequestKind.TRIM, output="Z_um", value=2.0, duration_s=30.0)
        machine.values["s"] = 24.0
        await at(100)
        await ask(loop, RequestKind.HOLD)
        await at(105)
        await ask(loop, RequestKind.RESUME)
        await at(110)
        machine.lose()
        await at(134)
        machine.come_back(offset_um=0.0)
        await at(154)
        machine.values["c"] = 95.0  # not plausible
        await at(164)
        machine.values["c"] = 20.0
        machine.values["interlock.referenced"] = 0.0
        await at(174)
        machine.values["interlock.referenced"] = 1.0
        await at(204)
        machine.obeys = False
        machine.set_offset(Z_um=11.0)
        await at(234)

    bench.play(script, None if wrap is None else wrap(machine, clock))
    return Run(
        machine.written,
        [
            (r.number, r.utc, r.monotonic_s, r.output, r.applied, r.lateness_s)
            for r in bench.historian.records
        ],
        [(e.utc, e.kind, e.who, e.text, dict(e.details)) for e in bench.historian.events],
        told,
        [r.samples.get(PROBE) for r in bench.historian.records],
    )


@pytest.fixture(scope="module")
def without() -> Run:
    return eventful()


def same(found: Run, without: Run) -> bool:
    """Whether everything is the same to the last bit, besides the probe's own samples."""
    return (
        repr(found.written) == repr(without.written)
        and found.cycles == without.cycles
        and found.events == without.events
        and found.told == without.told
    )


def test_the_day_of_trouble_has_states_alarms_and_a_fault(without: Run) -> None:
    states = {cycle[3].state for cycle in without.cycles}
    assert states >= {
        SupervisorState.WARMING,
        SupervisorState.ACTIVE,
        SupervisorState.HOLDING,
        SupervisorState.FADING,
        SupervisorState.FAULT,
    }
    assert {kind for _, kind, *_ in without.events} >= {"state", "alarm", "request", "connection"}
    assert any(told for told in without.told)
    assert set(without.seen) == {None}


def good(value: float | None) -> SourceSample:
    return SourceSample(value, good=True)


def probed(probes: Probes) -> Callable[[SimulatedMachine, VirtualClock], Source]:
    """Return what puts probes beside the source of a machine."""
    return lambda machine, clock: ProbedSource(SimulatedSource(machine), probes, [PROBE], clock)


class Whole(SimulatedSource):
    """One source that reads inputs and a probe together, as the virtual lathe's does."""

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        return {**await super().read(deadline_s), PROBE: good(math.nan)}


def test_a_source_that_reads_its_probe_itself_changes_not_one_bit_either(without: Run) -> None:
    found = eventful(lambda machine, _: Whole(machine))
    assert same(found, without)
    assert None not in found.seen


@pytest.mark.parametrize("late_s", quick_first(1, [0.375, 1.0, 2.0**30]))
def test_however_late_a_probe_answers_no_cycle_is_late(without: Run, late_s: float) -> None:
    probes = Probes(good(4.0), late_s)
    found = eventful(probed(probes))
    assert same(found, without)
    assert probes.asked - probes.answered <= 1
    assert probes.opened == 0
    ages = [one.age_s for one in found.seen if one is not None and one.value is not None]
    assert all(age is not None and 0.0 <= age <= 1.0 + 1e-9 for age in ages)
    if late_s < 1.0:
        assert len(ages) > 100
    if late_s > 1e3:
        assert ages == []


def test_a_probe_whose_driver_falls_over_costs_its_own_value_alone(without: Run) -> None:
    probes = Probes(good(4.0))
    probes.fails = True
    found = eventful(probed(probes))
    assert same(found, without)
    assert set(found.seen) == {NOT_READ}
    assert probes.asked > 100


@pytest.mark.proof
@settings(max_examples=2, deadline=None)
@given(
    value=st.one_of(st.none(), st.floats()),
    is_good=st.booleans(),
    status=st.text(max_size=12),
    age_s=st.one_of(st.none(), st.floats(0.0, 1e12)),
    late_s=st.integers(0, 3072).map(lambda ticks: ticks * TICK_S),
)
@example(value=12.5, is_good=True, status="Good", age_s=0.0, late_s=0.0)
@example(value=math.nan, is_good=True, status="Good", age_s=None, late_s=0.0)
@example(value=None, is_good=False, status="BadNoCommunication", age_s=None, late_s=0.0)
def test_no_sample_and_no_delay_of_a_probe_is_seen_in_a_correction(
    without: Run,
    value: float | None,
    is_good: bool,
    status: str,
    age_s: float | None,
    late_s: float,
) -> None:
    probes = Probes(SourceSample(value, is_good, status, age_s), late_s)
    found = eventful(probed(probes))
    assert same(found, without)
    assert None not in found.seen


def test_a_probe_could_be_seen_if_something_followed_from_it(without: Run) -> None:
    """The comparison itself: a change of an input by a thousandth of a kelvin is found."""
    found = eventful(before=lambda machine: machine.values.update(s=23.001))
    assert not same(found, without)


# ---- what is shown ------------------------------------------------------------------------------


def read_times(probes: Probes, times: int, *, every_s: float = 1.0) -> list[SourceSample]:
    machine = SimulatedMachine({"s": 23.0}, ("Z_um",))

    async def play() -> list[SourceSample]:
        source = ProbedSource(SimulatedSource(machine), probes, [PROBE], VirtualClock())
        await source.open()
        found: list[SourceSample] = []
        for number in range(times):
            probes.sample = probes.sample._replace(value=float(number))
            samples = await source.read(0.5)
            assert list(samples) == ["s", PROBE]
            assert samples["s"] == SourceSample(23.0, good=True)
            found.append(samples[PROBE])
            await asyncio.sleep(every_s)
        await source.close()
        assert asyncio.all_tasks() == {asyncio.current_task()}
        return found

    return run_in_virtual_time(play())


def test_what_is_shown_is_the_answer_of_the_cycle_before_with_its_true_age() -> None:
    found = read_times(Probes(good(0.0), late_s=0.25), 5)
    assert found[0] == NOT_READ
    assert [one.value for one in found[1:]] == [0.0, 1.0, 2.0, 3.0]
    # each came a quarter of a second after its cycle's begin, stamped at that moment
    assert [one.age_s for one in found[1:]] == [0.75] * 4


def test_a_question_without_an_answer_leaves_no_value_and_is_not_asked_again_meanwhile() -> None:
    probes = Probes(good(0.0), late_s=2.5)
    found = read_times(probes, 7)
    assert probes.asked == 3
    assert [one.value for one in found] == [None, None, None, 2.0, None, None, 5.0]


def test_the_probe_is_lost_with_the_inputs() -> None:
    machine = SimulatedMachine({"s": 23.0}, ("Z_um",))

    async def play() -> None:
        probes = Probes(good(5.0))
        source = ProbedSource(SimulatedSource(machine), probes, [PROBE], VirtualClock())
        await source.open()
        for lost in (False, False, True, False):
            machine.there = not lost
            samples = await source.read(0.5)
            await asyncio.sleep(1.0)
            assert source.connected is not lost
        assert samples[PROBE].value == 5.0
        machine.there = False
        assert (await source.read(0.5))[PROBE] == NOT_READ
        machine.there, probes.there = True, False
        await source.read(0.5)
        assert source.connected
        assert not source.ended
        await source.close()

    run_in_virtual_time(play())


def test_a_probe_never_stands_for_an_input_of_the_same_name() -> None:
    machine = SimulatedMachine({PROBE: 1.0}, ("Z_um",))

    async def play() -> Mapping[str, SourceSample]:
        source = ProbedSource(
            SimulatedSource(machine), Probes(good(5.0)), ["other"], VirtualClock()
        )
        await source.read(0.5)
        found = await source.read(0.5)
        await source.close()
        return found

    assert run_in_virtual_time(play()) == {PROBE: good(1.0), "other": NOT_READ}


# ---- the table ----------------------------------------------------------------------------------


def configured(folder: Path, table: str = TABLE, *changes: tuple[str, str]) -> Path:
    (folder / "history").mkdir(exist_ok=True)
    path = machine_file(folder, *changes)
    text = path.read_text(encoding="utf-8")
    path.write_text(f"{text}\n{table}", encoding="utf-8")
    return path


def test_a_probe_is_read_in_micrometres_away_from_the_workpiece(tmp_path: Path) -> None:
    for unit, scale, raw, expected_um in (
        *(("um", 1.0, -3.5, -3.5), ("mm", 1.0, 0.0125, 12.5), ("inch", 1.0, 1e-3, 25.4)),
        *(("mm", -1.0, 0.002, -2.0), ("um", -0.01, -1250, 12.5)),
    ):
        table = TABLE.replace('"mm"', f'"{unit}"') + f"scale = {scale!r}\n"
        found = read_machine(configured(tmp_path, table))
        assert found.probes == {"Z_um": ProbeSettings("ns=2;s=Probe", unit, scale)}
        ((name, node),) = probes_read(found).items()
        assert (name, node.node, node.unit) == ("probe.Z_um", "ns=2;s=Probe", "um")
        assert raw * node.scale == pytest.approx(expected_um, rel=1e-12)
        assert PROBE not in nodes_read(found)


def test_what_cannot_be_a_probe_is_said(tmp_path: Path) -> None:
    for table, key, code in (
        (TABLE.replace("Z_um", "Y_um"), "probe.Y_um", "not_of_model"),
        (TABLE.replace("s=Probe", "s=T_spindle"), "probe.Z_um.node", "node_twice"),
        (TABLE.replace("s=Probe", "s=Z_offset"), "probe.Z_um.node", "node_twice"),
        (TABLE.replace("ns=2;s=Probe", "Probe"), "probe.Z_um.node", "no_node_id"),
        (TABLE.replace('"mm"', '"degC"'), "probe.Z_um.unit", "value_unknown"),
        (f"{TABLE}scale = 0.0\n", "probe.Z_um.scale", "scale_zero"),
        ('[probe.Z_um]\nunit = "mm"\n', "probe.Z_um", "key_needed_here"),
    ):
        found = examine_machine(configured(tmp_path, table))
        assert not isinstance(found, MachineConfiguration), table
        assert [(one.place.key, one.code) for one in found] == [(key, f"error-{code}")]


def test_an_input_may_not_have_the_name_of_a_probe(tmp_path: Path) -> None:
    extra = '[input."probe.Z_um"]\nnode = "ns=2;s=X"\nunit = "degC"\nlowest_c = 1\nhighest_c = 9\n'
    found = examine_machine(configured(tmp_path, TABLE + extra))
    assert not isinstance(found, MachineConfiguration)
    assert [p.code for p in found] == ["error-reserved_name"]


def test_a_replay_has_no_probe_and_says_so(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time_s,T_spindle_C,T_column_C\n0,20,20\n1,20,20\n")
    replay = (
        '[source]\nkind = "opcua"\nconnection = "control"',
        '[source]\nkind = "replay"\nlog = "log.csv"',
    )
    dry = ('[sink]\nkind = "opcua"', '[sink]\nkind = "dry"')
    found = read_machine(configured(tmp_path, TABLE, replay, dry))
    assert found.probes == {}
    assert build_parts(found, SystemClock()).probes is None
    words = " ".join(as_text(describe_machine(found)).split())
    assert "probes but for touches, and the diameter are not read" in words


def test_what_a_probe_is_for_is_said_in_words(tmp_path: Path) -> None:
    words = " ".join(as_text(describe_machine(read_machine(configured(tmp_path)))).split())
    assert "Z_um is measured by ns=2;s=Probe, in mm: that is recorded and shown, and" in words
    assert "is measured by" not in as_text(describe_machine(read_machine(machine_file(tmp_path))))


def test_the_probe_has_a_connection_of_its_own_to_the_same_server(tmp_path: Path) -> None:
    parts = build_parts(read_machine(configured(tmp_path)), SystemClock())
    assert isinstance(parts.ports.source, ProbedSource)
    assert parts.probes is not None
    assert parts.ports.source.source.session is parts.sessions["control"]
    assert parts.ports.source.probes.session is parts.probes
    assert parts.probes is not parts.sessions["control"]
    ours, theirs = parts.probes.settings, parts.sessions["control"].settings
    assert replace(ours, name=theirs.name) == theirs
    assert list(parts.sessions) == ["control"]


# ---- the self-test ------------------------------------------------------------------------------


def described(
    value: float | None = 0.0125, *, exists: bool = True, data_type: str = "Double"
) -> NodeDescription:
    return NodeDescription("ns=2;s=Probe", exists, "Good", data_type, True, False, value, 0.5)


class Asked:
    """A connection that says of every node what it is told to say."""

    def __init__(self, *answers: NodeDescription | None, connected: bool = True) -> None:
        self.answers = list(answers)
        self.connected = connected
        self.failure = None if connected else Message("error-connection_closed")
        self.clock_difference_s: float | None = 0.0
        self.nodes: list[str] = []

    async def describe(self, node: str, deadline_s: float) -> NodeDescription | None:
        self.nodes.append(node)
        return self.answers.pop(0) if self.answers else None

    async def write(self, values: object, deadline_s: float) -> list[str] | None:
        raise AssertionError(values)


def of_probes(folder: Path, control: Asked, probes: Asked | None) -> list[Finding]:
    configuration = read_machine(configured(folder))
    sink = DrySink(("Z_um",))
    found = asyncio.run(self_test(configuration, {"control": control}, sink, probes))
    return [finding for finding in found if finding.message.place.key.startswith("probe")]


def test_nothing_that_is_wrong_with_a_probe_forbids_a_correction(tmp_path: Path) -> None:
    for probes, said in (
        (Asked(described(0.0125)), "probe_age"),
        (Asked(described(None)), "probe_no_value"),
        (Asked(described(math.nan)), "probe_no_value"),
        (Asked(described(exists=False)), "probe_unusable"),
        (Asked(described(data_type="String")), "probe_unusable"),
        (Asked(None), "probe_not_asked"),
        (Asked(connected=False), "probe_not_asked"),
        (None, "probe_not_asked"),
    ):
        (finding,) = of_probes(tmp_path, Asked(*[described()] * 7), probes)
        assert finding.message.code == f"self_test-{said}"
        assert finding.level is (Level.OK if said == "probe_age" else Level.WARNING), said


def test_of_a_machine_that_is_not_there_nothing_is_said_about_its_probe(tmp_path: Path) -> None:
    assert of_probes(tmp_path, Asked(connected=False), Asked(connected=False)) == []


@given(
    st.builds(
        NodeDescription,
        node=st.just("i=1"),
        exists=st.booleans(),
        status=st.text(max_size=9),
        data_type=st.sampled_from(["Double", "Float", "Int16", "Boolean", "String", ""]),
        readable=st.booleans(),
        writable=st.booleans(),
        value=st.one_of(st.none(), st.booleans(), st.floats()),
        age_s=st.one_of(st.none(), st.floats(0.0, 1e9)),
    ),
    st.sampled_from(["um", "mm", "inch"]),
)
def test_no_node_at_all_makes_a_probe_an_error(node: NodeDescription, unit) -> None:
    assert judge_probe("[probe.Z_um]", node, ProbeSettings("i=1", unit)).level is not Level.ERROR


# ---- a real connection --------------------------------------------------------------------------


LONGEST_S = 10.0
"""Time that a silent server could cost a read, were it waited for. Real time is the subject here;
a read in half of it has waited for nothing, however loaded the computer is. [s]"""


def source_of(machine: Machine, cable: Cable, timeout_s: float = LONGEST_S) -> ProbedSource:
    """Return inputs by a straight connection, and a probe by the cable."""
    clock = SystemClock()
    straight = f"opc.tcp://127.0.0.1:{machine.port}/machine"

    def session(name: str, url: str) -> OpcUaSession:
        settings = ConnectionSettings(
            name=name, url=url, security="none", timeout_s=timeout_s, retry_s=0.02
        )
        return OpcUaSession(settings, clock)

    def node(name: str, unit: str, scale: float = 1.0) -> NodeSettings:
        return NodeSettings(node=f"nsu={NAMESPACE};s={name}", unit=unit, scale=scale)

    inputs = OpcUaSource(session("inputs", straight), {"T1": node("T1", "degC")})
    probes = OpcUaSource(session("probes", cable.url), {PROBE: node("Probe", "um", 1e3)})
    return ProbedSource(inputs, probes, [PROBE], clock)


async def seen(source: ProbedSource, *, wanted: float | None) -> SourceSample:
    """Read, as a loop does, until the probe has a value or has none any more."""
    for _ in range(1000):
        samples = await source.read(LONGEST_S)
        assert samples["T1"].good
        assert samples["T1"].value == 20.5
        if samples[PROBE].value == wanted:
            return samples[PROBE]
        await asyncio.sleep(0.02)
    raise AssertionError(samples[PROBE])


def test_a_server_that_falls_silent_to_the_probe_still_tells_the_inputs_in_time(
    runner: asyncio.Runner, machine: Machine
) -> None:
    async def life() -> None:
        cable = Cable()
        cable.plug(machine)
        await cable.mend()
        source = source_of(machine, cable)
        await source.open()
        await until(lambda: source.source.session.connected)
        clock = SystemClock()
        put_s = clock.monotonic_s()
        machine.put("Probe", 0.0125)
        first = await seen(source, wanted=12.5)
        assert first.good
        assert first.age_s is not None
        assert 0.0 <= first.age_s <= clock.monotonic_s() - put_s + 0.1  # two clocks
        generation = source.source.session.generation

        cable.stop()  # what is asked is taken, and never answered
        slowest_s = 0.0
        for _ in range(10):
            began_s = clock.monotonic_s()
            samples = await source.read(LONGEST_S)
            slowest_s = max(slowest_s, clock.monotonic_s() - began_s)
            assert samples["T1"].good
            await asyncio.sleep(0.02)
        assert samples[PROBE] == NOT_READ
        assert slowest_s < LONGEST_S / 2.0
        assert source.source.session.generation == generation

        await cable.cut()
        await seen(source, wanted=None)
        await cable.mend()
        machine.put("Probe", -0.003)
        assert (await seen(source, wanted=-3.0)).good
        machine.put("Probe", "broken", kind=ua.VariantType.String)
        assert (await seen(source, wanted=None)).status == "BadTypeMismatch"
        machine.put("Probe", 0.0, status=ua.StatusCodes.BadSensorFailure)
        assert (await seen(source, wanted=None)).value is None
        assert source.source.session.generation == generation
        await source.close()
        await cable.cut()
        machine.reset()

    runner.run(life())


# ---- the virtual lathe --------------------------------------------------------------------------


def test_a_rehearsal_records_the_probe_as_a_series_in_micrometres(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = Path(copytree(root / "examples" / "machine", tmp_path / "machine")) / "lathe.toml"
    assert PROBE in {probe_name(name) for name in read_machine(path).probes}
    column = input_column(PROBE)
    history, truth = tmp_path / "h.db", tmp_path / "truth.csv"
    words = ["rehearse", str(path), "--hours", "0.1", "--history", str(history), "-o", str(truth)]
    assert main(words) == 0
    capsys.readouterr()

    with HistoryReader(f"sqlite:///{history}") as reader:
        assert column in reader.series()
        span = reader.span()
        assert span is not None
        trend = reader.trend([column], *span, points=50)[column]
    true_um = pl.read_csv(truth)["Z_true_um"].to_numpy()
    seen_um = np.array(trend.mean)
    assert seen_um.size > 10
    noise_um = 0.3 * 6.0 + 0.1
    assert np.all(seen_um >= true_um.min() - noise_um)
    assert np.all(seen_um <= true_um.max() + noise_um)

    log = tmp_path / "log.csv"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("lathe.history.db", str(history)), encoding="utf-8")
    assert main(["history", "export", str(path), "-o", str(log)]) == 0
    capsys.readouterr()
    back = read_thermal_log(log)
    exported_um = back.column(column, unit="um")
    good = ~np.isnan(exported_um)
    assert good.sum() > 300
    assert np.abs(exported_um[good] - true_um[: good.size][good]).max() < noise_um
