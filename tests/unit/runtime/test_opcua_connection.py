"""Settings of a connection, secrets, node ids, signs and units."""

import copy
import logging
import pickle
import traceback
import uuid
from pathlib import Path

import pytest
from asyncua import ua
from hypothesis import given, strategies as st

from thermaxis.errors import ConfigurationError
from thermaxis.runtime import (
    AWAY,
    OFFSET_UNITS,
    SECURITIES,
    TOWARDS,
    ConnectionSettings,
    Secret,
    offset_factor,
)
from thermaxis.runtime.opcua import parse_node
from thermaxis.runtime.opcua._nodes import NodeText, node_id

WORD = "correct horse"
FILES = {
    "certificate": Path("own.der"),
    "private_key": Path("own.pem"),
    "server_certificate": Path("machine.der"),
}


def settings(**changes) -> ConnectionSettings:
    given = {"name": "lathe", "url": "opc.tcp://127.0.0.1:4840/x", "security": "none"}
    return ConnectionSettings(**{**given, **changes})


# ---- secrets ------------------------------------------------------------------------------------


def test_a_secret_shows_itself_to_nobody_but_who_asks_for_it() -> None:
    secret = Secret(WORD)
    shown = [repr(secret), str(secret), f"{secret}", f"{secret:>5}", f"{secret!r}", f"{[secret]}"]
    shown.append("%s %r" % (secret, secret))  # noqa: UP031 - logging formats so
    shown.append(repr(settings(security="Basic256Sha256", user="a", password=secret, **FILES)))
    assert all(WORD not in text for text in shown)
    assert secret.reveal() == WORD
    assert secret
    assert not Secret("")


def test_a_secret_is_neither_stored_nor_copied_into_a_file() -> None:
    for store in (pickle.dumps, copy.deepcopy):
        with pytest.raises(TypeError, match="not stored"):
            store(Secret(WORD))


def test_secrets_are_equal_by_their_text() -> None:
    assert Secret(WORD) == Secret(WORD)
    assert Secret(WORD) != Secret(WORD + " ")
    assert Secret(WORD) != WORD
    assert len({Secret(WORD), Secret(WORD)}) == 1


def test_a_secret_does_not_appear_in_a_log_or_a_traceback(caplog) -> None:
    secret = Secret(WORD)
    with caplog.at_level(logging.DEBUG):
        logging.getLogger("test").warning("the secret is %s", secret)
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - its text is what is looked at
        raise ValueError(secret)
    lines = traceback.format_exception(caught.value)
    assert WORD not in caplog.text + "".join(lines)


# ---- settings -----------------------------------------------------------------------------------


def test_a_user_is_refused_without_encryption() -> None:
    with pytest.raises(ConfigurationError) as caught:
        settings(user="thermaxis", password=Secret(WORD))
    assert caught.value.code == "user_unencrypted"
    with pytest.raises(ConfigurationError) as caught:
        settings(user="thermaxis")
    assert caught.value.code == "user_unencrypted"


def test_a_password_needs_a_user() -> None:
    with pytest.raises(ConfigurationError) as caught:
        settings(security="Basic256Sha256", password=Secret(WORD), **FILES)
    assert caught.value.code == "password_without_user"


