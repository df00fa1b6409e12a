"""The result of ``correct`` as text for a terminal and as JSON."""

import numpy as np

from thermaxis import __version__
from thermaxis.cli._text_table import filled, text_table
from thermaxis.cli.axis._axis_run import (
    absent_in_words,
    axis_warning,
    drift_in_words,
    edition_in_words,
    figure_rows,
    run_in_words,
    shown_figures,
    systematic_range,
    temperature_in_words,
)
from thermaxis.cli.axis._make_table import MadeTable, OlderTable
from thermaxis.cli.axis._results import finite_or_none
from thermaxis.errors import printable
from thermaxis.positioning import (
    BACKWARD,
    FORWARD,
    CompensationTable,
    CorrectionEffect,
    FloatArray,
    PositioningTest,
)

_DECIMALS = 2
_WRONG_SIGN = (
    "a wrong sign doubles the error: load the table, measure two points with and without it, and"
    " only then use it"
)
_NO_DRIFT = (
    "a table removes the systematic deviations at the thermal state of the run; it does not remove"
    " drift"
)
_IGNORED = (
    "the reversal value of the control counts as 0 during the run; if it was not, and this table"
    " makes the control ignore it (BACKLASH of the joint on LinuxCNC) or asks for 0 (1851 on Fanuc"
    " with two tables), give --backlash-in-force: what it corrected comes back otherwise"
)
_MOST_OUTSIDE = 6
"""So many points outside the targets are named each. [1]"""
_SAME_REVERSAL = 1e-3
"""Reversals nearer than this are the same: the last digit that is shown. [µm or arcsec]"""


def as_text(result: MadeTable, kept: str | None) -> str:
    """Return the summary for a terminal."""
    parts = [_head(result, kept), _sign_and_unit(result), _values(result), _left(result)]
    parts.append(effect_table(result.run.test, result.measured, result.without_drift))
    if result.older is not None:
        parts.append(_older(result, result.older))
    older = () if result.older is None else result.older.read.findings
    said = [f"finding in the older table: {printable(text, 400)}" for text in older]
    said += [f"read back: {printable(text, 400)}" for text in result.read.findings]
    said += [f"warning: {printable(text, 600)}" for text in warnings_of(result)]
    parts.append("\n".join(filled(text, hanging=True) for text in said) + "\n")
    return "\n".join(parts)


def _head(result: MadeTable, kept: str | None) -> str:
    run = result.run
    lines = [
        (
            f"{printable(result.output)}: compensation table of axis {run.axis} for"
            f" {result.control.title}"
        ),
        run_in_words(run),
        f"levels: {levels_in_words(result)}",
    ]
    if kept is not None:
        lines.append(f"the table that stood there was kept as {printable(kept)}")
    return "\n".join(lines) + "\n"


def levels_in_words(result: MadeTable) -> str:
    """Return what levels the table was made of."""
    drift = result.run.drift
    if not result.drift_free or drift is None:
        return "as measured, with the drift of the run in them"
    if not drift.significant:
        return "no drift is seen in the run: the drift-free levels are the measured ones"
    when = ""
    if drift.reference_time_s is not None:
        when = f" at {drift.reference_time_s / 3600.0:.2f} h"
    return f"drift-free, those of the thermal state{when}"


def _sign_and_unit(result: MadeTable) -> str:
    control = result.control
    first = [f"sign: {control.sign}", f"unit: {control.unit}"]
    known = {control.sign.rstrip("."), control.unit.rstrip(".")}
    more = [s for s in result.text.sentences if s.rstrip(".") not in known]
    options = ", ".join(f"{name}={value}" for name, value in result.options.items())
    if options:
        more.append(f"options: {options}")
    return "\n".join(filled(printable(s, 600), hanging=True) for s in (*first, *more)) + "\n"


