"""Show the figures of one axis over several runs."""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from thermaxis import __version__, report
from thermaxis.cli._arguments import add_figures, add_json, adder
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli._reading import Reading, add_reading, reading_of
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.files import RunMapping, read_positioning
from thermaxis.positioning import FIGURE_KEYS, PositioningTest
from thermaxis.report.tables import Part, Section, Table, Value, as_json, messages_of, values_of

_UNCERTAINTY = (
    "±: expanded uncertainty U (95.45 %, GUM, Monte Carlo) from noise and drift alone, without"
    " instrument and environment"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add(
        "runs RUN",
        "measured runs of one axis: .rtl, CSV, _ISO230.dat or .xlsx, in any order",
        Path,
        nargs="+",
    )
    add_figures(parser, "the chart as PNG and SVG, and its CSV")
    add("--csv FILE|-", "write the table as CSV; - for standard output alone")
    add_json(parser)
    add("--no-drift", "leave the figures without drift out", bool)
    add_reading(parser, "a text")


def run(arguments: argparse.Namespace) -> int:
    """Evaluate the runs and show how the figures changed."""
    _check_outputs(arguments)
    paths: list[Path] = arguments.runs
    tests = _read(paths, reading_of(arguments))
    with Progress() as progress:
        trend = report.evaluate_trend(tests, drift=not arguments.no_drift, progress=progress)
    if arguments.figures is not None:
        report.write_trend_figures(trend, arguments.figures)
    if arguments.csv is not None:
        _write_csv(trend, arguments.csv)
    written = [] if arguments.figures is None else [arguments.figures]
    show(described(trend), arguments.json, written, quiet=arguments.csv == "-")
    return 0


def _read(paths: list[Path], reading: Reading) -> list[tuple[str, PositioningTest]]:
    """Read runs; what an option says of tables need not fit those that are none."""
    unused: dict[str, list[MeasurementFileError]] = {}
    tests: list[tuple[str, PositioningTest]] = []
    for path in paths:
        mapping, encoding = reading["mapping"], reading["fallback_encoding"]
        while True:
            try:
                test = read_positioning(path, fallback_encoding=encoding, mapping=mapping)
                tests.append((path.name, test))
                break
            except MeasurementFileError as error:
                if error.code != "reading_option_unused":
                    raise
                name = str(error.values["name"])
                unused.setdefault(name, []).append(error)
                mapping = replace(mapping, **{name: getattr(RunMapping(), name)})
    for errors in unused.values():
        if len(errors) == len(paths):
            raise errors[0]
    return tests


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Refuse an output that cannot be written, before anything is read or written."""
    if arguments.json == "-" and arguments.csv == "-":
        raise ConfigurationError("options_exclude", key="--csv", one="--json -", other="--csv -")
    check_outputs(
        [("--json", arguments.json), ("--csv", arguments.csv)],
        [*arguments.runs, arguments.map],
        charts=arguments.figures,
    )


def _write_csv(trend: report.Trend, destination: str) -> None:
    content = report.trend_table(trend).as_csv()
    if destination == "-":
        sys.stdout.write(content.decode())
    else:
        report.write_bytes(Path(destination), content)


def described(trend: report.Trend) -> list[Part]:
    """Return the trend for terminal and JSON."""
    unit = trend.runs[0].test.kind.units.deviation
    shown = [_figures(trend, f"Figures of ISO 230-2 as measured, {unit}", free=False)]
    if any(run.drift_free for run in trend.runs):
        title = f"Figures without drift, {unit} (not a result of ISO 230-2)"
        shown.append(_figures(trend, title, free=True))
    known = any(f.expanded_uncertainty is not None for r in trend.runs for f in r.measured.values())
    return [
        Value("version", __version__),
        Value("kind", str(trend.runs[0].test.kind)),
        Value("sorted_by", "order given" if trend.dates is None else "start"),
        Section("", [_change(change, len(trend.runs), unit) for change in trend.changes]),
        *shown,
        *([_UNCERTAINTY] if known else []),
        Value("runs", [as_json(_run(run)) for run in trend.runs]),
        Value("changes", [as_json(values_of_change(change)) for change in trend.changes]),
        Section("", messages_of("warnings", trend.warnings, "warning")),
    ]


def _figures(trend: report.Trend, title: str, *, free: bool) -> Table:
    rows: list[list[Value]] = []
    for k, run in enumerate(trend.runs):
        start = "–" if run.test.start is None else run.test.start.strftime("%Y-%m-%d")
        rows.append(
            [
                Value("", f"{k + 1}", ""),
                Value("", run.name[:40], "run"),
                Value("", start, "start"),
                Value("", run.test.cycles, "cycles"),
            ]
        )
        figures = run.drift_free if free else run.measured
        rows[-1] += [
            Value("", _cell(figures.get(key)), report.FIGURE_SYMBOLS[key]) for key in trend.figures
        ]
    return Table(title, rows, words=3)


def _cell(figure: report.TrendFigure | None) -> str:
    if figure is None:
        return "–"
    if figure.expanded_uncertainty is None:
        return f"{figure.value:.2f}"
    return f"{figure.value:.2f} ± {figure.expanded_uncertainty:.2f}"


def _change(change: report.TrendChange, runs: int, unit: str) -> str:
    text = (
        f"{report.FIGURE_SYMBOLS[change.key]} changed by {change.change:+.2f} {unit} from run 1 to"
        f" run {runs} ({'without drift' if change.drift_free else 'measured'})"
    )
    if change.significant is None:
        return text
    verdict = "more than" if change.significant else "within"
    return f"{text}: {verdict} its U of {change.expanded_uncertainty:.2f} {unit} (95.45 %)"


def values_of_change(change: report.TrendChange) -> list[Value]:
    """Return a change for the JSON."""
    return [
        Value("figure", change.key),
        *values_of(change, "drift_free", "change", "expanded_uncertainty", "significant"),
    ]


def _run(run: report.TrendRun) -> list[Part]:
    test, drift = run.test, run.drift
    parts: list[Part] = [
        Value("name", run.name),
        Value("start", test.start),
        Value("targets", test.target.size),
        Value("first_target", test.target[0]),
        Value("last_target", test.target[-1]),
        Value("cycles", test.cycles),
        *_by_figure(run.measured),
    ]
    if drift is None:
        return [*parts, Value("drift", None)]
    values = values_of(drift, "model", "total", "total_per_m")
    return [*parts, Section("drift", [*values, *_by_figure(run.drift_free)])]


def _by_figure(figures: Mapping[str, report.TrendFigure]) -> list[Value]:
    values = {key: getattr(figures.get(key), "value", None) for key in FIGURE_KEYS}
    stated = {key: getattr(figures.get(key), "expanded_uncertainty", None) for key in FIGURE_KEYS}
    return [Value("iso230_2", values), Value("uncertainty", stated)]
