"""The probe's page beside the truth of a virtual lathe, and beside numbers worked out by hand."""

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.unit.runtime.history_records import BEGIN, cycle_record, url_of, write_history
from tests.unit.runtime.simulated import SimulatedHistorian
from tests.unit.screen.stand import client, lathe, parts
from thermaxis.compensation import (
    Compensation,
    Limits,
    Request,
    RequestKind,
    SensorRules,
    SupervisorRules,
    SupervisorState,
)
from thermaxis.files import read_model
from thermaxis.runtime import (
    Applied,
    AtStop,
    CompensationLoop,
    CycleRecord,
    LoopSettings,
    Ports,
    SourceSample,
    VirtualClock,
    probe_name,
    run_in_virtual_time,
)
from thermaxis.runtime.history import HistoryReader
from thermaxis.screen.pages import probe_page as _probe_page
from thermaxis.screen.pages.history import to_ms
from thermaxis.screen.pages.probe_page import by_cycle, by_minute, comparison
from thermaxis.virtual import LatheSettings, LatheSink, LatheSource, OffsetRules, VirtualLathe
from thermaxis.virtual.lathe import lathe_names

MODEL = Path(__file__).parents[3] / "examples/machine/models/lathe.json"
CYCLE_S = 10.0
HOURS = 6
NOISE = LatheSettings()


class Morning(NamedTuple):
    """A run of the compensated lathe: its history, and what was true."""

    url: str
    span: tuple[datetime, datetime]
    uncorrected_um: np.ndarray
    true_um: np.ndarray
    seen: np.ndarray
    arrived: np.ndarray


@pytest.fixture(scope="module")
def morning(tmp_path_factory: pytest.TempPathFactory) -> Morning:
    model = read_model(MODEL)
    slow = LatheSettings(offset=OffsetRules(watchdog_s=60.0))
    virtual = VirtualLathe("verification", seed=11, settings=slow)
    compensation = Compensation(
        model=model,
        sensors={
            c: SensorRules(lowest_c=5.0, highest_c=80.0, longest_age_s=60.0) for c in model.channels
        },
        limits={"Z_um": Limits(280.0, 0.5)},
        supervisor=SupervisorRules(
            settle_s=60.0, input_timeout_s=20.0, recovery_delay_s=10.0, read_back_s=60.0
        ),
        cycle_s=CYCLE_S,
    )
    historian = SimulatedHistorian()
    truth: list[tuple[float, float]] = []

    async def play() -> None:
        clock = VirtualClock()
        names = {**lathe_names(), probe_name("Z_um"): "Z_um"}
        loop = CompensationLoop(
            compensation,
            LoopSettings(
                machine="lathe", model_file="lathe.json", model_sha256="", at_stop=AtStop.LEAVE
            ),
            Ports(
                LatheSource(virtual, clock, names=names),
                LatheSink(virtual, clock),
                historian,
                clock,
            ),
        )
        loop.listeners.append(
            lambda _: truth.append((float(virtual.uncorrected_um[0]), float(virtual.true_um[0])))
        )
        running = asyncio.ensure_future(
            loop.run(asyncio.Event(), cycles=int(HOURS * 3600 / CYCLE_S))
        )
        answer = await loop.submit(Request(RequestKind.ENABLE, "test"))
        assert answer.accepted, answer.reason
        await running

    run_in_virtual_time(play())
    records = historian.records
    path = tmp_path_factory.mktemp("probe") / "h.db"
    write_history(path, records, outputs=("Z_um",))
    uncorrected, true = np.array(truth).T
    seen = np.array([record.samples[probe_name("Z_um")].good for record in records])
    arrived = np.cumsum([follows(record) for record in records]) > 0
    span = records[0].utc, records[-1].utc + timedelta(seconds=CYCLE_S)
    return Morning(url_of(path), span, uncorrected, true, seen, arrived)


def follows(record: CycleRecord) -> bool:
    """Return whether the offset is where it is wanted, within a micrometre."""
    effective_um, wanted_um = record.applied["Z_um"].effective_um, record.output.wanted_um[0]
    active = record.output.state is SupervisorState.ACTIVE
    return active and effective_um is not None and abs(effective_um - wanted_um) <= 1.0


