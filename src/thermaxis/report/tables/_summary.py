"""What one sees first of an evaluated run: verdict, figures, drift, findings and warnings."""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import chain, zip_longest
from textwrap import wrap

import numpy as np

from thermaxis.codes import Message, printable
from thermaxis.messages import keys, sentence_of
from thermaxis.positioning import APPROACHES, Edition
from thermaxis.report._figure_table import FigureRow, FigureTable, figure_table
from thermaxis.report._limits_check import Verdict
from thermaxis.report._names import OTHER_NAMES, edition_name, other_standard_name
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._text import as_given, fixed, two_digits, with_u
from thermaxis.report.tables._text_table import aligned_lines

_LINES, _WIDTH = 20, 80
"""What a small terminal shows at once. [1]"""
_LONGEST_NAME = 40
_NO_MODEL = "warning-no_drift_model"
_UNIT_ASSUMED = "remark-unit_assumed"  # every figure hangs on it
_HEADS = {"value": "measured", "drift-free": "without drift"}
_SAID_OF_FIGURES = {"note-u_stated", "note-order_assumed"}
_LESS_URGENT = {"warning-many_cycles", "warning-targets_equidistant"}


def summary_of(report: PositioningReport) -> str:
    """Return what a metrologist at the machine needs first.

    Returns
    -------
    str
        At most 20 lines of at most 80 characters for a terminal, on which text from files cannot
        act. The last line says how many findings and warnings had no room, and where they are.
    """
    table, adjacent = figure_table(report), report.adjacent_difference
    of_drift = () if report.drift is None else report.drift.warnings
    of_chart = () if adjacent is None else adjacent.warnings
    events = [one for one in of_drift if _short(one) is not one]
    others = [one for one in report.warnings if one.code != _NO_MODEL and one not in events]
    others.sort(key=lambda one: (one.code != _UNIT_ASSUMED, one not in of_drift))
    urgent = [one for one in others if one not in of_chart and one.code not in _LESS_URGENT]
    head = _lines(_run(report), *_verdict(report, table))
    figures = [*_figures(report, table)]
    drift = _lines(*_other_standard(report), *_drift(report))
    named, warnings, findings = _fitting(
        [_lines(_short(one)) for one in events],
        [_lines(_short(one), before="warning: ") for one in urgent],
        [_lines(_short(one.message), before="finding: ") for one in report.diagnosis],
        room=_LINES - len([*head, *figures, *drift]) - 2,
    )
    hidden = {
        "warnings": len(events) + len(others) - len(named) - len(warnings),
        "findings": len(report.diagnosis) - len(findings),
    }
    blocks = [head, figures, [*drift, *chain(*named)], [*chain(*findings, *warnings)]]
    blocks.append(_lines(Message("summary-rest", hidden)))
    spare = _LINES - sum(map(len, blocks))
    spaced = [[""] * (0 < k <= spare and bool(block)) + block for k, block in enumerate(blocks)]
    return "\n".join(chain(*spaced)) + "\n"


def _fitting(*kinds: Sequence[list[str]], room: int) -> tuple[list[list[str]], ...]:
    """Return the first of each kind that fit, the first of each before the second of any."""
    kept: tuple[list[list[str]], ...] = tuple([] for _ in kinds)
    for k, of_each in enumerate(zip_longest(*kinds, fillvalue=[])):
        for lines, own in zip(of_each, kept, strict=True):
            if 0 < len(lines) <= room and len(own) == k:
                own.append(lines)
                room -= len(lines)
    return kept


def _lines(*messages: Message, before: str = "") -> list[str]:
    texts = (before + sentence_of(one) for one in messages)  # their values are printable
    wrapped = partial(wrap, width=_WIDTH, break_on_hyphens=False, subsequent_indent="  ")
    return [line for text in texts for line in wrapped(text)]


def _short(message: Message) -> Message:
    short = f"{message.code}.short"
    return Message(short, message.values) if short in keys("en") else message


def _run(report: PositioningReport) -> Message:
    test, axis = report.test, report.header.get("axis", "")
    values = {
        "name": printable(report.source_name, _LONGEST_NAME),
        "kind": str(test.kind),
        "axis": f" {printable(axis, _LONGEST_NAME)}" if axis else "",
        "targets": test.target.size,
        "first": f"{test.target[0]:g}",
        "last": f"{test.target[-1]:g}",
        "unit": test.kind.units.position,
        "cycles": test.cycles,
        "approaches": " and ".join(APPROACHES[a] for a in test.approaches),
        "times": str(test.time_source),
        "assumed": "yes" if test.order_deduced else "no",
        "lasting_s": None if test.time_s is None else float(np.nanmax(test.time_s)),
    }
    return Message("summary-run", values)


