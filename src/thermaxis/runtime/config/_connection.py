"""The tables ``[connection.NAME]`` of configuration files, and errors of such files in words.

`ConnectionSection` is what may stand in the table; `ConnectionSection.settings` reads the secrets
and gives what a session needs. `explain` turns what pydantic says about any configuration into
sentences with file, key, the nearest known key and a remedy.
"""

import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Final,
    Literal,
    NamedTuple,
    TypeAlias,
    Union,
    cast,
    final,
    get_args,
    get_origin,
)
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import ConnectionSettings, Secret
from thermaxis.runtime.host import read_secret as secret_in, refuse_readable, unreadable

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

Security: TypeAlias = Literal["none", "Basic256Sha256", "Aes128Sha256RsaOaep", "Aes256Sha256RsaPss"]
"""Security policies that are offered; all but none sign and encrypt."""
FILE_LIMIT_BYTES: Final = 1_000_000
"""Largest configuration file. [byte]"""
_MOST_PROBLEMS = 8
_NO_TABLE = ("this is not a table", "Write keys with values below [...]")
_NO_NUMBER = ("this is not a number", "Write digits without quotation marks")
_TYPES: Final[Mapping[str, tuple[str, str]]] = {
    "dict_type": _NO_TABLE,
    "model_type": _NO_TABLE,
    "model_attributes_type": _NO_TABLE,
    "float_type": _NO_NUMBER,
    "float_parsing": _NO_NUMBER,
    "finite_number": ("this is not a finite number", "Write digits"),
    "int_type": ("this is not a whole number", "Write digits only"),
    "int_from_float": ("this is not a whole number", "Write digits only"),
    "string_type": ("this is not a text", "Write it in quotation marks"),
    "bool_type": ("this is neither true nor false", "Write true or false, without quotes"),
    "list_type": ("this is not a list", "Write [a, b]"),
    "greater_than_equal": ("this is less than {ge}", ""),
    "less_than_equal": ("this is more than {le}", ""),
    "greater_than": ("this is not more than {gt}", ""),
    "less_than": ("this is not less than {lt}", ""),
    "string_too_short": ("this is empty or too short", ""),
    "string_too_long": ("this is longer than {max_length} characters", ""),
}
"""What is wrong and what to do, by pydantic's name of the error; without the latter the remedy
is what the key means."""
_SCHEME = "opc.tcp"


def _refused(key: str, what: str, remedy: str) -> PydanticCustomError:
    """Make the error of one key that `explain` finds again."""
    return PydanticCustomError("refused", "{what}", {"key": key, "what": what, "remedy": remedy})