def _values(result: MadeTable) -> str:
    table = result.wanted
    unit, place = table.kind.units.deviation, table.kind.units.position
    worst = np.unravel_index(int(np.argmax(np.abs(table.deviation))), table.deviation.shape)
    lowest, highest = float(np.min(table.deviation)), float(np.max(table.deviation))
    most = "" if result.rule.most_points is None else f" of at most {result.rule.most_points}"
    lines = [
        (
            f"points: {table.position.size}{most}, from {table.position[0]:.9g} to"
            f" {table.position[-1]:.9g} {place}; {result.grid}"
        ),
        (
            f"zero at the reference point {table.reference_position:.9g} {place}"
            f" ({_reference_in_words(result)})"
        ),
        (
            f"deviations in the table: {lowest:+.{_DECIMALS}f} to {highest:+.{_DECIMALS}f} {unit},"
            f" largest {float(table.deviation[worst]):+.{_DECIMALS}f} {unit} at"
            f" {float(table.position[worst[0]]):.9g} {place}; {_slope_in_words(table)}"
        ),
        f"reversal: {_reversal_in_words(result)}",
    ]
    if result.rule.remark:
        lines.append(f"limit of the control: {result.rule.remark}")
    return "\n".join(filled(line, hanging=True) for line in lines) + "\n"


def _reference_in_words(result: MadeTable) -> str:
    target, point = result.levels.target, result.reference
    words = f"; {point.words}" if point.words else ""
    if target[0] <= point.position <= target[-1]:
        return f"the mean of both directions{words}"
    return f"outside the targets: the value of the nearest end was taken as zero{words}"


def _slope_in_words(table: CompensationTable) -> str:
    units = table.kind.units
    slope, low, high = table.steepest_slope
    return (
        f"steepest slope {slope:.3g} {units.deviation}/{units.position} from {low:.9g} to"
        f" {high:.9g} {units.position}"
    )


def _reversal_in_words(result: MadeTable) -> str:
    levels, unit = result.levels, result.wanted.kind.units.deviation
    if not levels.bidirectional:
        return "not known, as one approach only was measured; the table is the same for both"
    reversal = levels.level[:, FORWARD] - levels.level[:, BACKWARD]
    mean, largest = float(np.mean(reversal)), float(np.max(np.abs(reversal)))
    of_run = f"forward minus backward is {mean:+.{_DECIMALS}f} {unit} in the mean"
    if result.rule.per_direction:
        more = ""
        if result.in_force.backlash:
            more = f", with the {result.in_force.backlash:+.{_DECIMALS}f} {unit} that were apart"
        return f"{of_run}, at most {largest:.{_DECIMALS}f} {unit}; it is in the points{more}"
    if result.apart is not None:
        left = float(np.max(np.abs(reversal - mean)))
        during = ""
        if result.in_force.backlash is not None:
            during = f" ({result.in_force.backlash:+.{_DECIMALS}f} {unit} during the run)"
        return (
            f"{of_run}; {result.wanted.backlash:+.{_DECIMALS}f} {unit} are compensated apart"
            f"{during}, up to {left:.{_DECIMALS}f} {unit} remain at a target"
        )
    if result.wanted.backlash is not None:
        return (
            f"{of_run}, beside the {result.wanted.backlash:+.{_DECIMALS}f} {unit} that were in"
            f" force, which stay; all of it remains, at most {largest:.{_DECIMALS}f} {unit};"
            " --backlash adds the mean"
        )
    ask = "; --backlash writes the mean apart" if result.rule.backlash_apart else ""
    return (
        f"{of_run}; the control has one value per point, so all of it remains, at most"
        f" {largest:.{_DECIMALS}f} {unit}{ask}"
    )


