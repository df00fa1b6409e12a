"""The tables ``[historian]``, ``[server]`` and ``[metrics]``: what is stored, and who may look."""

from pathlib import Path

from thermaxis.runtime._connection import Secret
from thermaxis.runtime.config._connection import read_secret
from thermaxis.runtime.config._problems import Problems
from thermaxis.runtime.config._sections import HistorianSection, MetricsSection, ServerSection
from thermaxis.runtime.config._settings import MetricsSettings, ServerSettings
from thermaxis.runtime.historian import HistorianSettings, check_encryption, refuse_password
from thermaxis.runtime.host import is_loopback, refuse_readable

_FORGOTTEN_DATABASES = ("", "/", "/:memory:")
_POSTGRESQL = ("postgresql", "postgresql+psycopg")
_URL_REMEDY = (
    'Write url = "sqlite:///lathe.history.db", or "postgresql+psycopg://user@127.0.0.1/database"'
    " with password_file"
)
_APART = (
    "Write it into a file that only its owner can read, name that as password_file, and change the"
    " password"
)
_OWN_ADDRESS = "or take the address 127.0.0.1"


def historian_settings(
    section: HistorianSection, problems: Problems, default: str
) -> tuple[str, HistorianSettings] | None:
    """Return where cycles are recorded.

    Parameters
    ----------
    section : HistorianSection
        The table.
    problems : Problems
        Takes what is wrong.
    default : str
        File of the database where the table states no URL.

    Returns
    -------
    url : str
        The database, without a password; a file of SQLite with its whole path.
    settings : HistorianSettings
        The rest. None instead of both if something is wrong.
    """
    table = "[historian]"
    url = section.url or f"sqlite:///{default}"
    place = f"{table}, url"
    scheme = problems.guarded(place, lambda: _scheme_of(url, place))
    secret = stated_secret(
        table, section.password_file, section.password_environment, problems, key="password"
    )
    if scheme is None:
        return None
    if scheme == "sqlite":
        checked = _sqlite_url(url, problems)
        if secret:
            problems.add(
                f"{table}, password_file",
                "SQLite has no password",
                "Leave it out; who may read the file is decided by its folder's permissions",
            )
    elif scheme in _POSTGRESQL:
        checked = url
        problems.guarded(place, lambda: check_encryption(url, where=place))
    else:
        problems.add(f"{table}, url", "this database is not known", _URL_REMEDY)
        return None
    if checked is None or secret is None:
        return None
    stated = section.stated(HistorianSettings)
    settings = problems.guarded(table, lambda: HistorianSettings(password=secret, **stated))
    return None if settings is None else (checked, settings)


def _scheme_of(url: str, place: str) -> str:
    refuse_password(url, where=place, remedy=_APART)
    return url.partition(":")[0].casefold()


def _sqlite_url(url: str, problems: Problems) -> str | None:
    name = url.removeprefix("sqlite://")
    if name in _FORGOTTEN_DATABASES or not name.startswith("/") or "?" in name:
        problems.add("[historian], url", "this is no file of SQLite", _URL_REMEDY)
        return None
    return f"sqlite:///{problems.folder / name[1:]}"


def server_settings(section: ServerSection | None, problems: Problems) -> ServerSettings | None:
    """Return the settings of the status server.

    A password is taken over an encrypted connection only, also on this computer; other computers
    reach the server with a user's name only.

    Parameters
    ----------
    section : ServerSection or None
        The table, if there is one.
    problems : Problems
        Takes what is wrong.

    Returns
    -------
    ServerSettings or None
        None if there is no table.
    """
    if section is None:
        return None
    table = "[server]"
    certificate, private_key = key_pair(table, section.certificate, section.private_key, problems)
    users = problems.existing(f"{table}, users", section.users)
    outside = not is_loopback(section.address)
    if outside and users is None:
        problems.add(
            table,
            "the server can be reached from other computers, and users is missing",
            f"Write users, certificate and private_key, {_OWN_ADDRESS}",
        )
    if (outside or users is not None) and certificate is None:
        problems.add(
            table,
            "users have passwords, which need an encrypted connection, and certificate is missing",
            "Make one with thermaxis certificate new, and write certificate and private_key",
        )
    if outside and section.anonymous_role != "none":
        problems.add(
            f"{table}, anonymous_role",
            "the server can be reached from other computers by people without a name",
            f'Write "none", {_OWN_ADDRESS}',
        )
    if users is None and section.anonymous_role == "none" and not outside:
        problems.add(
            table,
            "nobody could connect: there are no users and no anonymous role",
            'Write users with a certificate, or anonymous_role = "viewer"',
        )
    return ServerSettings(
        section.address, section.port, users, section.anonymous_role, certificate, private_key
    )


def metrics_settings(section: MetricsSection | None, problems: Problems) -> MetricsSettings | None:
    """Return the settings of the figures for Prometheus.

    Parameters
    ----------
    section : MetricsSection or None
        The table, if there is one.
    problems : Problems
        Takes what is wrong.

    Returns
    -------
    MetricsSettings or None
        None if there is no table, or the token cannot be read.
    """
    if section is None:
        return None
    table = "[metrics]"
    certificate, private_key = key_pair(table, section.certificate, section.private_key, problems)
    token = stated_secret(
        table, section.token_file, section.token_environment, problems, key="token"
    )
    if token is None:
        return None
    if (certificate is None) != (private_key is None):
        return None  # said already
    return problems.guarded(
        table,
        lambda: MetricsSettings(section.address, section.port, token, certificate, private_key),
    )


def stated_secret(
    table: str, file: str, environment: str, problems: Problems, *, key: str
) -> Secret | None:
    """Return a secret that a table states.

    Parameters
    ----------
    table : str
        The table, in brackets.
    file : str
        File whose first line is the secret; may be empty.
    environment : str
        Environment variable that holds it; may be empty.
    problems : Problems
        Takes what is wrong.
    key : str
        What the secret is called: the keys are `KEY_file` and `KEY_environment`.

    Returns
    -------
    Secret or None
        An empty one where none is stated; None where it cannot be read.
    """
    if file and environment:
        problems.add(
            f"{table}, {key}_environment",
            f"the {key} is stated twice",
            f"Give {key}_file or {key}_environment",
        )
        return None
    if not file and not environment:
        return Secret("")
    return problems.guarded(
        table, lambda: read_secret(file, environment, folder=problems.folder, where=table, key=key)
    )


def key_pair(
    table: str, certificate: str, private_key: str, problems: Problems, *, prefix: str = ""
) -> tuple[Path | None, Path | None]:
    """Return a certificate and its key that a table states.

    Parameters
    ----------
    table : str
        The table, in brackets.
    certificate, private_key : str
        Names of the files; may be empty.
    problems : Problems
        Takes what is wrong: one without the other, a file that is missing, a key that others can
        read.
    prefix : str
        What stands before the names of both keys in the table. Default: nothing.

    Returns
    -------
    certificate, private_key : Path or None
        None where none is stated.
    """
    if bool(certificate) != bool(private_key):
        lacking = "private_key" if certificate else "certificate"
        problems.add(
            table,
            f"the key {prefix}{lacking} is missing",
            "Certificate and private key go together",
        )
    path = problems.existing(f"{table}, {prefix}certificate", certificate)
    if not private_key:
        return path, None
    key = problems.folder / private_key
    place = f"{table}, {prefix}private_key"
    problems.guarded(place, lambda: refuse_readable(key, where=place))
    return path, key