def test_the_uncompensated_displacement_is_the_truth_within_the_probes_noise(
    morning: Morning,
) -> None:
    with HistoryReader(morning.url) as reader:
        found = by_cycle(reader, "Z_um", morning.span)
    assert np.array_equal(np.isfinite(found.compensated_um), morning.seen)
    there = np.isfinite(found.uncompensated_um)
    assert there.sum() > 500
    error_um = (found.uncompensated_um - morning.uncorrected_um)[there]
    noise_um = NOISE.displacement_noise_um
    assert np.ptp(morning.uncorrected_um) > 40.0
    assert abs(error_um.mean()) < 0.1
    assert error_um.std() < 1.1 * np.hypot(noise_um, NOISE.displacement_count_um / np.sqrt(12.0))
    assert np.abs(error_um).max() < 6.0 * noise_um
    measured_error_um = (found.compensated_um - morning.true_um)[there]
    assert np.abs(measured_error_um).max() < 6.0 * noise_um


def test_the_figures_are_those_of_the_truth_and_say_of_how_many_values(morning: Morning) -> None:
    with HistoryReader(morning.url) as reader:
        found = comparison(reader, "Z_um", morning.span, CYCLE_S, 500)
    figures = found["figures"]
    there = morning.seen & morning.arrived
    assert 0.9 * morning.seen.sum() < figures["values"] == there.sum()
    truth = np.ptp(morning.uncorrected_um[there]), np.ptp(morning.true_um[there])
    assert figures["uncompensated_um"] == pytest.approx(
        truth[0], abs=8.0 * NOISE.displacement_noise_um
    )
    assert figures["compensated_um"] == pytest.approx(
        truth[1], abs=8.0 * NOISE.displacement_noise_um
    )
    assert figures["ratio"] == pytest.approx(
        figures["compensated_um"] / figures["uncompensated_um"], rel=1e-5
    )
    assert figures["ratio"] < 0.4
    assert found["means_s"] == 0.0


def test_while_the_table_turns_there_is_a_gap(morning: Morning) -> None:
    with HistoryReader(morning.url) as reader:
        found = comparison(reader, "Z_um", morning.span, CYCLE_S, 4000)
    line = found["series"]["compensated"]
    gaps = sum(value is None for value in line["mean"])
    stretches = int((np.diff(np.concatenate([[0], morning.seen.astype(int)])) == 1).sum())
    assert stretches > 1
    assert gaps == stretches - 1
    model = found["series"]["model"]
    assert model["mean"].count(None) == 0
    assert len(model["t"]) > len(line["t"])


def test_long_spans_are_compared_by_minutes_with_nearly_the_same_figures(
    morning: Morning, monkeypatch: pytest.MonkeyPatch
) -> None:
    with HistoryReader(morning.url) as reader:
        each = comparison(reader, "Z_um", morning.span, CYCLE_S, 4000)
        monkeypatch.setattr(_probe_page, "MOST_CYCLES", 100)
        means = comparison(reader, "Z_um", morning.span, CYCLE_S, 60 * HOURS)
    assert means["means_s"] == 60.0
    for key in ("compensated_um", "uncompensated_um"):
        assert means["figures"][key] == pytest.approx(each["figures"][key], abs=4.0)
        assert means["figures"][key] <= each["figures"][key] + 1.0
    assert 0 < means["figures"]["values"] < each["figures"]["values"]
    first = means["series"]["uncompensated"]
    assert first["t"][0] >= to_ms(morning.span[0])


# ---- by hand ------------------------------------------------------------------------------------


def measured(
    number: int,
    probe_um: float | None,
    accepted_um: float | None,
    effective_um: float | None,
    *,
    wanted_um: float = -9.5,
    state: SupervisorState = SupervisorState.ACTIVE,
) -> CycleRecord:
    record = cycle_record(number, state=state)
    output = record.output._replace(wanted_um=(wanted_um, *record.output.wanted_um[1:]))
    samples: dict[str, SourceSample] = dict(record.samples)
    if probe_um is not None:
        samples["probe.Z_um"] = SourceSample(probe_um, True)
    applied = {"Z_um": Applied(0.0, accepted_um, effective_um)}
    return replace(record, samples=samples, applied=applied, output=output)


def compare_by_hand(path: Path, records: Sequence[CycleRecord]) -> dict[str, Any]:
    write_history(path, records)
    with HistoryReader(url_of(path)) as reader:
        return comparison(reader, "Z_um", (BEGIN, BEGIN + timedelta(minutes=1)), 1.0, 1000)


