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

from tests.refusals import refused
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


def test_what_contradicts_itself_or_would_send_a_password_in_the_clear_is_refused() -> None:
    secret = {"password": Secret(WORD)}
    for changes, code in (
        ({"user": "thermaxis", **secret}, "user_unencrypted"),
        ({"user": "thermaxis"}, "user_needs_password"),
        ({"security": "Basic256Sha256", **secret, **FILES}, "password_without_user"),
        *(({"security": old, **FILES}, "unknown_choice") for old in ("", "None", "Basic128Rsa15")),
        ({"url": "opc.tcp://me:correcthorse@a:4840"}, "user_in_address"),
    ):
        with refused(code) as caught:
            settings(**changes)
        assert WORD.replace(" ", "") not in str(caught.value)


def test_encryption_needs_every_certificate() -> None:
    for missing, security in zip(FILES, SECURITIES[1:], strict=True):
        with refused("certificate_missing", name=missing):
            settings(security=security, **{**FILES, missing: None})


def test_what_is_no_address_is_refused() -> None:
    for url in (
        *("", "http://a:4840", "opc.tcp://", "opc.tcp://:4840", "opc.tcp://a:port"),
        *("opc.tcp://a:70000", "opc.tcp://a:0", "opc.tcp://[::1", "opc.tcp://a b:4840"),
        "opc.tcp://a:4840/\n",
    ):
        with refused("no_opcua_address"):
            settings(url=url)


def test_an_address_without_a_port_gets_the_registered_one() -> None:
    for url, full, host, port in (
        ("opc.tcp://a/path", "opc.tcp://a:4840/path", "a", 4840),
        ("opc.tcp://a:5000/path", "opc.tcp://a:5000/path", "a", 5000),
        ("opc.tcp://[::1]/p", "opc.tcp://[::1]:4840/p", "::1", 4840),
    ):
        found = settings(url=url)
        assert (found.full_url, found.host, found.port) == (full, host, port)


def test_a_time_without_a_bound_is_refused() -> None:
    for name, value in (("timeout_s", 0.0), ("retry_s", 61.0), ("timeout_s", float("nan"))):
        with refused("outside_range", key=f"connection.lathe.{name}"):
            settings(**{name: value})


# ---- nodes --------------------------------------------------------------------------------------


def test_node_ids_of_every_kind_are_read_and_nothing_else() -> None:
    guid = "09087e75-8e5e-499b-954f-f2a9603db28a"
    for text, node in {
        "i=85": NodeText(0, "", 85),
        "ns=2;s=/Channel/Parameter/R[u1,10]": NodeText(2, "", "/Channel/Parameter/R[u1,10]"),
        "ns=3;s=a;b=c": NodeText(3, "", "a;b=c"),
        "nsu=urn:x:y;i=7": NodeText(0, "urn:x:y", 7),
        "nsu=http://x/%3Ba;s=n": NodeText(0, "http://x/;a", "n"),
        "ns=1;b=AAEC": NodeText(1, "", b"\x00\x01\x02"),
        f"ns=1;g={guid}": NodeText(1, "", uuid.UUID(guid)),
    }.items():
        assert parse_node(text) == node
    for text in (
        *("", "T", "ns=2", "ns=2;", "ns=x;s=a", "ns=70000;s=a", "ns=2;s=", "ns=-1;i=1"),
        *("nsu=;s=a", "nsu=urn:x", "i=", "i=-1", "i=4294967296", "i=1.5", "g=nothing", "b=***"),
        *("s=a\n", "x=1", "ns=²;s=a", "i=²", "s=" + "a" * 1000),
    ):
        with refused("no_node_id"):
            parse_node(text)


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


def test_a_correction_arrives_in_the_machines_unit_and_sign() -> None:
    units = {"um": 34.5, "mm": 0.0345, "0.1 um": 345.0, "m": 3.45e-5, "inch": 0.0345 / 25.4}
    assert set(OFFSET_UNITS) == set(units)
    for unit, expected in units.items():
        assert 34.5 * offset_factor(unit, AWAY) == pytest.approx(expected, rel=1e-12)
        assert 34.5 * offset_factor(unit, TOWARDS) == pytest.approx(-expected, rel=1e-12)
    with refused("unknown_choice", key="unit"):
        offset_factor("", AWAY)
    for sign in ("", "+1", "positive", AWAY + "."):
        with refused("unknown_sign"):
            offset_factor("mm", sign)
