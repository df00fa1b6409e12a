"""The table ``[screen]``: where the pages are served, who may look, and how they reach the loop.

The pages show what the status server of the table ``[server]`` says, and each log-in is a
connection of its own to it. What one table states can therefore make the other one useless; every
such contradiction is said here, before anything listens.
"""

import ipaddress
import re
from collections.abc import Iterable, Iterator
from typing import Final

from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import Secret
from thermaxis.runtime._findings import Finding, Level, advice
from thermaxis.runtime.config._problems import Problems
from thermaxis.runtime.config._sections import ScreenSection
from thermaxis.runtime.config._servers import key_pair, stated_secret
from thermaxis.runtime.config._settings import (
    EVERY_ADDRESS,
    MachineConfiguration,
    MetricsSettings,
    ScreenSettings,
    ServerSettings,
)
from thermaxis.runtime.host import is_loopback

TABLE: Final = "screen"
"""The table, as errors name it."""
_LABEL = r"[a-z0-9_](?:[a-z0-9_-]{0,61}[a-z0-9_])?"
_HOST = re.compile(rf"(?P<name>{_LABEL}(?:\.{_LABEL})*|\[[0-9a-f:.]+\])(?::(?P<port>\d{{1,5}}))?")
_LONGEST_HOST = 253
_MOST_PORTS = 65_535
_PLAIN = {
    *("address", "port", "view_without_login", "language", "user"),
    *("idle_s", "longest_login_s", "evaluation_s"),
}
"""Keys that the settings have as they stand in the file."""


def screen_settings(
    section: ScreenSection | None,
    server: ServerSettings | None,
    metrics: MetricsSettings | None,
    problems: Problems,
    *,
    server_stated: bool,
) -> ScreenSettings | None:
    """Return the settings of the pages."""
    if section is None:
        return None
    certificate, private_key = key_pair(TABLE, section.certificate, section.private_key, problems)
    own, own_key = key_pair(
        TABLE, section.client_certificate, section.client_private_key, problems, prefix="client_"
    )
    password = stated_secret(
        TABLE, section.password_file, section.password_environment, problems, key="password"
    )
    settings = ScreenSettings(
        hosts=tuple(host.lower() for host in section.hosts),
        certificate=certificate,
        private_key=private_key,
        password=password or Secret(""),
        client_certificate=own,
        client_private_key=own_key,
        **section.model_dump(include=_PLAIN),
    )
    _check_reach(settings, problems)
    _check_times(settings, problems)
    _check_user(section, problems)
    others = (("server", server), ("metrics", metrics))
    _check_port(settings, [(t, s.address, s.port) for t, s in others if s is not None], problems)
    if server is not None:
        _check_server(settings, server, problems)
    elif not server_stated:
        problems.add("screen_without_server", TABLE)
    return None if password is None else settings


# ---- the pages by themselves --------------------------------------------------------------------


def _check_reach(settings: ScreenSettings, problems: Problems) -> None:
    """Check by whom the pages are reached, and under which names."""
    if not is_loopback(settings.address) and settings.certificate is None:
        problems.add("screen_unencrypted", TABLE)
    if settings.address in EVERY_ADDRESS and not settings.hosts:
        problems.add("screen_without_name", f"{TABLE}.hosts")
    for host in settings.hosts:
        if not is_host(host):
            problems.add("no_host_name", f"{TABLE}.hosts", name=host)


def is_host(text: str) -> bool:
    """Return whether a text in small letters names a computer, perhaps with a port."""
    found = _HOST.fullmatch(text)
    if found is None or len(found["name"]) > _LONGEST_HOST:
        return False
    if found["port"] is not None and not 1 <= int(found["port"]) <= _MOST_PORTS:
        return False
    name = found["name"]
    if not name.startswith("["):
        return True
    try:
        ipaddress.IPv6Address(name[1:-1])
    except ValueError:
        return False
    return True


def _check_times(settings: ScreenSettings, problems: Problems) -> None:
    if settings.idle_s > settings.longest_login_s:
        problems.add("idle_too_long", f"{TABLE}.idle_s", longest_s=settings.longest_login_s)


