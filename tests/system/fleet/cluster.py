"""A fleet's database, scheduler, workers and coordinator, each a program that can be killed."""

import os
import random
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

import psutil
import psycopg
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from tests.in_time import LONGEST_S
from tests.system.postgres import PASSWORD, Server, free_port
from tests.system.programs import KILLED_WITH_US
from tests.unit.fleet.fleet_machines import GAIN, LAST, Truth, machine_of, shipped
from thermaxis.fleet import NightJob, Registry, do_nights, serial_engine

ROOT: Final = Path(__file__).parents[3]
VICTIMS: Final = ("worker", "scheduler", "coordinator", "database")
"""What is killed."""
SETTINGS: Final = {
    "distributed.comm.require-encryption": "True",
    "distributed.scheduler.allowed-failures": "0",
    "distributed.scheduler.worker-saturation": "1.0",
    "distributed.worker.profile.enabled": "False",
}
"""Dask's configuration of a cluster, beside its certificate."""
BACK: Final = 1
_KINDS: Final = (GAIN, 1.3 * GAIN, GAIN)


def make_certificate(folder: Path) -> dict[str, str]:
    """Write what all programs of a cluster share; return Dask's configuration of it."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "fleet")])
    now = datetime.now(UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    pem, secret = folder / "fleet.crt", folder / "fleet.key"
    pem.write_bytes(made.public_bytes(serialization.Encoding.PEM))
    secret.write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    tls = "distributed.comm.tls"
    each = ("scheduler", "worker", "client")
    return {
        f"{tls}.ca-file": str(pem),
        **{f"{tls}.{one}.cert": str(pem) for one in each},
        **{f"{tls}.{one}.key": str(secret) for one in each},
    }


def as_environment(configuration: dict[str, str]) -> dict[str, str]:
    """Return Dask's configuration as variables of the environment."""
    names = {one: one.upper().replace("-", "_").replace(".", "__") for one in configuration}
    return {f"DASK_{names[one]}": value for one, value in configuration.items()}


