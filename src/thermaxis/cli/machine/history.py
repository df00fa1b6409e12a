"""Read the history that the loop writes, while it runs or later; nothing is changed.

HISTORY is a file of SQLite, the URL of a database, or a machine's configuration (MACHINE.toml),
which names it.
"""

import argparse
import math
import sys
from collections import Counter
from datetime import datetime, timedelta
from pathlib import Path

from thermaxis.cli._arguments import add_json, adder, count, positive_seconds, refuse_foreign
from thermaxis.cli._database import add_password_file, database_of
from thermaxis.cli._json import show, write_json
from thermaxis.cli._progress import Progress
from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError
from thermaxis.files.table import parse_moment
from thermaxis.messages import text_of
from thermaxis.report.tables import Value, messages_of, values_of
from thermaxis.runtime import EventRecord, history, read_machine


def _moment(text: str) -> datetime:
    found = parse_moment(text)
    if found is None and len(text) == len("2026-11-20"):
        found = parse_moment(f"{text}T00:00")
    if found is None:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no time; write 2026-11-20, 2026-11-20T14:03 or 2026-11-20T14:03:05+01:00"
        )
    return found.astimezone()  # a time without a zone is one of this computer's


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    export = actions.add_parser(
        "export", help="write a span as a thermal log, Parquet or CSV", allow_abbrev=False
    )
    _add_history(export)
    add = adder(export)
    add("-o, --output LOG", ".parquet or .csv", Path, required=True)
    _add_span(export)
    add(
        "--column PATTERN",
        "headings that are wanted, with * and ?; may be given more than once (default: all)",
        many=True,
    )
    add(
        "--all",
        "also states, reasons and statuses as codes, ages, and what the model was given",
        bool,
    )
    events = actions.add_parser("events", help="list what happened", allow_abbrev=False)
    _add_history(events)
    _add_span(events)
    add = adder(events)
    add(
        "--kind KIND",
        "start, stop, state, request, connection, alarm, commission or loss; may be given"
        " more than once (default: all)",
        many=True,
    )
    add("--newest N", "only the newest (default: all in the span)", count("number", 1))
    add("--json FILE|-", "write them as JSON; - for standard output alone")
    check = actions.add_parser(
        "check", help="read everything and say what is there", allow_abbrev=False
    )
    _add_history(check)
    copy = actions.add_parser(
        "copy", help="copy a file of SQLite, also while the loop writes to it", allow_abbrev=False
    )
    _add_history(copy)
    adder(copy)("-o, --output FILE", "the copy, a new file", Path, required=True)
    ship = actions.add_parser(
        "ship", help="send finished hours and days to a lake, each once", allow_abbrev=False
    )
    _add_history(ship)
    adder(ship)("lake LAKE", "folder, or a URL of fsspec such as s3://bucket/fleet")
    add_json(ship)


def _add_history(parser: argparse.ArgumentParser) -> None:
    adder(parser)("history HISTORY", "file, URL, or MACHINE.toml")
    add_password_file(parser, "MACHINE.toml names its own; else ")


def _add_span(parser: argparse.ArgumentParser) -> None:
    add = adder(parser)
    zone = "without a zone it is this computer's"
    add(
        "--from TIME",
        "begin: 2026-11-20, 2026-11-20T14:03 or with a zone 2026-11-20T14:03:05+01:00"
        " (default: the begin of the history)",
        _moment,
        dest="first",
    )
    add("--to TIME", f"end, not included; {zone}", _moment, dest="last")
    add(
        "--last TIME",
        "so long before the end of the history, such as 90min or 8h",
        positive_seconds,
        dest="length_s",
    )


def run(arguments: argparse.Namespace) -> int:
    """Export, list, check, copy or ship."""
    url, password = _address_of(arguments)
    if arguments.action == "ship":
        return _ship(arguments, url, password)
    actions = {"export": _export, "events": _events, "check": _check, "copy": _copy}
    actions[arguments.action](arguments, url, password)
    return 0


def _address_of(arguments: argparse.Namespace) -> tuple[str, str]:
    """Return URL and password of what the user names."""
    text: str = arguments.history
    if "://" not in text and text.casefold().endswith(".toml"):
        refuse_foreign(arguments, "the URL of a database", "--password-file")
        machine = read_machine(text)
        return machine.historian.url, machine.historian.password.reveal()
    return database_of(text, arguments.password_file, key="HISTORY")


