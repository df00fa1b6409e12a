"""A database as it is named on the command line: a file of SQLite, or a URL without a password."""

import argparse
from pathlib import Path

from thermaxis.cli._arguments import adder
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.history import refuse_password
from thermaxis.runtime.host import read_secret


def add_password_file(parser: argparse.ArgumentParser, own: str = "") -> None:
    """Declare ``--password-file``."""
    adder(parser)(
        "--password-file FILE",
        "file with the password that the database of a URL asks for, readable by its owner"
        f" only (default: {own}what the database's library finds)",
        Path,
    )


def database_of(text: str, password_file: Path | None, *, key: str) -> tuple[str, str]:
    """Return URL and password of a database."""
    if "://" in text:
        refuse_password(text, key=key)
        if password_file is None:
            return text, ""
        return text, read_secret(password_file, key="--password-file").reveal()
    if password_file is not None:
        raise ConfigurationError(
            "option_belongs_to", key="--password-file", what="the URL of a database"
        )
    return f"sqlite:///{text}", ""
