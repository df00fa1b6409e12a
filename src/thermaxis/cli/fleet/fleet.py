"""Look after many machines: their models verified every night, from what they ship.

REGISTRY is a file of SQLite or the URL of a PostgreSQL database. Nothing is written onto a machine.
"""

import argparse
import asyncio
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from typing import Any, cast

from thermaxis import fleet
from thermaxis.cli._arguments import add_json, adder, count, day, refuse_both
from thermaxis.cli._database import add_password_file, database_of
from thermaxis.cli._json import show
from thermaxis.cli._progress import Progress
from thermaxis.cli._reading import add_reading, reading_of
from thermaxis.cli.axis.trend import values_of_change
from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError, ThermaxisError, require_known
from thermaxis.files import (
    format_model,
    model_sha256,
    parse_model,
    read_model,
    read_positioning_with_sha256,
    write_model,
)
from thermaxis.messages import remedy_of, sentence, sentence_of, text_of
from thermaxis.positioning import PositioningTest
from thermaxis.quantities import AxisKind
from thermaxis.report import FIGURE_SYMBOLS
from thermaxis.report.tables import Part, Table, Value, as_json, messages_of, values_of
from thermaxis.report.trend import shown_figures
from thermaxis.runtime import PROPOSAL_SUFFIX, read_machine

_DAYS_BACK = 6
_WORST = "rmse_um"
_AT_MACHINE = "there, thermaxis fleet fetch brings it into its folder of models."
_WITHDRAWN = {
    fleet.ProposalState.ACCEPTED: (
        "It was not fetched, and will not be: a newer night has to propose again."
    ),
    fleet.ProposalState.FETCHED: (
        "It was fetched: the next thermaxis fleet fetch at the machine removes it, unless it is in"
        " force there by then."
    ),
    fleet.ProposalState.IN_FORCE: (
        "It is in force: at the machine, choose another model on the page of models, or call"
        " thermaxis relearn --rollback; the next thermaxis fleet fetch then removes it."
    ),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)

    def action(name: str, text: str, first: str = "") -> argparse.ArgumentParser:
        found = actions.add_parser(name, help=text, allow_abbrev=False)
        if first:
            adder(found)(first, "the machine, with a folder of models", Path)
        adder(found)("registry REGISTRY", "file of SQLite, or URL of a database")
        add_password_file(found)
        return found

    init = action("init", "make a registry, or bring an older one to this version")
    adder(init)("lake LAKE", "folder to which machines ship, or a URL of fsspec")
    adder(init)("--move-lake", "LAKE takes the place of the one that the registry has", bool)
    _add_machine(action("add", "add a machine, or give one another model"))
    collected = action("collect", "store positioning runs of machines' axes, each once")
    add = adder(collected)
    add("runs RUN", "measured runs, or folders of them", Path, nargs="+")
    add("--machine MACHINE", "whose they are (default: the machine that a run's file states)")
    add("--axis AXIS", "of which axis (default: the axis that a run's file states)")
    add_json(collected)
    add_reading(collected, "a text")
    nights = action("night", "verify every machine's model on a day, from the lake")
    add = adder(nights)
    add("--day DATE", "the day, UTC (default: yesterday)", day)
    add(
        "--days-back N",
        f"days before it from which the model runs (default: {_DAYS_BACK})",
        count("number", 0),
        default=_DAYS_BACK,
    )
    add("--machine MACHINE", "only this one; may be given more than once", many=True)
    add(
        "--workers N",
        "processes on this computer (default: 0, in this one)",
        count("number", 0),
    )
    add("--scheduler URL", "scheduler of a Dask cluster that exists: tls://host:8786")
    add("--again", "do those that were set aside, too", bool)
    add("--dry-run", "only say what is missing", bool)
    add_json(nights)
    shown = action("show", "show the machines' last night")
    adder(shown)("--day DATE", "that of this day (default: the one judged last)", day)
    add_json(shown)
    one = action("machine", "show a machine: its models and its nights")
    adder(one)("machine MACHINE", "its name")
    add_json(one)
    for name, text in (
        ("accept", "accept the newest proposal, for the machine to fetch"),
        ("reject", "reject the newest proposal"),
        ("withdraw", "take an accepted model back"),
        ("rollback", "accept the model before the one in force, for the machine to fetch"),
    ):
        decided = action(name, text)
        add = adder(decided)
        add("machine MACHINE", "its name")
        add("--who PERSON", "who decides", _stated, required=True)
        add("--why TEXT", "why", _stated, required=True)
        if name == "accept":
            add("-o, --output MODEL", "write it there, too, a new file", Path)
    fetched = action(
        "fetch",
        "at a machine: bring its accepted model into its folder of models",
        "configuration MACHINE.toml",
    )
    add_json(fetched)
    _add_page(action("page", "serve the morning board"))