@pytest.mark.parametrize("missing", FILES)
@pytest.mark.parametrize("security", SECURITIES[1:])
def test_encryption_needs_every_certificate(missing: str, security: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        settings(security=security, **{**FILES, missing: None})
    assert (caught.value.code, caught.value.values) == ("certificate_missing", {"name": missing})


@pytest.mark.parametrize("security", ["", "None", "basic256sha256", "Basic256", "Basic128Rsa15"])
def test_old_and_unknown_policies_are_refused(security: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        settings(security=security, **FILES)
    assert caught.value.code == "unknown_choice"


@pytest.mark.parametrize(
    "url",
    [
        "",
        "http://a:4840",
        "opc.tcp://",
        "opc.tcp://:4840",
        "opc.tcp://a:port",
        "opc.tcp://a:70000",
        "opc.tcp://a:0",
        "opc.tcp://[::1",
        "opc.tcp://a b:4840",
        "opc.tcp://a:4840/\n",
    ],
)
def test_what_is_no_address_is_refused(url: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        settings(url=url)
    assert caught.value.code == "no_opcua_address"


def test_a_password_in_the_address_is_refused_and_not_repeated() -> None:
    with pytest.raises(ConfigurationError) as caught:
        settings(url=f"opc.tcp://me:{WORD.replace(' ', '')}@a:4840")
    assert caught.value.code == "user_in_address"
    assert WORD.replace(" ", "") not in str(caught.value)


@pytest.mark.parametrize(
    ("url", "full", "host", "port"),
    [
        ("opc.tcp://a", "opc.tcp://a:4840", "a", 4840),
        ("opc.tcp://a/path", "opc.tcp://a:4840/path", "a", 4840),
        ("opc.tcp://a:5000/path", "opc.tcp://a:5000/path", "a", 5000),
        ("opc.tcp://[::1]/p", "opc.tcp://[::1]:4840/p", "::1", 4840),
    ],
)
def test_an_address_without_a_port_gets_the_registered_one(url, full, host, port) -> None:
    found = settings(url=url)
    assert (found.full_url, found.host, found.port) == (full, host, port)


@pytest.mark.parametrize("name", ["timeout_s", "retry_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, 61.0, float("nan"), float("inf")])
def test_a_time_without_a_bound_is_refused(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError) as caught:
        settings(**{name: value})
    error = caught.value
    assert (error.code, error.place.key) == ("outside_range", f"connection.lathe.{name}")


# ---- nodes --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "node"),
    [
        ("i=85", NodeText(0, "", 85)),
        ("ns=2;s=/Plc/DB190.DBD72:REAL", NodeText(2, "", "/Plc/DB190.DBD72:REAL")),
        ("ns=2;s=/Channel/Parameter/R[u1,10]", NodeText(2, "", "/Channel/Parameter/R[u1,10]")),
        ("ns=3;s=a;b=c", NodeText(3, "", "a;b=c")),
        ("nsu=urn:x:y;i=7", NodeText(0, "urn:x:y", 7)),
        ("nsu=http://x/%3Ba;s=n", NodeText(0, "http://x/;a", "n")),
        ("ns=1;b=AAEC", NodeText(1, "", b"\x00\x01\x02")),
        (
            "ns=1;g=09087e75-8e5e-499b-954f-f2a9603db28a",
            NodeText(1, "", uuid.UUID("09087e75-8e5e-499b-954f-f2a9603db28a")),
        ),
    ],
)
def test_node_ids_of_every_kind_are_read(text: str, node: NodeText) -> None:
    assert parse_node(text) == node


@pytest.mark.parametrize(
    "text",
    [
        *("", "T", "ns=2", "ns=2;", "ns=x;s=a", "ns=70000;s=a", "ns=2;s=", "ns=-1;i=1"),
        *("nsu=;s=a", "nsu=urn:x", "i=", "i=-1", "i=4294967296", "i=1.5", "g=nothing", "b=***"),
        *("s=a\n", "x=1", "ns=²;s=a", "i=²", "s=" + "a" * 1000),
    ],
)
def test_what_is_no_node_id_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        parse_node(text)
    assert caught.value.code == "no_node_id"
    assert "ns=2;s=Name" in str(caught.value)


@given(st.integers(0, 0xFFFF), st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1))
def test_a_node_means_what_the_library_means_by_it(index: int, name: str) -> None:
    found = node_id(parse_node(f"ns={index};s={name}"), ())
    assert found == ua.NodeId(name, index)


def test_a_namespace_is_looked_up_by_its_address() -> None:
    node = parse_node("nsu=urn:b;s=T")
    assert node_id(node, ["http://opcfoundation.org/UA/", "urn:a", "urn:b"]) == ua.NodeId("T", 2)
    assert node_id(node, ["http://opcfoundation.org/UA/", "urn:b"]) == ua.NodeId("T", 1)
    assert node_id(node, ["http://opcfoundation.org/UA/"]) is None


# ---- sign and unit ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unit", "expected"),
    [("um", 34.5), ("mm", 0.0345), ("0.1 um", 345.0), ("m", 3.45e-5), ("inch", 0.0345 / 25.4)],
)
def test_a_correction_arrives_in_the_machines_unit_and_sign(unit: str, expected: float) -> None:
    assert 34.5 * offset_factor(unit, AWAY) == pytest.approx(expected, rel=1e-12)
    assert 34.5 * offset_factor(unit, TOWARDS) == pytest.approx(-expected, rel=1e-12)


def test_unit_and_sign_must_be_stated_in_known_words() -> None:
    assert set(OFFSET_UNITS) == {"um", "mm", "0.1 um", "m", "inch"}
    with pytest.raises(ConfigurationError, match="unit"):
        offset_factor("", AWAY)
    for sign in ("", "+1", "positive", AWAY + "."):
        with pytest.raises(ConfigurationError) as caught:
            offset_factor("mm", sign)
        assert caught.value.code == "unknown_sign"
