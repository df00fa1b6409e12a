"""The result of ``correct`` as text for a terminal and as JSON."""

from collections.abc import Iterator

import numpy as np

from thermaxis import __version__
from thermaxis.cli.axis.tables.make import MadeTable, OlderTable
from thermaxis.cli.axis.tables.run import (
    EDITION,
    absent_in_words,
    axis_warning,
    drift_in_words,
    run_in_words,
    shown_figures,
    systematic_range,
    temperature_in_words,
)
from thermaxis.codes import message_as_json
from thermaxis.controls import ReadTable
from thermaxis.messages import text_of
from thermaxis.positioning import (
    APPROACHES,
    BACKWARD,
    FIGURE_KEYS,
    FORWARD,
    CompensationTable,
    CorrectionEffect,
    FloatArray,
    PositioningTest,
)
from thermaxis.report import FIGURE_NAMES, FIGURE_SYMBOLS, edition_name
from thermaxis.report.tables import Part, Section, Table, Value, rows_of

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


def found_in(read: ReadTable) -> tuple[str, ...]:
    """Return what was found in a control's table, in sentences."""
    return tuple(text_of(one) for one in read.findings)


def finding_codes(read: ReadTable) -> list[dict[str, object]]:
    """Return what was found in a control's table, as JSON has it."""
    return [message_as_json(one) for one in read.findings]


def described(result: MadeTable, kept: str | None) -> list[Part]:
    """Return a table that was made for terminal and JSON."""
    run, drift, older = result.run, result.run.drift, result.older
    state = drift.reference_time_s if result.drift_free and drift is not None else None
    read = () if older is None else found_in(older.read)
    return [
        Value("version", __version__),
        Value("input", {"name": run.name, "sha256": run.sha256}),
        Value("output", result.output),
        Section("", list(_head(result, kept))),
        Value("older_file", kept),
        Value("control", result.control_name),
        Value("options", result.options),
        Value("kind", str(run.test.kind)),
        Value("axis", run.axis),
        Value("levels", "drift-free" if result.drift_free else "measured"),
        Value("reference_time_s", state),
        Section("", list(_sign_and_unit(result))),
        Value("sign", text_of(result.control.sign)),
        Value("unit", text_of(result.control.unit)),
        Value("sentences", [text_of(one) for one in result.text.advice]),
        Value("sentence_codes", [message_as_json(one) for one in result.text.advice]),
        Section("", list(_values(result))),
        table_of(result.read.table),
        Value("backlash_in_force", result.in_force.backlash),
        Value("reference_position", result.wanted.reference_position),
        *_left(result),
        targets_of(run.test, result.measured, ""),
        effects(run.test, result.measured, result.without_drift),
        Value("merge", None) if older is None else Section("merge", list(_older(result, older))),
        Section("", [Value("", read, "finding in the older table")]),
        Value("findings", found_in(result.read), "read back"),
        Value("finding_codes", finding_codes(result.read)),
        Value("warnings", warnings_of(result), "warning"),
    ]


def _head(result: MadeTable, kept: str | None) -> Iterator[str]:
    run = result.run
    yield f"{result.output}: compensation table of axis {run.axis} for {result.control.title}"
    yield run_in_words(run)
    yield f"levels: {levels_in_words(result)}"
    if kept is not None:
        yield f"the table that stood there was kept as {kept}"


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


def _sign_and_unit(result: MadeTable) -> Iterator[str]:
    control = result.control
    yield f"sign: {text_of(control.sign)}"
    yield f"unit: {text_of(control.unit)}"
    yield from map(text_of, result.text.advice)
    options = ", ".join(f"{name}={value}" for name, value in result.options.items())
    if options:
        yield f"options: {options}"


def _values(result: MadeTable) -> Iterator[str]:
    table = result.wanted
    unit, place = table.kind.units.deviation, table.kind.units.position
    worst = np.unravel_index(int(np.argmax(np.abs(table.deviation))), table.deviation.shape)
    lowest, highest = float(np.min(table.deviation)), float(np.max(table.deviation))
    most = "" if result.rule.most_points is None else f" of at most {result.rule.most_points}"
    yield (
        f"points: {table.position.size}{most}, from {table.position[0]:.9g} to"
        f" {table.position[-1]:.9g} {place}; {result.grid}"
    )
    yield (
        f"zero at the reference point {table.reference_position:.9g} {place}"
        f" ({_reference_in_words(result)})"
    )
    yield (
        f"deviations in the table: {lowest:+.{_DECIMALS}f} to {highest:+.{_DECIMALS}f} {unit},"
        f" largest {float(table.deviation[worst]):+.{_DECIMALS}f} {unit} at"
        f" {float(table.position[worst[0]]):.9g} {place}; {slope_in_words(table)}"
    )
    yield f"reversal: {_reversal_in_words(result)}"
    if result.rule.advice is not None:
        yield f"limit of the control: {text_of(result.rule.advice)}"


def _reference_in_words(result: MadeTable) -> str:
    target, point = result.levels.target, result.reference
    words = f"; {point.words}" if point.words else ""
    if target[0] <= point.position <= target[-1]:
        return f"the mean of both directions{words}"
    return f"outside the targets: the value of the nearest end was taken as zero{words}"


def slope_in_words(table: CompensationTable) -> str:
    """Return where a table is steepest."""
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


