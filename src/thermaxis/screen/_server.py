"""The web server of the screen: a program of its own beside the loop."""

import secrets
import ssl
from collections.abc import Callable, Sequence

from starlette.routing import BaseRoute
from starlette.types import ASGIApp

from thermaxis.errors import ConfigurationError
from thermaxis.runtime import Clock, MachineConfiguration, ScreenSettings
from thermaxis.runtime.config import configuration_sha256
from thermaxis.runtime.host import is_loopback, server_context
from thermaxis.screen._application import build_application
from thermaxis.screen.access import LoopSession, ScreenParts, UserSessions
from thermaxis.screen.feed import StatusFeed
from thermaxis.web import Listener, Server

_STANDARD_PORTS = {False: 80, True: 443}
_EVERYWHERE = ("0.0.0.0", "::")  # noqa: S104 - compared, not bound


async def serve(
    configuration: MachineConfiguration,
    clock: Clock,
    tell: Callable[[str], None],
    more: Sequence[BaseRoute] = (),
) -> None:
    """Serve the pages until told to end.

    Parameters
    ----------
    configuration : MachineConfiguration
        The machine, with a table ``[screen]``.

    Raises
    ------
    ConfigurationError
        If there is no table ``[screen]``, a certificate or key cannot be used, or the address is
        taken or not this computer's.
    """
    settings = configuration.screen
    if settings is None:
        raise ConfigurationError("no_screen", file=configuration.path)
    parts = ScreenParts(
        configuration=configuration,
        settings=settings,
        clock=clock,
        feed=StatusFeed(configuration.screen_connection(settings.user, settings.password), clock),
        persons=UserSessions(
            lambda name, password: LoopSession.log_in(
                configuration.screen_connection(name, password), clock
            ),
            clock,
            idle_s=settings.idle_s,
            longest_s=settings.longest_login_s,
            takes_pin=settings.takes_pin,
        ),
        program=secrets.token_hex(8),
        secure=settings.secure,
        configuration_sha256=configuration_sha256(configuration),
    )
    await serve_pages(
        settings, lambda hosts: build_application(parts, hosts, more), tell, web_sockets=True
    )


async def serve_pages(
    settings: ScreenSettings,
    application: Callable[[Sequence[str]], ASGIApp],
    tell: Callable[[str], None],
    *,
    web_sockets: bool = False,
) -> None:
    """Serve what is made for the names of a server, until told to end: see `serve`."""
    context, scheme = _context_of(settings), "https" if settings.secure else "http"
    with Listener.at(settings.address, settings.port, "screen_cannot_listen") as listener:
        port = int(listener.getsockname()[1])
        hosts = allowed_hosts(settings, port, secure=settings.secure)
        server = Server(
            application(hosts),
            lambda: tell(f"{scheme}://{_host(settings.address)}:{port}/"),
            web_sockets=web_sockets,
            context=context,
        )
        await server.serve(sockets=[listener])


def _context_of(settings: ScreenSettings) -> ssl.SSLContext | None:
    if settings.certificate is None or settings.private_key is None:
        return None
    return server_context(settings.certificate, settings.private_key)


def allowed_hosts(settings: ScreenSettings, port: int, *, secure: bool) -> tuple[str, ...]:
    """Return what browsers may call this server: any other name is somebody else's trick."""
    names = list(settings.hosts)
    if settings.address not in _EVERYWHERE:
        names.append(_host(settings.address))
    if is_loopback(settings.address):
        names += ["localhost", "127.0.0.1", "[::1]"]
    found: dict[str, None] = {}
    for name in names:
        has_port = name.rpartition("]")[2].count(":") == 1
        found[name if has_port else f"{name}:{port}"] = None
        if not has_port and port == _STANDARD_PORTS[secure]:
            found[name] = None
    return tuple(found)


def _host(address: str) -> str:
    return f"[{address}]" if ":" in address else address
