"""The result of ``correct`` as text for a terminal and as JSON."""

from collections.abc import Iterator

import numpy as np

from thermaxis import __version__
from thermaxis.cli.axis.tables.make import MadeTable
from thermaxis.cli.axis.tables.run import (
    EDITION,
    absent_in_words,
    drift_warning,
    run_in_words,
    shown_figures,
    systematic_range,
    table_warning,
    temperature_in_words,
)
from thermaxis.codes import Message
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
from thermaxis.report.tables import Part, Section, Table, Value, messages_of, rows_of

_DECIMALS = 2
_MOST_OUTSIDE = 6
"""So many points outside the targets are named each. [1]"""
_SAME_REVERSAL = 1e-3
"""Reversals nearer than this are the same: the last digit that is shown. [µm or arcsec]"""


def described(result: MadeTable, kept: str | None) -> list[Part]:
    """Return a table that was made for terminal and JSON."""
    run, drift, arguments, older = result.run, result.run.drift, result.arguments, result.in_force
    state = drift.reference_time_s if arguments.drift_free and drift is not None else None
    read = () if older.read is None else tuple(map(text_of, older.read.findings))
    drift_said = drift.warnings if arguments.drift_free and drift is not None else ()
    said = [*result.levels.remarks, *drift_said, *warnings_of(result)]
    return [
        Value("version", __version__),
        Value("input", {"name": run.name, "sha256": run.sha256}),
        Value("output", arguments.output),
        Section("", list(_head(result, kept))),
        Value("older_file", kept),
        Value("control", arguments.control),
        Value("options", result.options),
        Value("kind", str(run.test.kind)),
        Value("axis", run.axis),
        Value("levels", "drift-free" if arguments.drift_free else "measured"),
        Value("reference_time_s", state),
        Section("", list(_sign_and_unit(result))),
        Value("sign", text_of(result.control.sign)),
        Value("unit", text_of(result.control.unit)),
        *messages_of("sentences", result.text.advice),
        Section("", list(_values(result))),
        table_of(result.read.table),
        Value("backlash_in_force", older.backlash),
        Value("reference_position", result.wanted.reference_position),
        *_left(result),
        targets_of(run.test, result.measured, ""),
        effects(run.test, result.measured, result.without_drift),
        Section("merge", [*_older(result)]) if older.read is not None else Value("merge", None),
        Section("", [Value("", read, "finding in the older table")]),
        *messages_of("findings", result.read.findings, "read back"),
        *messages_of("warnings", [*run.test.remarks, *said], "warning"),
    ]


def _head(result: MadeTable, kept: str | None) -> Iterator[str]:
    run = result.run
    output = result.arguments.output
    yield f"{output}: compensation table of axis {run.axis} for {result.control.title}"
    yield effect_in_words(run.test, result.measured)
    yield run_in_words(run)
    yield f"made of: {levels_in_words(result)}"
    if kept is not None:
        yield f"the table that stood there was kept as {kept}"


def levels_in_words(result: MadeTable) -> str:
    """Return what levels the table was made of."""
    drift = result.run.drift
    if not result.arguments.drift_free or drift is None:
        return "mean deviations as measured, with the drift of the run in them"
    if not drift.significant:
        return "mean deviations as measured: no drift is seen in the run"
    when = ""
    if drift.reference_time_s is not None:
        when = f" at {drift.reference_time_s / 3600.0:.2f} h"
    return f"mean deviations without drift, in the thermal state{when}"


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
    if result.residual.backlash is not None:
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
    residual = np.max(np.abs(result.missed), axis=1)
    bound = result.bound
    i, j = int(np.argmax(bound)), int(np.argmax(residual))
    target = result.levels.target
    half = "; both with the half of the reversal that remains"
    yield Section(
        "bound",
        [
            (
                "interpolation: between its points the table can miss a mean deviation by"
                f" {float(bound[i]):.{_DECIMALS}f} {unit} at most (target at"
                f" {target[i]:.9g} {place}, by the slopes between targets); the largest residual is"
                f" {float(residual[j]):.{_DECIMALS}f} {unit} (target at {target[j]:.9g}"
                f" {place}){'' if result.rule.per_direction else half}"
            ),
            (
                f"rounding: {result.rounding:.3g} {unit} at most, between what was meant and the"
                " file as the control reads it"
            ),
            Value("interpolation", bound[i]),
            Value("residual", residual[j]),
            Value("rounding", result.rounding),
            Value("steepest_slope", result.wanted.steepest_slope[0]),
        ],
    )


def effect_in_words(test: PositioningTest, effect: CorrectionEffect) -> str:
    """Return what a table makes of the measured figures."""
    before, after = (
        shown_figures(test, figures) for figures in (effect.figures_before, effect.figures_after)
    )
    figures = [key for key in FIGURE_KEYS if key[0] in "AEM" and before[key] is not None]
    said = [
        f"{FIGURE_SYMBOLS[key]} from {before[key]:.{_DECIMALS}f} to {after[key]:.{_DECIMALS}f}"
        for key in [key for key in figures if len(key) == 1] or figures
    ]
    return f"with the table, simulated: {', '.join(said)} {test.kind.units.deviation}"


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


