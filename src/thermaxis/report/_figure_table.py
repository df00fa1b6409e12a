"""The figures of a run in one table, and what their uncertainty consists of.

Terminal, PDF, HTML, JSON and DCC take these numbers and, where they print text, these cells.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isclose
from typing import TYPE_CHECKING, final

from thermaxis.codes import Message
from thermaxis.messages import sentence_of
from thermaxis.positioning import FIGURE_KEYS, BudgetRow, FigureUncertainty, figures_by_key
from thermaxis.report._names import FIGURE_NAMES, FIGURE_SYMBOLS, absence_reason
from thermaxis.report._text import ABSENT, as_given, decimals_of_u, fixed, two_digits, with_u

if TYPE_CHECKING:
    from thermaxis.report._limits_check import Verdict
    from thermaxis.report._positioning_report import PositioningReport

_NOT_EVALUATED = "not evaluated"
_COUNTED = {"left_out-in_scatter", "left_out-drift_unknown"}
"""Terms without a row of their own that the scatter of the readings contains."""
_MAIN = ("B", "M", "E", "R", "A")
_MAIN_OF_ONE_APPROACH = ("E", "R", "A")


@final
@dataclass(frozen=True, slots=True)
class FigureRow:
    """One figure of a run; None where something does not exist. The axis fixes the unit."""

    key: str
    symbol: str
    name: str
    """Its name in the edition of the standard."""
    absent: str
    """Why the run does not have it; empty if it has."""
    strong: bool
    value: float | None
    """The standard's figure, as measured. [µm or arcsec]"""
    expanded_uncertainty: float | None
    """Its U, which holds the true figure of this run in 95.45 % of cases. [µm or arcsec]"""
    coverage_factor: float | None
    """k = U / u. [1]"""
    standard_uncertainty: float | None
    """Combined standard uncertainty u, bias included. [µm or arcsec]"""
    bias: float | None
    """How much the figure is too large on average, contained in U. [µm or arcsec]"""
    drift_free: float | None
    """The figure without the drift of the run and without outliers. [µm or arcsec]"""
    drift_free_expanded_uncertainty: float | None
    """Its U. [µm or arcsec]"""
    drift_free_coverage_factor: float | None
    """Its k. [1]"""
    drift_free_with_outliers: float | None
    """The figure without the drift, of all readings; None without outliers. [µm or arcsec]"""
    drift_effect: float | None
    """What the drift did to the figure: value less that without drift, of all readings both.
    [µm or arcsec]"""
    drift_effect_expanded_uncertainty: float | None
    """Its U. [µm or arcsec]"""
    drift_effect_coverage_factor: float | None
    """Its k. [1]"""
    limit: float | None
    """Largest magnitude allowed. [µm or arcsec]"""
    guard_band: float | None
    """How far below its limit the figure must be to pass. [µm or arcsec]"""
    verdict: "Verdict | None"
    """What the decision rule says."""


@final
@dataclass(frozen=True, slots=True)
class FigureTable:
    """The figures of a run as numbers and, rounded once, as text."""

    unit: str
    """Unit of all numbers but k."""
    rows: tuple[FigureRow, ...]
    """One row for each figure."""
    labels: tuple[str, ...]
    """Heads of the columns that this run has; the first two hold symbol and name."""
    cells: tuple[tuple[str, ...], ...]
    legend: tuple[Message, ...]
    """What must be read beside the numbers: what U covers, contains and lacks."""
    notes: tuple[Message, ...]
    """What else must be known of them."""

    @property
    def strong(self) -> tuple[int, ...]:
        """Rows that stand out, from 0. [1]"""
        return tuple(i for i, row in enumerate(self.rows) if row.strong)


