"""What ``thermaxis record`` says while it runs, and what becomes of it if nobody can be told."""

import errno
import io
import sys

import pytest

from thermaxis.cli.machine.record import _show


class FullDisk(io.StringIO):
    """A stream whose file lies on a full disk."""

    def __init__(self, *, at_once: bool) -> None:
        super().__init__()
        self.at_once = at_once
        self.tries = 0

    def write(self, text: str, /) -> int:
        self.tries += 1
        if self.at_once:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(text)

    def flush(self) -> None:
        if not self.closed and self.tries:
            raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("at_once", [True, False])
def test_a_full_disk_under_the_messages_ends_no_recording(monkeypatch, at_once):
    stream = FullDisk(at_once=at_once)
    with monkeypatch.context() as within:
        within.setattr(sys, "stderr", stream)
        _show("the connection is lost")
        _show("it is there again")
    assert stream.tries == 2
    stream.tries = 0


def test_a_message_has_its_time_and_no_line_of_its_own_making(capsys):
    _show("a\nb")
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said[8] == "Z"
