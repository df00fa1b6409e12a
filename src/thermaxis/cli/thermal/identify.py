"""``thermaxis identify``: from thermal logs to a compensation model."""

import argparse
from collections.abc import Sequence
from datetime import date
from pathlib import Path

import numpy as np

from thermaxis import __version__, report
from thermaxis.cli._json import show
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._identification_result import (
    described,
)
from thermaxis.cli.thermal._thermal_logs import (
    ReadLog,
    add_log_options,
    check_written,
    positive_seconds,
    read_logs,
    remarks_of,
    span,
)
from thermaxis.codes import printable
from thermaxis.compensation import Provenance
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.files import write_model
from thermaxis.thermal import (
    Identification,
    InputDefinition,
    LogFinding,
    Method,
    Records,
    ThermalLog,
    check_inputs,
    check_log,
    identify,
    identify_joint,
    parse_input,
    records_of,
    usual_step_of,
)

_DISPLACEMENTS = ("um", "mm", "nm", "m")
_FEWEST_ROWS = 2
_SHORTEST_STEP = 0.5


def _orders(text: str) -> tuple[int, int, int]:
    words = text.split(",")
    if len(words) != 3 or not all(word.strip().isdecimal() for word in words):
        raise argparse.ArgumentTypeError(f"'{text}' is no na,nb,nk, such as 2,2,3")
    na, nb, nk = (int(word) for word in words)
    return na, nb, nk


def _joint(text: str) -> tuple[str, dict[str, float | None]]:
    part, sign, listed = text.partition("=")
    found: dict[str, float | None] = {}
    for entry in listed.split(","):
        channel, at, place = (word.strip() for word in entry.partition("@"))
        try:
            diameter = None if place.casefold() == "tcp" else float(place)
        except ValueError:
            diameter = -1.0
        good = channel and at and channel not in found and (diameter is None or diameter >= 0.0)
        if not sign or not part.strip() or not good:
            raise argparse.ArgumentTypeError(
                f"'{text}' is no PART=CHANNEL@MM,CHANNEL@MM,..., such as"
                " table=Z_D0_um@0,Z_D3000_um@3000"
            )
        found[channel] = diameter
    return part.strip(), found


