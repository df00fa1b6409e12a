"""Options and reading of thermal logs, shared by the commands that take them."""

import argparse
import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, final

import numpy as np

from thermaxis.cli._arguments import TIME, UNITS_S, add_mapping, adder, diameter, positive_seconds
from thermaxis.codes import message_as_json
from thermaxis.compensation import CompensationModel, TrainingLog
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_thermal_log
from thermaxis.messages import remedy_of, sentence_of
from thermaxis.report.tables import Value
from thermaxis.thermal import (
    InputDefinition,
    LogFinding,
    LogStart,
    MeasuredOutput,
    ThermalLog,
    check_log,
    mask_rows,
    with_one_clock,
    without_faults,
)

_ASSUMED = "remark-seconds_assumed"


class Span(NamedTuple):
    """Part of a log: rows, or times since its first row."""

    first: float | None
    """Begin, None for that of the log. [1 or s]"""
    last: float | None
    """End, not included; None for that of the log. [1 or s]"""
    in_seconds: bool
    text: str
    """As the user wrote it."""

    def rows_of(self, log: ThermalLog) -> tuple[int, int]:
        """Return its first row in a log, and the one behind its last."""
        if self.in_seconds:
            edges_s = (self.first or 0.0, math.inf if self.last is None else self.last)
            first, last = (int(np.searchsorted(log.time_s, edge_s)) for edge_s in edges_s)
        else:
            last = None if self.last is None else int(self.last)
            first, last, _ = slice(int(self.first or 0), last).indices(log.rows)
        if first >= last:
            raise ConfigurationError(
                "span_without_rows",
                typed=self.text,
                rows=log.rows,
                lasts_h=float(f"{log.duration_s / 3600.0:.3g}"),
                file=log.where,
            )
        return first, last


def span(text: str) -> Span:
    """Return a span as it is written on the command line."""
    first_word, colon, last_word = text.replace(" ", "").partition(":")
    first, last = TIME.fullmatch(first_word), TIME.fullmatch(last_word)
    if not colon or first is None or last is None or first_word + last_word == "":
        raise argparse.ArgumentTypeError(
            f"'{text}' is no span; write 0:6669 in rows, or 0:8h or 30min:90min in time"
        )
    units = [m["unit"] for m in (first, last) if m["unit"]]
    numbers = [None if m["number"] is None else float(m["number"]) for m in (first, last)]
    if not units:
        if any(n is not None and n != int(n) for n in numbers):
            raise argparse.ArgumentTypeError(f"'{text}': rows are whole numbers")
        return _in_order(Span(numbers[0], numbers[1], in_seconds=False, text=text))
    scaled: list[float | None] = []
    for match, number in zip((first, last), numbers, strict=True):
        unit = match["unit"] or units[0]  # 0:8h
        scaled.append(None if number is None else number * UNITS_S[unit])
    if any(n is not None and n < 0 for n in scaled):
        raise argparse.ArgumentTypeError(f"'{text}': times count from the first row")
    return _in_order(Span(scaled[0], scaled[1], in_seconds=True, text=text))


def _in_order(typed: Span) -> Span:
    """Refuse a span that is empty in any log; rows below zero count from the last."""
    if None not in (typed.first, typed.last) and 0 <= (typed.last or 0) <= (typed.first or 0):
        raise argparse.ArgumentTypeError(f"'{typed.text}': the end is not after the start")
    return typed


class Mask(NamedTuple):
    """Rows that count as missing."""

    channel: str
    """Its column; empty for all."""
    rows: Span


def mask(text: str) -> Mask:
    """Return a mask as it is written on the command line."""
    channel, _, rows = text.rpartition("=")
    if rows.count("..") != 1 or ":" in rows:
        raise argparse.ArgumentTypeError(
            f"'{text}' masks nothing; write T_oil_c=1200..1500 in rows, or 2h..150min in time of"
            " all channels"
        )
    return Mask(channel.strip(), span(rows.replace("..", ":"))._replace(text=rows))


