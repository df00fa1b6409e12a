"""Make, show and fetch certificates of encrypted OPC UA connections.

`new` makes an own certificate and its private key, which only the owner can read; `show` prints
what a certificate says and when it expires; `fetch` asks a machine for its certificate, shows the
fingerprint, and stores it once it was compared with the one that the machine itself shows. No other
certificate is then accepted from it.
"""

import argparse
import asyncio
import json
import logging
import os
import socket
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from datetime import UTC, datetime
from pathlib import Path

from thermaxis.cli._arguments import adder
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence_of
from thermaxis.runtime import SECURITIES, Certificate, CertificateUse, opcua
from thermaxis.runtime.host import whole_file

_ANSWER_LIMIT = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    _add_new(actions.add_parser("new", help="make a certificate and its key", allow_abbrev=False))
    show = actions.add_parser("show", help="show what certificates say", allow_abbrev=False)
    adder(show)("files CERTIFICATE", "certificate, DER or PEM", nargs="+")
    _add_fetch(
        actions.add_parser("fetch", help="store a machine's certificate", allow_abbrev=False)
    )


def _add_new(parser: argparse.ArgumentParser) -> None:
    add = adder(parser)
    add("certificate CERTIFICATE", "file of the certificate, such as own.der")
    add("key KEY", "file of the private key, such as own.pem")
    add(
        "--uri URI",
        "address of the application (default: urn:thermaxis:client)",
        default="urn:thermaxis:client",
    )
    add(
        "--host NAME",
        "name or address of this computer; may be given more than once (default: its name)",
        action="append",
    )
    add("--days N", "validity (default: 730, two years)", int)
    add("--organisation TEXT", "whose it is (default: not stated)", default="")
    add(
        "--use",
        "for connections to machines, for the status server, or both (default: client)",
        choices=("client", "server", "both"),
        default="client",
    )
    add("--replace", "renew files that are there already", bool)


def _add_fetch(parser: argparse.ArgumentParser) -> None:
    add = adder(parser)
    add("url URL", "address of the server, such as opc.tcp://192.168.214.241:4840")
    add("-o, --output CERTIFICATE", "file to store it in", required=True)
    add(
        "--fingerprint HEX",
        "fingerprint that the machine shows, SHA-256 or SHA-1; stored without a question if"
        " it is the same, not at all if it is another",
    )
    add(
        "--connection FILE.toml",
        "write the table [connection.control] for this machine there, a new file; the own"
        " certificate and key are looked for beside the machine's, own.der and own.pem",
        Path,
    )
    add("--timeout S", "longest time (default: 5)", float, default=5.0)
    add("--replace", "replace the stored certificate of a machine", bool)


def run(arguments: argparse.Namespace) -> int:
    """Make, show or fetch certificates."""
    actions = {"new": _new, "show": _show, "fetch": _fetch}
    actions[arguments.action](arguments)
    return 0


def _now() -> datetime:
    return datetime.now(UTC)


def _new(arguments: argparse.Namespace) -> None:
    new = opcua.NewCertificate(
        application_uri=arguments.uri,
        hosts=tuple(arguments.host or (socket.gethostname(),)),
        days=opcua.DEFAULT_DAYS if arguments.days is None else arguments.days,
        organisation=arguments.organisation,
        use=CertificateUse(arguments.use),
    )
    now = _now()
    path, key = Path(arguments.certificate), Path(arguments.key)
    opcua.write_pair(path, key, opcua.make_pair(new, now), replace=arguments.replace)
    sys.stdout.write(_as_text(opcua.certificate_of(path), now, str(path)))
    sys.stdout.write(f"private key   {key}, readable by its owner only\n")
    if arguments.use != "server":
        sys.stdout.write("Let the machine trust this certificate; compare its fingerprint there.\n")


def _show(arguments: argparse.Namespace) -> None:
    now = _now()
    files: Sequence[str] = arguments.files
    certificates = [opcua.certificate_of(Path(name)) for name in files]
    texts = [_as_text(c, now, name) for c, name in zip(certificates, files, strict=True)]
    sys.stdout.write("\n".join(texts))


