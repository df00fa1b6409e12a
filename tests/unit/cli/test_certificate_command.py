"""``thermaxis certificate``: what is made, shown, fetched, and above all what is not stored."""

import argparse
import asyncio
import io
import socket
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.opcua_server import Machine, OneUser, start_machine
from thermaxis.cli.machine import certificate as command
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import read_toml, tree_of
from thermaxis.runtime import ConnectionSettings
from thermaxis.runtime.opcua import certificate_of, private_key_of


def run(*words: str | Path) -> int:
    parser = argparse.ArgumentParser(allow_abbrev=False)
    command.add_arguments(parser)
    return command.run(parser.parse_args([str(word) for word in words]))


def make(folder: Path, name: str, *words: str) -> tuple[Path, Path]:
    certificate, key = folder / f"{name}.der", folder / f"{name}.pem"
    assert run("new", certificate, key, *words) == 0
    return certificate, key


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """An encrypted machine in a thread of its own, as the command has its own event loop."""
    folder = tmp_path_factory.mktemp("machine")
    words = ("--uri", "urn:test:server", "--use", "both")
    certificate, key = make(folder, "server", *words)
    loop = asyncio.new_event_loop()
    files = str(certificate), str(key)
    started: Machine = loop.run_until_complete(start_machine(user=OneUser("a", "b"), pki=files))
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    yield f"opc.tcp://127.0.0.1:{started.port}/machine", certificate
    asyncio.run_coroutine_threadsafe(started.stop(), loop).result(10)
    loop.call_soon_threadsafe(loop.stop)
    thread.join(10)
    loop.close()


def answer(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(text))


def test_a_pair_is_made_that_belongs_together_and_its_dates_are_shown(tmp_path, capsys):
    certificate, key = make(tmp_path / "pki", "own")
    assert (tmp_path / "pki").stat().st_mode & 0o77 == 0
    found = certificate_of(certificate)
    assert found.parsed.public_key() == private_key_of(key).public_key()
    assert found.application_uris == ("urn:thermaxis:client",)
    assert found.hosts == (socket.gethostname(),)
    text = capsys.readouterr().out
    for words in (found.sha256, found.sha1, f"{found.not_after:%Y-%m-%d}", "730 days left"):
        assert words in text
    assert "PRIVATE" not in text


def test_what_is_asked_for_stands_in_the_certificate(tmp_path):
    words = ("--uri", "urn:works:ipc", "--host", "ipc", "--host", "10.0.0.9", "--days", "20")
    certificate, _ = make(tmp_path, "own", *words, "--organisation", "Works")
    found = certificate_of(certificate)
    assert (found.application_uris, found.hosts) == (("urn:works:ipc",), ("ipc", "10.0.0.9"))
    assert "Works" in found.subject


def test_a_certificate_that_ends_soon_is_warned_of(tmp_path, capsys):
    soon, _ = make(tmp_path, "soon", "--days", "20")
    late, _ = make(tmp_path, "late", "--days", "60")
    capsys.readouterr()
    assert run("show", soon) == 0
    assert "warning       the certificate soon.der expires on" in capsys.readouterr().out
    assert run("show", late) == 0
    assert "warning" not in capsys.readouterr().out


def test_several_certificates_are_shown_or_none(tmp_path, capsys):
    a, b = make(tmp_path, "a")[0], make(tmp_path, "b")[0]
    capsys.readouterr()
    assert run("show", a, b) == 0
    text = capsys.readouterr().out
    assert certificate_of(a).sha256 in text
    assert certificate_of(b).sha256 in text
    with pytest.raises(ConfigurationError, match="cannot be read"):
        run("show", a, tmp_path / "missing.der")
    assert capsys.readouterr().out == ""


def test_an_existing_pair_is_renewed_only_when_asked(tmp_path):
    certificate, key = make(tmp_path, "own")
    before = certificate.read_bytes()
    with pytest.raises(ConfigurationError, match="exists already"):
        run("new", certificate, key)
    assert certificate.read_bytes() == before
    make(tmp_path, "own", "--replace")
    assert certificate.read_bytes() != before
    own = certificate_of(certificate).parsed
    assert own.public_key() == private_key_of(key).public_key()


def test_a_machines_certificate_is_stored_after_a_yes(machine, tmp_path, monkeypatch, capsys):
    url, certificate = machine
    answer(monkeypatch, "yes\n")
    assert run("fetch", url, "-o", tmp_path / "machine.der") == 0
    assert (tmp_path / "machine.der").read_bytes() == certificate.read_bytes()
    text = capsys.readouterr().out
    assert text.index(certificate_of(certificate).sha256) < text.index("Does the machine itself")
    assert "policies      Basic256Sha256" in text
    assert "users         user and password" in text


