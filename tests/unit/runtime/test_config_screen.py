"""The table of the screen: what is read, what contradicts the status server, who is reached how."""

import asyncio
import ipaddress
import socket
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from tests.opcua_server import until
from tests.refusals import refused
from tests.unit.runtime.machine_files import TEXT, machine_file
from tests.unit.runtime.status_server_parts import PASSWORD, Box, users_file
from thermaxis.cli.machine._machine_words import describe_machine
from thermaxis.report.tables import as_json, as_text
from thermaxis.runtime import (
    CertificateUse,
    Finding,
    Level,
    MachineConfiguration,
    OpcUaSession,
    ScreenSettings,
    Secret,
    StatusServer,
    SystemClock,
    examine_machine,
    read_machine,
    warnings_of,
)
from thermaxis.runtime.config import page_certificate_findings
from thermaxis.runtime.config._contradictions import is_host
from thermaxis.runtime.opcua import NewCertificate, make_pair
from thermaxis.runtime.status import NAMESPACE

OPEN = '[server]\nanonymous_role = "viewer"'
LOOK = "view_without_login = true"
TLS = 'certificate = "page.der"\nprivate_key = "page.pem"'
USERS = '[server]\nusers = "users.toml"\ncertificate = "server.der"\nprivate_key = "server.pem"'
OWN = 'client_certificate = "own.der"\nclient_private_key = "own.pem"'
FEED = f'{OWN}\nuser = "viewer"\npassword_file = "secret"'


def write(folder: Path, *tables: str) -> Path:
    """Write a configuration with more tables, and every file that they may name."""
    for name in ("server.der", "own.der", "page.der"):
        (folder / name).write_bytes(b"x")
    for name in ("server.pem", "own.pem", "page.pem", "secret"):
        (folder / name).write_text("hunter2\n", encoding="utf-8")
        (folder / name).chmod(0o600)
    (folder / "users.toml").write_text("", encoding="utf-8")
    path = machine_file(folder)
    path.write_text("\n".join((TEXT, *tables, "")), encoding="utf-8")
    return path


def screen_of(folder: Path, *tables: str) -> ScreenSettings:
    screen = read_machine(write(folder, *tables)).screen
    assert screen is not None
    return screen


def said(folder: Path, *tables: str) -> list[tuple[str, str]]:
    """Return key and code of everything that is wrong."""
    found = examine_machine(write(folder, *tables))
    assert not isinstance(found, MachineConfiguration)
    return [(one.place.key, one.code.removeprefix("error-")) for one in found]


# ---- what is read -------------------------------------------------------------------------------


def test_without_a_table_there_are_no_pages(tmp_path: Path) -> None:
    assert read_machine(write(tmp_path, OPEN)).screen is None


def test_every_key_reaches_the_program(tmp_path: Path) -> None:
    keys = (
        'address = "10.0.0.5"\nport = 443\nhosts = ["Lathe-3.shop", "[FD00::5]:8450"]\n'
        'certificate = "page.der"\nprivate_key = "page.pem"\nlanguage = "cs"\n'
        "idle_s = 120\nlongest_login_s = 3600.0\nevaluation_s = 5.0"
    )
    found = screen_of(tmp_path, USERS, "[screen]", keys, FEED)
    assert (found.address, found.port, found.language) == ("10.0.0.5", 443, "cs")
    assert found.hosts == ("lathe-3.shop", "[fd00::5]:8450")
    assert (found.certificate, found.private_key) == (tmp_path / "page.der", tmp_path / "page.pem")
    assert found.client_certificate == tmp_path / "own.der"
    assert found.client_private_key == tmp_path / "own.pem"
    assert (found.user, found.password.reveal()) == ("viewer", "hunter2")
    assert (found.idle_s, found.longest_login_s, found.evaluation_s) == (120.0, 3600.0, 5.0)
    assert found.secure
    assert found.view_without_login is False
    assert "hunter2" not in repr(found)


@pytest.mark.parametrize(
    ("keys", "everybody"),
    [
        ("", True),
        ('address = "::1"', True),
        ('address = "localhost"', True),
        ('hosts = ["lathe-3.shop"]', False),  # somebody else comes through a proxy
        (f'address = "10.0.0.5"\n{TLS}', False),
        (f'address = "0.0.0.0"\nhosts = ["a"]\n{TLS}', False),
        ("view_without_login = false", False),
        (f'address = "10.0.0.5"\n{TLS}\nview_without_login = true', True),
    ],
)
def test_unless_it_is_stated_everybody_looks_where_only_this_computer_reaches_the_pages(
    tmp_path: Path, keys: str, *, everybody: bool
) -> None:
    assert screen_of(tmp_path, USERS, "[screen]", keys, FEED).view_without_login is everybody