@final
class ConnectionSection(BaseModel):
    """One OPC UA connection as it stands in a configuration file.

    A password never stands in the file itself, and is never sent without encryption.

    Raises
    ------
    ValidationError
        If a key is unknown, has the wrong type or range, or keys contradict each other.
    """

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        hide_input_in_errors=True,
        use_attribute_docstrings=True,
    )

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

    @model_validator(mode="before")
    @classmethod
    def _no_password_inside(cls, table: object) -> object:
        if isinstance(table, dict) and "password" in table:
            raise _refused(
                "password",
                "the password itself stands in the file",
                "Write it into a file that only its owner can read, name that as password_file or"
                " a variable as password_environment, and change the password",
            )
        return cast("object", table)

    @model_validator(mode="after")
    def _check_together(self) -> "ConnectionSection":
        self._check_url()
        self._check_user()
        given = {
            "certificate": self.certificate,
            "private_key": self.private_key,
            "server_certificate": self.server_certificate,
        }
        for key, value in given.items():
            if self.security == "none" and value:
                raise _refused(
                    key,
                    "the connection is not encrypted, and a certificate is stated",
                    "Choose a policy such as Basic256Sha256, or leave the certificates out",
                )
            if self.security != "none" and not value:
                raise _refused(
                    key,
                    f"{key} is missing, and the connection shall be encrypted",
                    "Make and fetch certificates with thermaxis certificate, and name the files",
                )
        return self

    def _check_url(self) -> None:
        try:
            parts = urlsplit(self.url)
            host, _ = parts.hostname, parts.port
        except ValueError:
            parts, host = None, None
        if parts is None or parts.scheme != _SCHEME or not host:
            raise _refused(
                "url",
                "this is no address of an OPC UA server",
                "Write it as opc.tcp://host:4840/path",
            )
        if parts.username is not None or parts.password is not None:
            raise _refused(
                "url",
                "the address contains a user or a password",
                "Write user and password_file as keys of their own",
            )

    def _check_user(self) -> None:
        if self.password_file and self.password_environment:
            raise _refused(
                "password_environment",
                "the password is stated twice",
                "Give password_file or password_environment",
            )
        stated = bool(self.password_file or self.password_environment)
        if stated and not self.user:
            raise _refused("user", "there is a password and no user", "Write user as well")
        if self.user and not stated:
            raise _refused(
                "user",
                "there is a user and no password",
                "Name password_file or password_environment",
            )
        if self.user and self.security == "none":
            raise _refused(
                "security",
                "a password is never sent over a connection that is not encrypted",
                "Choose a policy such as Basic256Sha256, or leave the user out",
            )

    def settings(self, name: str, folder: Path, *, where: str = "") -> ConnectionSettings:
        """Read the secrets and return what a session needs.

        Parameters
        ----------
        name : str
            Name of the connection.
        folder : Path
            Folder of the configuration file: relative paths count from there.
        where : str
            The table, for errors. Default: its name alone.

        Returns
        -------
        ConnectionSettings
            With the password masked.

        Raises
        ------
        ConfigurationError
            If a password cannot be read, a file is missing, or others can read a secret.
        """
        where = where or f"[connection.{name}]"
        private_key = _file(self.private_key, folder, f"{where}, private_key")
        if private_key is not None:
            refuse_readable(private_key, where=f"{where}, private_key")
        return ConnectionSettings(
            name=name,
            url=self.url,
            security=self.security,
            user=self.user,
            password=self._password(folder, where) or Secret(""),
            certificate=_file(self.certificate, folder, f"{where}, certificate"),
            private_key=private_key,
            server_certificate=_file(
                self.server_certificate, folder, f"{where}, server_certificate"
            ),
            application_uri=self.application_uri,
            timeout_s=self.timeout_s,
            retry_s=self.retry_s,
        )

    def _password(self, folder: Path, where: str) -> Secret | None:
        if self.password_file or self.password_environment:
            return read_secret(
                self.password_file, self.password_environment, folder=folder, where=where
            )
        return None


def read_secret(
    file: str, environment: str, *, folder: Path, where: str, key: str = "password"
) -> Secret:
    """Read a secret from a file or an environment variable.

    Parameters
    ----------
    file : str
        File whose first line is the secret; empty: the variable counts.
    environment : str
        Environment variable.
    folder : Path
        Folder from which a relative path counts.
    where : str
        The table of the configuration, for errors.
    key : str
        What the secret is called in the configuration: `KEY_file` and `KEY_environment`.

    Returns
    -------
    Secret
        Never empty.

    Raises
    ------
    ConfigurationError
        If it is missing, empty, too long, no text, or readable by others.
    """
    if not file:
        text = os.environ.get(environment, "")
        if not text:
            raise ConfigurationError(
                f"the environment variable {environment} is not set, or empty",
                where=f"{where}, {key}_environment",
                remedy="Set it before the program starts",
            )
        return Secret(text)
    return secret_in(folder / file, where=f"{where}, {key}_file")


def _file(name: str, folder: Path, where: str) -> Path | None:
    if not name:
        return None
    path = folder / name
    try:
        found = path.is_file()
    except (OSError, ValueError) as error:
        raise unreadable(path, error, where=where) from None
    if not found:
        raise ConfigurationError(
            f"there is no file {path}",
            where=where,
            remedy="Check the name; relative names count from the folder of the configuration file",
        )
    return path


# What pydantic says, in words ------------------------------------------------------------------


class Problem(NamedTuple):
    """One thing that is wrong in a configuration file."""

    place: str
    """Table and key, such as ``[connection.control], security``."""
    what: str
    """What is wrong."""
    remedy: str
    """What to do; may be empty."""