def test_the_table_of_the_connection_is_written_but_for_the_user(machine, tmp_path):
    url, certificate = machine
    pki = tmp_path / "pki\N{WRENCH}"
    own, key = make(pki, "own", "--uri", "urn:works:ipc")
    stored, file = pki / "machine.der", tmp_path / "connection.toml"
    words = ("fetch", url, "-o", stored, "--fingerprint", certificate_of(certificate).sha256)
    assert run(*words, "--connection", file) == 0
    with pytest.raises(ConfigurationError) as kept:
        run(*words, "--connection", file, "--replace")
    assert kept.value.code == "file_exists"
    text = file.read_text(encoding="utf-8")
    assert text.count('""  # decide') == 2
    (tmp_path / "secret").write_text("hunter2", encoding="utf-8")
    file.write_text(text.replace('user = ""', 'user = "a"').replace('""', '"secret"'))
    connections: Any = read_toml(file)["connection"]
    found = tree_of(ConnectionSettings, connections["control"], tmp_path)
    assert (found.url, found.security, found.user) == (url, "Basic256Sha256", "a")
    assert (found.certificate, found.private_key, found.server_certificate) == (own, key, stored)
    assert (found.password_file, found.application_uri) == (tmp_path / "secret", "urn:works:ipc")


def test_no_certificate_is_stored_where_its_table_cannot_be(machine, tmp_path):
    url, certificate = machine
    words = ("fetch", url, "--fingerprint", certificate_of(certificate).sha256)
    with pytest.raises(FileNotFoundError):
        run(*words, "-o", tmp_path / "machine.der", "--connection", tmp_path / "no" / "a.toml")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", ["", "y\n", "x" * 500 + "\nyes\n"])
def test_nothing_is_stored_without_a_plain_yes(machine, tmp_path, monkeypatch, text):
    answer(monkeypatch, text)
    with pytest.raises(ConfigurationError, match="nothing was stored"):
        run("fetch", machine[0], "-o", tmp_path / "machine.der")
    assert list(tmp_path.iterdir()) == []


def test_a_fingerprint_that_is_given_replaces_the_question(machine, tmp_path, monkeypatch):
    url, certificate = machine
    answer(monkeypatch, "no\n")
    own = certificate_of(certificate)
    for number, written in enumerate((own.sha1, own.sha256.lower().replace(":", ""))):
        path = tmp_path / f"{number}.der"
        assert run("fetch", url, "-o", path, "--fingerprint", written) == 0
        assert path.read_bytes() == certificate.read_bytes()


@pytest.mark.parametrize("change", ["", "first", "part"])
def test_another_fingerprint_stores_nothing_whatever_is_answered(
    machine, tmp_path, monkeypatch, change
):
    url, certificate = machine
    answer(monkeypatch, "yes\n")
    right = certificate_of(certificate).sha256.replace(":", "")
    other = "0" if right[0] != "0" else "1"
    wrong = {"first": other + right[1:], "part": right[:32]}.get(change, change)
    with pytest.raises(ConfigurationError, match="another fingerprint"):
        run("fetch", url, "-o", tmp_path / "machine.der", "--fingerprint", wrong)
    assert list(tmp_path.iterdir()) == []


def test_a_stored_certificate_is_replaced_only_when_asked(machine, tmp_path):
    url, certificate = machine
    path = tmp_path / "machine.der"
    path.write_bytes(b"the old one")
    words = ("fetch", url, "-o", path, "--fingerprint", certificate_of(certificate).sha256)
    with pytest.raises(ConfigurationError, match="exists already"):
        run(*words)
    assert path.read_bytes() == b"the old one"
    assert run(*words, "--replace") == 0
    assert path.read_bytes() == certificate.read_bytes()


def test_a_machine_that_is_not_there_is_an_error_in_words(tmp_path):
    with pytest.raises(ConfigurationError, match="Nothing listens on port 1"):
        run("fetch", "opc.tcp://127.0.0.1:1", "-o", tmp_path / "a.der", "--timeout", "1")


def test_a_machine_without_certificates_has_none_to_store(tmp_path):
    loop = asyncio.new_event_loop()
    started = loop.run_until_complete(start_machine())
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    try:
        with pytest.raises(ConfigurationError, match="has no certificate"):
            run("fetch", f"opc.tcp://127.0.0.1:{started.port}/machine", "-o", tmp_path / "a.der")
    finally:
        asyncio.run_coroutine_threadsafe(started.stop(), loop).result(10)
        loop.call_soon_threadsafe(loop.stop)
        thread.join(10)
        loop.close()
