"""The tables ``[connection.NAME]`` of configuration files, and what is wrong in such files.

`ConnectionSection` is what may stand in the table; `ConnectionSection.settings` reads the secrets
and gives what a session needs. `explain` turns what pydantic says about any configuration into
codes with values, the key and the nearest known key.
"""

import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    ClassVar,
    Final,
    Literal,
    TypeAlias,
    Union,
    cast,
    final,
    get_args,
    get_origin,
)

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from thermaxis.codes import Message, Place, Value
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import ConnectionSettings, Secret
from thermaxis.runtime.host import read_limited, read_secret as secret_in, refuse_readable

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

Security: TypeAlias = Literal["none", "Basic256Sha256", "Aes128Sha256RsaOaep", "Aes256Sha256RsaPss"]
"""Security policies that are offered; all but none sign and encrypt."""
FILE_LIMIT_BYTES: Final = 1_000_000
"""Largest configuration file. [byte]"""
_MOST_PROBLEMS = 8
_FILES = ("certificate", "private_key", "server_certificate")
_CODES: Final[Mapping[str, str]] = {
    "dict_type": "not_a_table",
    "model_type": "not_a_table",
    "model_attributes_type": "not_a_table",
    "float_type": "no_number",
    "float_parsing": "no_number",
    "finite_number": "not_finite",
    "int_type": "no_whole_number",
    "int_from_float": "no_whole_number",
    "string_type": "not_a_text",
    "bool_type": "no_boolean",
    "list_type": "not_a_list",
    "factor": "scale_zero",
    "shown": "control_character",
}
"""What is wrong, by pydantic's name of the error."""
_BOUNDS: Final[Mapping[str, tuple[str, str]]] = {
    "greater_than_equal": ("below_bound", "ge"),
    "less_than_equal": ("above_bound", "le"),
    "greater_than": ("not_above_bound", "gt"),
    "less_than": ("not_below_bound", "lt"),
    "string_too_short": ("text_short", "min_length"),
    "string_too_long": ("text_long", "max_length"),
}
"""The same for what has a bound, and pydantic's name of the bound."""


def refused(code: str, key: str, **values: str) -> PydanticCustomError:
    """Return the error of one key of a table, so that `explain` finds its code again."""
    return PydanticCustomError("refused", "{code}", {"code": code, "key": key, "values": values})


class Section(BaseModel):
    """A table: an unknown key, a wrong type, infinity and NaN are errors."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
        hide_input_in_errors=True,
        use_attribute_docstrings=True,
    )

    secret_keys: ClassVar[frozenset[str]] = frozenset()
    """Keys that somebody might write a secret into; each is refused with the way to do it."""

    @model_validator(mode="before")
    @classmethod
    def _no_secret_inside(cls, table: object) -> object:
        if not isinstance(table, dict):
            return table
        for key in cls.secret_keys & set(cast("dict[str, object]", table)):
            raise refused("secret_in_file", key, name=key)
        return cast("object", table)


@final
class ConnectionSection(Section):
    """One OPC UA connection as it stands in a configuration file.

    A password never stands in the file itself, and is never sent without encryption.
    """

    secret_keys: ClassVar[frozenset[str]] = frozenset({"password"})

    url: Annotated[str, Field(max_length=1000)]
    """Where the server is, such as ``opc.tcp://192.168.214.241:4840``."""
    security: Security
    """Security policy; there is no default, so that nobody goes without by mistake."""
    user: Annotated[str, Field(max_length=200)] = ""
    """User name; empty: anonymous."""
    password_file: str = ""
    """File whose first line is the password; it must be readable by its owner only."""
    password_environment: str = ""
    """Environment variable that holds the password."""
    certificate: str = ""
    """Own certificate, DER or PEM."""
    private_key: str = ""
    """Its private key; it must be readable by its owner only."""
    server_certificate: str = ""
    """The server's certificate: no other is accepted."""
    application_uri: Annotated[str, Field(min_length=1, max_length=500)] = "urn:thermaxis:client"
    """Must equal the address in the own certificate. Default: what `thermaxis certificate` puts
    there."""
    timeout_s: Annotated[float, Field(ge=0.05, le=60.0)] = 1.0
    """Longest time of a request. Default: as measured against servers on one computer, with room.
    [s]"""
    retry_s: Annotated[float, Field(ge=0.1, le=60.0)] = 0.5
    """Pause before a lost connection is tried again. Default: as measured: working again 0.1 to
    0.5 s after the server's return. [s]"""

    @model_validator(mode="after")
    def _check_together(self) -> "ConnectionSection":
        if self.password_file and self.password_environment:
            raise refused("stated_twice", "password_environment", name="password")
        if self.user and not (self.password_file or self.password_environment):
            raise refused("user_needs_password", "user")
        for key in _FILES:
            if self.security == "none" and getattr(self, key):
                raise refused("certificate_unused", key)
        return self

    def settings(self, name: str, folder: Path, *, used: bool = True) -> ConnectionSettings:
        """Read the secrets and return what a session needs; where it is not used none is read."""
        table = f"connection.{name}"
        plain = ("url", "security", "user", "application_uri", "timeout_s", "retry_s")
        settings = ConnectionSettings(
            name=name,
            password=self._password(folder, table) if used else Secret("unread" * bool(self.user)),
            **{key: folder / file for key in _FILES if (file := getattr(self, key))},
            **{key: getattr(self, key) for key in plain},
        )
        if not used:
            return settings
        for key in _FILES:
            file: Path | None = getattr(settings, key)
            if file is not None:
                require_file(file, f"{table}.{key}")
        if settings.private_key is not None:
            refuse_readable(settings.private_key, key=f"{table}.private_key")
        return settings

    def _password(self, folder: Path, table: str) -> Secret:
        if not (self.password_file or self.password_environment):
            return Secret("")
        return read_secret(
            self.password_file, self.password_environment, folder=folder, table=table
        )


