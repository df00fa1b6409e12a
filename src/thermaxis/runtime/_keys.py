"""Kinds of keys of configuration files: pydantic reads them from the annotations of a table."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, LiteralString, NoReturn, TypeVar, cast

from pydantic import (
    AfterValidator,
    Field,
    GetPydanticSchema,
    ValidationInfo,
    WrapValidator,
)
from pydantic_core import PydanticCustomError, PydanticOmit, core_schema

from thermaxis.errors import ConfigurationError

if TYPE_CHECKING:
    from pydantic import ValidatorFunctionWrapHandler

_Kind = TypeVar("_Kind")


def _shown(text: str) -> str:
    """Refuse what a terminal would obey instead of showing it."""
    if not text.isprintable():
        raise PydanticCustomError("control_character", "control character")
    return text


def located(name: str, at: ValidationInfo) -> Path | None:
    """Return the path of a file, which counts from the folder of the configuration."""
    folder = cast("Path", at.context)
    return folder / name if name else None


@dataclass(frozen=True)
class _NoKey:
    """Stands at a field that the program fills in: no file may state it."""

    code: LiteralString

    def __get_pydantic_core_schema__(self, *_: object) -> core_schema.CoreSchema:
        def refuse(_: object) -> NoReturn:
            raise PydanticCustomError(self.code, "not a key")

        return core_schema.no_info_plain_validator_function(refuse)

    def __get_pydantic_json_schema__(self, *_: object) -> NoReturn:
        raise PydanticOmit


def _checked(value: object, check: "ValidatorFunctionWrapHandler") -> object:
    """Take an error of ours for one of pydantic's, so that the others are found as well."""
    try:
        return check(value)
    except ConfigurationError as error:
        raise PydanticCustomError("refused", "refused", {"message": error.message}) from None


@dataclass(frozen=True)
class Only:
    """Marks a key that no other kind of source or sink may state."""

    kind: str


@dataclass(frozen=True)
class Needed:
    """Marks a key that this kind of source or sink must state."""

    kind: str


def _not_zero(value: float) -> float:
    if value == 0.0:
        raise PydanticCustomError("scale_zero", "factor of zero")
    return value


def read_as(kind: object) -> Any:
    """Return what makes pydantic read a key as another kind than its attribute has."""
    return GetPydanticSchema(lambda _, handler: handler.generate_schema(kind))


Word = Annotated[str, Field(min_length=1, max_length=1000), AfterValidator(_shown)]
"""A text that says something."""
Text = Annotated[str, Field(max_length=1000), AfterValidator(_shown)]
"""A text that may be empty, which is the same as leaving it out."""
LOCATED = Annotated[Text, AfterValidator(located)]
"""The name of a file, which counts from the folder of the configuration."""
FileName = Annotated[Path | None, read_as(LOCATED)]
"""A file that may be left out."""
Scale = Annotated[float, Field(gt=0.0, le=1e6)]
"""A positive factor."""
Factor = Annotated[float, Field(ge=-1e6, le=1e6), AfterValidator(_not_zero)]
"""A factor other than zero; a negative one turns the sign."""
Port = Annotated[int, Field(ge=0, le=65_535)]
"""A port; 0 takes a free one."""
Own = Annotated[_Kind, _NoKey("extra_forbidden")]
"""What the program fills in: no key."""
Hidden = Annotated[_Kind, _NoKey("secret_in_file")]
"""A secret, which never stands in the file itself."""
Checked = Annotated[_Kind, WrapValidator(_checked)]
"""A table whose class refuses what contradicts itself."""
Table = Annotated[Mapping[Word, _Kind], Field(max_length=200)]
"""Tables by a name that the file chooses."""
