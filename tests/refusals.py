"""What an error says as data: its code, its place, and the values that matter."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from thermaxis.codes import Place, Value
from thermaxis.errors import ThermaxisError
from thermaxis.messages import place_text, text_of

if TYPE_CHECKING:
    from thermaxis.runtime import Sink


def said_by(sink: "Sink") -> str:
    """Return why a sink is not connected, or refused its last write; empty if nothing is wrong."""
    return "" if sink.failure is None else text_of(sink.failure)


@contextmanager
def refused(
    code: str,
    *,
    file: Path | str | None = None,
    line: int | None = None,
    column: str | None = None,
    key: str | None = None,
    channel: str | None = None,
    **values: Value,
) -> Iterator[pytest.ExceptionInfo[ThermaxisError]]:
    """Expect an error of a code; of a place and of values where they are stated."""
    parts = {"line": line, "column": column, "key": key, "channel": channel}
    stated = {name: part for name, part in parts.items() if part is not None}
    if file is not None:
        stated["file"] = str(file)
    with pytest.raises(ThermaxisError) as caught:
        yield caught
    error = caught.value
    assert error.code == code, str(error)
    assert not stated or error.place == Place(**stated)
    assert {name: error.values.get(name) for name in values} == values
    assert f"error-{code}" not in str(error)  # the sentence has what it needs


def said(error: ThermaxisError) -> str:
    """Return the place inside the file and the code: ``line 2, column target_mm: not_a_number``."""
    place = place_text(error.place._replace(file=""))
    return f"{place}: {error.code}" if place else error.code


def refusal_of(read: Callable[[Path], object], path: Path) -> str:
    """Return what is said of the error that a reader raises; it names the file."""
    with pytest.raises(ThermaxisError) as caught:
        read(path)
    assert caught.value.place.file == str(path)
    return said(caught.value)


def answer_of(call: Callable[..., object], *arguments: object, **named: object) -> str:
    """Return what is said of the error of a call, or that there was none."""
    try:
        call(*arguments, **named)
    except ThermaxisError as caught:
        error = caught
    else:
        return "no error"
    assert f"error-{error.code}" not in str(error)  # the sentence has what it needs
    return said(error)


def check_refusals(
    read: Callable[[Path], object], path: Path, wrong: Mapping[str | bytes, str]
) -> None:
    """Check what is said of each wrong content of a file; all that differs is shown."""
    other: list[tuple[object, str, str]] = []
    for content, expected in wrong.items():
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        try:
            answer = refusal_of(read, path)
        except pytest.fail.Exception:
            answer = "no error"
        if answer != expected:
            other.append((content[-200:], answer, expected))
    assert not other, other
