"""A server of PostgreSQL of one's own on this computer, as a program that can be killed."""

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psycopg
import pytest

from tests.in_time import LONGEST_S

PASSWORD = "not a secret: of a server that lives for a test"  # noqa: S105 - see its text


def program(name: str) -> str:
    """Return a program of PostgreSQL; it is not always on the path."""
    found = shutil.which(name)
    folders = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    beside = [str(folder / name) for folder in folders if (folder / name).is_file()]
    choices = beside if found is None else [found, *beside]
    if not choices:
        pytest.fail(f"{name} is missing: install the package postgresql")
    return choices[0]


def user() -> str | None:
    """Return who runs the server: it refuses to run for root."""
    if os.geteuid() != 0:
        return None
    names = {entry.pw_name for entry in pwd.getpwall()}
    return "postgres" if "postgres" in names else "nobody"


def free_port() -> int:
    """Return a port that nobody has."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


@dataclass
class Server:
    """A server of PostgreSQL."""

    folder: Path
    port: int
    child: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        return f"postgresql+psycopg://thermaxis@127.0.0.1:{self.port}/thermaxis"

    def start(self) -> None:
        settings = {
            "listen_addresses": "127.0.0.1",
            "port": str(self.port),
            "unix_socket_directories": str(self.folder),
            "shared_buffers": "4MB",
            "max_connections": "10",
        }
        words = [word for name, value in settings.items() for word in ("-c", f"{name}={value}")]
        with (self.folder / "server.log").open("ab") as log:
            self.child = subprocess.Popen(
                [program("postgres"), "-D", str(self.folder / "data"), *words],
                stdout=log,
                stderr=log,
                user=user(),
                cwd=self.folder,
            )
        until_s = time.monotonic() + LONGEST_S
        while time.monotonic() < until_s:
            try:
                self.execute("SELECT 1", database="postgres")
            except psycopg.OperationalError:
                time.sleep(0.1)
            else:
                return
        pytest.fail((self.folder / "server.log").read_text(errors="replace")[-2000:])

    def kill(self) -> None:
        """End it as a loss of power would: at once, without a word to its clients."""
        if self.child is not None:
            self.child.send_signal(3)  # SIGQUIT: no checkpoint, recovery at the next start
            self.child.wait(20)
            self.child = None

    def execute(self, statement: str, database: str = "thermaxis") -> list[tuple[object, ...]]:
        with psycopg.connect(
            host="127.0.0.1",
            port=self.port,
            user="thermaxis",
            password=PASSWORD,
            dbname=database,
            autocommit=True,
        ) as connection:
            found = connection.execute(statement.encode())
            return found.fetchall() if found.description else []


@contextmanager
def new_server() -> Generator[Server]:
    """Make a server with a database, and end it."""
    folder = Path(tempfile.mkdtemp(prefix="postgres"))
    server = Server(folder, free_port())
    secret = folder / "secret"
    secret.write_text(PASSWORD)
    who = user()
    if who is not None:
        for path in (folder, secret):
            shutil.chown(path, who)
    try:
        subprocess.run(
            [
                *(program("initdb"), "-D", str(folder / "data"), "-U", "thermaxis", "-E", "UTF8"),
                *("--auth=scram-sha-256", f"--pwfile={secret}", "--no-sync"),
            ],
            check=True,
            stdout=subprocess.DEVNULL,
            user=who,
            cwd=folder,
        )
        server.start()
        server.execute("CREATE DATABASE thermaxis", database="postgres")
        yield server
    finally:
        server.kill()
        shutil.rmtree(folder)