# ---- verdict and figures ------------------------------------------------------------------------


def _verdict(report: PositioningReport, table: FigureTable) -> Iterator[Message]:
    check = report.limits
    if check is None:
        yield Message("summary-no_limits")
        return
    values = {"verdict": str(check.verdict), "rule": str(check.limits.decision_rule)}
    named = tuple(
        f"{row.symbol} {row.verdict}"
        for row in table.rows
        if row.verdict not in {None, Verdict.PASS}
    )
    if named:
        yield Message("summary-verdict_of", {**values, "figures": named})
    else:
        yield Message("summary-verdict", values)
    if check.reservation is not None:
        yield check.reservation


def _figures(report: PositioningReport, table: FigureTable) -> Iterator[str]:
    """Yield the main figures as measured and without drift, with U and limits."""
    edition = report.iso230_2.edition
    shown = [i for i in table.strong if table.rows[i].value is not None]
    names = [_name(table.rows[i], edition) for i in shown]
    columns = [(f"{edition_name(edition)}, {table.unit}", names)]
    for k, label in enumerate(table.labels):
        cells = [table.cells[i][k] for i in shown]
        if label in {"value", "drift-free"}:
            columns.append((_HEADS[label], cells))
        elif label in {"U", "its U"}:
            head, values = columns.pop()
            columns.append((head, _with_u(values, cells)))
        elif label in {"limit", "verdict"}:
            columns.append((label, cells))
    heads, texts = zip(*columns, strict=True)
    yield from aligned_lines(heads, list(zip(*texts, strict=True)), words=1)
    yield from _lines(*(one for one in table.legend if one.code in _SAID_OF_FIGURES))
    if any(table.rows[i].expanded_uncertainty is not None for i in shown):
        lacking = [one.values["terms"] for one in table.legend if one.code == "note-u_without"]
        doubts = [one.values for one in table.legend if one.code == "note-u_doubted"]
        of_u = Message("summary-u_doubted", doubts[0]) if doubts else Message("summary-u")
        if lacking:
            of_u = Message("summary-u_without", {"coverage": of_u, "left_out": lacking[0]})
        yield from _lines(of_u)


def _name(row: FigureRow, edition: Edition) -> str:
    name = Message(f"summary-figure_{row.key[0]}", {"edition": edition.name})
    return f"{row.symbol:<2} {sentence_of(name)}"


def _with_u(values: Sequence[str], uncertainties: Sequence[str]) -> list[str]:
    known = [f" ± {u}" if u[:1].isdigit() else "" for u in uncertainties]
    widest = max(map(len, known), default=0)
    return [f"{value}{u:<{widest}}" for value, u in zip(values, known, strict=True)]


def _other_standard(report: PositioningReport) -> list[Message]:
    """Return the figures of another standard that was asked for; none was, as a rule."""
    other, unit = report.other_standard, report.test.kind.units.deviation
    if other is None:
        return []
    figures = ", ".join(
        f"{OTHER_NAMES[key][0]} {fixed(getattr(other, key), report.figure_decimals)}"
        for key in type(other).__slots__
        if key != "mark"
    )
    name = other_standard_name(other)
    values = {"name": name, "mark": other.mark, "figures": figures, "unit": unit}
    return [Message("summary-other_standard", values)]


# ---- drift --------------------------------------------------------------------------------------


def _drift(report: PositioningReport) -> Iterator[Message]:
    drift, kind = report.drift, str(report.test.kind)
    if drift is None:
        why = next((one for one in report.warnings if one.code == _NO_MODEL), None)
        yield why or Message("summary-drift_not_evaluated")
        return
    p = drift.p_no_drift
    length = round(float(np.ptp(report.test.target)), 1)
    growth, within = drift.total_per_m, drift.total_per_m_within
    said = {
        "found": "yes" if drift.significant else "no",
        "p": "p < 0.0001" if p < 1e-4 else f"p = {p:.2g}",
        "growth": _amount(growth, within),
        "grown": _amount(1e-3 * length * growth, 1e-3 * length * within),
        "length": as_given(length),
        "shift": _amount(drift.total, drift.total_within),
    }
    yield Message(f"summary-drift_{kind}", said)
    swing = float(np.ptp(drift.common))
    if swing > abs(drift.total) + drift.total_within:
        unit = report.test.kind.units.deviation
        yield Message("summary-drift_swings", {"swing": two_digits(swing), "unit": unit})


def _amount(value: float, band: float) -> str:
    """Return an amount with its band, or what it is less than where its band contains zero."""
    if 0.0 < band and abs(value) <= band:
        return f"less than {two_digits(abs(value) + band)}"
    return f"{'+' * (value > 0.0)}{with_u(value, band).replace('-', '−')}"
