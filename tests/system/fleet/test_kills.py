"""Whatever of a fleet is killed: no night is lost, none doubled, and all are as undisturbed."""

import threading
from pathlib import Path
from typing import Any

import pytest
from dask import config

from tests.in_time import LONGEST_S
from tests.system.fleet.cluster import VICTIMS, Cluster, found_in, make_fleet, undisturbed
from tests.system.postgres import PASSWORD, new_server
from thermaxis.errors import DataError
from thermaxis.fleet import dask_engine, results_of

pytestmark = pytest.mark.system
MACHINES = 15


def poison(job: str) -> str:
    """Do as a night that never ends, or that has more and more memory."""
    if job == "hungry":
        job += "x" * 1_000_000_000
    if job != "fair":
        threading.Event().wait()
    return job


def test_what_never_ends_or_has_too_much_memory_is_set_aside_and_the_others_are_done() -> None:
    slow = config.set({"distributed.deploy.lost-worker-timeout": "1ms"})  # any worker comes later
    with slow, dask_engine(workers=1, memory="700MB") as own:
        engine = own._replace(patience_s=LONGEST_S)
        found = dict(results_of(engine, poison, ["hungry"]))
        short = engine._replace(longest_s=5.0)
        found |= dict(results_of(short, poison, ["endless", "fair"]))
    assert found.pop("fair") == "fair"
    assert ["died" in str(error) for error in found.values()] == [True, True]


def test_nights_are_done_once_and_as_undisturbed_whatever_is_killed(tmp_path: Path) -> None:
    """Each program in turn, the workers over TLS with what Dask's own configuration names."""
    with new_server() as server:
        cluster = Cluster(tmp_path, server)
        make_fleet(tmp_path, server.url, PASSWORD, MACHINES)
        try:
            assert cluster.do_nights(VICTIMS, seed=1) == len(VICTIMS), cluster.told()
            found: Any = found_in(server.url, PASSWORD)
            with (
                pytest.raises(DataError, match="cannot be reached"),
                dask_engine(cluster.scheduler),
            ):
                pass  # without certificates
            with config.set(cluster.configuration), dask_engine(cluster.scheduler) as engine:
                assert engine.window == 8
        finally:
            cluster.end()
    assert set(cluster.codes) <= {0, 2}
    assert "Traceback" not in (tmp_path / "coordinator.log").read_text("utf-8")
    assert found == undisturbed(tmp_path, MACHINES)
    assert len([one for one in found if one and isinstance(one[0], str)]) == MACHINES