def test_a_password_may_stand_in_the_environment_and_never_in_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("THE_FEED", "from the environment")
    by_name = FEED.replace('password_file = "secret"', 'password_environment = "THE_FEED"')
    assert screen_of(tmp_path, USERS, "[screen]", by_name).password.reveal() == (
        "from the environment"
    )
    inside = FEED.replace('password_file = "secret"', 'password = "hunter2"')
    assert said(tmp_path, USERS, "[screen]", inside) == [("screen.password", "secret_in_file")]


# ---- what contradicts itself --------------------------------------------------------------------


CLOSED = "view_without_login = false"
VIEWER = 'user = "viewer"\npassword_file = "secret"'
PAIR_LESS = 'client_private_key = "own.pem"', 'user = "v"'
LONG_IDLE = "idle_s = 7200\nlongest_login_s = 3600"
EVERYWHERE = 'address = "0.0.0.0"\nport = 4850\nhosts = ["a"]'
NOT_THERE = 'certificate = "not-there.der"\nprivate_key = "page.pem"'
WRONG = (
    (("[screen]", LOOK), "", "screen_without_server"),
    ((f"{OPEN}\nport = 0", "[screen]", LOOK), "server.port", "server_port_changes"),
    ((OPEN, "[screen]", LOOK, 'address = "10.0.0.5"'), "", "screen_unencrypted"),
    ((OPEN, "[screen]", LOOK, 'address = "lathe-3.shop"'), "", "screen_unencrypted"),
    ((OPEN, "[screen]", LOOK, 'certificate = "page.der"'), "", "pair_incomplete"),
    ((OPEN, "[screen]", LOOK, 'private_key = "page.pem"'), "", "pair_incomplete"),
    ((USERS, "[screen]", LOOK, VIEWER), "", "client_certificate_missing"),
    ((USERS, "[screen]", LOOK, OWN), "user", "screen_sees_nothing"),
    ((OPEN, "[screen]", LOOK, OWN), "client_certificate", "server_without_certificate"),
    ((USERS, "[screen]", *PAIR_LESS), "", "pair_incomplete"),
    ((OPEN, "[screen]", LOOK, 'password_file = "secret"'), "user", "password_without_user"),
    ((USERS, "[screen]", OWN, 'user = "viewer"'), "user", "user_needs_password"),
    ((OPEN, "[screen]", LOOK, VIEWER), "user", "user_unencrypted"),
    ((OPEN, "[screen]", LOOK, VIEWER), "user", "server_without_users"),
    ((OPEN, "[screen]", CLOSED), "view_without_login", "nobody_can_look"),
    ((OPEN, "[screen]", LOOK, LONG_IDLE), "idle_s", "idle_too_long"),
    ((OPEN, "[screen]", 'pin_from = ["panel-3"]'), "pin_from", "no_address"),
    ((OPEN, "[screen]", LOOK, "port = 4850"), "port", "port_twice"),
    ((OPEN, "[metrics]\nport = 8450", "[screen]", LOOK), "port", "port_twice"),
    ((OPEN, "[screen]", LOOK, 'address = "localhost"\nport = 4850'), "port", "port_twice"),
    ((OPEN, "[screen]", LOOK, EVERYWHERE), "port", "port_twice"),
    ((OPEN, "[metrics]\nport = 4850"), "metrics.port", "port_twice"),
    ((OPEN, "[screen]", LOOK, 'address = "::"'), "hosts", "screen_without_name"),
    ((OPEN, "[screen]", LOOK, 'hosts = ["https://lathe-3.shop"]'), "hosts", "no_host_name"),
    ((OPEN, "[screen]", LOOK, 'language = "fr"'), "language", "value_unknown"),
    ((OPEN, "[screen]", LOOK, "idle_s = 5"), "idle_s", "below_bound"),
    ((OPEN, "[screen]", LOOK, "evaluation_s = 0.5"), "evaluation_s", "below_bound"),
    ((OPEN, "[screen]", LOOK, 'hosts = "lathe-3.shop"'), "hosts", "not_a_list"),
    ((OPEN, "[screen]", LOOK, NOT_THERE), "certificate", "file_not_found"),
)
"""Tables that cannot be, and what is said of them, at which key."""