def read_secret(
    file: str, environment: str, *, folder: Path, table: str, key: str = "password"
) -> Secret:
    """Read a secret from a file or an environment variable."""
    if not file:
        text = os.environ.get(environment, "")
        if not text:
            place = Place(key=f"{table}.{key}_environment")
            raise ConfigurationError("variable_not_set", name=environment, place=place)
        return Secret(text)
    return secret_in(folder / file, key=f"{table}.{key}_file")


def require_file(path: Path, key: str) -> None:
    """Check that a file that a key names is there."""
    try:
        there = path.is_file()
    except (OSError, ValueError):
        there = False
    if not there:
        raise ConfigurationError("file_not_found", place=Place(str(path), key=key))


# What pydantic says, as codes --------------------------------------------------------------------


def read_tables(path: Path) -> dict[str, object]:
    """Read a configuration file."""
    content = read_limited(path, limit_bytes=FILE_LIMIT_BYTES)
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise ConfigurationError("not_utf8", place=Place(str(path))) from None
    except tomllib.TOMLDecodeError as error:
        cause = str(error).rstrip(".")
    except RecursionError:
        cause = "nested too deeply"
    raise ConfigurationError("not_toml", cause=cause, place=Place(str(path)))


def explain(error: ValidationError, model: type[BaseModel]) -> list[Message]:
    """Say what is wrong with a configuration, table by table; its values do not occur in it.

    Unknown keys stand first in their table, as a key that is missing may be one that is misspelt.
    """
    details = error.errors(include_url=False, include_input=False)
    tables = [detail["loc"][:-1] for detail in details]
    details.sort(key=lambda d: (tables.index(d["loc"][:-1]), d["type"] != "extra_forbidden"))
    return [_problem(detail, model) for detail in details]


def refuse(problems: Sequence[Message], path: Path | str) -> ConfigurationError:
    """Make one error of everything that is wrong in a file: of several the first are its values."""
    if len(problems) > 1:
        shown, count = tuple(problems[:_MOST_PROBLEMS]), len(problems)
        place = Place(str(path))
        return ConfigurationError("several_problems", problems=shown, count=count, place=place)
    only = problems[0]
    place = only.place if only.place.file else only.place._replace(file=str(path))
    return ConfigurationError.of(replace(only, place=place))


def _problem(detail: "ErrorDetails", model: type[BaseModel]) -> Message:
    loc = tuple(str(part) for part in detail["loc"] if not str(part).endswith("[key]"))
    kind = detail["type"]
    context = cast("Mapping[str, Value]", detail.get("ctx", {}))
    if kind == "refused":
        said = cast("Mapping[str, str]", context["values"])
        return problem(str(context["code"]), ".".join((*loc, str(context["key"]))), **said)
    key = ".".join(loc)
    if kind == "extra_forbidden":
        return _unknown_key(loc, model)
    if kind in _CODES:
        return problem(_CODES[kind], key)
    if kind == "literal_error":
        return problem("value_unknown", key, known=str(context["expected"]))
    values: dict[str, Value] = {"meaning": _meaning(loc, model)}
    code, bound = _BOUNDS.get(kind, ("key_needed" if kind == "missing" else "value_refused", ""))
    if bound:
        values["bound"] = context[bound]
    elif kind == "missing":
        values["name"] = loc[-1]
    else:
        values["said"] = detail["msg"]
    return problem(code, key, **values)


def problem(code: str, key: str, **values: Value) -> Message:
    """Return something that is wrong at a key; empty: in the file as a whole."""
    return Message(f"error-{code}", values, Place(key=key))


_RENAMED = {
    "heal_s": "recovery_delay_s",
    "grace_s": "input_timeout_s",
    "spare_node": "redundant_node",
}


def _unknown_key(loc: tuple[str, ...], model: type[BaseModel]) -> Message:
    name, key = loc[-1], ".".join(loc)
    known = sorted(_known_keys(loc[:-1], model))
    near = get_close_matches(name, known, n=1, cutoff=0.6)
    if _RENAMED.get(name) in known:
        return problem("key_renamed", key, name=name, now=_RENAMED[name])
    if near:
        return problem("unknown_key_near", key, name=name, near=near[0])
    return problem("unknown_key", key, name=name, known=tuple(known))


def _known_keys(loc: Sequence[str], model: type[BaseModel]) -> set[str]:
    found: set[str] = set()
    for section in _sections(loc, model):
        found |= {entry.alias or name for name, entry in section.model_fields.items()}
    return found


def _sections(loc: Sequence[str], model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    """Yield the models that may stand at a place; the words of a union's branch are passed over."""
    if not loc:
        yield model
        return
    field = model.model_fields.get(loc[0])
    if field is None:
        if len(loc) > 1 or model.model_fields:
            yield from _sections(loc[1:], model)
        return
    yield from _inside(field.annotation, loc[1:])


def _inside(annotation: object, loc: Sequence[str]) -> Iterator[type[BaseModel]]:
    origin = get_origin(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield from _sections(loc, annotation)
    elif origin in {Union, UnionType, Annotated}:
        for member in get_args(annotation):
            yield from _inside(member, loc)
    elif origin in {dict, Mapping, list, tuple} and loc:
        yield from _inside(get_args(annotation)[-1], loc[1:])


def _meaning(loc: Sequence[str], model: type[BaseModel]) -> str:
    """Return the first sentence under the key, which says what belongs there."""
    for section in _sections(loc[:-1], model):
        field = section.model_fields.get(loc[-1]) if loc else None
        if field is not None and field.description:
            return " ".join(field.description.split()).rstrip(".")
    return "-"