def _add_machine(added: argparse.ArgumentParser) -> None:
    add = adder(added)
    add("machine MACHINE", "its name, as in the lake")
    add("model MODEL", "its model in force (JSON)", Path)
    add("--kind KIND", "machines of one kind are sisters (default: machine)", default="machine")
    add(
        "--channel NAME=COLUMN",
        "column of its history for a channel of the model, or for the displacement of an output"
        " (default: of its own name, and probe_OUTPUT); may be given more than once",
        _pair,
        many=True,
    )
    add("--why TEXT", f"why this model (default: {fleet.ADDED})", default=fleet.ADDED)
    add("--from-sisters", "write MODEL first, a new file: the median of the kind's models", bool)
    add("--renames OLD", "the machine was called so; or it is that one, too, and both are one")


def _add_page(page: argparse.ArgumentParser) -> None:
    add = adder(page)
    add(
        "--users FILE",
        "users, as thermaxis user writes them: engineers decide on proposals (default: the page"
        " shows, and nobody decides)",
        Path,
    )
    add("--address ADDRESS", "where it is served (default: 127.0.0.1)", default="127.0.0.1")
    add("--port N", "port; 0 takes a free one (default: 8470)", count("port", 0), default=8470)
    add("--host NAME", "further name by which browsers reach it; more than once", many=True)
    add("--certificate FILE", "certificate for TLS, needed beyond this computer", Path)
    add("--private-key FILE", "its key; mode 0600", Path)


def _stated(text: str) -> str:
    if not text.strip():
        raise argparse.ArgumentTypeError("it is empty")
    return text


def _pair(text: str) -> tuple[str, str]:
    name, sign, column = text.partition("=")
    if not (name and sign and column):
        raise argparse.ArgumentTypeError(f"'{text}' is no NAME=COLUMN")
    return name, column


def run(arguments: argparse.Namespace) -> int:
    """Make, add, do or show."""
    address = database_of(arguments.registry, arguments.password_file, key="REGISTRY")
    if arguments.action == "init":
        fleet.Lake(arguments.lake)
        lake = arguments.lake
        if "://" not in lake:
            lake = str(Path(lake).absolute())
        stands = "there"
        try:
            fleet.Registry(*address).close()
        except ThermaxisError as error:
            stands = "made" if error.code in {"registry_not_found", "no_registry"} else stands
        fleet.Registry.make(address[0], lake, address[1], move_lake=arguments.move_lake).close()
        sys.stdout.write(f"The registry is {stands}; its lake is {lake}.\n")
        return 0
    actions = {"add": _add, "night": _night, "show": _show, "machine": _machine}
    actions |= {"accept": _decide, "reject": _decide, "fetch": _fetch}
    actions |= {"withdraw": _withdraw, "rollback": _roll_back, "collect": _collect, "page": _page}
    with fleet.Registry(*address) as registry:
        return actions[arguments.action](arguments, registry)