def read_tables(path: Path) -> dict[str, object]:
    """Read a configuration file.

    Parameters
    ----------
    path : Path
        The file, TOML.

    Returns
    -------
    dict
        Its tables.

    Raises
    ------
    ConfigurationError
        If it cannot be read, is too large or no TOML.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(FILE_LIMIT_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or type(error).__name__
        raise ConfigurationError(
            f"the file cannot be read ({reason})",
            where=str(path),
            remedy="Check the name and the permissions",
        ) from None
    if len(content) > FILE_LIMIT_BYTES:
        raise ConfigurationError(
            f"the file is longer than {FILE_LIMIT_BYTES} bytes",
            where=str(path),
            remedy="Name the configuration file itself",
        )
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        reason = "its text is not UTF-8"
    except tomllib.TOMLDecodeError as error:
        reason = str(error).rstrip(".")
    except RecursionError:
        reason = "nested too deeply"
    raise ConfigurationError(
        f"this is not TOML: {reason}",
        where=str(path),
        remedy='Write tables such as [connection.control] and keys such as url = "opc.tcp://..."',
    )


def explain(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Say in words what is wrong with a configuration.

    Parameters
    ----------
    error : ValidationError
        What pydantic found.
    model : type of BaseModel
        The model that was validated: its keys are the known ones.

    Returns
    -------
    list of Problem
        Table by table; never empty. Unknown keys stand first in their table, as a key that is
        missing may be one that is misspelt. Values of the file do not occur in it.
    """
    details = error.errors(include_url=False, include_input=False)
    tables = [detail["loc"][:-1] for detail in details]
    details.sort(key=lambda d: (tables.index(d["loc"][:-1]), d["type"] != "extra_forbidden"))
    return [_problem(detail, model) for detail in details]


def refuse(problems: Sequence[Problem], path: Path | str) -> ConfigurationError:
    """Make one error of everything that is wrong in a file.

    Parameters
    ----------
    problems : sequence of Problem
        At least one.
    path : Path or str
        The file.

    Returns
    -------
    ConfigurationError
        With the place of the first; the others follow in its text.
    """
    first, *others = problems
    what = first.what
    for problem in others[:_MOST_PROBLEMS]:
        what += f"; {problem.place}: {problem.what}"
    if len(others) > _MOST_PROBLEMS:
        what += f"; and {len(others) - _MOST_PROBLEMS} more"
    where = f"{path}, {first.place}" if first.place else str(path)
    return ConfigurationError(what, where=where, remedy=first.remedy)


def _problem(detail: "ErrorDetails", model: type[BaseModel]) -> Problem:
    loc = tuple(str(part) for part in detail["loc"] if not str(part).endswith("[key]"))
    kind = detail["type"]
    context = cast("Mapping[str, object]", detail.get("ctx", {}))
    if kind == "refused":
        return Problem(
            _place((*loc, str(context["key"]))), str(context["what"]), str(context["remedy"])
        )
    if kind == "extra_forbidden":
        return _unknown_key(loc, model)
    if kind == "missing":
        return Problem(_place(loc), f"the key {loc[-1]} is missing", _remedy_of_type(loc, model))
    if kind == "literal_error":
        return Problem(_place(loc), "this value is not known", f"Write {context['expected']}")
    what, remedy = _TYPES.get(kind, ("", ""))
    if not what:
        words = detail["msg"].removeprefix("Value error, ").rstrip(".")
        what = words[:1].lower() + words[1:]
    return Problem(_place(loc), what.format(**context), remedy or _remedy_of_type(loc, model))


_RENAMED = {
    "heal_s": "recovery_delay_s",
    "grace_s": "input_timeout_s",
    "spare_node": "redundant_node",
}


def _unknown_key(loc: tuple[str, ...], model: type[BaseModel]) -> Problem:
    key = loc[-1]
    known = sorted(_known_keys(loc[:-1], model))
    near = get_close_matches(key, known, n=1, cutoff=0.6)
    remedy = f"Did you mean {near[0]}" if near else f"Known are {', '.join(known)}"
    if _RENAMED.get(key) in known:
        remedy = f"Write {_RENAMED[key]}, as it is called now"
    place = f"[{printable('.'.join(loc[:-1]), 120)}]" if loc[1:] else ""
    return Problem(place, f"'{printable(key, 60)}' is not a key here", remedy)


def _place(loc: Sequence[str]) -> str:
    """Write where a value stands: tables in brackets, then the key."""
    if not loc:
        return ""
    *tables, key = loc
    shown = printable(key, 60)
    if not tables:
        return shown
    return f"[{printable('.'.join(tables), 120)}], {shown}"


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


def _remedy_of_type(loc: Sequence[str], model: type[BaseModel]) -> str:
    """Return the first sentence under the key, which says what belongs there."""
    for section in _sections(loc[:-1], model):
        field = section.model_fields.get(loc[-1]) if loc else None
        if field is not None and field.description:
            return f"It means: {' '.join(field.description.split()).rstrip('.')}"
    return "Correct the value"