def test_what_cannot_be_is_said_with_its_place(tmp_path: Path) -> None:
    for tables, key, code in WRONG:
        place = key if "." in key else f"screen.{key}".rstrip(".")
        assert (place, code) in said(tmp_path, *tables), tables


@pytest.mark.parametrize(
    ("screen", "server", "meets"),
    [
        ("127.0.0.1", "127.0.0.1", True),
        ("localhost", "127.0.0.1", True),
        ("127.0.0.2", "127.0.0.1", False),
    ],
)
def test_one_port_serves_two_programs_only_where_the_system_lets_both_listen(
    tmp_path: Path, screen: str, server: str, meets: bool
) -> None:
    tables = (
        f'{OPEN}\naddress = "{server}"\nport = 4850',
        f'[screen]\naddress = "{screen}"\nport = 4850\nhosts = ["a"]',
        f'{LOOK}\ncertificate = "page.der"\nprivate_key = "page.pem"',
    )
    found = examine_machine(write(tmp_path, *tables))
    told = not isinstance(found, MachineConfiguration) and any(
        "port" in one.place.key for one in found
    )
    with socket.socket() as first, socket.socket() as second:
        first.bind((server, 0))
        first.listen()
        try:
            second.bind((screen, first.getsockname()[1]))
            second.listen()
            collided = False
        except OSError:
            collided = True
    assert told is collided is meets


# ---- names of computers -------------------------------------------------------------------------


def test_only_a_name_of_a_computer_is_taken() -> None:
    for host in (
        *("lathe-3", "lathe-3.shop", "lathe_3.shop:8450", "10.0.0.5", "10.0.0.5:443"),
        *("[fd00::5]", "[::1]:8450", "xn--frse-wqa.example", "a" * 63 + ".b"),
    ):
        assert is_host(host), host
    for host in (
        *("", "*", "*.shop", "http://a", "a/b", "a b", "a:0", "a:65536", "a:", ":8450", "-a", "a-"),
        *("a..b", ".a", "a.", "fd00::5", "[fd00::5", "[lathe]", "[::g]", "a@b", "a:80:90"),
        *("ä.shop", "a" * 64, ".".join(["a" * 60] * 5), "a\n"),
    ):
        assert not is_host(host), host


@given(st.ip_addresses(), st.integers(1, 65_535))
def test_every_address_is_a_name_with_and_without_a_port(
    address: ipaddress.IPv4Address | ipaddress.IPv6Address, port: int
) -> None:
    scope = getattr(address, "scope_id", None)
    text = str(address) if address.version == 4 else f"[{address}]"
    assert is_host(text) is (scope is None)
    assert is_host(f"{text}:{port}") is (scope is None)


@given(st.text(max_size=40))
def test_no_name_can_end_a_header_or_a_word_of_the_pages_rules(text: str) -> None:
    if is_host(text):
        assert not set(text) & set("\r\n\t ;,'\"*/\\@?#<>")


# ---- the connection to the status server --------------------------------------------------------


def connection(folder: Path, user: str, *tables: str):
    return read_machine(write(folder, *tables)).screen_connection(
        user, Secret("secret" if user else "")
    )


def test_without_certificates_the_status_server_is_asked_as_nobody(tmp_path: Path) -> None:
    found = connection(tmp_path, "", OPEN, "[screen]", LOOK)
    assert (found.url, found.security) == ("opc.tcp://127.0.0.1:4850/thermaxis", "none")
    assert (found.user, found.certificate, found.server_certificate) == ("", None, None)


def test_a_server_at_every_address_is_reached_on_this_computer(tmp_path: Path) -> None:
    for address, host in (
        ("0.0.0.0", "127.0.0.1"),  # noqa: S104 - of a file that is only read
        ("::", "[::1]"),
        ("localhost", "localhost"),
        ("10.0.0.5", "10.0.0.5"),
    ):
        server = f'{USERS}\naddress = "{address}"\nport = 4900'
        found = connection(tmp_path, "novak", server, "[screen]", FEED)
        assert found.url == f"opc.tcp://{host}:4900/thermaxis"
        assert (found.host, found.port) == (host.strip("[]"), 4900)


