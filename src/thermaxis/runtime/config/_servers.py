"""The tables ``[historian]``, ``[server]`` and ``[metrics]``: what is stored, and who may look."""

from pathlib import Path

from thermaxis.runtime._connection import Secret
from thermaxis.runtime.config._connection import read_secret
from thermaxis.runtime.config._problems import Problems
from thermaxis.runtime.config._sections import HistorianSection, MetricsSection, ServerSection
from thermaxis.runtime.config._settings import MetricsSettings, ServerSettings
from thermaxis.runtime.history import HistorianSettings, check_encryption, refuse_password
from thermaxis.runtime.host import refuse_readable

_FORGOTTEN_DATABASES = ("", "/", "/:memory:")
_POSTGRESQL = ("postgresql", "postgresql+psycopg")


def historian_settings(
    section: HistorianSection, problems: Problems, machine: str, default: str
) -> tuple[str, HistorianSettings] | None:
    """Return where cycles are recorded."""
    table, key = "historian", "historian.url"
    url = section.url or f"sqlite:///{default}.db"
    scheme = problems.guarded(key, lambda: _scheme_of(url, key))
    secret = stated_secret(
        table, section.password_file, section.password_environment, problems, key="password"
    )
    if scheme is None:
        return None
    if scheme == "sqlite":
        checked = _sqlite_url(url, problems)
        if secret:
            problems.add("sqlite_without_password", f"{table}.password_file")
    elif scheme in _POSTGRESQL:
        checked = url
        problems.guarded(key, lambda: check_encryption(url, key=key))
    else:
        problems.add("unknown_database", key, kind=scheme)
        return None
    if checked is None or secret is None:
        return None
    stated = section.stated(HistorianSettings) | {"machine": machine, "folder": None}
    if section.folder or scheme != "sqlite":  # a server's is beside the configuration
        stated["folder"] = problems.folder / (section.folder or default)
    settings = problems.guarded(table, lambda: HistorianSettings(password=secret, **stated))
    return None if settings is None else (checked, settings)


def _scheme_of(url: str, key: str) -> str:
    refuse_password(url, key=key)
    return url.partition(":")[0].casefold()


def _sqlite_url(url: str, problems: Problems) -> str | None:
    name = url.removeprefix("sqlite://")
    if name in _FORGOTTEN_DATABASES or not name.startswith("/") or "?" in name:
        problems.add("no_file_in_url", "historian.url")
        return None
    return f"sqlite:///{problems.folder / name[1:]}"


def server_settings(section: ServerSection | None, problems: Problems) -> ServerSettings | None:
    """Return the settings of the status server.

    A password is taken over an encrypted connection only, also on this computer; other computers
    reach the server with a user's name only.
    """
    if section is None:
        return None
    table = "server"
    certificate, private_key = key_pair(table, section.certificate, section.private_key, problems)
    users = problems.existing(f"{table}.users", section.users)
    if (certificate is None) != (private_key is None):
        return None  # said already
    return problems.guarded(
        table,
        lambda: ServerSettings(
            section.address, section.port, users, section.anonymous_role, certificate, private_key
        ),
    )


def metrics_settings(section: MetricsSection | None, problems: Problems) -> MetricsSettings | None:
    """Return the settings of the figures for Prometheus."""
    if section is None:
        return None
    table = "metrics"
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
    """Return a secret that a table states."""
    if file and environment:
        problems.add("stated_twice", f"{table}.{key}_environment", name=key)
        return None
    if not file and not environment:
        return Secret("")
    return problems.guarded(
        table, lambda: read_secret(file, environment, folder=problems.folder, table=table, key=key)
    )


def key_pair(
    table: str, certificate: str, private_key: str, problems: Problems, *, prefix: str = ""
) -> tuple[Path | None, Path | None]:
    """Return a certificate and its key that a table states."""
    if bool(certificate) != bool(private_key):
        lacking = "private_key" if certificate else "certificate"
        problems.add("pair_incomplete", table, name=f"{prefix}{lacking}")
    path = problems.existing(f"{table}.{prefix}certificate", certificate)
    if not private_key:
        return path, None
    file = problems.folder / private_key
    key = f"{table}.{prefix}private_key"
    problems.guarded(key, lambda: refuse_readable(file, key=key))
    return path, file
