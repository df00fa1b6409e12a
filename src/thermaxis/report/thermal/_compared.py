"""Several models against one log: one chart of all of them, and the table of their fits."""

from collections.abc import Sequence

import numpy as np

from thermaxis import __version__
from thermaxis.files import model_sha256
from thermaxis.messages import text_of
from thermaxis.report._document import (
    Document,
    Fields,
    ItemList,
    Section,
    Table,
    columns_of,
)
from thermaxis.report._text import plain_text
from thermaxis.report.thermal._compared_model import ComparedModel
from thermaxis.report.thermal._conditions import HOUR_S
from thermaxis.report.thermal._panels import (
    LOOKS,
    MEASURED,
    Panel,
    PanelGrid,
    ThermalChart,
    Trace,
    panel_chart,
)
from thermaxis.report.thermal._verification import FREE_RUN_NOTES, pictures_of
from thermaxis.report.thermal._words import (
    hours,
    micrometres,
    name_text,
    percent,
    warning_blocks,
)
from thermaxis.thermal import VerifiedOutput


def _by_output(models: Sequence[ComparedModel]) -> dict[str, list[tuple[str, VerifiedOutput]]]:
    """Return the free runs by measured output, each with its model's name, best first."""
    found: dict[str, list[tuple[str, VerifiedOutput]]] = {}
    for one in models:
        for output in one.result.logs[0].outputs:
            found.setdefault(output.measured.name, []).append((one.name, output))
    for runs in found.values():
        runs.sort(key=lambda run: run[1].figures.rmse_um)
    return found


def comparison_charts(models: Sequence[ComparedModel]) -> tuple[ThermalChart, ...]:
    """Return one chart per measured output: measured and free runs, what each leaves below."""
    log = models[0].result.logs[0]
    time_h = log.time_s / HOUR_S
    charts: list[ThermalChart] = []
    for number, (name, runs) in enumerate(_by_output(models).items()):
        shown = [
            (f"{model}\nfit {percent(run.figures.fit_percent)} %", run, look)
            for (model, run), look in zip(runs, LOOKS, strict=False)
        ][::-1]  # the last line lies above the others
        measured = Trace("measured", time_h, shown[0][1].measured_um, MEASURED)
        free = [Trace(label, time_h, run.simulated_um, look) for label, run, look in shown]
        left = [Trace(label, time_h, run.residual_um, look) for label, run, look in shown]
        grid = PanelGrid(
            heading=f"{name}: measured, and the free run of every model, best last",
            source=log.name,
            panels=(
                Panel(
                    title="Displacement",
                    quantity="displacement [µm]",
                    traces=(measured, *free),
                    height_in=2.6,
                ),
                Panel(
                    title="Error: measured minus free run",
                    quantity="error [µm]",
                    traces=tuple(left),
                    height_in=2.1,
                ),
            ),
            one_legend=True,
        )
        caption = f"{name_text(name)}: measured displacement, free run of every model, and errors."
        if len(shown) < len(runs):
            caption += f" The best {len(shown)} of {len(runs)} models."
        charts.append(panel_chart(f"compared_output_{number + 1}", caption, grid))
    return tuple(charts)


def comparison_document(models: Sequence[ComparedModel]) -> Document:
    """Return the content of the report of a comparison."""
    log = models[0].result.logs[0]
    pictures = list(pictures_of(comparison_charts(models)).values())
    warnings = [f"{one.name}: {text_of(w)}" for one in models for w in one.result.warnings]
    sections = [
        Section(name_text(name), (_fits(name, runs), picture))
        for (name, runs), picture in zip(_by_output(models).items(), pictures, strict=True)
    ]
    rows = tuple(
        (
            name_text(one.name),
            name_text(one.model.provenance.program, 40),
            model_sha256(one.model),
        )
        for one in models
    )
    files = Table(columns_of("*Model | <Made with | <SHA-256"), rows, "Models, as given.")
    return Document(
        title="Comparison of thermal compensation models",
        subtitle=plain_text(f"Free run of {len(models)} models against {log.name}", 160),
        date=None,
        footer=name_text(log.name),
        author=f"thermaxis {__version__}",
        opening=(
            *warning_blocks(warnings),
            Fields(
                "",
                (
                    ("Log", name_text(log.name)),
                    ("Rows", f"{log.time_s.size} over {hours(float(np.ptp(log.time_s)))}"),
                ),
            ),
        ),
        sections=(
            *sections,
            Section("Models", (files,)),
            Section("How to read this report", (ItemList(FREE_RUN_NOTES, numbered=True),)),
        ),
    )


def _fits(name: str, runs: Sequence[tuple[str, VerifiedOutput]]) -> Table:
    rows = [
        (
            name_text(model),
            str(run.start.start),
            percent(run.figures.fit_percent),
            *map(
                micrometres,
                (
                    run.figures.residual_um,
                    run.figures.rmse_um,
                    run.figures.mae_um,
                    run.figures.max_um,
                    run.figures.static_rmse_um,
                ),
            ),
        )
        for model, run in runs
    ]
    columns = columns_of(
        "*Model | <Start | Fit [%] | p-p left | RMSE | MAE | Largest | Static RMSE"
    )
    words = (
        f"{name_text(name)}, best first; {micrometres(runs[0][1].figures.uncompensated_um)} µm"
        " peak-to-peak without compensation; errors in µm. Static: a static regression on the same"
        " inputs."
    )
    return Table(columns, tuple(rows), words)