def test_a_person_is_sent_encrypted_to_the_servers_own_certificate(tmp_path: Path) -> None:
    found = connection(tmp_path, "novak", USERS, "[screen]", FEED)
    assert found.security == "Basic256Sha256"
    assert found.server_certificate == tmp_path / "server.der"
    assert found.certificate == tmp_path / "own.der"
    assert found.private_key == tmp_path / "own.pem"
    assert (found.user, found.password.reveal()) == ("novak", "secret")


def test_a_server_with_a_certificate_of_which_nobody_logs_in_is_still_asked(tmp_path: Path) -> None:
    server = f'{OPEN}\ncertificate = "server.der"\nprivate_key = "server.pem"'
    assert connection(tmp_path, "", server, "[screen]", LOOK).security == "none"


def test_nobody_is_sent_with_a_password_over_a_plain_connection(tmp_path: Path) -> None:
    with refused("user_unencrypted"):
        connection(tmp_path, "novak", OPEN, "[screen]", LOOK)
    with refused("no_screen_table"):
        connection(tmp_path, "", OPEN)


# ---- against the status server itself -----------------------------------------------------------


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


def pair(
    folder: Path,
    name: str,
    uri: str,
    use: CertificateUse,
    hosts: tuple[str, ...] = ("127.0.0.1",),
) -> None:
    new = NewCertificate(application_uri=uri, hosts=hosts, use=use)
    certificate, key = make_pair(new, datetime.now(UTC))
    (folder / f"{name}.der").write_bytes(certificate)
    (folder / f"{name}.pem").write_bytes(key)
    (folder / f"{name}.pem").chmod(0o600)


async def everything(
    found: MachineConfiguration, user: str, password: str, *, let_in: bool = True
) -> str | None:
    """Log in as the screen does, and return the status of what it was told first."""
    assert found.server is not None
    box, clock = Box(), SystemClock()
    server = StatusServer(found.server, box, clock)
    await server.open()
    session = OpcUaSession(found.screen_connection(user, Secret(password)), clock)
    try:
        await session.open()
        # a busy computer may need more than one attempt
        await until(lambda: session.connected if let_in else bool(session.last_error))
        told = await session.read([f"nsu={NAMESPACE};s=Status/Everything"], 20.0)
        return None if told is None else told[0].StatusCode.name
    finally:
        await session.close()
        await server.close()


def test_a_person_logs_in_and_a_wrong_password_does_not(tmp_path: Path) -> None:
    path = write(tmp_path, f"{USERS}\nport = {free_port()}", "[screen]", FEED)
    pair(tmp_path, "server", "urn:thermaxis:server", CertificateUse.BOTH)
    pair(tmp_path, "own", "urn:thermaxis:client", CertificateUse.CLIENT)
    users_file(tmp_path)
    found = read_machine(path)
    assert asyncio.run(everything(found, "operator", PASSWORD)) is not None
    assert asyncio.run(everything(found, "operator", "another one", let_in=False)) is None
    assert about_the_screen(found) == []


# ---- what somebody should know ------------------------------------------------------------------


def about_the_screen(found: MachineConfiguration) -> list[Finding]:
    now = datetime.now(UTC)
    every = warnings_of(found, now)
    names = {"own.der", "page.der"}
    return [
        one
        for one in every
        if one.message.place.key.startswith("screen") or Path(one.message.place.file).name in names
    ]


def test_pages_that_the_whole_network_may_look_at_are_said(tmp_path: Path) -> None:
    tls = 'address = "10.0.0.5"\ncertificate = "page.der"\nprivate_key = "page.pem"'
    path = write(tmp_path, OPEN, "[screen]", LOOK, tls)
    pair(tmp_path, "page", "urn:thermaxis:page", CertificateUse.SERVER)
    (finding,) = about_the_screen(read_machine(path))
    assert (finding.level, finding.message.code) == (Level.WARNING, "advice-everybody_may_look")
    closed = path.read_text(encoding="utf-8").replace(LOOK, CLOSED)
    path.write_text(closed.replace(OPEN, USERS).replace(tls, f"{tls}\n{FEED}"), encoding="utf-8")
    pair(tmp_path, "own", "urn:thermaxis:client", CertificateUse.CLIENT)
    assert about_the_screen(read_machine(path)) == []


def test_a_certificate_of_another_program_is_an_error_before_the_server_says_so(
    tmp_path: Path,
) -> None:
    path = write(tmp_path, USERS, "[screen]", FEED)
    pair(tmp_path, "own", "urn:another:program", CertificateUse.CLIENT)
    (finding,) = about_the_screen(read_machine(path))
    assert (finding.level, finding.message.code) == (Level.ERROR, "error-application_uri_differs")
    assert finding.message.values["found"] == ("urn:another:program",)


