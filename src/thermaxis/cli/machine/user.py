"""Write the file of users that a machine's status server reads.

It has name, role and the argon2 hash of the password, which cannot be read back. A viewer may look;
an operator may enable, disable, hold, trim and acknowledge; an engineer may choose another model as
well. A running server reads the file again when it changes.
"""

import argparse
import getpass
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from thermaxis.cli._arguments import adder
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import (
    Role,
    User,
    check_name,
    hash_password,
    hash_pin,
    read_users,
    write_users,
)

_ROLES = ("viewer", "operator", "engineer")
_LONGEST_LINE = 4096


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    add = actions.add_parser(
        "add", help="add a user, or give one another password or role", allow_abbrev=False
    )
    adder(add)("file USERS.toml", "file of users; made if it is not there")
    adder(add)("name NAME", "name that is given at log-in")
    adder(add)(
        "--role",
        "viewer looks; operator enables, disables, holds, trims, acknowledges as well;"
        " engineer chooses a model as well",
        choices=_ROLES,
        required=True,
    )
    adder(add)(
        "--stdin",
        "read the password from the first line of standard input instead of asking for it",
        bool,
    )
    pin = actions.add_parser(
        "pin",
        help="give an operator a PIN for panels; another password ends it",
        allow_abbrev=False,
    )
    adder(pin)("file USERS.toml", "file of users")
    adder(pin)("name NAME", "name of the operator")
    adder(pin)("--stdin", "read the PIN from the first line of standard input", bool)
    remove = actions.add_parser("remove", help="remove a user", allow_abbrev=False)
    adder(remove)("file USERS.toml", "file of users")
    adder(remove)("name NAME", "name of the user")
    listed = actions.add_parser("list", help="show names and roles", allow_abbrev=False)
    adder(listed)("file USERS.toml", "file of users")


def run(arguments: argparse.Namespace) -> int:
    """Add, remove or list users, or set a PIN."""
    path = Path(arguments.file)
    if arguments.action == "list":
        sys.stdout.write(_table(read_users(path)))
    elif arguments.action == "remove":
        _remove(path, arguments.name)
        sys.stdout.write(f"{arguments.name} removed from {path}.\n")
    elif arguments.action == "pin":
        _set_pin(path, arguments)
        sys.stdout.write(f"{arguments.name} has a PIN in {path}.\n")
    else:
        changed = _add(path, arguments)
        said = "changed in" if changed else "added to"
        sys.stdout.write(f"{arguments.name} ({arguments.role}) {said} {path}.\n")
    return 0


def _table(users: Sequence[User]) -> str:
    if not users:
        return "There are no users.\n"
    width = max(len(user.name) for user in users)
    return "".join(f"{user.name:<{width}}  {user.role}\n" for user in users)


def _add(path: Path, arguments: argparse.Namespace) -> bool:
    """Write a file with one user more or changed; return whether the user was there before."""
    name = check_name(arguments.name)
    users = read_users(path) if path.exists() else ()
    new = User(
        name, Role(arguments.role), hash_password(_secret("Password", stdin=arguments.stdin))
    )
    changed = any(user.name == name for user in users)
    kept = [new if user.name == name else user for user in users]
    write_users(kept if changed else [*kept, new], path)
    return changed


def _set_pin(path: Path, arguments: argparse.Namespace) -> None:
    users = read_users(path)
    user = _found(users, arguments.name, path)
    if user.role is not Role.OPERATOR:
        raise ConfigurationError("pin_of_operators", name=user.name, file=path)
    new = replace(user, pin=hash_pin(_secret("PIN", stdin=arguments.stdin)))
    write_users([new if one is user else one for one in users], path)


def _remove(path: Path, name: str) -> None:
    users = read_users(path)
    gone = _found(users, name, path)
    write_users([user for user in users if user is not gone], path)


def _found(users: Sequence[User], name: str, path: Path) -> User:
    found = next((user for user in users if user.name == name), None)
    if found is None:
        raise ConfigurationError(
            "unknown_name", file=path, name=name, known=", ".join(user.name for user in users)
        )
    return found


def _secret(what: str, *, stdin: bool) -> str:
    """Return a password or PIN from a pipe, or asked for twice without an echo."""
    if stdin:
        return sys.stdin.readline(_LONGEST_LINE).rstrip("\r\n")
    if not sys.stdin.isatty():
        raise ConfigurationError("no_terminal", key="--stdin")
    first = getpass.getpass(f"{what}: ")
    if getpass.getpass("Once more: ") != first:
        raise ConfigurationError("passwords_differ")
    return first
