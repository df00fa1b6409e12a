"""The certificate of a thermal test after ISO 230-3: its pages and charts."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermaxis.messages import text_of
from thermaxis.positioning import FloatArray
from thermaxis.report import tables as described
from thermaxis.report._document import Document, ItemList, Picture, Section
from thermaxis.report._text import as_given, plain_text
from thermaxis.report._thermal_test_report import ThermalTestReport
from thermaxis.report.certificate import certificate_of, condition_section, write_certificate
from thermaxis.report.tables import (
    CASES,
    QUANTITY_UNITS,
    TITLES,
    as_page_table,
    compared_table,
    lines_of,
    results_sha256,
    tables_of,
)
from thermaxis.report.thermal._conditions import HOUR_S, input_panels, lines_panel, speed_panel
from thermaxis.report.thermal._output import write_charts
from thermaxis.report.thermal._panels import (
    LOOKS,
    Panel,
    PanelGrid,
    ThermalChart,
    Trace,
    panel_chart,
)
from thermaxis.report.thermal._verification import pictures_of
from thermaxis.report.thermal._words import name_text
from thermaxis.thermal import ThermalTest, ThermalTestKind, ThermalTestQuantity

_NOTES = (
    (
        "[V] verified in a source: that ISO 230-3:2020 has these four tests. [M] from memory, to be"
        " checked against the standard's text before the figures are used for acceptance: which"
        " spans and ranges, the tilts, the end of a test, its usual duration."
    ),
    (
        "A range is the largest less the smallest value. Displacements are as the probes show them:"
        " noise widens a range and is not taken off."
    ),
    (
        "U: expanded uncertainty, k = 2, of independent terms (GUM). Probe: as stated. Temperature:"
        " expansion of fixture and mandrel with the range of ambient temperature. Resolution: two"
        " readings. Sampling: half the step to a neighbour at both extremes. Distance: that of the"
        " probes. A term that nobody stated is not in U."
    ),
    (
        "Drift per hour [/h]: slope by least squares within the first and the last 60 min. Gradient"
        " of a temperature: its largest range within any 60 min."
    ),
)


def write_thermal_test_report(report: ThermalTestReport, *paths: Path) -> None:
    """Write the certificate of a thermal test in the formats that the files' suffixes name.

    They are those of `write_report`: PDF, HTML, and XML, the Digital Calibration Certificate with
    the PDF inside.

    Raises
    ------
    ConfigurationError
        If a suffix is another one, or a file cannot be written.
    """
    write_certificate(report, lambda: _document(report), *paths)


def write_thermal_test_figures(report: ThermalTestReport, folder: Path) -> tuple[Path, ...]:
    """Write every chart of a thermal test as PNG and SVG, and what is drawn as CSV.

    ConfigurationError says what cannot be written.
    """
    return write_charts(_charts(report), folder)


# ---- pages --------------------------------------------------------------------------------------


def _document(report: ThermalTestReport) -> Document:
    test = report.measured
    figures, *others, budget = map(as_page_table, tables_of(test))
    charts = pictures_of(_charts(report))
    compared = compared_table(report)
    notes = [_setup_words(report), *lines_of(test), *_NOTES]
    sections = [
        Section("Over time", (charts["over_time"],)),
        Section("Notes to the results", (ItemList(tuple(notes), numbered=True),)),
        *([] if compared is None else [_compensation(report, compared, charts)]),
        Section("Details", (*others, *(p for name, p in charts.items() if name == "etve"))),
        *_warnings(report),
        condition_section(report, results_sha256(report)),
        Section("Uncertainty budget", (budget,)),
    ]
    standard = "ISO 230-3:2020 [V], its details from memory [M]"
    return certificate_of(
        report, f"Thermal test: {TITLES[test.kind]}", standard, [figures], sections
    )


def _setup_words(report: ThermalTestReport) -> str:
    setup, apart = report.setup, report.setup.probes.distance_mm
    named = setup.named(report.measured.kind)
    listed = ", ".join(f"{name}: {name_text(channel, 40)}" for name, channel in named)
    if report.measured.kind is ThermalTestKind.LINEAR:
        return f"Channels: {listed}. +: approached forward, -: backward; D = P2 - P1."
    tilts = "A = (Y1 - Y2)/l about X, B = (X1 - X2)/l about Y [M]"
    return f"Channels: {listed}." + (
        "" if apart is None else f" l = {as_given(apart)} mm; tilts {tilts}."
    )


def _compensation(
    report: ThermalTestReport, compared: described.Table, charts: Mapping[str, Picture]
) -> Section:
    words = [f"{CASES[case]}: log {name_text(t.name)}" for case, t in report.cases.items()]
    if report.model_sha256 is not None:
        words.append(
            f"model: SHA-256 {report.model_sha256}; in free run, without any measured"
            " displacement; what it says of X1 is taken off X2 as well, so that tilts stay"
        )
    blocks = (as_page_table(compared), ItemList(tuple(words)), charts["with_and_without"])
    return Section("With and without compensation", blocks)


def _warnings(report: ThermalTestReport) -> list[Section]:
    said = dict.fromkeys(plain_text(text_of(one), 600) for one in report.warnings)
    return [Section("Remarks and warnings", (ItemList(tuple(said)),))] if said else []


# ---- charts -------------------------------------------------------------------------------------


def _charts(report: ThermalTestReport) -> list[ThermalChart]:
    charts = [_over_time(report)]
    if report.measured.spans_h:
        charts.append(_etve(report.measured))
    if len(report.cases) > 1:
        charts.append(_with_and_without(report))
    return charts


def _relative(test: ThermalTest, one: ThermalTestQuantity) -> FloatArray:
    """Return a quantity less its first value of the test, or of the motion."""
    known = ~np.isnan(one.values) & (test.time_s >= test.begin_s)
    return one.values - one.values[np.argmax(known)]


def _panel(test: ThermalTest, title: str, *, tilt: bool, height_in: float) -> Panel | None:
    own = {one.name: _relative(test, one) for one in test.quantities if one.is_tilt == tilt}
    what = "tilt [µm/m]" if tilt else "displacement [µm]"
    if not own:
        return None
    panel = lines_panel(title, what, test.time_s, own, height_in=height_in)
    return _marked(test, panel)


def _marked(test: ThermalTest, panel: Panel) -> Panel:
    """Return a panel with a line where the motion ends."""
    if test.kind is ThermalTestKind.ETVE:
        return panel
    return replace(panel, mark=test.end_s / HOUR_S, mark_label="end of motion")


def _over_time(report: ThermalTestReport) -> ThermalChart:
    test, log = report.measured, report.log
    panels = [
        _panel(test, "Displacement", tilt=False, height_in=2.2),
        _panel(test, "Tilt", tilt=True, height_in=1.4),
    ]
    channels = [one.channel for one in test.temperatures]
    title = "Temperatures relative to the start"
    panels += [replace(p, title=title) for p in input_panels(log, channels, reference_s=None)]
    panels.append(speed_panel(log))
    caption = (
        "Displacements and tilts from the begin of the test or motion, temperatures and speeds."
    )
    grid = PanelGrid(
        heading=f"ISO 230-3, {TITLES[test.kind]}",
        source=report.source_name,
        panels=tuple(_marked(test, panel) for panel in panels if panel is not None),
    )
    return panel_chart("over_time", caption, grid)


def _etve(test: ThermalTest) -> ThermalChart:
    spans_h = np.array(test.spans_h)
    panels = [
        Panel(
            title="Tilt" if tilt else "Displacement",
            quantity=f"largest range [{QUANTITY_UNITS['um/m' if tilt else 'um']}]",
            traces=tuple(
                Trace(one.name, spans_h, np.array(one.within_spans), look)
                for one, look in zip(own, LOOKS, strict=False)
            ),
            height_in=1.8,
        )
        for tilt in (False, True)
        if (own := [one for one in test.quantities if one.is_tilt == tilt])
    ]
    grid = PanelGrid(
        heading="ETVE(D, t)",
        source=test.name,
        panels=tuple(panels),
        axis="span t [h]",
        log_x=True,
    )
    return panel_chart("etve", "ETVE(D, t): the largest range in any span of length t.", grid)


def _with_and_without(report: ThermalTestReport) -> ThermalChart:
    cases = [
        (case, _panel(test, CASES[case], tilt=False, height_in=2.4))
        for case, test in report.cases.items()
    ]
    grid = PanelGrid(
        heading="Without and with compensation",
        source=report.source_name,
        panels=tuple(panel for _, panel in cases if panel is not None),
        columns=len(cases),
        one_scale=True,
        one_legend=True,
    )
    return panel_chart("with_and_without", "Displacements of all cases on one scale.", grid)