def _span(
    arguments: argparse.Namespace, reader: history.HistoryReader
) -> tuple[datetime | None, datetime | None]:
    first: datetime | None = arguments.first
    last: datetime | None = arguments.last
    if arguments.length_s is not None:
        if first is not None or last is not None:
            raise ConfigurationError(
                "options_exclude", key="--last", one="--last", other="--from, --to"
            )
        whole = reader.span()
        if whole is not None:
            first = whole[1] - timedelta(seconds=arguments.length_s)
    if first is not None and last is not None and first >= last:
        raise ConfigurationError("span_ends_before_it_begins", key="--from, --to")
    return first, last


def _export(arguments: argparse.Namespace, url: str, password: str) -> None:
    output: Path = arguments.output
    if output.suffix.casefold() not in {".parquet", ".csv"}:
        raise ConfigurationError(
            "history_suffix", file=output, key="--output", suffix=output.suffix
        )
    with history.HistoryReader(url, password) as reader:
        first, last = _span(arguments, reader)
        written = history.export_history(
            reader,
            output,
            first=first,
            last=last,
            patterns=arguments.column,
            everything=arguments.all,
        )
    sys.stdout.write(
        f"written: {printable(str(output))} ({_number(written.rows, 'cycle')},"
        f" {1 + len(written.columns)} columns)\n"
    )


def _events(arguments: argparse.Namespace, url: str, password: str) -> None:
    with history.HistoryReader(url, password) as reader:
        first, last = _span(arguments, reader)
        found = reader.events(first, last, kinds=arguments.kind, newest=arguments.newest)
    if arguments.json is not None:
        write_json({"events": [_event_as_json(event) for event in found]}, arguments.json)
    if arguments.json != "-":
        sys.stdout.write("".join(map(_event_line, found)) or "There are no such events.\n")


def _event_as_json(event: EventRecord) -> dict[str, object]:
    details = {
        name: str(value) if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in event.details.items()
    }
    return {
        "utc": event.utc.isoformat(),
        "kind": event.kind,
        "who": event.who,
        "text": event.text,
        "details": details,
    }


def _event_line(event: EventRecord) -> str:
    when = event.utc.astimezone().isoformat(sep=" ", timespec="seconds")
    who = f" ({printable(event.who, 60)})" if event.who else ""
    return f"{when}  {printable(event.kind, 20):<10}  {printable(event.text, 400)}{who}\n"


def _check(_: argparse.Namespace, url: str, password: str) -> None:
    with Progress() as progress:
        found = history.check_history(url, password, report=progress)
    sys.stdout.write(_condition_text(found))


def _number(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _condition_text(found: history.Condition) -> str:
    lines = ["The history is sound: everything in it could be read."]
    if found.first is not None and found.last is not None:
        times = (
            found.first.isoformat(timespec="seconds"),
            found.last.isoformat(timespec="seconds"),
        )
        lines.append(f"{_number(found.cycles, 'cycle')} from {times[0]} to {times[1]}")
    else:
        lines.append("no cycles")
    lines.append(f"{_number(found.events, 'event')}, {_number(found.starts, 'start')} of the loop")
    if found.lost_cycles or found.lost_events:
        lines.append(
            f"It says itself what was lost, {_number(found.lost_cycles, 'cycle')} and"
            f" {_number(found.lost_events, 'event')}: thermaxis history events --kind loss"
        )
    lines.append(f"{found.size_bytes / 1e6:.1f} MB")
    return "\n".join(lines) + "\n"


def _copy(arguments: argparse.Namespace, url: str, _: str) -> None:
    history.copy_history(url, arguments.output)
    sys.stdout.write(f"written: {printable(str(arguments.output))}\n")


def _ship(arguments: argparse.Namespace, url: str, password: str) -> int:
    """Ship; the code is 1 where parts were kept apart or are damaged."""
    from thermaxis import fleet  # noqa: PLC0415 - the other actions need no fsspec

    lake = fleet.Lake(arguments.lake)
    with history.HistoryReader(url, password) as reader, Progress() as progress:
        sent = fleet.ship(reader.parts(), lake, report=progress)
    text = f"{_number(sent.sent, 'part')} sent of {sent.parts}, {sent.sent_bytes / 1e6:.1f} MB"
    counts = Counter(one.code for one in sent.remarks)
    first = {one.code: text_of(one) for one in reversed(sent.remarks)}
    once = [first[code] + f" ({n - 1} more)" * (n > 1) for code, n in counts.items()]
    parts = [
        *(text, *values_of(sent, "parts", "sent", "sent_bytes")),
        *messages_of("remarks", sent.remarks),
        Value("", once, "remark"),
    ]
    show(parts, arguments.json)
    return 1 if sent.remarks else 0