def _left(result: MadeTable) -> str:
    unit, place = result.wanted.kind.units.deviation, result.wanted.kind.units.position
    residual = np.max(np.abs(result.residual), axis=1)
    i, j = int(np.argmax(result.bound)), int(np.argmax(residual))
    target = result.levels.target
    half = "; both with the half of the reversal that remains"
    lines = [
        (
            f"interpolation: between its points the table can miss a level by"
            f" {float(result.bound[i]):.{_DECIMALS}f} {unit} at most (target at"
            f" {target[i]:.9g} {place}, by the slopes of the levels); the largest residual is"
            f" {float(residual[j]):.{_DECIMALS}f} {unit} (target at {target[j]:.9g}"
            f" {place}){'' if result.rule.per_direction else half}"
        ),
        (
            f"rounding: {result.rounding:.3g} {unit} at most, between what was meant and the file"
            " as the control reads it"
        ),
    ]
    return "\n".join(filled(line, hanging=True) for line in lines) + "\n"


def effect_table(
    test: PositioningTest, measured: CorrectionEffect, without_drift: CorrectionEffect | None
) -> str:
    """Return the figures before and after, as measured and without drift."""
    unit = test.kind.units.deviation
    effects = [measured] if without_drift is None else [measured, without_drift]
    columns = [
        shown_figures(test, figures)
        for effect in effects
        for figures in (effect.figures_before, effect.figures_after)
    ]
    heads = ["", "figure", "before", "after"]
    title = f"{edition_in_words()}, simulated with the table, {unit}"
    if without_drift is not None:
        heads += ["no drift: before", "after"]
    table = text_table(title, heads, figure_rows(columns, _DECIMALS), words=2)
    notes = [text for text in (absent_in_words(test),) if text]
    if without_drift is not None:
        notes.append("Figures without drift are no results of ISO 230-2.")
    return "\n".join((table, *notes, "")) if notes else table


def _older(result: MadeTable, older: OlderTable) -> str:
    table, unit = result.wanted, result.wanted.kind.units
    new = table.deviation
    change = new - older.at_points
    sides = (FORWARD, BACKWARD) if result.rule.per_direction else (FORWARD,)
    heads = [unit.position]
    for name in ("old", "new", "change"):
        heads += [f"{name} {arrow}" for arrow, _ in zip("↑↓", sides, strict=False)]
    if len(sides) == 1:
        heads = [unit.position, "old", "new", "change"]
    rows = [
        [f"{place:.3f}"]
        + [
            f"{float(values[k, a]):+.3f}"
            for values in (older.at_points, new, change)
            for a in sides
        ]
        for k, place in enumerate(table.position.tolist())
    ]
    title = f"Deviations in {printable(older.name)} and in the new table, {unit.deviation}"
    said = (
        "The run counts as measured with the old table in force: the new table is the old one plus"
        " what the run still shows, and takes its place. Load it instead of the old one, not in"
        " addition to it."
    )
    reversal = ""
    if table.backlash is not None and not result.rule.per_direction:
        before, after = result.in_force.backlash or 0.0, table.backlash
        reversal = (
            f"\nReversal apart from the points: old {before:+.3f}, new {after:+.3f}"
            f" {unit.deviation}"
        )
    return f"{text_table(title, heads, rows)}\n{filled(said)}\n{_references(result)}{reversal}\n"


def _references(result: MadeTable) -> str:
    point, unit = result.reference, result.wanted.kind.units.position
    older = "not stated, and the table is nowhere zero"
    if point.older is not None:
        older = f"{point.older:.9g} {unit}"
    return filled(f"Reference point: old {older}, new {point.position:.9g} {unit}")


def warnings_of(result: MadeTable) -> list[str]:
    """Return what the user of a table must know, in words."""
    run = result.run
    said = [*run.test.remarks, *result.levels.remarks]
    if run.axis_assumed:
        said.append(axis_warning(run))
    said += _drift_warnings(result)
    said += _range_warnings(result)
    before, after = (
        systematic_range(level) for level in (result.measured.before, result.measured.after)
    )
    if after >= before:
        said.append(
            "the simulated table does not make the measured deviations smaller: do not use it"
        )
    if result.older is None:
        said.append(
            "the run counts as measured without any table in force; if one was, give it with"
            " --merge"
        )
    said += result.doubts
    said += result.reference.warnings
    said += _reversal_warnings(result)
    said.append(_WRONG_SIGN)
    said.append(f"{_NO_DRIFT}. Temperature of the run: {temperature_in_words(run.test)}")
    said.append("the table is not in force: nothing was sent to the control or activated")
    return said