def figure_table(report: "PositioningReport") -> FigureTable:
    """Return the figures of a run with uncertainty, effect of drift, limit and verdict.

    Returns
    -------
    FigureTable
        Columns of what was not evaluated are left out of `labels` and `cells`.
    """
    rows = tuple(_row(report, key) for key in FIGURE_KEYS)
    decimals = report.figure_decimals
    columns = [
        ("", [row.symbol for row in rows]),
        ("figure", [f"{r.name} (absent: {r.absent})" if r.absent else r.name for r in rows]),
        ("value", [_value(row, decimals) for row in rows]),
    ]
    if any(row.expanded_uncertainty is not None for row in rows):
        columns.append(("U", [_u(r.value, r.expanded_uncertainty) for r in rows]))
        columns.append(("k", [fixed(r.coverage_factor, 2, absent="") for r in rows]))
    if report.drift is not None:
        free = [fixed(r.drift_free, _free_decimals(r, decimals), absent="") for r in rows]
        columns.append(("drift-free", free))
    if report.uncertainty is not None and report.uncertainty.drift_free is not None:
        of_free = [
            _u(r.drift_free, r.drift_free_expanded_uncertainty, _free_decimals(r, decimals))
            for r in rows
        ]
        columns.append(("its U", of_free))
    if any(row.drift_free_with_outliers is not None for row in rows):
        of_all = ((r.drift_free_with_outliers, r.expanded_uncertainty) for r in rows)
        texts = [fixed(value, _decimals(u, decimals), absent="") for value, u in of_all]
        columns.append(("with outliers", texts))
    if "its U" in dict(columns):
        effect = [_effect(r.drift_effect, r.drift_effect_expanded_uncertainty) for r in rows]
        columns.append(("effect of drift", effect))
    if report.limits is not None:
        limits = ["" if r.limit is None else _limit(r, decimals) for r in rows]
        verdicts = ["" if r.verdict is None else str(r.verdict) for r in rows]
        columns += [("limit", limits), ("verdict", verdicts)]
    labels, texts = zip(*columns, strict=True)
    cells = tuple(zip(*texts, strict=True))
    unit = report.test.kind.units.deviation
    legend, notes = tuple(_legend(report, labels)), tuple(_notes(report, rows))
    return FigureTable(unit, rows, labels, cells, legend, notes)


def _row(report: "PositioningReport", key: str) -> FigureRow:
    result, uncertainty = report.iso230_2, report.uncertainty
    value = figures_by_key(result)[key]
    without = None if report.drift is None else figures_by_key(report.drift.figures)[key]
    of_all = None if report.drift is None else report.drift.figures_of_all
    with_outliers = None if of_all is None else figures_by_key(of_all)[key]
    measured = None if uncertainty is None else uncertainty.measured
    free = None if uncertainty is None else uncertainty.drift_free
    if value is None:
        measured = free = without = with_outliers = None
    u = measured.expanded_uncertainty.get(key) if measured else None
    same = without if with_outliers is None else with_outliers
    effect = None if value is None or same is None else value - same
    of_effect = None if effect is None else uncertainty
    check = None if report.limits is None else report.limits.of(key)
    forward, backward = report.test.measured_approaches
    main = _MAIN if forward and backward else _MAIN_OF_ONE_APPROACH
    return FigureRow(
        key=key,
        symbol=FIGURE_SYMBOLS[key],
        name=FIGURE_NAMES[result.edition][key],
        absent=absence_reason(key, result, report.test) if value is None else "",
        strong=key in main if forward and backward else key[0] in main and value is not None,
        value=value,
        expanded_uncertainty=u,
        coverage_factor=measured.coverage_factor.get(key) if measured else None,
        standard_uncertainty=measured.combined(key) if measured and u else None,
        bias=measured.bias.get(key) if measured else None,
        drift_free=without,
        drift_free_expanded_uncertainty=free.expanded_uncertainty.get(key) if free else None,
        drift_free_coverage_factor=free.coverage_factor.get(key) if free else None,
        drift_free_with_outliers=with_outliers,
        drift_effect=effect,
        drift_effect_expanded_uncertainty=of_effect.drift_effect.get(key) if of_effect else None,
        drift_effect_coverage_factor=(
            of_effect.drift_effect_coverage_factor.get(key) if of_effect else None
        ),
        limit=check.limit if check else None,
        guard_band=check.guard_band if check else None,
        verdict=check.verdict if check else None,
    )