def add_log_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of reading logs."""
    add_mapping(parser)
    adder(parser)(
        "--reference TIME",
        "temperatures and displacements count from their mean over this first time of each"
        " log (default: 60 s; temperatures that plainly move then, from their line's first row)",
        positive_seconds,
    )
    adder(parser)(
        "--mask [CHANNEL=]A..B",
        "rows (1200..1500) or times (2h..150min) of each log, of one channel or of all, that count"
        " as missing; may be given more than once",
        mask,
        many=True,
    )
    adder(parser)(
        "--as-logged",
        "mask only what is no measurement, join and delay nothing: faults are named all the same",
        bool,
    )


def add_start(parser: argparse.ArgumentParser, *, spans: bool = False) -> None:
    """Declare the option of how a log began."""
    adder(parser)(
        "--start",
        "the machine at the first row: rest, steady (inputs were for long what they are then), or"
        f" fitted to {'the measured rows before --span, or to ' * spans}all measured rows (default:"
        " rest, unless the measured rows make another start far more likely; it is said)",
        LogStart,
        choices=tuple(LogStart),
    )


@final
@dataclass(frozen=True, slots=True, eq=False)
class ReadLog:
    """A log that was read, and what a model remembers of it."""

    log: ThermalLog
    """The log, or the part of it that was asked for."""
    training: TrainingLog


def read_logs(
    paths: Sequence[Path],
    *,
    mapping: Path | None,
    part: Span | None = None,
    sample_time_s: float | None = None,
    masks: Sequence[Mask] = (),
    as_logged: bool = False,
    reference_s: float | None = None,
) -> list[ReadLog]:
    """Read logs, or the same part of each, without their faults."""
    found: list[ReadLog] = []
    spans = [*(one.rows for one in masks), *([part] if part is not None else [])]
    reduce_s = sample_time_s if all(one.in_seconds for one in spans) else None
    for path in paths:
        log = read_thermal_log(path, mapping=mapping, sample_time_s=reduce_s)
        for one in masks:
            log = mask_rows(log, *one.rows.rows_of(log), one.channel)
        log = without_faults(log, as_logged=as_logged)
        first = 0
        if part is not None:
            first, last = part.rows_of(log)
            log = log.span(first, last)
        if reference_s is not None and reference_s > log.duration_s:
            raise ConfigurationError(
                "reference_too_long",
                file=log.where,
                key="--reference",
                reference_s=reference_s,
                duration_s=log.duration_s,
            )
        with path.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        found.append(ReadLog(log, TrainingLog(path.name, digest, log.rows, first)))
    return found


def entries_of(
    arguments: argparse.Namespace,
    paths: Sequence[Path],
    *,
    part: Span | None = None,
    sample_time_s: float | None = None,
) -> list[ReadLog]:
    """Read logs, or the same part of each, as the options of `add_log_options` say."""
    return read_logs(
        paths,
        mapping=arguments.mapping,
        part=part,
        sample_time_s=sample_time_s,
        masks=arguments.mask,
        as_logged=arguments.as_logged,
        reference_s=arguments.reference,
    )


def logs_of(arguments: argparse.Namespace, paths: Sequence[Path]) -> list[ThermalLog]:
    """Read logs as the options of `add_log_options` say, without what a model remembers."""
    return [entry.log for entry in entries_of(arguments, paths)]


def check_twice(entries: Sequence[ReadLog]) -> None:
    """Refuse a log that is named twice: it would count as two experiments."""
    seen: set[tuple[str, int, int]] = set()
    for training in (entry.training for entry in entries):
        key = (training.sha256, training.first_row, training.rows)
        if key in seen:
            raise ConfigurationError("same_log_twice", file=training.name)
        seen.add(key)


def with_clocks_told(
    logs: Sequence[ThermalLog],
    models: Sequence[CompensationModel],
    measured: Sequence[MeasuredOutput] | None,
    reference_s: float | None,
) -> list[ThermalLog]:
    """Return logs that judge models, told where their clocks differ or a channel drifts."""
    outputs = [output for model in models for output in model.outputs]
    parts = {part.name: part for output in outputs for part in output.parts}
    inputs = [InputDefinition(p.name, p.plus, p.minus or None) for p in parts.values()]
    names = [one.channel for one in measured or ()] or [output.name for output in outputs]
    return [
        with_one_clock(log, inputs, names, reference_s=reference_s, told_only=True) for log in logs
    ]


def remarks_of(logs: Sequence[ThermalLog], *, assumed: bool = False) -> list[str]:
    """Return what was noticed while logs were read, or what was assumed: it stands first."""
    remarks = [(log, one) for log in logs for one in log.remarks]
    chosen = [pair for pair in remarks if (pair[1].code == _ASSUMED) == assumed]
    return [f"{log.where}: {sentence_of(one)}" for log, one in chosen]


def reading_codes(logs: Sequence[ThermalLog]) -> Value:
    """Return what was noticed and done while logs were read, as JSON has it."""
    codes = [
        {"log": log.where, "text": sentence_of(one)} | message_as_json(one)
        for log in logs
        for one in log.remarks
    ]
    return Value("reading_codes", codes)


def measured_output(text: str) -> MeasuredOutput:
    """Return what is compared with what, as it is written on the command line."""
    channel, sign, rest = text.partition("=")
    output, at, diameter_word = (rest if sign else channel).partition("@")
    channel = channel.partition("@")[0].strip()
    output = output.strip()
    if not channel or not output:
        raise argparse.ArgumentTypeError(f"'{text}' is no CHANNEL=OUTPUT or CHANNEL=OUTPUT@MM")
    if not at:
        return MeasuredOutput(channel, output)
    return MeasuredOutput(channel, output, diameter(diameter_word))


def rows_of_span(logs: Sequence[ThermalLog], part: Span) -> tuple[int, int]:
    """Return a span as rows of the only log."""
    if len(logs) > 1:
        raise ConfigurationError("span_of_several_logs", key=f"--span {part.text}", logs=len(logs))
    return part.rows_of(logs[0])


def findings_in(log: ThermalLog, channels: Sequence[str]) -> tuple[LogFinding, ...]:
    """Return what is wrong with those of the named channels that a log has."""
    known = {name.casefold(): name for name in log.columns}
    names = dict.fromkeys(known[c.casefold()] for c in channels if c.casefold() in known)
    return tuple(check_log(log.select(list(names)))) if names else ()


def sensor_warnings(logs: Sequence[ThermalLog], channels: Sequence[str]) -> tuple[str, ...]:
    """Return what is seriously wrong with the channels of a model, before the model is blamed."""
    return tuple(
        f"{log.where}: {sentence_of(finding.message)}. {remedy_of(finding.message)}"
        for log in logs
        for finding in findings_in(log, channels)
        if finding.serious
    )
