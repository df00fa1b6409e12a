"""Where the real measurements lie; they are read in place and are no part of the project."""

import gc
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from asyncua.server.internal_server import InternalServer
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from hypothesis import settings
from xdist.remote import Producer
from xdist.scheduler import LoadFileScheduling

from thermaxis import positioning, thermal
from thermaxis.cli.thermal import _thermal_logs
from thermaxis.runtime.status._address_space import fill_address_space
from thermaxis.runtime.users import _users
from thermaxis.thermal.identification import _identification

gc.disable()  # nothing of what is imported and collected is garbage
# The same cases everywhere, and a quarter as many as usual.
settings.register_profile("same", derandomize=True, deadline=None, max_examples=25)
settings.load_profile("same")

ROOT = Path(__file__).resolve().parent.parent

TOGETHER = {
    "linuxcnc": (
        "test_linuxcnc",
        "test_linuxcnc_offset",
        "test_linuxcnc_loop",
        "test_linuxcnc_source",
    ),
    "asyncua": ("test_opcua_session", "test_opcua_security", "test_probes"),
    "node-opcua": ("test_foreign_opcua", "test_foreign_opcua_loop", "test_foreign_status_client"),
}
"""Files of tests that would wait for each other, or share what takes long to start: a computer has
one LinuxCNC, packages of the foreign server are installed once, and a server is started once."""


FIRST = (
    "test_linuxcnc",
    "test_loop_is_killed",
    "test_foreign_opcua",
    "test_clean_installation",
    "test_kills",
    "test_tutorials",
    "test_app",
    "test_operator_looks",
    "test_interventions",
    "test_thermal",
    "test_compensated_lathe",
    "test_historian_power_loss",
    "test_access",
    "test_loop_faults",
    *("test_library", "test_vectors", "test_export", "test_drift", "test_axis_room", "test_loop"),
    *("test_modal", "test_identification", "test_uncertainty", "test_thermal_reports"),
)
"""Files that take longest: what begins last ends soon."""


class ByFile(LoadFileScheduling):
    """Give each worker whole files, and one worker the files that would wait for each other."""

    def _split_scope(self, nodeid: str) -> str:
        file = super()._split_scope(nodeid)
        groups = [group for group, files in TOGETHER.items() if Path(file).stem in files]
        return groups[0] if groups else file


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let the files that take longest come first."""
    rank = {stem: k for k, stem in enumerate(FIRST)}
    items.sort(key=lambda item: rank.get(item.path.stem, len(FIRST)))


def pytest_collection_finish() -> None:
    """Keep thousands of collected tests out of every later search for garbage, and search less."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 50)
    gc.enable()


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> ByFile | None:
    """Return how tests come to the workers with `--dist loadfile`."""
    if config.getvalue("dist") != "loadfile":
        return None
    config.option.loadscopereorder = False  # as they come, not those of many tests first
    return ByFile(config, log)


@contextmanager
def remembered_drifts() -> Iterator[None]:
    """Let the drift of the same readings be fitted once, where something else is the subject."""
    fit = positioning.evaluate_drift

    def remembered(test: Any, **options: Any) -> Any:
        parts = (test.kind, test.target, test.deviation, test.time_s, test.order)
        readings = (repr(part) if part is None else bytes(part) for part in parts[1:])
        key = (parts[0], *readings, *sorted(options.items()))
        if key not in DRIFTS:
            DRIFTS[key] = fit(test, **options)
        return DRIFTS[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(positioning, "evaluate_drift", remembered)
        yield


DRIFTS: dict[tuple[object, ...], Any] = {}


@pytest.fixture(scope="session")
def fitted_once() -> Callable[[], AbstractContextManager[None]]:
    """Return what lets the drift of the same readings be fitted once."""
    return remembered_drifts


@pytest.fixture(scope="module")
def one_clock_and_regime() -> Iterator[None]:
    """Let no second clock or regime be looked for in a log: both have tests of their own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_identification, "with_regimes", lambda output, _: output)
        for module in (thermal, _thermal_logs):
            patch.setattr(module, "with_one_clock", lambda log, *_, **__: log)
        yield


async def few_nodes(server: InternalServer, shelf_file: Path | None = None) -> None:
    fill_address_space(server.node_mgt_service)


@pytest.fixture(scope="session", autouse=True)
def _few_nodes() -> Iterator[None]:
    """Let OPC UA servers inside the tests make few nodes of the standard, not all seven thousand.

    That is most of their start. Programs that system tests start make all.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(InternalServer, "load_standard_address_space", few_nodes)
        yield


@pytest.fixture(scope="session", autouse=True)
def _quick_hashes() -> Iterator[None]:
    """Let hashes of passwords be cheap; what they cost users, `test_users` says."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_users, "HASH_PASSES", 1)
        patch.setattr(_users, "HASH_MEMORY_KIB", 64)
        yield


@pytest.fixture(scope="session", autouse=True)
def _quick_keys() -> Iterator[None]:
    """Let six private keys serve in turn, and each be looked through once."""
    made: deque[rsa.RSAPrivateKey] = deque(maxlen=6)
    make = rsa.generate_private_key

    def in_turn(**asked: int) -> rsa.RSAPrivateKey:
        if len(made) < 6:
            made.append(make(**asked))
        made.rotate()
        return made[0]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rsa, "generate_private_key", in_turn)
        for name in ("load_pem_private_key", "load_der_private_key"):
            patch.setattr(serialization, name, cache(getattr(serialization, name)))
        yield


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the project's root."""
    return ROOT


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Return the folder of real measurements beside the project; skip where there is none."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("no real measurements beside the project (../shared/data)")
    return folder