def _reversal_warnings(result: MadeTable) -> list[str]:
    """Return what the control's own reversal value has to do with the new file."""
    in_force, unit = result.in_force, result.wanted.kind.units.deviation
    alone = result.rule.per_direction and result.older is None
    if in_force.backlash is None:
        if result.apart is not None:
            return [
                (
                    "the reversal value of the control (MD32450, 1851) counts as 0 during the run;"
                    " if it was not, give --backlash-in-force: the file replaces it"
                )
            ]
        return [_IGNORED] if alone else []
    if alone and in_force.backlash != 0.0:
        return [
            (
                "the reversal value that the control had during the run is in the points now: set"
                " it to 0 on a control that does not ignore it beside a table"
            )
        ]
    own = None if in_force.read is None else in_force.read.table.backlash
    if own is not None and abs(own - in_force.backlash) > _SAME_REVERSAL:
        return [
            (
                f"the older table states a reversal of {own:+.3f} {unit}, --backlash-in-force"
                f" {in_force.backlash:+.3f} {unit}: the latter counts as in force during the run"
            )
        ]
    return []


def _drift_warnings(result: MadeTable) -> list[str]:
    run = result.run
    unit = run.test.kind.units.deviation
    if run.drift is None:
        return [f"whether the run drifts is not known: {run.why_no_drift}"]
    if result.drift_free or not run.drift.significant:
        return list(run.drift.warnings) if result.drift_free else []
    apart = np.abs(run.drift.level - result.measured.before)
    return [
        (
            f"{drift_in_words(run)}; the measured levels depart from the drift-free ones by up to"
            f" {float(np.nanmax(apart)):.2f} {unit}: consider --drift-free"
        )
    ]


def _range_warnings(result: MadeTable) -> list[str]:
    target, position = result.levels.target, result.wanted.position
    place = result.run.test.kind.units.position
    said: list[str] = []
    near = 0.01 * float(np.min(np.diff(position), initial=1.0))
    if position[0] < target[0] - near or position[-1] > target[-1] + near:
        said.append(
            f"points of the table lie outside the targets, which reach from {target[0]:.9g} to"
            f" {target[-1]:.9g} {place}: the first of them continues the line through the last"
            " target where it is long enough, else its value is held; nothing was measured there:"
            f" {_points_outside(result, near)}"
        )
    if position[0] > target[0] + near or position[-1] < target[-1] - near:
        said.append(
            f"the table reaches from {position[0]:.9g} to {position[-1]:.9g} {place} only: outside"
            " it the control holds the end values"
        )
    older = result.older
    if older is not None:
        lost, where = older.lost_at_points
        if max(lost, older.lost) > 0.5 * result.rule.resolution:
            unit = result.run.test.kind.units.deviation
            said.append(
                "the new points are too few for the older table: up to"
                f" {max(lost, older.lost):.2f} {unit} of it are lost between them, {lost:.2f}"
                f" {unit} at its point at {where:.9g} {place}; leave --points and --spacing out"
            )
    return said


def _points_outside(result: MadeTable, near: float) -> str:
    """Return the points outside the targets with their values, in words."""
    table, target = result.wanted, result.levels.target
    units = table.kind.units
    number = np.flatnonzero(
        (table.position < target[0] - near) | (table.position > target[-1] + near)
    )
    if number.size > _MOST_OUTSIDE:  # those next to the targets, and the outermost ones
        below = np.flatnonzero(table.position[number] < target[0])
        ends = {0, number.size - 1, *(below[-1:]).tolist(), min(below.size, number.size - 1)}
        shown = number[sorted(ends)]
    else:
        shown = number
    said: list[str] = []
    for k in shown.tolist():
        values = [f"{float(v):+.{_DECIMALS}f}" for v in table.deviation[k]]
        kept = values if result.rule.per_direction else values[:1]
        said.append(
            f"{table.position[k]:.9g} {units.position}: {' and '.join(kept)} {units.deviation}"
        )
    rest = number.size - shown.size
    return "; ".join(said) + (f"; and {rest} more" if rest else "")


