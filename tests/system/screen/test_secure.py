"""The pages through TLS, with a certificate that thermaxis certificate new has made."""

import socket
import ssl
from collections.abc import Callable, Generator

import pytest

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import PATIENCE_S, Rig

Look = Callable[..., Looked]


@pytest.fixture(scope="module")
def secure(tmp_path_factory: pytest.TempPathFactory) -> Generator[Rig]:
    with Rig(tmp_path_factory.mktemp("secure"), secure=True) as found:
        yield found


def test_a_client_that_trusts_the_certificate_is_served(secure: Rig) -> None:
    visitor = secure.visitor()  # it trusts this certificate and no other
    assert visitor.ask("/alive").status == 200
    answer = visitor.log_in("operator")
    assert answer.status == 200
    cookie = answer.headers["set-cookie"]
    assert cookie.startswith("__Host-thermaxis")
    assert "Secure" in cookie
    assert "HttpOnly" in cookie
    page = visitor.ask("/")
    assert "strict-transport-security" not in page.headers  # it would hold for every port


def test_a_client_that_does_not_know_the_certificate_refuses_it(secure: Rig) -> None:
    with (
        socket.create_connection(("127.0.0.1", secure.screen_port), timeout=PATIENCE_S) as plain,
        pytest.raises(ssl.SSLCertVerificationError),
    ):
        ssl.create_default_context().wrap_socket(plain, server_hostname="127.0.0.1")


def test_the_pages_work_through_tls(look: Look, secure: Rig) -> None:
    seen = look(of=secure, ignore_https_errors=True)
    page = seen.open("/")
    page.fill("input[name=name]", "viewer")
    page.fill("input[name=password]", secure.passwords["viewer"])
    page.click("button.main")
    page.wait_for_selector("body[data-role=viewer]")  # the page of the log-in is live, too
    seen.wait_live()
    assert page.evaluate("isSecureContext")
    assert seen.unexpected() == []
