"""What reads settings of one kind: pydantic, loaded where there are some."""

from functools import cache
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from pydantic import TypeAdapter


@cache
def adapter_of(kind: type) -> "TypeAdapter[Any]":
    """Return what reads a list with settings of one kind."""
    from pydantic import ConfigDict, TypeAdapter  # noqa: PLC0415  a tenth of a second

    strict = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, hide_input_in_errors=True)
    return TypeAdapter(cast("Any", tuple)[kind], config=strict)