def _as_text(certificate: Certificate, now: datetime, name: str) -> str:
    begin, end = (
        moment.strftime("%Y-%m-%d") for moment in (certificate.not_before, certificate.not_after)
    )
    lines = [
        f"certificate   {name}",
        f"names         {certificate.subject}",
        f"application   {', '.join(certificate.application_uris) or 'not stated'}",
        f"computer      {', '.join(certificate.hosts) or 'not stated'}",
        f"valid         {begin} to {end}, {certificate.days_left(now):.0f} days left",
        f"SHA-256       {certificate.sha256}",
        f"SHA-1         {certificate.sha1}",
    ]
    warning = opcua.validity_warning(certificate, now, Path(name))
    if warning is not None:
        lines.append(f"warning       {sentence_of(warning)}")
    return "".join(f"{line}\n" for line in lines)


def _fetch(arguments: argparse.Namespace) -> None:
    table: Path | None = arguments.connection
    if table is not None and table.exists():
        raise ConfigurationError("file_exists", file=table, key="--connection")
    library = logging.getLogger("asyncua")
    level = library.level
    library.setLevel(logging.CRITICAL)  # what fails is said in words
    try:
        offers = asyncio.run(opcua.fetch_offers(arguments.url, arguments.timeout))
    finally:
        library.setLevel(level)
    offer = _chosen(offers, arguments)
    sys.stdout.write(_as_text(offer.certificate, _now(), arguments.url))
    sys.stdout.write(f"policies      {', '.join(offer.policies) or 'none that encrypts'}\n")
    sys.stdout.write(f"users         {', '.join(offer.users) or 'not stated'}\n")
    if arguments.fingerprint is None and not _confirmed():
        raise ConfigurationError("fingerprint_not_confirmed", file=arguments.url)
    with nullcontext() if table is None else whole_file(table) as stream:  # both or neither
        if stream is not None:
            stream.write(_table(arguments, offer).encode())
        path = Path(arguments.output)
        opcua.write_certificate(path, offer.certificate, replace=arguments.replace)
    sys.stdout.write(f"stored        {arguments.output}\n")
    if table is not None:
        sys.stdout.write(f"written       {table}\n")


def _table(arguments: argparse.Namespace, offer: opcua.ServerOffer) -> str:
    """Return the connection as machine.toml has it; what a person must decide is left empty."""
    folder, stored = arguments.connection.absolute().parent, Path(arguments.output).absolute()
    own = stored.with_name("own.der")
    files = {
        "certificate": own,
        "private_key": own.with_suffix(".pem"),
        "server_certificate": stored,
    }
    values = {
        "url": arguments.url,
        "security": min(offer.policies, key=SECURITIES.index, default=""),
        **{key: Path(os.path.relpath(file, folder)).as_posix() for key, file in files.items()},
    }
    uris = opcua.certificate_of(own).application_uris if own.exists() else ()
    if uris:
        values["application_uri"] = uris[0]
    if "anonymous" not in offer.users:
        values |= {"user": "", "password_file": ""}
    lines = (
        f"{key} = {json.dumps(value, ensure_ascii=False)}{'' if value else '  # decide'}\n"
        for key, value in values.items()
    )
    return f"[connection.control]\n{''.join(lines)}"


def _chosen(
    offers: Sequence[opcua.ServerOffer], arguments: argparse.Namespace
) -> opcua.ServerOffer:
    if not offers:
        raise ConfigurationError("no_server_certificate", file=arguments.url)
    if arguments.fingerprint is None:
        usable = [offer for offer in offers if offer.policies] or list(offers)
        if len(usable) == 1:
            return usable[0]
        raise ConfigurationError(
            "several_server_certificates",
            file=arguments.url,
            fingerprints=", ".join(offer.certificate.sha256 for offer in usable),
        )
    wanted = _digits(arguments.fingerprint)
    for offer in offers:
        if wanted in {_digits(offer.certificate.sha256), _digits(offer.certificate.sha1)}:
            return offer
    raise ConfigurationError(
        "other_fingerprint",
        file=arguments.url,
        fingerprints=", ".join(offer.certificate.sha256 for offer in offers),
    )


def _digits(fingerprint: str) -> str:
    return "".join(c for c in fingerprint.lower() if c not in ": -")


def _confirmed() -> bool:
    """Ask whether the machine shows the same fingerprint; no answer means no."""
    sys.stdout.write("Does the machine itself show this fingerprint? Write yes to store it: ")
    sys.stdout.flush()
    answer = sys.stdin.readline(_ANSWER_LIMIT)
    if not sys.stdin.isatty():
        sys.stdout.write("\n")
    return answer.strip().lower() == "yes"
