"""Identify a compensation model from thermal logs."""

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from thermaxis import __version__, report, thermal
from thermaxis.cli._arguments import add_figures, add_json, add_report, adder, day, positive_seconds
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._identification import described
from thermaxis.cli.thermal._series import add_series, write_run_series
from thermaxis.cli.thermal._thermal_logs import (
    add_log_options,
    check_twice,
    entries_of,
    findings_in,
    reading_codes,
    remarks_of,
    span,
)
from thermaxis.compensation import Provenance
from thermaxis.errors import ConfigurationError, DataError, require_unique
from thermaxis.files import write_model
from thermaxis.messages import text_of

_T = TypeVar("_T")
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


def _lags(text: str) -> tuple[str, tuple[float, ...]]:
    name, _, listed = text.rpartition("=")
    return name.strip(), tuple(positive_seconds(word) for word in listed.split(","))


_NO_TIME = re.compile(r"0+(\.0*)?\s*(s|min|h)?")


def _delay(text: str) -> tuple[str, float | None]:
    name, sign, length = (word.strip() for word in text.rpartition("="))
    if not sign or not name:
        raise argparse.ArgumentTypeError(f"'{text}' is no INPUT=auto or INPUT=S")
    if length.casefold() == "auto":
        return name, None
    return name, 0.0 if _NO_TIME.fullmatch(length) else positive_seconds(length)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add(
        "logs LOG",
        "calibration tests, each an experiment of its own: CSV, Parquet, .xlsx, .mat or .tdms",
        Path,
        nargs="+",
    )
    add(
        "--output CHANNEL",
        "measured displacement, such as Z_um; may be given more than once",
        action="append",
        required=True,
    )
    add(
        "--input NAME=CHANNEL[-CHANNEL]",
        "an input: a channel or the difference of two, such as"
        " spindle=T_spindle_c-T_column_c; may be given more than once",
        many=True,
    )
    add(
        "--candidates PATTERN",
        'channels among which the selection chooses, with * and ?, such as "t*_C";'
        " displacements are never among them; where a candidate is slower than the rows,"
        " means over its step are taken unless a sample time is given; may be given more than"
        " once; modal only",
        many=True,
    )
    add(
        "--span A:B",
        "part of each log: rows from zero, the last one not included (0:6669), or times"
        " (0:8h, 30min:90min) (default: the whole log)",
        span,
    )
    add(
        "--sample-time S",
        "take means over so much time first (default: the logs' own step)",
        positive_seconds,
    )
    add(
        "--method",
        "modal: direct gain and lags, always stable; oe, arx: output error and ARX of the"
        " paper; averages, static: a ridge on inputs and their averages over fixed times, on"
        " inputs alone (default: modal)",
        choices=("modal", "oe", "arx", "averages", "static"),
        default="modal",
    )
    add(
        "--orders NA,NB,NK",
        "order of the denominator, number of numerator coefficients, delay in rows; of oe and"
        " arx only (default: searched up to three, lags only)",
        _orders,
    )
    add(
        "--lags [INPUT=]S,S,...",
        "time constants that are known, of all inputs or of one: 600,2h or spindle=600,2h; may be"
        " given more than once; modal with --input only (default: those that the record shows)",
        _lags,
        many=True,
    )
    add(
        "--delay INPUT=auto|S",
        "dead time of an input: a time, or auto for the most likely one; no clock is then set; may"
        " be given more than once; modal with --input only (default: none)",
        _delay,
        many=True,
    )
    add(
        "--joint PART=CHANNEL@MM,...",
        "estimate the gain of a part by workpiece diameter together with the parts, from"
        " displacements at several diameters: table=Z_D0_um@0,Z_D3000_um@3000, with @tcp for"
        " the tool centre point; --output is then the name of the model's (default: gains 1)",
        _joint,
    )
    add("--model OUT.json", "write the compensation model", Path)
    add_json(parser)
    add_series(parser)
    add_report(parser)
    add_figures(parser)
    add(
        "--date YYYY-MM-DD",
        "date, kept in the model: the program reads no clock, so that same input gives same bytes",
        day,
    )
    add_log_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Identify, show and write."""
    _check_outputs(arguments)
    with Progress() as progress:
        progress("reading", 0, 0)
        entries = entries_of(
            arguments, arguments.logs, part=arguments.span, sample_time_s=arguments.sample_time
        )
        check_twice(entries)
        logs = [entry.log for entry in entries]
        inputs = _inputs(arguments, logs)
        outputs: list[str] = arguments.output
        if arguments.joint is not None:
            outputs = list(arguments.joint[1])
        _check_logs(arguments, logs, inputs, outputs)
        if not arguments.as_logged:
            logs = [
                thermal.with_one_clock(
                    log,
                    inputs,
                    outputs,
                    reference_s=arguments.reference,
                    told_only=bool(arguments.delay),
                )
                for log in logs
            ]
        used = [*outputs, *(c for d in inputs for c in d.channels)]
        findings = {log.where: findings_in(log, used) for log in logs}
        remarks = remarks_of(logs)
        records = thermal.records_of(
            logs,
            inputs,
            outputs,
            sample_time_s=arguments.sample_time or _common_step_s(arguments, logs, inputs),
            reference_s=arguments.reference,
        )
        progress("identifying", 0, 0)
        result = _identified(arguments, records, logs)
        provenance = Provenance(
            method=f"{arguments.method}: {text_of(result.rule)}"[:2000],
            program=f"thermaxis {__version__}",
            date=arguments.date or "",
            logs=tuple(entry.training for entry in entries),
            figures={
                f"{o.name}.fit_percent": fit
                for o in result.outputs
                if (fit := o.fit_percent) is not None
            }
            | {
                f"{o.name}.condemned": 1.0
                for o in result.outputs
                if not thermal.VERDICTS.isdisjoint(w.code for w in o.warnings)
            },
        )
        if arguments.model is not None:
            model = result.to_compensation_model(records, provenance, sentence=text_of)
            write_model(model, arguments.model)
        if arguments.series is not None:
            write_run_series([run for o in result.outputs for run in o.runs], arguments.series)
        if arguments.report or arguments.figures is not None:
            progress("report", 0, 0)
        if arguments.report:
            report.write_identification_report(
                result,
                records,
                logs,
                provenance,
                *arguments.report,
                reference_s=arguments.reference,
            )
        if arguments.figures is not None:
            report.write_identification_figures(
                result, records, logs, arguments.figures, reference_s=arguments.reference
            )
    files = (arguments.model, arguments.series, *arguments.report, arguments.figures)
    written = [path for path in files if path is not None]
    first = remarks_of(logs, assumed=True)
    told = described(result, records, findings, remarks, beside=len(first) + len(written))
    shown = [*first, *told, reading_codes(logs)]
    show(shown, arguments.json, written)
    return 0


def _identified(
    arguments: argparse.Namespace, records: thermal.Records, logs: Sequence[thermal.ThermalLog]
) -> thermal.Identification:
    """Call the estimator that was asked for."""
    if not arguments.candidates and not (records.highest_k > records.lowest_k).any():
        raise DataError("no_input_changes", file=", ".join(log.where for log in logs[:3]))
    options = _modal_options(arguments, [definition.name for definition in records.inputs])
    if arguments.joint is not None:
        return thermal.identify_joint(
            records, arguments.output[0], *arguments.joint, modal_options=options
        )
    return thermal.identify(
        records,
        method=thermal.Method(arguments.method),
        choose=bool(arguments.candidates),
        orders=arguments.orders,
        modal_options=options,
    )


def _modal_options(
    arguments: argparse.Namespace, names: Sequence[str]
) -> thermal.ModalOptions | None:
    """Return the lags and delays that were given, in the order of the inputs."""
    lags: dict[str, tuple[float, ...]] = _by_input("--lags", arguments.lags, names)
    delays: dict[str, float | None] = _by_input("--delay", arguments.delay, names)
    every = [lags.get(name, lags.get("", ())) for name in names]
    lacking = [name for name, its in zip(names, every, strict=True) if lags and not its]
    if lacking:
        raise ConfigurationError("lags_missing", names=", ".join(lacking), key="--lags")
    return thermal.ModalOptions(
        time_constants_s=tuple(every) if lags else None,
        delays_s=tuple(delays.get(name, 0.0) for name in names) if delays else None,
    )


def _by_input(key: str, given: Sequence[tuple[str, _T]], names: Sequence[str]) -> dict[str, _T]:
    known = {name.casefold(): name for name in names} | {"": ""}
    require_unique(key, [name.casefold() for name, _ in given])
    for name, _ in given:
        if name.casefold() not in known:
            raise ConfigurationError("unknown_name", name=name, known=tuple(names), key=key)
    return {known[name.casefold()]: value for name, value in given}


def _check_outputs(arguments: argparse.Namespace) -> None:
    if not arguments.input and not arguments.candidates:
        raise ConfigurationError("no_input_named", key="--input")
    check_outputs(
        [
            ("--model", arguments.model),
            ("--json", arguments.json),
            ("--series", arguments.series),
            *(("--report", path) for path in arguments.report),
        ],
        [*arguments.logs, arguments.mapping],
        charts=arguments.figures,
    )
    alone = len(arguments.output) == 1 and arguments.method == "modal" and not arguments.candidates
    if arguments.joint is not None and not alone:
        raise ConfigurationError("joint_gains_need_one_output", key="--joint")
    known = arguments.lags or arguments.delay
    if known and (arguments.method != "modal" or arguments.candidates):
        raise ConfigurationError("lags_of_modal_only", key="--lags, --delay")
    require_unique("--output", arguments.output)


def _check_logs(
    arguments: argparse.Namespace,
    logs: Sequence[thermal.ThermalLog],
    inputs: Sequence[thermal.InputDefinition],
    outputs: Sequence[str],
) -> None:
    """Refuse what no estimator can make anything of."""
    for log in logs:
        if log.rows < _FEWEST_ROWS:
            raise DataError("too_few_rows", file=log.where, rows=log.rows, needed=_FEWEST_ROWS)
        step_s = _step_of_values(log)
        if arguments.sample_time is not None and arguments.sample_time < _SHORTEST_STEP * step_s:
            raise ConfigurationError(
                "sample_time_too_short",
                file=log.where,
                key="--sample-time",
                sample_time_s=arguments.sample_time,
                step_s=step_s,
            )
    measured = {name.casefold() for name in outputs}
    for definition in inputs:
        if any(channel.casefold() in measured for channel in definition.channels):
            raise ConfigurationError("input_is_displacement", key="--input", name=definition.name)


def _step_of_values(log: thermal.ThermalLog) -> float:
    """Return the usual time between rows that hold a value: means over less are mostly empty."""
    filled = np.zeros(log.rows, dtype=np.bool_)
    for values in log.columns.values():
        filled |= ~np.isnan(values)
    times_s = log.time_s[filled]
    return float(np.median(np.diff(times_s))) if times_s.size > 1 else 0.0


def _common_step_s(
    arguments: argparse.Namespace,
    logs: Sequence[thermal.ThermalLog],
    inputs: Sequence[thermal.InputDefinition],
) -> float | None:
    """Return the step at which every candidate has a value; None where the rows' own step does."""
    if not arguments.candidates:
        return None
    slowest = max(thermal.usual_step_of(log, inputs) for log in logs)
    own = max(log.usual_step_s for log in logs)
    return slowest if slowest > 1.5 * own else None


def _inputs(
    arguments: argparse.Namespace, logs: Sequence[thermal.ThermalLog]
) -> tuple[thermal.InputDefinition, ...]:
    """Return the inputs that were named, and every channel that fits a pattern."""
    found: list[thermal.InputDefinition] = []
    for text in arguments.input:
        written = thermal.parse_input(text, channels=logs[0].columns)
        minus = None if written.minus is None else logs[0].name_of(written.minus)
        # Models of several tests fit together only if they spell a channel alike.
        found.append(thermal.InputDefinition(written.name, logs[0].name_of(written.plus), minus))
    outputs = {name.casefold() for name in arguments.output}
    for pattern in arguments.candidates:
        names = [
            n
            for n in logs[0].names_matching(pattern)
            if n.casefold() not in outputs and logs[0].units[n] not in _DISPLACEMENTS
        ]
        if not names:
            raise ConfigurationError(
                "no_channel_fits",
                key="--candidates",
                pattern=pattern,
                known=", ".join(list(logs[0].columns)[:12]),
            )
        known = {definition.name for definition in found}
        found += [thermal.InputDefinition(name, name) for name in names if name not in known]
    thermal.check_inputs(found)
    return tuple(found)
