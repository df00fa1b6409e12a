"""The sign of life for systemd, received by a socket as systemd has one."""

import socket
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from thermaxis.compensation import SupervisorState
from thermaxis.runtime import SignOfLife


def status(time_s: float, state: SupervisorState) -> Any:
    return SimpleNamespace(output=SimpleNamespace(time_s=time_s, state=state))


def test_a_sign_of_life_is_sent_once_a_second_with_the_state_when_it_changes(
    tmp_path: Path,
) -> None:
    place = tmp_path / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(place))
        systemd.setblocking(False)
        sign = SignOfLife(str(place))
        for k in range(25):
            sign.tell(status(0.1 * k, SupervisorState.OFF))
        sign.tell(status(5.0, SupervisorState.WARMING))
        told = []
        while True:
            try:
                told.append(systemd.recv(1000).decode())
            except BlockingIOError:
                break
    assert told == [
        "READY=1\nWATCHDOG=1\nSTATUS=Off",
        "WATCHDOG=1",
        "WATCHDOG=1",
        "WATCHDOG=1\nSTATUS=Warming",
    ]


def test_without_systemd_nothing_is_sent_and_a_dead_socket_stops_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    SignOfLife().tell(status(1.0, SupervisorState.OFF))
    SignOfLife(str(tmp_path / "nobody")).tell(status(1.0, SupervisorState.OFF))