def _date(text: str) -> str:
    try:
        return date.fromisoformat(text).isoformat()
    except ValueError:
        raise argparse.ArgumentTypeError("a date such as 2026-03-31 is expected") from None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = parser.add_argument
    add(
        "logs",
        metavar="LOG",
        type=Path,
        nargs="+",
        help="calibration tests, each an experiment of its own: CSV, Parquet, .xlsx, .mat or .tdms",
    )
    add(
        "--output",
        metavar="CHANNEL",
        action="append",
        required=True,
        help="measured displacement, such as Z_um; may be given more than once",
    )
    add(
        "--input",
        metavar="NAME=CHANNEL[-CHANNEL]",
        action="append",
        default=[],
        help="an input: a channel or the difference of two, such as"
        " spindle=T_spindle_c-T_column_c; may be given more than once",
    )
    add(
        "--candidates",
        metavar="PATTERN",
        action="append",
        default=[],
        help='channels among which the selection chooses, such as "t*_C"',
    )
    add(
        "--span",
        metavar="A:B",
        type=span,
        help="rows (0:6669, the last one not included) or times (0:8h) of each log",
    )
    add(
        "--sample-time",
        metavar="S",
        type=positive_seconds,
        help="take means over so much time first (default: the logs' own step)",
    )
    add(
        "--method",
        choices=("modal", "oe", "arx"),
        default="modal",
        help="estimator: gains and lags that are always stable (default), or the paper's output"
        " error or ARX",
    )
    add(
        "--orders",
        metavar="NA,NB,NK",
        type=_orders,
        help="orders of oe and arx (default: searched up to four)",
    )
    add(
        "--joint",
        metavar="PART=CHANNEL@MM,...",
        type=_joint,
        help="estimate the gain of a part by workpiece diameter together with the parts, from"
        " displacements at several diameters: table=Z_D0_um@0,Z_D3000_um@3000; --output then names"
        " the model's output",
    )
    add("--model", metavar="OUT.json", type=Path, help="write the compensation model")
    add("--json", metavar="FILE|-", help="write the result as JSON; - for standard output alone")
    add(
        "--report",
        metavar="FILE",
        type=Path,
        action="append",
        default=[],
        help="write the report, .pdf or .html; may be given more than once",
    )
    add("--date", metavar="YYYY-MM-DD", type=_date, help="date, kept in the model")
    add_log_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Identify, show and write."""
    _check_outputs(arguments)
    with Progress() as progress:
        progress("reading", 0, 0)
        entries = read_logs(
            arguments.logs,
            mapping=arguments.mapping,
            part=arguments.span,
            sample_time_s=arguments.sample_time,
        )
        _check_twice(entries)
        logs = [entry.log for entry in entries]
        inputs = _inputs(arguments, logs)
        outputs: list[str] = arguments.output
        if arguments.joint is not None:
            outputs = list(arguments.joint[1])
        _check_logs(arguments, logs, inputs, outputs)
        used = [*outputs, *(c for d in inputs for c in d.channels)]
        findings: dict[str, Sequence[LogFinding]] = {}
        for log in logs:
            known = {name.casefold(): name for name in log.columns}
            names = dict.fromkeys(known[c.casefold()] for c in used if c.casefold() in known)
            findings[log.where] = check_log(log.select(list(names)))
        remarks = remarks_of(logs)
        records = records_of(
            logs,
            inputs,
            outputs,
            sample_time_s=arguments.sample_time or _common_step_s(arguments, logs, inputs),
            reference_s=arguments.reference,
        )
        progress("identifying", 0, 0)
        result = _identified(arguments, records, logs)
        provenance = Provenance(
            method=f"{arguments.method}: {result.rule}"[:2000],
            program=f"thermaxis {__version__}",
            date=arguments.date or "",
            logs=tuple(entry.training for entry in entries),
            figures={f"{o.name}.fit_percent": o.fit_percent for o in result.outputs},
        )
        if arguments.model is not None:
            write_model(result.to_compensation_model(records, provenance), arguments.model)
        if arguments.report:
            progress("report", 0, 0)
            for path in arguments.report:
                report.write_identification_report(
                    result, records, logs, provenance, path, reference_s=arguments.reference
                )
    written = [path for path in (arguments.model, *arguments.report) if path is not None]
    show(described(result, records, findings, remarks), arguments.json, written)
    return 0


def _identified(
    arguments: argparse.Namespace, records: Records, logs: Sequence[ThermalLog]
) -> Identification:
    """Call the estimator that was asked for."""
    if not arguments.candidates and not (records.highest_k > records.lowest_k).any():
        raise DataError(
            "no input ever changes",
            where=", ".join(log.where for log in logs[:3]),
            remedy="Check the sensors, or name other channels",
        )
    if arguments.joint is not None:
        return identify_joint(records, arguments.output[0], *arguments.joint)
    return identify(
        records,
        method=Method(arguments.method),
        choose=bool(arguments.candidates),
        orders=arguments.orders,
    )


def _check_outputs(arguments: argparse.Namespace) -> None:
    if not arguments.input and not arguments.candidates:
        raise ConfigurationError(
            "no input is named",
            where="--input, --candidates",
            remedy='Write --input spindle=T_spindle_c-T_column_c, or --candidates "T*_c"',
        )
    check_written(
        [
            ("--model", arguments.model),
            ("--json", arguments.json),
            *(("--report", path) for path in arguments.report),
        ],
        [*arguments.logs, arguments.mapping],
    )
    alone = len(arguments.output) == 1 and arguments.method == "modal" and not arguments.candidates
    if arguments.joint is not None and not alone:
        raise ConfigurationError(
            "joint gains are for one output, the method modal and named inputs", where="--joint"
        )
    if len(set(arguments.output)) < len(arguments.output):
        raise ConfigurationError("an output is named twice", where="--output")


def _check_logs(
    arguments: argparse.Namespace,
    logs: Sequence[ThermalLog],
    inputs: Sequence[InputDefinition],
    outputs: Sequence[str],
) -> None:
    """Refuse what no estimator can make anything of."""
    for log in logs:
        if log.rows < _FEWEST_ROWS:
            raise DataError(
                "the log has a single row, or a single mean",
                where=log.where,
                remedy="Give a test of some hours, a longer span, or a shorter sample time",
            )
        step_s = _step_of_values(log)
        if arguments.sample_time is not None and arguments.sample_time < _SHORTEST_STEP * step_s:
            raise ConfigurationError(
                f"{arguments.sample_time:g} s is shorter than the time between the rows of"
                f" {log.where}, {step_s:g} s",
                where="--sample-time",
                remedy="Leave it out, or give a longer time",
            )
    measured = {name.casefold() for name in outputs}
    for definition in inputs:
        if any(channel.casefold() in measured for channel in definition.channels):
            raise ConfigurationError(
                f"the input {printable(definition.name, 40)} is made of a measured displacement",
                where="--input",
                remedy="Name temperatures: displacements are not there when the machine works",
            )


def _step_of_values(log: ThermalLog) -> float:
    """Return the usual time between rows that hold a value: means over less are mostly empty."""
    filled = np.zeros(log.rows, dtype=np.bool_)
    for values in log.columns.values():
        filled |= ~np.isnan(values)
    times_s = log.time_s[filled]
    return float(np.median(np.diff(times_s))) if times_s.size > 1 else 0.0


def _check_twice(entries: Sequence[ReadLog]) -> None:
    """Refuse a log that is named twice: it would count as two experiments."""
    seen: set[tuple[str, int, int]] = set()
    for entry in entries:
        key = (entry.training.sha256, entry.training.first_row, entry.training.rows)
        if key in seen:
            raise ConfigurationError(
                "the same log is given twice: it would count as two experiments",
                where=entry.training.name,
                remedy="Give it once",
            )
        seen.add(key)


def _common_step_s(
    arguments: argparse.Namespace,
    logs: Sequence[ThermalLog],
    inputs: Sequence[InputDefinition],
) -> float | None:
    """Return the step at which every candidate has a value; None where the rows' own step does."""
    if not arguments.candidates:
        return None
    slowest = max(usual_step_of(log, inputs) for log in logs)
    own = max(log.usual_step_s for log in logs)
    return slowest if slowest > 1.5 * own else None


def _inputs(
    arguments: argparse.Namespace, logs: Sequence[ThermalLog]
) -> tuple[InputDefinition, ...]:
    """Return the inputs that were named, and every channel that fits a pattern."""
    found: list[InputDefinition] = []
    for text in arguments.input:
        written = parse_input(text, channels=logs[0].columns)
        minus = None if written.minus is None else logs[0].name_of(written.minus)
        # Models of several tests fit together only if they spell a channel alike.
        found.append(InputDefinition(written.name, logs[0].name_of(written.plus), minus))
    outputs = {name.casefold() for name in arguments.output}
    for pattern in arguments.candidates:
        names = [
            n
            for n in logs[0].names_matching(pattern)
            if n.casefold() not in outputs and logs[0].units[n] not in _DISPLACEMENTS
        ]
        if not names:
            raise ConfigurationError(
                "no channel fits the pattern",
                where=f"--candidates {printable(pattern, 60)}",
                remedy=f"Channels are {', '.join(list(logs[0].columns)[:12])}",
            )
        known = {definition.name for definition in found}
        found += [InputDefinition(name, name) for name in names if name not in known]
    check_inputs(found)
    return tuple(found)
