"""Compare several compensation models on one log."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

from thermaxis import __version__, report
from thermaxis.cli._arguments import add_figures, add_json, add_report, adder
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._thermal_logs import (
    add_log_options,
    add_start,
    logs_of,
    measured_output,
    reading_codes,
    remarks_of,
    with_clocks_told,
)
from thermaxis.cli.thermal.verify import figures_of
from thermaxis.compensation import CompensationModel
from thermaxis.files import model_sha256, read_model
from thermaxis.messages import text_of
from thermaxis.report.tables import Part, Section, Table, Value, as_json, messages_of
from thermaxis.thermal import LogStart, ThermalLog, verify

_STARTS = {
    LogStart.REST: "at rest, as the machine does",
    LogStart.STEADY: "in the steady state of the first row; a machine starts at rest",
    LogStart.FITTED: "from states and zero fitted to the log; a machine starts at rest",
}
_ORDER = tuple(LogStart)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("files MODEL", "compensation models (JSON)", Path, nargs="+")
    add("log LOG", "a test that none of them was made from", Path)
    add(
        "--measured CHANNEL[=OUTPUT[@MM]]",
        "measured channel, the models' output it is compared with, and the workpiece diameter"
        " (default: channels named as the outputs)",
        measured_output,
        action="append",
    )
    add_start(parser)
    add_json(parser)
    add_report(parser)
    add_figures(parser)
    add_log_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Compare and show."""
    check_outputs(
        [("--json", arguments.json), *(("--report", path) for path in arguments.report)],
        [*arguments.files, arguments.log, arguments.mapping],
        charts=arguments.figures,
    )
    with Progress() as progress:
        progress("reading", 0, 0)
        (log,) = logs_of(arguments, [arguments.log])
        models = [(path, read_model(path)) for path in arguments.files]
        (log,) = with_clocks_told(
            [log], [model for _, model in models], arguments.measured, arguments.reference
        )
        results = _compared(progress, arguments, log, models, arguments.start)
        if len(starts := _starts(results)) > 1:
            results = _compared(progress, arguments, log, models, max(starts, key=_ORDER.index))
        written = [*arguments.report]
        if arguments.report or arguments.figures is not None:
            progress("report", 0, 0)
        if arguments.report:
            report.write_comparison_report(results, *arguments.report)
        if arguments.figures is not None:
            report.write_comparison_figures(results, arguments.figures)
            written.append(arguments.figures)
    show(_described(log, results), arguments.json, written)
    return 0


def _compared(
    progress: Progress,
    arguments: argparse.Namespace,
    log: ThermalLog,
    models: Sequence[tuple[Path, CompensationModel]],
    start: LogStart | None,
) -> list[report.ComparedModel]:
    results: list[report.ComparedModel] = []
    names = _names(arguments.files)
    for k, (path, model) in enumerate(models):
        progress(f"simulating {path.name}", k, len(models))
        result = verify(
            model, [log], arguments.measured, reference_s=arguments.reference, start=start
        )
        results.append(report.ComparedModel(names[k], model, result))
    return results


def _starts(results: Sequence[report.ComparedModel]) -> set[LogStart]:
    """Return how the free runs began; models are ranked by runs that began alike."""
    return {o.start.start for one in results for o in one.result.logs[0].outputs}


def _names(paths: Sequence[Path]) -> list[str]:
    """Return the names of files, with as many of their folders as tell them apart."""
    parts = [path.absolute().parts for path in paths]
    depth = 1
    while len({each[-depth:] for each in parts}) < len(set(parts)):
        depth += 1
    return ["/".join(each[-depth:]) for each in parts]


def _described(log: ThermalLog, results: Sequence[report.ComparedModel]) -> list[Part]:
    remarks = remarks_of([log])
    models = [
        {
            "name": one.name,
            "model_sha256": model_sha256(one.model),
            "outputs": {n: as_json(figures_of(f)) for n, f in one.result.pooled.items()},
        }
        | as_json(messages_of("warnings", one.result.warnings))
        for one in results
    ]
    names = dict.fromkeys(name for one in results for name in one.result.pooled)
    warnings = [
        f"{one.name[:40]}: {text_of(w)}"
        for one in results
        for w in one.result.warnings
        if not w.code.startswith("remark-start_")
    ]
    (start,) = _starts(results)
    return [
        *remarks_of([log], assumed=True),
        Value("version", __version__),
        Value("log", log.name),
        Value("start", str(start)),
        Section("", [f"Every model starts {_STARTS[start]}."]),
        *(Section("", list(_table(name, log, results))) for name in names),
        Value("models", models),
        Value("warnings", remarks, "reading"),
        reading_codes([log]),
        Value("", warnings, "warning"),
    ]


def _table(name: str, log: ThermalLog, results: Sequence[report.ComparedModel]) -> Iterator[Part]:
    known = [(o.name, o.result.pooled[name]) for o in results if name in o.result.pooled]
    known.sort(key=lambda entry: entry[1].rmse_um)
    uncompensated = known[0][1].uncompensated_um
    rows = [
        [
            Value("", model[:40], "model"),
            Value("", f.fit_percent, "fit %", ".1f"),
            Value("", f.residual_um, "left um", ".2f"),
            Value("", f.rmse_um, "RMSE um", ".2f"),
            Value("", f.mae_um, "MAE um", ".2f"),
            Value("", f.max_um, "max um", ".2f"),
        ]
        for model, f in known
    ]
    title = f"{name[:30]} of {log.name[:40]}, best first; p-p without"
    yield Table(f"{title} compensation {uncompensated:.2f} um", rows, words=1)
    statics = [f.static_rmse_um for _, f in known if f.static_rmse_um is not None]
    if statics:
        yield f"static regression on the same inputs: RMSE {min(statics):.2f} um"