def _older(result: MadeTable) -> Iterator[Part]:
    table, unit, point = result.wanted, result.wanted.kind.units, result.reference
    in_force, older = result.in_force, result.older
    if in_force.read is None or older is None:
        return
    change = table.deviation - older.at_points
    both = result.rule.per_direction
    columns = [Value("", table.position, unit.position, ".3f")]
    for name, values in (("old", older.at_points), ("new", table.deviation), ("change", change)):
        for a in (FORWARD, BACKWARD) if both else (FORWARD,):
            head = f"{name} {'↑↓'[a]}" if both else name
            columns.append(Value("", values[:, a], head, "+.3f"))
    title = f"Deviations in {in_force.name} and in the new table, {unit.deviation}"
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
            f"Reversal apart from the points: old {in_force.backlash or 0.0:+.3f}, new"
            f" {table.backlash:+.3f} {unit.deviation}"
        )
    yield Value("name", in_force.name)
    yield from messages_of("findings", in_force.read.findings)
    yield Value("lost", older.lost)
    yield Value("reference_position", point.older)
    yield Value("backlash", in_force.read.table.backlash)
    for key, values in (("old", older.at_points), ("change", change)):
        yield Value(f"{key}_forward", values[:, FORWARD])
        yield Value(f"{key}_backward", values[:, BACKWARD])


def warnings_of(result: MadeTable) -> Iterator[Message]:
    """Return what the user of a table must know."""
    run, drift = result.run, result.run.drift
    if run.axis_refused:
        yield table_warning("axis_name_unusable", stated=run.axis_refused, axis=run.axis)
    elif run.axis_assumed:
        yield table_warning("axis_assumed", axis=run.axis)
    if drift is None:
        yield table_warning("drift_unknown", cause=run.why_no_drift)
    elif drift.significant and not result.arguments.drift_free:
        apart = float(np.nanmax(np.abs(drift.level - result.measured.before)))
        yield drift_warning("drift_in_levels", run, drift, apart=apart)
    yield from _range_warnings(result)
    if systematic_range(result.measured.after) >= systematic_range(result.measured.before):
        yield table_warning("nothing_gained")
    if result.older is None:
        yield table_warning("no_table_in_force")
    yield from result.doubts
    yield from result.reference.warnings
    yield from _reversal_warnings(result)
    yield table_warning("sign_to_be_proven")
    yield table_warning("drift_stays")
    yield table_warning("temperature_of_run", temperature=temperature_in_words(run.test))
    yield table_warning("table_not_in_force")


def _reversal_warnings(result: MadeTable) -> Iterator[Message]:
    """Return what the control's own reversal value has to do with the new file."""
    stated, read = result.in_force.backlash, result.in_force.read
    alone = result.rule.per_direction and result.older is None
    own = None if read is None else read.table.backlash
    if stated is None and result.residual.backlash is not None:
        yield table_warning("reversal_counts_as_zero")
    elif stated is None:
        if alone:
            yield table_warning("reversal_may_be_ignored")
    elif alone and stated != 0.0:
        yield table_warning("reversal_in_points")
    elif own is not None and abs(own - stated) > _SAME_REVERSAL:
        unit = result.wanted.kind.units.deviation
        yield table_warning("reversal_differs", of_table=own, stated=stated, unit=unit)


def _range_warnings(result: MadeTable) -> Iterator[Message]:
    target, position, older = result.levels.target, result.wanted.position, result.older
    units = result.run.test.kind.units
    place = units.position
    first, last = float(target[0]), float(target[-1])
    near = 0.01 * float(np.min(np.diff(position), initial=1.0))
    if position[0] < first - near or position[-1] > last + near:
        points = tuple(_points_outside(result, near))
        yield table_warning(
            "points_outside_targets", first=first, last=last, position_unit=place, points=points
        )
    low, high = float(position[0]), float(position[-1])
    if low > first + near or high < last - near:
        yield table_warning("table_ends_within_targets", first=low, last=high, position_unit=place)
    if older is not None:
        lost, where = older.lost_at_points
        if max(lost, older.lost) > 0.5 * result.rule.resolution:
            yield table_warning(
                "older_table_lost",
                lost=max(lost, older.lost),
                lost_at_point=lost,
                unit=units.deviation,
                position=where,
                position_unit=place,
            )


def _points_outside(result: MadeTable, near: float) -> Iterator[str]:
    """Yield the points outside the targets with their values."""
    table, target = result.wanted, result.levels.target
    units = table.kind.units
    number = np.flatnonzero(
        (table.position < target[0] - near) | (table.position > target[-1] + near)
    )
    shown = number
    if number.size > _MOST_OUTSIDE:  # those next to the targets, and the outermost ones
        below = np.flatnonzero(table.position[number] < target[0])
        ends = {0, number.size - 1, *(below[-1:]).tolist(), min(below.size, number.size - 1)}
        shown = number[sorted(ends)]
    for k in shown.tolist():
        values = [f"{float(v):+.{_DECIMALS}f}" for v in table.deviation[k]]
        kept = values if result.rule.per_direction else values[:1]
        yield f"{table.position[k]:.9g} {units.position}: {' and '.join(kept)} {units.deviation}"
    if number.size > shown.size:
        yield f"and {number.size - shown.size} more"
