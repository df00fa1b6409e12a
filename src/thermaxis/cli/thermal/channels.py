"""Show what is in logs before a model is made of them.

Channels with units and ranges, span and sampling, what is doubtful of sensors and clock, and inputs
with which an identification may begin.
"""

import argparse
from pathlib import Path

import numpy as np

from thermaxis import __version__, thermal
from thermaxis.cli._arguments import add_json, adder
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._identification import finding_sentences, findings_as_json
from thermaxis.cli.thermal._series import add_series, write_log_series
from thermaxis.cli.thermal._thermal_logs import (
    ReadLog,
    add_log_options,
    entries_of,
    findings_in,
    reading_codes,
    remarks_of,
)
from thermaxis.report.tables import Part, Section, Table, Value, as_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("logs LOG", "thermal logs: CSV, Parquet, .xlsx, .mat or .tdms", Path, nargs="+")
    add_json(parser)
    add_series(parser)
    add_log_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Read and show."""
    check_outputs(
        [("--json", arguments.json), ("--series", arguments.series)],
        [*arguments.logs, arguments.mapping],
    )
    with Progress() as progress:
        progress("reading", 0, 0)
        entries = entries_of(arguments, arguments.logs)
        progress("checking sensors", 0, 0)
        logs = [entry.log for entry in entries]
        findings = {log.where: findings_in(log, list(log.columns)) for log in logs}
        if arguments.series is not None:
            write_log_series(logs, arguments.series)
    parts: list[Part] = [
        Value("version", __version__),
        *(part for entry in entries for part in _text(entry)),
        *finding_sentences(findings),
        *(f"reading: {remark}" for remark in remarks_of(logs)),
        Value("logs", [as_json(_log(entry)) for entry in entries]),
        Value("findings", list(findings_as_json(findings))),
        reading_codes(logs),
    ]
    written = [] if arguments.series is None else [arguments.series]
    show([*remarks_of(logs, assumed=True), *parts], arguments.json, written)
    return 0


def _text(entry: ReadLog) -> list[Part]:
    log = entry.log
    title = f"{log.where}: {log.rows} rows, {log.duration_s / 3600.0:.3g} h"
    title += f", every {log.usual_step_s:g} s"
    inputs = [f"{one.name}={one.expression}" for one in thermal.suggest_inputs(log)]
    suggested = [f"inputs to begin with: {' '.join(inputs)}"] if inputs else []
    suggested += [
        f'{one.name} rests: moves_with = "{one.moves_with}", rests_k = {one.rests_k:.2g}'
        for one in thermal.find_resting(log)
    ]
    return [Section("", [Table(title, _channels(log), words=2)]), *suggested]


def _log(entry: ReadLog) -> list[Part]:
    log = entry.log
    return [
        Value("name", log.where),
        Value("sha256", entry.training.sha256),
        Value("rows", log.rows),
        Value("start", log.start),
        Value("duration_s", log.duration_s),
        Value("usual_step_s", log.usual_step_s),
        Table("", _channels(log), key="channels"),
        Value(
            "suggested_inputs",
            [
                {"name": one.name, "plus": one.plus, "minus": one.minus}
                for one in thermal.suggest_inputs(log)
            ],
        ),
        Value("resting", [one._asdict() for one in thermal.find_resting(log)]),
    ]


def _channels(log: thermal.ThermalLog) -> list[list[Value]]:
    return [
        [
            Value("name", name, "channel"),
            Value("quantity", thermal.quantity_of(log.units[name]), "quantity"),
            Value("unit", log.units[name], "unit"),
            Value("rows", int(np.sum(~np.isnan(values))), "rows"),
            Value("lowest", np.fmin.reduce(values), "lowest", ".6g"),
            Value("highest", np.fmax.reduce(values), "highest", ".6g"),
        ]
        for name, values in log.columns.items()
    ]