def _check_user(section: ScreenSection, problems: Problems) -> None:
    stated = bool(section.password_file or section.password_environment)
    if stated and not section.user:
        problems.add("password_without_user", f"{TABLE}.user")
    if section.user and not stated:
        problems.add("user_needs_password", f"{TABLE}.user")


def _check_port(
    settings: ScreenSettings, others: Iterable[tuple[str, str, int]], problems: Problems
) -> None:
    for table, address, port in others:
        if port and port == settings.port and _meet(address, settings.address):
            problems.add("port_twice", f"{TABLE}.port", table=table)


def _meet(one: str, other: str) -> bool:
    """Whether two addresses may be listened at only once with the same port."""
    every = one in EVERY_ADDRESS or other in EVERY_ADDRESS
    local = {one, other} <= {"127.0.0.1", "::1", "localhost"} and "localhost" in {one, other}
    return every or local or one == other


def page_certificate_findings(configuration: MachineConfiguration) -> Iterator[Finding]:
    """Look at the certificate with which the pages are served, as a browser will.

    Whether it is one, and its dates, are looked at with all other certificates: see `warnings_of`.
    """
    screen = configuration.screen
    if screen is None or screen.certificate is None or screen.private_key is None:
        return
    from thermaxis.runtime.host import server_context  # noqa: PLC0415 - as above
    from thermaxis.runtime.opcua import certificate_of  # noqa: PLC0415 - cryptography is heavy

    key = f"{TABLE}.certificate"
    try:
        contained = certificate_of(screen.certificate).hosts
    except ConfigurationError:
        return  # told already
    try:
        server_context(screen.certificate, screen.private_key)
    except ConfigurationError as failure:
        yield Finding(Level.ERROR, failure.message)
        return
    for name in _called(screen):
        if not _contains(contained, name):
            yield advice("host_not_in_certificate", key, name=name, hosts=contained)


def _called(screen: ScreenSettings) -> list[str]:
    """Return the names by which browsers reach the pages, without ports, each once."""
    names = [_HOST.fullmatch(host) for host in screen.hosts]
    found = [one["name"].strip("[]") for one in names if one is not None]
    if screen.address not in EVERY_ADDRESS and not (is_loopback(screen.address) and found):
        found.append(screen.address)
    return list(dict.fromkeys(found))


def _contains(contained: Iterable[str], name: str) -> bool:
    """Whether a certificate is for a name, by RFC 9525, 6.3: a star stands for one first label."""
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        rest = name.partition(".")[2]
        wanted = {name.lower(), f"*.{rest.lower()}"} if rest else {name.lower()}
        return any(one.lower() in wanted for one in contained)
    return any(_is_address(one, address) for one in contained)


def _is_address(text: str, address: ipaddress.IPv4Address | ipaddress.IPv6Address) -> bool:
    try:
        return ipaddress.ip_address(text) == address
    except ValueError:
        return False


# ---- the pages and the status server ------------------------------------------------------------


def _check_server(settings: ScreenSettings, server: ServerSettings, problems: Problems) -> None:
    if server.port == 0:
        problems.add("server_port_changes", "server.port")
    _check_encryption(settings, server, problems)
    if not settings.user and server.anonymous_role != "viewer":
        problems.add("screen_sees_nothing", f"{TABLE}.user")
    if settings.user and server.users is None:
        problems.add("server_without_users", f"{TABLE}.user")
    if server.users is None and not settings.view_without_login:
        problems.add("nobody_can_look", f"{TABLE}.view_without_login")


def _check_encryption(settings: ScreenSettings, server: ServerSettings, problems: Problems) -> None:
    if settings.client_certificate is not None and server.certificate is None:
        problems.add("server_without_certificate", f"{TABLE}.client_certificate")
    if settings.client_certificate is not None:
        return
    if server.users is not None:
        problems.add("client_certificate_missing", TABLE)
    elif settings.user:
        problems.add("user_unencrypted", f"{TABLE}.user")