@dataclass
class Cluster:
    """Programs that are started again whenever they have ended, as by a service manager."""

    folder: Path
    server: Server
    port: int = field(default_factory=free_port)
    running: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)
    codes: list[int] = field(default_factory=list)
    """How coordinators have ended that nobody killed."""

    def __post_init__(self) -> None:
        self.configuration = make_certificate(self.folder)
        self.secret = self.folder / "password"
        self.secret.write_text(PASSWORD)
        self.secret.chmod(0o600)

    @property
    def scheduler(self) -> str:
        return f"tls://127.0.0.1:{self.port}"

    def _words(self, name: str) -> list[str]:
        if name == "scheduler":
            words = ["dask", "scheduler", "--protocol", "tls", "--port", str(self.port)]
            return [*words, "--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0"]
        if name == "coordinator":
            words = ["thermaxis", "fleet", "night", self.server.url, "--day", LAST.isoformat()]
            options = ["--password-file", str(self.secret), "--scheduler", self.scheduler]
            return [*words, "--days-back", str(BACK), *options]
        words = ["dask", "worker", self.scheduler, "--nthreads", "1", "--memory-limit", "1GB"]
        local = str(self.folder / "scratch")
        return [*words, "--host", "127.0.0.1", "--no-dashboard", "--local-directory", local]

    def start(self, name: str) -> None:
        """Start a program; what it says is kept in a file of its name."""
        settings = {**SETTINGS, **self.configuration}
        own = {"PYTHONPATH": f"{ROOT / 'src'}:{ROOT}", "OMP_NUM_THREADS": "1"}
        with (self.folder / f"{name}.log").open("ab") as log:
            self.running[name] = subprocess.Popen(
                [*KILLED_WITH_US, sys.executable, "-m", *self._words(name)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env={**os.environ, **own, **as_environment(settings)},
            )

    def mind(self) -> None:
        """Start again what has ended; the coordinator until it has done all."""
        if self.server.child is None:
            self.server.start()
        for name in ("scheduler", "worker 1", "worker 2", "coordinator"):
            found = self.running.get(name)
            if found is not None and found.poll() is not None:
                self.running.pop(name)
                if name == "coordinator":
                    self.codes.append(found.returncode)
            if name not in self.running and (name != "coordinator" or 0 not in self.codes):
                self.start(name)

    def kill(self, name: str) -> None:
        """Kill a program with its children, as a loss of power would (SIGKILL)."""
        if name == "database":
            child, self.server.child = self.server.child, None
        else:
            child = self.running.pop(name, None)
        if child is None:
            return
        with_children = [psutil.Process(child.pid)]
        with_children += with_children[0].children(recursive=True)
        for one in with_children:
            try:
                one.kill()
            except psutil.NoSuchProcess:
                continue
        psutil.wait_procs(with_children[1:], LONGEST_S)
        child.wait(LONGEST_S)

    def end(self) -> None:
        """Kill all but the database."""
        for name in list(self.running):
            self.kill(name)

    def stored(self) -> int:
        """Return how many nights are stored."""
        try:
            ((found,),) = self.server.execute("SELECT count(*) FROM nights")
        except psycopg.OperationalError:
            return 0
        return int(str(found))

    def do_nights(self, kills: Sequence[str], seed: int) -> int:
        """Have all nights done, with kills in between; return how many of them there were."""
        choose, done = random.Random(seed), 0  # noqa: S311 - no secret
        for victim in kills:
            if not self._waited_for(self.stored() + 1):  # of more a fast computer has all before
                break
            time.sleep(choose.random())  # in the middle of a job as well
            number = choose.randint(1, 2)
            self.kill(f"worker {number}" if victim == "worker" else victim)
            done += 1
        self._waited_for(None)
        return done

    def _waited_for(self, nights: int | None) -> bool:
        """Return whether so many are stored before all are done."""
        stored, until_s = -1, 0.0
        while 0 not in self.codes:
            found = self.stored()
            if nights is not None and found >= nights:
                return True
            if found != stored:
                stored, until_s = found, time.monotonic() + 2.0 * LONGEST_S
            if time.monotonic() > until_s:
                raise TimeoutError(f"nothing comes: {self.told()}")
            self.mind()
            time.sleep(0.1)
        return False

    def told(self) -> str:
        """Return what the programs have said last."""
        tails = {
            path.stem: path.read_text("utf-8", "replace") for path in self.folder.glob("*.log")
        }
        return "\n".join(f"--- {name}\n{text[-1500:]}" for name, text in tails.items())


def make_fleet(folder: Path, url: str, password: str, machines: int) -> None:
    """Make a lake of machines, of which each third has the same days, and a registry of them."""
    lake = folder / "lake"
    if not lake.is_dir():
        lake.mkdir()
        for k in range(len(_KINDS)):
            shipped(folder / "machines", lake, f"M{k:03}", Truth(k))
        for k in range(len(_KINDS), machines):
            same = f"machine=M{k % len(_KINDS):03}"
            (lake / f"machine=M{k:03}").symlink_to(lake / same, target_is_directory=True)
    with Registry.make(url, str(lake), password) as registry:
        for k in range(machines):
            registry.add(machine_of(f"M{k:03}", _KINDS[k % len(_KINDS)]), "first")


def found_in(url: str, password: str = "") -> list[tuple[object, ...]]:
    """Return what a registry has of nights and proposals, but for when."""
    with Registry(url, password) as registry:
        nights = [(one.machine, one.day, one.result) for one in registry.nights(LAST)]
        names = [machine.name for machine in registry.machines()]
        return [*nights, *(tuple(registry.proposals(name)) for name in names)]


def undisturbed(folder: Path, machines: int) -> list[tuple[object, ...]]:
    """Return what is found by one program that nobody disturbs."""
    url = f"sqlite:///{folder / 'undisturbed.db'}"
    make_fleet(folder, url, "", machines)
    with Registry(url) as registry, serial_engine() as engine:
        jobs = [NightJob(one, LAST, BACK, registry.lake) for one in registry.missing(LAST)]
        do_nights(registry, jobs, engine)
    return found_in(url)