def _value(row: FigureRow, decimals: int) -> str:
    """Return a figure with more digits where rounding would hide on which side of a limit it is."""
    if row.value is None:
        return ABSENT
    decimals = _decimals(row.expanded_uncertainty, decimals)
    text = fixed(row.value, decimals)
    if row.limit is None or row.guard_band != 0.0:
        return text
    above = abs(row.value) > row.limit
    while decimals < 9 and (abs(float(text)) > row.limit) != above:
        decimals += 1
        text = fixed(row.value, decimals)
    return text


def _decimals(u: float | None, without: int) -> int:
    """Return with how many decimals a figure is printed: those of its U, else as without one."""
    return decimals_of_u(u) if u else without


def _free_decimals(row: FigureRow, decimals: int) -> int:
    """Return the decimals of the drift-free figure: as measured where it is the same number."""
    measured, free = (
        _decimals(u, decimals)
        for u in (row.expanded_uncertainty, row.drift_free_expanded_uncertainty)
    )
    same = isclose(row.value or 0.0, row.drift_free or 0.0, rel_tol=1e-9)
    return measured if same and abs(measured - free) == 1 else free


def _limit(row: FigureRow, decimals: int) -> str:
    """Return a limit with all digits that were given, at least with those of its figure."""
    given, decimals = as_given(row.limit or 0.0), _decimals(row.expanded_uncertainty, decimals)
    return given if len(given.partition(".")[2]) >= decimals else fixed(row.limit, decimals)


def _u(value: float | None, u: float | None, decimals: int | None = None) -> str:
    if value is None:
        return ""
    if u is None:
        return _NOT_EVALUATED
    return two_digits(u) if decimals is None else fixed(u, decimals)


def _effect(effect: float | None, u: float | None) -> str:
    if effect is None:
        return ""
    return _NOT_EVALUATED if u is None else with_u(effect, u)


def terms_of_u(figures: FigureUncertainty) -> tuple[tuple[Message, ...], tuple[Message, ...]]:
    """Return what uncertainties contain, and what they lack."""
    rows = dict.fromkeys(row.quantity for row in figures.budget if row.contribution > 0.0)
    counted = [one for one in figures.left_out if one.code in _COUNTED]
    lacking = tuple(one for one in figures.left_out if one not in counted)
    return (*(Message(f"term-{quantity}") for quantity in rows), *counted), lacking


def doubts_of_u(report: "PositioningReport") -> tuple[Message, ...]:
    """Return why uncertainties may be too small; what the drift did is then not surely known."""
    if report.drift is None:
        return ()
    found = [Message("doubt-jump")] if report.drift.changes else []
    if any(one.code == "warning-swing_too_fast" for one in report.drift.warnings):
        found.append(Message("doubt-swing"))
    return tuple(found)


def _legend(report: "PositioningReport", labels: Sequence[str]) -> Iterator[Message]:
    if "U" in labels:
        doubts = doubts_of_u(report)
        yield Message("note-u_doubted", {"doubts": doubts}) if doubts else Message("note-u")
    if report.uncertainty is not None:
        if stated := report.uncertainty.measured.stated:
            symbols = ", ".join(FIGURE_SYMBOLS[key] for key in stated)
            yield Message("note-u_stated", {"symbols": symbols})
        contained, lacking = terms_of_u(report.uncertainty.measured)
        if contained:
            yield Message("note-u_contains", {"terms": contained})
        if lacking:
            yield Message("note-u_without", {"terms": lacking})
    if "drift-free" in labels:
        yield Message("note-drift_free")
        if report.test.order_deduced:
            yield Message("note-order_assumed")
    if report.drift is not None and report.drift.outliers:
        told = [one for one in report.drift.warnings if one.code == "warning-outlier_left_out"]
        readings = tuple(Message("outlier-reading", one.values) for one in told)
        count = len(report.drift.outliers)
        more = {"count": count, "more": count - len(told)}
        yield Message("note-outliers", {**more, "readings": readings})


