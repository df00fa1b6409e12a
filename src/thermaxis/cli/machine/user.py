"""``thermaxis user``: add, change, remove and list the users of a status server."""

import argparse
import getpass
import sys
from collections.abc import Sequence
from pathlib import Path

from thermaxis.errors import ConfigurationError
from thermaxis.runtime import Role, User, check_name, hash_password, read_users, write_users

_DESCRIPTION = """\
Write the file of users that a machine's status server reads: name, role and the argon2 hash of the
password, which nobody can read back. A viewer may look; an operator may enable, disable, hold,
trim and acknowledge; an engineer may choose another model as well. A running server reads the file
again when it changes.
"""
_ROLES = ("viewer", "operator", "engineer")
_LONGEST_LINE = 4096


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    add = actions.add_parser(
        "add", help="add a user, or give one another password or role", allow_abbrev=False
    )
    add.add_argument("file", metavar="USERS.toml", help="file of users; made if it is not there")
    add.add_argument("name", metavar="NAME", help="name that is given at log-in")
    add.add_argument("--role", choices=_ROLES, required=True, help="what the user may do")
    add.add_argument(
        "--stdin",
        action="store_true",
        help="read the password from the first line of standard input instead of asking for it",
    )
    remove = actions.add_parser("remove", help="remove a user", allow_abbrev=False)
    remove.add_argument("file", metavar="USERS.toml", help="file of users")
    remove.add_argument("name", metavar="NAME", help="name of the user")
    listed = actions.add_parser("list", help="show names and roles", allow_abbrev=False)
    listed.add_argument("file", metavar="USERS.toml", help="file of users")


def run(arguments: argparse.Namespace) -> int:
    """Add, remove or list users."""
    path = Path(arguments.file)
    if arguments.action == "list":
        sys.stdout.write(_table(read_users(path)))
    elif arguments.action == "remove":
        _remove(path, arguments.name)
        sys.stdout.write(f"{arguments.name} removed from {path}.\n")
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
    new = User(name, Role(arguments.role), hash_password(_password(stdin=arguments.stdin)))
    changed = any(user.name == name for user in users)
    kept = [new if user.name == name else user for user in users]
    write_users(kept if changed else [*kept, new], path)
    return changed


def _remove(path: Path, name: str) -> None:
    users = read_users(path)
    kept = [user for user in users if user.name != name]
    if len(kept) == len(users):
        raise ConfigurationError(
            f"there is no user {name}",
            where=str(path),
            remedy="thermaxis user list shows the names",
        )
    write_users(kept, path)


def _password(*, stdin: bool) -> str:
    """Return a password from a pipe, or asked for twice without an echo."""
    if stdin:
        return sys.stdin.readline(_LONGEST_LINE).rstrip("\r\n")
    if not sys.stdin.isatty():
        raise ConfigurationError(
            "there is no terminal to ask for the password",
            where="password",
            remedy="Say --stdin to read it from standard input",
        )
    first = getpass.getpass("Password: ")
    if getpass.getpass("Once more: ") != first:
        raise ConfigurationError("the two passwords differ", where="password")
    return first