def _left(result: MadeTable) -> Iterator[Part]:
    unit, place = result.wanted.kind.units.deviation, result.wanted.kind.units.position
    residual = np.max(np.abs(result.residual), axis=1)
    i, j = int(np.argmax(result.bound)), int(np.argmax(residual))
    target = result.levels.target
    half = "; both with the half of the reversal that remains"
    yield Section(
        "bound",
        [
            (
                "interpolation: between its points the table can miss a level by"
                f" {float(result.bound[i]):.{_DECIMALS}f} {unit} at most (target at"
                f" {target[i]:.9g} {place}, by the slopes of the levels); the largest residual is"
                f" {float(residual[j]):.{_DECIMALS}f} {unit} (target at {target[j]:.9g}"
                f" {place}){'' if result.rule.per_direction else half}"
            ),
            (
                f"rounding: {result.rounding:.3g} {unit} at most, between what was meant and the"
                " file as the control reads it"
            ),
            Value("interpolation", result.bound[i]),
            Value("residual", residual[j]),
            Value("rounding", result.rounding),
            Value("steepest_slope", result.wanted.steepest_slope[0]),
        ],
    )


def effects(
    test: PositioningTest, measured: CorrectionEffect, without_drift: CorrectionEffect | None
) -> Section:
    """Return the figures before and after, as measured and without drift."""
    parts: list[Part] = []
    columns: dict[str, dict[str, float | None]] = {}
    for key, effect, head in (
        ("figures", measured, "before"),
        ("figures_without_drift", without_drift, "no drift: before"),
    ):
        if effect is None:
            parts.append(Value(key, None))
            continue
        before, after = (
            shown_figures(test, figures)
            for figures in (effect.figures_before, effect.figures_after)
        )
        parts.append(Value(key, {"before": before, "after": after}))
        columns |= {head: before, f"{head.replace('before', 'after')}": after}
    names = FIGURE_NAMES[EDITION]
    rows = [
        [
            Value("", FIGURE_SYMBOLS[figure], ""),
            Value("", names[figure], "figure"),
            *(
                Value("", column[figure], head, f".{_DECIMALS}f")
                for head, column in columns.items()
            ),
        ]
        for figure in FIGURE_KEYS
        if columns["before"][figure] is not None
    ]
    title = f"{edition_name(EDITION)}, simulated with the table, {test.kind.units.deviation}"
    parts.append(Table(title, rows, words=2))
    parts += [text for text in (absent_in_words(test),) if text]
    if without_drift is not None:
        parts.append("Figures without drift are no results of ISO 230-2.")
    return Section("", parts)


def table_of(table: CompensationTable) -> Section:
    """Return a table as the control reads it, for the JSON."""
    return Section(
        "table",
        [
            Value("axis", table.axis),
            Value("positions", table.position),
            Value("deviation_forward", table.deviation[:, FORWARD]),
            Value("deviation_backward", table.deviation[:, BACKWARD]),
            Value("backlash", table.backlash),
            Value("step", table.step),
        ],
    )


def targets_of(test: PositioningTest, effect: CorrectionEffect, title: str) -> Table:
    """Return what happens at the targets; without a title for the JSON alone."""
    units = test.kind.units
    columns = [Value("position", effect.target, units.position, ".3f")]
    for name in ("before", "correction", "after"):
        for a, (word, seen) in enumerate(zip(APPROACHES, test.measured_approaches, strict=True)):
            values: FloatArray = getattr(effect, name)[:, a]
            head = f"{name} {'↑↓'[a]}" if seen else None
            columns.append(Value(f"{name}_{word}", values, head, f"+.{_DECIMALS}f"))
    return Table(f"{title}, {units.deviation}" if title else "", rows_of(*columns), key="targets")


def _older(result: MadeTable, older: OlderTable) -> Iterator[Part]:
    table, unit, point = result.wanted, result.wanted.kind.units, result.reference
    change = table.deviation - older.at_points
    both = result.rule.per_direction
    columns = [Value("", table.position, unit.position, ".3f")]
    for name, values in (("old", older.at_points), ("new", table.deviation), ("change", change)):
        for a in (FORWARD, BACKWARD) if both else (FORWARD,):
            head = f"{name} {'↑↓'[a]}" if both else name
            columns.append(Value("", values[:, a], head, "+.3f"))
    title = f"Deviations in {older.name} and in the new table, {unit.deviation}"
    yield Table(title, rows_of(*columns))
    yield (
        "The run counts as measured with the old table in force: the new table is the old one plus"
        " what the run still shows, and takes its place. Load it instead of the old one, not in"
        " addition to it."
    )
    nowhere = "not stated, and the table is nowhere zero"
    stated = nowhere if point.older is None else f"{point.older:.9g} {unit.position}"
    yield f"Reference point: old {stated}, new {point.position:.9g} {unit.position}"
    if table.backlash is not None and not both:
        yield (
            f"Reversal apart from the points: old {result.in_force.backlash or 0.0:+.3f}, new"
            f" {table.backlash:+.3f} {unit.deviation}"
        )
    yield Value("name", older.name)
    yield Value("findings", found_in(older.read))
    yield Value("finding_codes", finding_codes(older.read))
    yield Value("lost", older.lost)
    yield Value("reference_position", point.older)
    yield Value("backlash", older.read.table.backlash)
    for key, values in (("old", older.at_points), ("change", change)):
        yield Value(f"{key}_forward", values[:, FORWARD])
        yield Value(f"{key}_backward", values[:, BACKWARD])


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