def _add(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    if arguments.model.suffix.casefold() == ".toml":
        raise ConfigurationError("configuration_for_model", file=arguments.model)
    if arguments.from_sisters:
        if arguments.model.exists():
            raise ConfigurationError("file_exists", file=arguments.model)
        watched = {one.machine for one in registry.standings() if one.night is not None}
        sisters = {
            one.name: parse_model(one.model, name=one.name)
            for one in registry.machines()
            if one.kind == arguments.kind and one.name in watched - {arguments.machine}
        }
        median = fleet.sister_model(sisters)
        write_model(median, arguments.model)
        said = f"{printable(str(arguments.model))}, {median.provenance.method}"
        sys.stdout.write(f"written: {said}\n")
    model = read_model(arguments.model)
    channels: dict[str, str] = dict(arguments.channel)
    outputs = (output.name for output in model.outputs)
    require_known("--channel", channels, [*model.channels, *outputs])
    machine = fleet.FleetMachine(
        *(arguments.machine, arguments.kind, format_model(model), model_sha256(model)), channels
    )
    former: str | None = arguments.renames
    if former is not None:
        stays = f"is one with it: what is stored of {former} stays under that name"
        merged = registry.rename(former, arguments.machine)
        known_as = stays if merged else f"was called {former}: what is stored of it goes on"
        sys.stdout.write(f"{arguments.machine} {known_as}.\n")
    new = registry.add(machine, arguments.why)
    sys.stdout.write(f"{arguments.machine} is {'added' if new else 'there, with this model'}.\n")
    with suppress(ThermaxisError):  # the lake need not be within reach of who adds
        names = [arguments.machine, *([former] if former else [])]
        if not any(map(fleet.Lake(registry.lake).days, names)):
            sys.stdout.write("Nothing was shipped under this name yet: it is the machine's own.\n")
    return 0


# ---- axes ---------------------------------------------------------------------------------------

_RUN_SUFFIXES = (".rtl", ".csv", ".dat", ".md", ".xlsx", ".xls")


def _collect(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    """Store runs; the code is 1 where one could not be read or has no place among the others."""
    if arguments.machine is not None:
        registry.machines([arguments.machine])
    files: list[Path] = []
    for path in arguments.runs:
        found = sorted(path.rglob("*")) if path.is_dir() else [path]
        files += (one for one in found if one == path or one.suffix.lower() in _RUN_SUFFIXES)
    reading, stored = reading_of(arguments), 0
    unread, others = list[str](), list[str]()
    with Progress() as progress:
        for done, path in enumerate(files):
            progress("runs", done, len(files))
            lost = others if path not in arguments.runs and path.suffix != ".rtl" else unread
            try:
                test, sha256 = read_positioning_with_sha256(path, **reading)
                lost = unread  # it is a run
                stored += _collected(arguments, registry, path.name, test, sha256)
            except ThermaxisError as error:
                if error.code == "registry_out_of_reach":
                    raise
                inside = error.at(error.message.place._replace(file=""))
                lost.append(f"{printable(str(path))}: {text_of(inside.message)}")
    runs = len(files) - len(others)
    show(
        [
            Value("runs", runs, "runs"),
            Value("stored", stored, "stored"),
            Value("known", runs - stored - len(unread), "known already"),
            Value("unread", unread, "not stored"),
            Value("others", others),
            Value("", len(others), "other files, no positioning runs" if others else None),
        ],
        arguments.json,
    )
    return 1 if unread else 0


def _collected(
    arguments: argparse.Namespace,
    registry: fleet.Registry,
    name: str,
    test: PositioningTest,
    sha256: str,
) -> bool:
    machine: str = arguments.machine or test.header.get("machine", "")
    axis: str = arguments.axis or test.header.get("axis", "")
    for stated, option in ((machine, "--machine"), (axis, "--axis")):
        if not stated:
            raise ConfigurationError("run_states_none", option=option)
    if test.start is None:
        raise ConfigurationError("run_without_start")
    if registry.axis_runs(machine, sha256):
        return False
    return registry.add_axis_run(fleet.axis_run(machine, axis, test, test.start, name, sha256))


def _axis(trend: fleet.AxisTrend) -> list[Value]:
    changed = ("per_year", "per_year_low", "per_year_high", "per_year_p_value")
    stepped = ("step", "step_at", "step_p_value")
    return [
        *values_of(trend, "axis", "kind"),
        Value("runs", [fleet.axis_run_as_json(run) for run in trend.runs]),
        Value("apart", [run.name for run in trend.apart]),
        Value(
            "changes",
            [
                as_json([*values_of_change(one.ends), *values_of(one, *changed, *stepped)])
                for one in trend.changes
            ],
        ),
        *messages_of("remarks", trend.remarks),
    ]


def _axis_table(trend: fleet.AxisTrend) -> Table:
    unit = AxisKind(trend.kind).units.deviation
    keys = shown_figures([(run.measured, run.drift_free) for run in trend.runs])
    rows = [
        [
            Value("", f"{run.start:%Y-%m-%d}", "start"),
            Value("", run.name[:40], "run"),
            Value("", run.air_c, "air C", ".1f"),
            *(
                Value(
                    "", getattr(side.get(key), "value", None), f"{FIGURE_SYMBOLS[key]}{word}", ".2f"
                )
                for word, side in (("", run.measured), (" free", run.drift_free))
                for key in keys
            ),
        ]
        for run in trend.runs
    ]
    title = f"Axis {trend.axis}: figures of ISO 230-2, {unit}; free: without drift"
    return Table(title, rows, words=2)


# ---- nights -------------------------------------------------------------------------------------


def _night(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    """Do what is missing; the code is 1 where a machine was set aside or could not be read."""
    refuse_both(arguments, "--workers", "--scheduler")
    today = datetime.now(UTC).date()
    asked = date.fromisoformat(arguments.day) if arguments.day else today - timedelta(days=1)
    if asked >= today:
        raise ConfigurationError("day_not_over", key="--day")
    chosen = {machine.name for machine in registry.machines(arguments.machine)}
    missing = [m for m in registry.missing(asked, again=arguments.again) if m.name in chosen]
    late = [
        (machine, day)
        for day in (asked - timedelta(days=1), asked)
        for machine in fleet.late_nights(registry, day)
        if machine.name in chosen
    ]
    jobs = [
        fleet.NightJob(machine, day, arguments.days_back, registry.lake)
        for machine, day in [*late, *((machine, asked) for machine in missing)]
    ]
    again = [f"{machine.name}, {day}" for machine, day in late]
    of_day: list[Part] = [
        Value("day", asked.isoformat(), "day"),
        Value("again", again, "again, as more was shipped" if again else None),
    ]
    if arguments.dry_run:
        names = [machine.name for machine in missing]
        show([*of_day, Value("missing", names, "missing")], arguments.json)
        return 0
    with ExitStack() as stack:
        progress = stack.enter_context(Progress())
        engine = stack.enter_context(
            fleet.dask_engine(arguments.scheduler or "", arguments.workers or 0)
            if jobs and (arguments.scheduler or arguments.workers)
            else fleet.serial_engine()
        )
        done = fleet.do_nights(registry, jobs, engine, report=progress)
    judged = registry.judge(asked)
    named = [one.machine for one in judged if one.named]
    who = f": {', '.join(named)}" if named else ""
    said = [f"{name}: {text_of(message)}" for name, message in done.unread.items()]
    show(
        [
            *of_day,
            *(
                Value(key, getattr(done, key), key.replace("_", " "))
                for key in ("asked", "stored", "not_shipped", "set_aside")
            ),
            Value("unread", said, "not read"),
            *_few(len(judged)),
            Value("named", len(named)),
            f"named {len(named)} machine{'s' * (len(named) != 1)}{who}",
        ],
        arguments.json,
    )
    return 1 if done.set_aside or said else 0


def _few(count: int) -> list[str]:
    """Return what is said where too few machines have a night of a day to be compared."""
    values = {"count": count, "least": fleet.SISTERS}
    return [sentence("fleet-few", values)] if 0 < count < fleet.SISTERS else []


def _show(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    newest = registry.last_judged() or registry.last_day()
    asked = date.fromisoformat(arguments.day) if arguments.day else newest
    nights = [] if asked is None else registry.nights(asked)
    named = [] if asked is None else registry.judgements(asked)
    place = {one.machine: number for number, one in enumerate(named)}
    nights = sorted(
        sorted(nights, key=_worst_first), key=lambda n: place.get(n.machine, len(place))
    )
    rows = [_row(night, night.machine) for night in nights]
    when = None if asked is None else asked.isoformat()
    known = {night.machine for night in nights}
    without = [one.name for one in registry.machines() if asked and one.name not in known]
    parts: list[Part] = [
        Value("day", when),
        *([sentence("fleet-no_nights")] if newest is None else []),
        Value("without", without, f"without a night of {when}" if without else None),
        *_few(len(known)),
        Table("Named, the surest first", [_named(one) for one in named], key="named", words=4),
        *(f"{j.machine}: {sentence_of(j.evidence[0])} {remedy_of(j.evidence[0])}" for j in named),
        Table(f"Nights of {when or 'no day yet'}, the worst first", rows, key="nights", words=4),
    ]
    show(parts, arguments.json)
    return 0


def _named(one: fleet.Judgement) -> list[Value]:
    return [
        *(Value(key, value) for key, value in fleet.judgement_as_json(one).items()),
        Value("", one.machine, "named"),
        Value("", one.kind, "kind"),
        Value("", f"{one.since}", "since"),
        Value("", sentence(f"cause-{one.causes[0]}"), "likely cause"),
    ]


def _machine(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    (machine,) = registry.machines([arguments.machine])
    nights = registry.nights(machine=machine.name)
    models = [
        [
            Value("sha256", model.sha256),
            Value("parent_sha256", model.parent_sha256),
            Value("added_utc", model.added_utc.isoformat()),
            Value("why", model.why, "why"),
            Value("", model.sha256[:12], "model"),
            Value("", f"{model.added_utc:%Y-%m-%d %H:%M}", "added"),
        ]
        for model in registry.models(machine.name)
    ]
    proposals = [
        [
            *values_of(one, "sha256", "parent_sha256", "accepted", "who", "why"),
            Value("day", one.day.isoformat(), "night of"),
            Value("", one.sha256[:12], "model"),
            Value("withdrawn", None if one.withdrawn is None else list(one.withdrawn)),
            Value("state", str(one.state), "state"),
            Value("", who, "by"),
            Value("", why, "why"),
        ]
        for one in registry.proposals(machine.name)
        for who, why in [one.withdrawn or (one.who, one.why)]
    ]
    axes = fleet.axis_trends(registry.axis_runs(machine.name))
    parts: list[Part] = [
        *values_of(machine, "name", "kind", "model_sha256"),
        Value("channels", dict(machine.channels)),
        Value("formerly", list(machine.formerly), "also called"),
        Table(f"{machine.name} ({machine.kind}): models", models, key="models", words=3),
        Table("Proposals", proposals, key="proposals", words=5),
        Table(
            "Nights",
            [_row(night, night.day.isoformat()) for night in nights],
            key="nights",
            words=4,
        ),
        *(part for axis in axes for part in (_axis_table(axis), *map(text_of, axis.remarks))),
        Table("", [_axis(axis) for axis in axes], key="axes"),
    ]
    show(parts, arguments.json)
    return 0


def _decide(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    """Store what a person decides; an accepted model may be written as a file, too."""
    accepted, name = arguments.action == "accept", arguments.machine
    output: Path | None = arguments.output if accepted else None
    if output is not None and output.exists():
        raise ConfigurationError("file_exists", file=output)
    found = registry.decide(name, accepted=accepted, who=arguments.who, why=arguments.why)
    said = "accepted" if accepted else "rejected"
    sys.stdout.write(f"The proposal {found.sha256} for {name} is {said}.\n")
    if output is not None:
        write_model(parse_model(found.content, name=name), output)
        sys.stdout.write(f"written: {printable(str(output))}\n")
    if accepted:
        sys.stdout.write(f"Nothing is changed on the machine: {_AT_MACHINE}\n")
    return 0


def _withdraw(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    for one in registry.withdraw(arguments.machine, who=arguments.who, why=arguments.why):
        sys.stdout.write(f"{one.sha256} is withdrawn. {_WITHDRAWN[one.state]}\n")
    return 0


def _roll_back(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    found = registry.roll_back(arguments.machine, who=arguments.who, why=arguments.why)
    sys.stdout.write(
        f"{found.sha256} is accepted in place of {found.parent_sha256}, and all others are"
        f" withdrawn.\nNothing is changed on the machine: {_AT_MACHINE}\n"
    )
    return 0


def _fetch(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    """Fetch; the code is 1 where an accepted model is not brought, or a withdrawn one stays."""
    configuration = read_machine(arguments.configuration)
    found = fleet.fetch(configuration, registry)
    news = f"; the registry knew {found.known_before[:12]}" if found.known_before else ""
    said = [f"{found.machine} has {found.model_sha256[:12]} in force{news}."]
    said += [f"removed, as it was withdrawn: {name}" for name in found.removed]
    if found.model is None and not found.remarks:
        said.append("There is no accepted model to fetch.")
    elif found.model is not None:
        proposal = Path(found.model).with_suffix(PROPOSAL_SUFFIX)
        command = f"thermaxis relearn {arguments.configuration.name} --accept {proposal}"
        said.append(f"{'written' if found.written else 'there already'}: {found.model}")
        said += ["Nothing is changed: choose it on the page of models, or by", command]
    keys = ("machine", "model_sha256", "known_before", "model", "written", "removed")
    parts = [*said, *values_of(found, *keys), *messages_of("remarks", found.remarks, "remark")]
    show(parts, arguments.json)
    return 1 if found.remarks else 0


def _page(arguments: argparse.Namespace, registry: fleet.Registry) -> int:
    """Serve the board until ended."""
    from thermaxis.board import board_settings, serve_board  # noqa: PLC0415 - a web server

    def tell(address: str) -> None:
        sys.stdout.write(f"fleet: {address}\n")
        sys.stdout.flush()

    served = ("address", "port", "host", "certificate", "private_key")
    settings = board_settings(*(getattr(arguments, name) for name in served))
    asyncio.run(serve_board(registry, settings, tell, arguments.users))
    return 0


def _outputs(night: fleet.StoredNight) -> Mapping[str, Mapping[str, Any]]:
    return cast("Mapping[str, Mapping[str, Any]]", night.result["outputs"])


def _worst_first(night: fleet.StoredNight) -> tuple[int, float]:
    """Order nights: those set aside, then sensors, then by what the model leaves."""
    set_aside = night.result["outcome"] == fleet.NightOutcome.SET_ASIDE
    left = [float(one[_WORST]) for one in _outputs(night).values()]
    return (0 if set_aside else 1 if night.result["sensor_codes"] else 2, -max(left, default=0.0))


def _row(night: fleet.StoredNight, first: str) -> list[Value]:
    """Return a night as a row: of several outputs the terminal shows the worst."""
    result, outputs = night.result, _outputs(night)
    worst = max(outputs.values(), key=lambda one: float(one[_WORST]), default=dict[str, Any]())
    sensors = cast("Sequence[Mapping[str, Any]]", result["sensor_codes"])
    return [
        Value("machine", night.machine),
        Value("kind", night.kind),
        Value("day", night.day.isoformat()),
        Value("model_sha256", night.model_sha256),
        Value("version", night.version),
        *(Value(key, value) for key, value in result.items()),
        Value("", first, "night of"),
        Value("", str(result["outcome"]), "outcome"),
        Value("", ", ".join(str(one["place"]["channel"]) for one in sensors) or "–", "sensors"),
        Value("", "yes" if result["proposal_sha256"] else "–", "proposal"),
        Value("", worst.get("touches"), "touches of 2 days"),
        Value("", worst.get("rmse_um"), "left um", ".2f"),
        Value("", worst.get("mean_um"), "mean um", "+.2f"),
        Value("", worst.get("offset_mae_um"), "with touches um", ".2f"),
    ]