def test_the_accepted_offset_stands_in_where_the_effective_one_is_not_known(
    tmp_path: Path,
) -> None:
    found = compare_by_hand(
        tmp_path / "h.db",
        [
            measured(0, 1.0, -9.0, -8.0, wanted_um=-8.0),
            measured(1, 2.0, -10.0, None),
            measured(2, 4.0, None, None),
            measured(3, None, -10.0, -10.0),
        ],
    )
    assert found["series"]["compensated"]["mean"] == [1.0, 2.0, 4.0]
    assert found["series"]["uncompensated"]["mean"] == [9.0, 12.0]
    figures = found["figures"]
    assert (figures["values"], figures["compensated_um"], figures["uncompensated_um"]) == (2, 1, 3)
    assert figures["ratio"] == pytest.approx(1.0 / 3.0, rel=1e-6)
    assert (figures["first"], figures["last"]) == (to_ms(BEGIN), to_ms(BEGIN) + 1000)


def test_how_the_correction_came_to_where_it_was_wanted_is_no_movement_of_the_machine(
    tmp_path: Path,
) -> None:
    before = [measured(k, 40.0, 0.0, 0.0, state=SupervisorState.OFF) for k in range(3)]
    approach = [
        measured(k, 70.0 - 10.0 * k, 0.0, 30.0 - 10.0 * k, wanted_um=-40.0) for k in range(3, 7)
    ]
    follows = [measured(k, 1.0, 0.0, -40.0 - k, wanted_um=-40.2 - k) for k in range(7, 12)]
    held = [measured(12, 30.0, 0.0, -45.0, state=SupervisorState.HOLDING)]
    again = [measured(k, 9.0, 0.0, -60.0 + k, wanted_um=-90.0) for k in range(13, 16)]
    found = compare_by_hand(tmp_path / "h.db", [*before, *approach, *follows, *held, *again])
    figures = found["figures"]
    assert (figures["values"], figures["compensated_um"], figures["uncompensated_um"]) == (5, 0, 4)
    assert figures["last"] - figures["first"] == 4000
    assert len(found["series"]["compensated"]["mean"]) == 16  # what is drawn is all of it


def test_without_a_single_value_there_are_no_figures(tmp_path: Path) -> None:
    found = compare_by_hand(tmp_path / "h.db", [measured(k, None, 0.0, 0.0) for k in range(3)])
    assert found["series"]["compensated"]["t"] == []
    figures = found["figures"]
    assert figures["values"] == 0
    assert figures["ratio"] is figures["compensated_um"] is figures["first"] is None


def test_a_touch_that_was_not_believed_says_nothing_of_the_correction(tmp_path: Path) -> None:
    records: list[CycleRecord] = []
    for number, (um, told) in enumerate(
        [(1.0, "believed"), (2.0, "confirmed"), (55.0, "excluded"), (3.0, None)]
    ):
        one = measured(number, um, -10.0, -10.0, wanted_um=-10.0)
        output = one.output._replace(offset_um=(0.0, 0.0), offset_std_um=(1.0, 1.0))
        records.append(replace(one, output=output, touched={"Z_um": told} if told else {}))
    figures = compare_by_hand(tmp_path / "h.db", records)["figures"]
    assert (figures["values"], figures["compensated_um"]) == (3, 2.0)


def test_a_history_before_the_probe_is_no_error_in_either_way(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    records = [measured(k, None, None, None) for k in range(200)]
    write_history(path, records)
    span = BEGIN, BEGIN + timedelta(hours=1)
    with HistoryReader(url_of(path)) as reader:
        found, step_us = by_minute(reader, "Z_um", span, 10)
        nothing = by_cycle(reader, "Z_um", (BEGIN - timedelta(days=2), BEGIN - timedelta(days=1)))
    assert np.isnan(found.compensated_um).all()
    assert np.isfinite(found.model_um).all()
    assert step_us == 360_000_000
    assert nothing.time_us.size == 0


def test_a_compensation_without_any_drift_has_no_ratio(tmp_path: Path) -> None:
    still = [measured(k, 1.0, 0.0, 0.0, wanted_um=0.0) for k in range(5)]
    found = compare_by_hand(tmp_path / "h.db", still)
    assert found["figures"]["uncompensated_um"] == 0.0
    assert found["figures"]["ratio"] is None


def test_the_probes_of_a_page_are_named_as_everywhere_and_asked_for_by_their_own_name() -> None:
    page = client(parts(lathe()), _probe_page.routes).get("/probe").text
    assert '<option value="Z_um">Z</option>' in page
