"""What every engine must hold, and nights that are done by it: the serial one, and Dask's."""

import json
import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from pathlib import Path

import pytest
from dask import config
from distributed import Security

from tests.unit.fleet.fleet_machines import GAIN, LAST, Truth, machine_of, shipped
from thermaxis.errors import DataError
from thermaxis.fleet import (
    TRIES,
    Engine,
    NightJob,
    NightOutcome,
    Registry,
    dask_engine,
    do_nights,
    night_as_json,
    results_of,
    serial_engine,
    work,
)


@pytest.fixture(scope="module")
def dask_of_two() -> Iterator[Engine]:
    with dask_engine(workers=2) as engine:
        yield engine


@pytest.fixture(params=["serial", pytest.param("dask", marks=pytest.mark.proof)])
def engine(request: pytest.FixtureRequest) -> Iterator[Engine]:
    if request.param == "dask":
        yield request.getfixturevalue("dask_of_two")
        return
    with serial_engine() as one:
        yield one


def doubled(job: int) -> int:
    return 2 * job


def counted(job: tuple[Path, int]) -> int:
    """Count the tries in a file; fail as often as is asked for."""
    path, failures = job
    with path.open("a", encoding="ascii") as stream:
        stream.write("x")
    tries = len(path.read_text("ascii"))
    if tries <= failures:
        raise ArithmeticError(f"poison {tries}")
    return tries


def test_every_job_has_its_result_and_never_more_than_a_window_is_begun(engine):
    begun: list[int] = []
    done: list[int] = []

    def jobs() -> Iterator[int]:
        for k in range(40):
            begun.append(k)
            assert len(begun) - len(done) <= engine.window
            yield k

    for job, result in results_of(engine, doubled, jobs()):
        assert result == 2 * job
        done.append(job)
    assert sorted(done) == list(range(40))


def test_a_job_that_fails_is_tried_again_and_set_aside_with_its_error(engine, tmp_path):
    jobs = [(tmp_path / str(failures), failures) for failures in (0, 1, 5)]
    found = dict(results_of(engine, counted, jobs))
    assert [found[job] for job in jobs[:2]] == [1, 2]
    assert isinstance(found[jobs[2]], ArithmeticError)
    assert "poison 2" in str(found[jobs[2]])
    assert len((tmp_path / "5").read_text("ascii")) == TRIES == 2


def test_who_goes_away_leaves_nothing_running(engine):
    found = results_of(engine, doubled, range(1000))
    next(found)
    found.close()
    assert dict(results_of(engine, doubled, [7])) == {7: 14}


def deadly(job: tuple[Path, str]) -> str:
    """End the worker as a lack of memory does, or not."""
    folder, name = job
    with (folder / name).open("a", encoding="ascii") as stream:
        stream.write("x")
    if name == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    return name


@pytest.mark.proof
def test_a_job_that_ends_its_worker_is_set_aside_and_costs_no_other_job(dask_of_two, tmp_path):
    names = ["deadly", *(f"job {k}" for k in range(8))]
    found = dict(results_of(dask_of_two, deadly, [(tmp_path, name) for name in names]))
    error = found.pop((tmp_path, "deadly"))
    assert "died" in str(error)
    assert set(found.values()) == set(names[1:])
    assert len((tmp_path / "deadly").read_text("ascii")) == TRIES


def test_workers_that_are_not_there_are_not_waited_for_for_ever():
    class Empty(Executor):
        def submit(self, fn, /, *args, **kwargs):
            return Future()

    found = results_of(Engine(Empty(), 2, patience_s=0.01), doubled, [1])
    with pytest.raises(DataError, match="No job has ended"):
        next(found)


@pytest.mark.parametrize(
    ("url", "advice"),
    [
        ("nothing://x", "its address"),
        ("tls://127.0.0.1:9", "TLS__CA_FILE"),
        ("tcp://127.0.0.1:9", "its address"),
    ],
)
def test_a_scheduler_that_is_not_there_or_not_as_encrypted_as_must_be_is_said(url, advice):
    with config.set({"distributed.comm.require-encryption": True}):
        assert Security().require_encryption
        with pytest.raises(DataError, match=f"cannot be reached.*{advice}"), dask_engine(url):
            pass


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "lake").mkdir()
    for k in range(2):
        shipped(folder / "machines", folder / "lake", f"M{k}", Truth(k))
    return folder / "lake"


@pytest.fixture(scope="module")
def expected(lake: Path) -> dict[str, object]:
    """Return what the nights of the shipped machines find."""
    machines = (machine_of("M0"), machine_of("M1", 1.3 * GAIN))
    results = [work(NightJob(one, LAST, 2, str(lake))) for one in machines]
    stored = {one.machine: night_as_json(one) for one in results if one is not None}
    return json.loads(json.dumps(stored))


@pytest.mark.proof
def test_nights_are_the_same_whatever_the_engine_and_only_what_is_missing_is_done(
    engine, lake, expected, tmp_path
):
    url = f"sqlite:///{tmp_path / 'registry.db'}"
    with Registry.make(url, str(lake)) as registry:
        for name in ("M0", "M1", "away"):
            registry.add(machine_of(name, 1.3 * GAIN if name == "M1" else GAIN), "first")

        def jobs() -> list[NightJob]:
            return [NightJob(one, LAST, 2, registry.lake) for one in registry.missing(LAST)]

        first = do_nights(registry, jobs()[:1], engine)
        assert (first.asked, first.stored, first.not_shipped) == (1, 1, ())
        assert [job.machine.name for job in jobs()] == ["M1", "away"]
        rest = do_nights(registry, jobs(), engine)
        assert (rest.asked, rest.stored, rest.not_shipped) == (2, 1, ("away",))
        assert [job.machine.name for job in jobs()] == ["away"]
        assert {one.machine: one.result for one in registry.nights(LAST)} == expected
        assert [len(registry.proposals(name)) for name in ("M0", "M1")] == [0, 1]


def test_a_damaged_lake_is_said_and_stays_missing_and_a_poison_machine_is_stored(
    lake, tmp_path, monkeypatch
):
    (cut,) = lake.glob("machine=M1/day=*03/minutes-*.parquet")
    whole = cut.read_bytes()
    cut.write_bytes(whole[:-1])
    make = work

    def poisoned(job: NightJob) -> object:
        if job.machine.name == "M2":
            raise ZeroDivisionError("no such luck")
        return make(job)

    monkeypatch.setattr("thermaxis.fleet._nights.work", poisoned)
    url = f"sqlite:///{tmp_path / 'registry.db'}"
    with Registry.make(url, str(lake)) as registry, serial_engine() as engine:
        for name in ("M1", "M2"):
            registry.add(machine_of(name), "first")
        jobs = [NightJob(one, LAST, 2, registry.lake) for one in registry.missing(LAST)]
        found = do_nights(registry, jobs, engine)
        cut.write_bytes(whole)
        assert (found.stored, found.set_aside, list(found.unread)) == (1, 1, ["M1"])
        assert found.unread["M1"].code == "error-lake_damaged"
        (stored,) = registry.nights(LAST)
        assert stored.result["outcome"] == NightOutcome.SET_ASIDE
        assert "no such luck" in str(stored.result["remark_codes"])
        assert [one.name for one in registry.missing(LAST)] == ["M1"]