# ---- JSON ---------------------------------------------------------------------------------------


def as_json(result: MadeTable, kept: str | None) -> dict[str, object]:
    """Return the result with the keys of the command's JSON."""
    drift = result.run.drift
    state = None
    if result.drift_free and drift is not None:
        state = finite_or_none(drift.reference_time_s)
    return {
        "version": __version__,
        "input": {"name": result.run.name, "sha256": result.run.sha256},
        "output": result.output,
        "older_file": kept,
        "control": result.control_name,
        "options": dict(result.options),
        "kind": str(result.run.test.kind),
        "axis": result.run.axis,
        "levels": "drift-free" if result.drift_free else "measured",
        "reference_time_s": state,
        "sign": result.control.sign,
        "unit": result.control.unit,
        "sentences": list(result.text.sentences),
        "table": table_as_json(result.read.table),
        "backlash_in_force": result.in_force.backlash,
        "reference_position": result.wanted.reference_position,
        "bound": {
            "interpolation": float(np.max(result.bound)),
            "residual": float(np.max(np.abs(result.residual))),
            "rounding": result.rounding,
            "steepest_slope": result.wanted.steepest_slope[0],
        },
        "targets": targets_as_json(result.measured),
        "figures": figures_as_json(result.run.test, result.measured),
        "figures_without_drift": None
        if result.without_drift is None
        else figures_as_json(result.run.test, result.without_drift),
        "merge": None if result.older is None else _merge_as_json(result, result.older),
        "findings": list(result.read.findings),
        "warnings": warnings_of(result),
    }


def table_as_json(table: CompensationTable) -> dict[str, object]:
    """Return a table as the control reads it."""
    return {
        "axis": table.axis,
        "positions": table.position.tolist(),
        "deviation_forward": table.deviation[:, FORWARD].tolist(),
        "deviation_backward": table.deviation[:, BACKWARD].tolist(),
        "backlash": table.backlash,
        "step": table.step,
    }


def _column(values: FloatArray, approach: int) -> list[float | None]:
    return [finite_or_none(value) for value in values[:, approach].tolist()]


def targets_as_json(effect: CorrectionEffect) -> list[dict[str, float | None]]:
    """Return what happens at the targets."""
    columns: dict[str, list[float | None]] = {
        "position": [finite_or_none(p) for p in effect.target.tolist()]
    }
    for name, values in (
        ("before", effect.before),
        ("correction", effect.correction),
        ("after", effect.after),
    ):
        columns[f"{name}_forward"] = _column(values, FORWARD)
        columns[f"{name}_backward"] = _column(values, BACKWARD)
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def figures_as_json(
    test: PositioningTest, effect: CorrectionEffect
) -> dict[str, dict[str, float | None]]:
    """Return figures before and after."""
    return {
        "before": shown_figures(test, effect.figures_before),
        "after": shown_figures(test, effect.figures_after),
    }


def _merge_as_json(result: MadeTable, older: OlderTable) -> dict[str, object]:
    change = result.wanted.deviation - older.at_points
    return {
        "name": older.name,
        "findings": list(older.read.findings),
        "lost": older.lost,
        "reference_position": result.reference.older,
        "backlash": older.read.table.backlash,
        "old_forward": _column(older.at_points, FORWARD),
        "old_backward": _column(older.at_points, BACKWARD),
        "change_forward": _column(change, FORWARD),
        "change_backward": _column(change, BACKWARD),
    }