def test_a_certificate_of_the_pages_that_expires_is_said_in_time(tmp_path: Path) -> None:
    tls = 'certificate = "page.der"\nprivate_key = "page.pem"'
    path = write(tmp_path, OPEN, "[screen]", LOOK, tls)
    pair(tmp_path, "page", "urn:thermaxis:page", CertificateUse.SERVER)
    found = read_machine(path)
    assert about_the_screen(found) == []
    late = datetime.now(UTC) + timedelta(days=3650)
    told = [f for f in warnings_of(found, late) if f.message.place.key == "screen.certificate"]
    assert [finding.level for finding in told] == [Level.ERROR]


# ---- what thermaxis check says ------------------------------------------------------------------


def test_check_says_where_the_pages_are_and_no_secret(tmp_path: Path) -> None:
    keys = 'address = "::1"\nhosts = ["lathe-3.shop"]\ncertificate = "page.der"'
    found = read_machine(write(tmp_path, USERS, "[screen]", keys, 'private_key = "page.pem"', FEED))
    described = describe_machine(found)
    assert as_json(described)["screen"] == {
        "address": "::1",
        "port": 8450,
        "hosts": ["lathe-3.shop"],
        "secure": True,
        "view_without_login": False,
    }
    assert "https://[::1]:8450" in as_text(described)
    assert "hunter2" not in as_text(described) + str(as_json(described))


# ---- the certificate of the pages, looked at before anybody opens one --------------------------


def page_file(folder: Path, address: str, hosts: str = "") -> Path:
    """Write a configuration whose pages are at an address, with a certificate that stays."""
    pages = [folder / name for name in ("page.der", "page.pem")]
    kept = {file: file.read_bytes() for file in pages if file.exists()}
    page = f'certificate = "page.der"\nprivate_key = "page.pem"\naddress = "{address}"'
    path = write(folder, OPEN, "[screen]", LOOK, page, f"hosts = [{hosts}]")
    for file, content in kept.items():
        file.write_bytes(content)
    return path


def page_findings(folder: Path, *names: str) -> list[Finding]:
    """Return what is found about a new certificate for these names."""
    path = page_file(folder, "192.168.1.7")
    pair(folder, "page", "urn:page", CertificateUse.SERVER, names)
    return findings_of(path)


def findings_of(path: Path) -> list[Finding]:
    return list(page_certificate_findings(read_machine(path)))


def test_every_name_by_which_the_pages_are_reached_stands_in_their_certificate(
    tmp_path: Path,
) -> None:
    names = ("lathe-3.shop", "*.WORKS", "192.168.1.7", "fd00::7", "localhost", "*")
    assert page_findings(tmp_path, *names) == []
    for address, hosts, missing in (
        ("192.168.1.7", '"lathe-3.shop:443"', []),
        ("192.168.1.70", '"panel"', ["panel", "192.168.1.70"]),
        ("0.0.0.0", '"Lathe-3.shop"', []),  # noqa: S104 - not bound
        ("fd00::7", '"[fd00:0::7]:8450"', []),
        ("127.0.0.1", '"localhost"', []),
        ("127.0.0.1", "", ["127.0.0.1"]),
        ("127.0.0.1", '"a.works", "works", "a.b.works"', ["works", "a.b.works"]),  # one label
    ):
        found = findings_of(page_file(tmp_path, address, hosts))
        assert {level for level, _ in found} <= {Level.WARNING}
        assert [message.values["name"] for _, message in found] == missing, (address, hosts)


def test_a_key_of_another_certificate_is_an_error_before_the_start(tmp_path: Path) -> None:
    assert page_findings(tmp_path, "192.168.1.7") == []
    path = tmp_path / "machine.toml"
    pair(tmp_path, "other", "urn:page", CertificateUse.SERVER, ("192.168.1.7",))
    (tmp_path / "page.pem").write_bytes((tmp_path / "other.pem").read_bytes())
    ((level, message),) = findings_of(path)
    assert (level, message.code) == (Level.ERROR, "error-pair_unusable")


def test_without_tls_there_is_nothing_to_find(tmp_path: Path) -> None:
    assert findings_of(write(tmp_path, OPEN, "[screen]", LOOK)) == []