def _notes(report: "PositioningReport", rows: tuple[FigureRow, ...]) -> list[Message]:
    result, notes = report.uncertainty, list[Message]()
    if result is None:
        return [Message("note-u_none")]
    notes.append(Message("note-u_measured", {"samples": result.samples, "seed": result.seed}))
    notes.append(Message("note-u_of_run" if report.drift else "note-u_without_drift"))
    stated = [(r.symbol, r.value, r.expanded_uncertainty) for r in rows if r.strong]
    larger = [symbol for symbol, value, u in stated if value and u and u > value]
    if larger:
        notes.append(Message("note-u_larger", {"symbols": ", ".join(larger)}))
    biased = [row for row in rows if row.strong and row.bias]
    if biased:
        most = max(biased, key=lambda row: abs(row.bias or 0.0))
        values = {"symbol": most.symbol, "bias": most.bias or 0.0, "unit": _unit(report)}
        notes.append(Message("note-u_bias", values))
    if result.drift_free is not None:
        notes.append(Message("note-drift_effect"))
    return notes


def _unit(report: "PositioningReport") -> str:
    return report.test.kind.units.deviation


@final
@dataclass(frozen=True, slots=True)
class BudgetTable:
    """What the uncertainty of the main figures consists of, as numbers and as text."""

    rows: tuple[BudgetRow, ...]
    """One row for each figure and input quantity that contributes."""
    labels: tuple[str, ...]
    """Heads of the columns; figure, quantity and distribution are words."""
    cells: tuple[tuple[str, ...], ...]
    """The rows as text; behind those of each figure one with u, k and U."""
    strong: tuple[int, ...]
    """Rows of the text that hold the sums, from 0. [1]"""


def budget_table(report: "PositioningReport") -> BudgetTable | None:
    """Return the uncertainty budget of the main figures as measured; None where there is none.

    Returns
    -------
    BudgetTable or None
        Figures whose U was stated in place of the evaluated one are not in it.
    """
    if report.uncertainty is None:
        return None
    measured, unit = report.uncertainty.measured, _unit(report)
    shown = [row for row in figure_table(report).rows if row.strong and row.value is not None]
    rows: list[BudgetRow] = []
    cells: list[tuple[str, ...]] = []
    sums: list[int] = []
    for figure in shown:
        own = [row for row in measured.budget if row.figure == figure.key and row.contribution > 0]
        if not own:
            continue
        for row in own:
            named = sentence_of(Message(f"term-{row.quantity}"))
            value = fixed(row.value, 3) if row.quantity == "extremes" else two_digits(row.value)
            cells.append(
                (
                    figure.symbol,
                    named,
                    f"{value} {row.unit}",
                    row.distribution,
                    f"{two_digits(row.standard_uncertainty)} {row.unit}",
                    f"{row.sensitivity:.3f}",
                    two_digits(row.contribution),
                )
            )
        sums.append(len(cells))
        rows += own
        k, u = fixed(figure.coverage_factor, 2), figure.standard_uncertainty or 0.0
        total = f"U = {two_digits(figure.expanded_uncertainty or 0.0)} {unit} (k = {k})"
        cells.append((figure.symbol, total, "", "", "", "", two_digits(u)))
    if not rows:
        return None
    labels = ("", "quantity", "value", "distribution", "u", "sensitivity", f"contribution [{unit}]")
    return BudgetTable(tuple(rows), labels, tuple(cells), tuple(sums))
