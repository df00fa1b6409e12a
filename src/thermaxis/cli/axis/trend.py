"""``thermaxis trend``: one axis over the years."""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

from thermaxis import __version__, report
from thermaxis.cli._json import write_json
from thermaxis.cli._progress import Progress
from thermaxis.cli._text_table import text_table
from thermaxis.errors import ConfigurationError, printable
from thermaxis.files import read_positioning
from thermaxis.positioning import FIGURE_KEYS
from thermaxis.report import (
    FIGURE_SYMBOLS,
    Trend,
    TrendFigure,
    TrendRun,
    evaluate_trend,
    trend_table,
    write_bytes,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = parser.add_argument
    add(
        "runs",
        metavar="RUN",
        type=Path,
        nargs="+",
        help="measured runs of one axis: .rtl, CSV, _ISO230.dat or .xlsx, in any order",
    )
    add("--figures", metavar="DIR", type=Path, help="write the chart as PNG and SVG, and its CSV")
    add("--csv", metavar="FILE|-", help="write the table as CSV; - for standard output alone")
    add("--json", metavar="FILE|-", help="write the result as JSON; - for standard output alone")
    add("--no-drift", action="store_true", help="leave the figures without drift out")
    add("--encoding", metavar="NAME", default="cp1250", help="of a text that is not UTF-8")


def run(arguments: argparse.Namespace) -> int:
    """Evaluate the runs and show how the figures changed."""
    _check_outputs(arguments)
    paths: list[Path] = arguments.runs
    tests = [
        (path.name, read_positioning(path, fallback_encoding=arguments.encoding)) for path in paths
    ]
    with Progress() as progress:
        trend = evaluate_trend(tests, drift=not arguments.no_drift, progress=progress)
    if arguments.figures is not None:
        report.write_trend_figures(trend, arguments.figures)
    if arguments.json is not None:
        write_json(trend_as_json(trend), arguments.json)
    if arguments.csv is not None:
        _write_csv(trend, arguments.csv)
    if "-" not in (arguments.json, arguments.csv):
        sys.stdout.write(trend_as_text(trend))
        if arguments.figures is not None:
            sys.stdout.write(f"written: {arguments.figures}\n")
    return 0


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Refuse an output that cannot be written, before anything is read or written."""
    if arguments.json == "-" and arguments.csv == "-":
        raise ConfigurationError(
            "JSON and CSV cannot both be alone on standard output",
            where="--json - --csv -",
            remedy="Give one of them a file",
        )
    for word in (arguments.json, arguments.csv):
        if word in (None, "-"):
            continue
        path = Path(word)
        if any(path.exists() and s.exists() and path.samefile(s) for s in arguments.runs):
            raise ConfigurationError(
                "this output would overwrite a measured run",
                where=word,
                remedy="Give it another name",
            )
    if arguments.figures is not None and arguments.figures.is_file():
        raise ConfigurationError(
            "the chart needs a folder, and this is a file",
            where=str(arguments.figures),
            remedy="Name a folder; it is made if it does not exist",
        )


def _write_csv(trend: Trend, destination: str) -> None:

    content = trend_table(trend).as_csv()
    if destination == "-":
        sys.stdout.write(content.decode())
    else:
        write_bytes(Path(destination), content)


# ---- text ---------------------------------------------------------------------------------------


def trend_as_text(trend: Trend) -> str:
    """Return the trend as tables for a terminal."""
    unit = trend.runs[0].test.kind.units.deviation
    parts = [_figure_table(trend, f"Figures of ISO 230-2 as measured, {unit}", free=False)]
    if any(run.drift_free for run in trend.runs):
        title = f"Figures without drift, {unit} (not a result of ISO 230-2)"
        parts.append(_figure_table(trend, title, free=True))
    if any(f.expanded_uncertainty is not None for r in trend.runs for f in r.measured.values()):
        parts.append(
            "±: expanded uncertainty (k = 2, GUM, Monte Carlo) from noise and drift alone, without"
            " instrument and environment\n"
        )
    parts.append(_change_lines(trend))
    parts += [f"warning: {printable(warning, 400)}" for warning in trend.warnings]
    return "\n".join(part for part in parts if part) + "\n"


def _cell(figure: TrendFigure | None) -> str:
    if figure is None:
        return "–"
    if figure.expanded_uncertainty is None:
        return f"{figure.value:.2f}"
    return f"{figure.value:.2f} ± {figure.expanded_uncertainty:.2f}"


def _figure_table(trend: Trend, title: str, *, free: bool) -> str:

    heads = ["", "run", "start", "cycles", *(FIGURE_SYMBOLS[key] for key in trend.figures)]
    rows: list[list[str]] = []
    for k, run in enumerate(trend.runs):
        figures = run.drift_free if free else run.measured
        start = "–" if run.test.start is None else run.test.start.strftime("%Y-%m-%d")
        cells = [_cell(figures.get(key)) for key in trend.figures]
        rows.append([f"{k + 1}", printable(run.name, 40), start, f"{run.test.cycles}", *cells])
    return text_table(title, heads, rows, words=3)


def _change_lines(trend: Trend) -> str:

    unit = trend.runs[0].test.kind.units.deviation
    lines: list[str] = []
    for change in trend.changes:
        text = f"{FIGURE_SYMBOLS[change.key]} changed by {change.change:+.2f} {unit} from run 1 to"
        text += f" run {len(trend.runs)} ({'without drift' if change.drift_free else 'measured'})"
        if change.significant is not None:
            verdict = "more than" if change.significant else "within"
            text += f": {verdict} its expanded uncertainty of {change.expanded_uncertainty:.2f}"
            text += f" {unit}"
        lines.append(text + "\n")
    return "".join(lines)


# ---- JSON ---------------------------------------------------------------------------------------


def trend_as_json(trend: Trend) -> dict[str, object]:
    """Return the trend with the keys of the command's JSON."""
    return {
        "version": __version__,
        "kind": str(trend.runs[0].test.kind),
        "sorted_by": "order given" if trend.dates is None else "start",
        "runs": [_run_as_json(run) for run in trend.runs],
        "changes": [
            {
                "figure": change.key,
                "drift_free": change.drift_free,
                "change": change.change,
                "expanded_uncertainty": change.expanded_uncertainty,
                "significant": change.significant,
            }
            for change in trend.changes
        ],
        "warnings": list(trend.warnings),
    }


def _run_as_json(run: TrendRun) -> dict[str, object]:
    test, drift = run.test, run.drift
    return {
        "name": run.name,
        "start": None if test.start is None else test.start.isoformat(),
        "targets": int(test.target.size),
        "first_target": float(test.target[0]),
        "last_target": float(test.target[-1]),
        "cycles": test.cycles,
        "iso230_2": _values(run.measured),
        "uncertainty": _uncertainties(run.measured),
        "drift": None
        if drift is None
        else {
            "model": str(drift.model),
            "total": drift.total,
            "total_per_m": drift.total_per_m,
            "iso230_2": _values(run.drift_free),
            "uncertainty": _uncertainties(run.drift_free),
        },
    }


def _values(figures: Mapping[str, TrendFigure]) -> dict[str, float | None]:

    return {key: figures[key].value if key in figures else None for key in FIGURE_KEYS}


def _uncertainties(figures: Mapping[str, TrendFigure]) -> dict[str, float | None]:

    return {
        key: figures[key].expanded_uncertainty if key in figures else None for key in FIGURE_KEYS
    }
