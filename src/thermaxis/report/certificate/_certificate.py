"""The certificate of a positioning run: what it says, in which order."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import zip_longest

import numpy as np

from thermaxis.messages import sentence_of
from thermaxis.positioning import (
    APPROACHES,
    UNVERIFIED,
    Cycle,
    figures_by_key,
    is_single_run_axis,
)
from thermaxis.positioning.standard import RUNS_PER_DIRECTION
from thermaxis.report._certified_report import CertifiedReport
from thermaxis.report._document import (
    Block,
    Document,
    ItemList,
    Paragraph,
    Picture,
    Section,
    Signature,
    Table,
    Verdict,
    columns_of,
)
from thermaxis.report._figure_table import figure_table
from thermaxis.report._limits_check import Verdict as LimitVerdict
from thermaxis.report._names import (
    CYCLE_NAMES,
    FIGURE_SYMBOLS,
    OTHER_NAMES,
    absence_reason,
    edition_name,
    other_standard_name,
)
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._progress import Progress
from thermaxis.report._text import fixed, plain_text
from thermaxis.report.certificate._adjacent import adjacent_section
from thermaxis.report.certificate._annex import raw_section, target_section
from thermaxis.report.certificate._drift import (
    diagnosis_section,
    drift_section,
)
from thermaxis.report.certificate._header import (
    condition_section,
    identification,
    issuer,
    prevailing,
    statements,
)
from thermaxis.report.certificate._number_tables import budget_section, figures_block
from thermaxis.report.certificate._showable import unshowable
from thermaxis.report.charts import charts_of, runs_of_targets
from thermaxis.report.tables import options_in_words, results_sha256

_CAPTIONS = {
    "iso230_2": "Means, bands of ±2s, single runs, and the extents of the figures.",
    "drift": (
        "The run in time order as measured and without drift, each less the mean of its target,"
        " on the same scale; below, the estimated drift relative to t₀ with bands of as"
        " many standard uncertainties as in the table."
    ),
    "figure_10_standard_deviation": (
        "Spread between adjacent positions (figure 10 of the paper). Above: standard uncertainty"
        " of the mean mutual deviation. Below: sample standard deviation of the difference beside"
        " the standard's s."
    ),
    "figure_12_deviation_chart": (
        "Deviation chart by progressive addition of the mean mutual deviations (figure 12 of the"
        " paper). The bounds say where the mean lies, not where the next approach will land."
    ),
    "figure_06_all_cycles": "All cycles over position (figure 6 of the paper).",
    "against_cycles": "Figures from the first 2, 3, ... cycles only.",
    "figure_07_one_position": (
        "The position with the largest range over the cycles (figure 7 of the paper)."
    ),
}
"""Charts that a certificate shows, in their order, with their captions."""

_FEW_CYCLES = 10
_OVER_CYCLES = ("figure_06_all_cycles", "against_cycles", "figure_07_one_position")


def draw_pictures(report: PositioningReport, progress: Progress) -> dict[str, Picture]:
    """Return the charts of a certificate, with their captions, by name."""
    charts = {chart.name: chart for chart in charts_of(report)}
    wanted = [name for name in _CAPTIONS if name in charts and _is_shown(name, report)]
    pictures: dict[str, Picture] = {}
    for done, name in enumerate(wanted):
        progress(f"chart {name}", done, len(wanted) + 1)
        caption, fills = _CAPTIONS[name], name == "iso230_2"
        if fills and not bool(np.any(np.isfinite(report.iso230_2.s))):
            caption = "Means of each direction, and the extents of the figures."
        size = {"height_in": _height_left(report)} if fills else {}
        svg = charts[name].svg(report, **size).decode("utf-8")
        pictures[name] = Picture(svg, f"Figure {done + 1}. {caption}", fills=fills)
    progress("pages", len(wanted), len(wanted) + 1)
    return pictures


def _height_left(report: PositioningReport) -> float:
    """Return what head, verdict and figures leave of the first page, nearly. [inch]"""
    texts = [len(text) for _, text in identification(report).fields]
    lines = sum(1 + max(pair) // 36 for pair in zip_longest(texts[::2], texts[1::2], fillvalue=0))
    head = 0.15 * lines + 0.2 * len(issuer(report)) + (0.75 if report.limits else 0.0)
    return max(5.8 - head, 3.0)


def _is_shown(name: str, report: PositioningReport) -> bool:
    """Return whether a certificate shows a chart: few cycles are seen in the first one."""
    return report.test.cycles > _FEW_CYCLES or name not in _OVER_CYCLES


def build_certificate(report: PositioningReport, pictures: dict[str, Picture]) -> Document:
    """Return the content of the certificate of a run."""
    axis = prevailing(report, "axis")
    title = "Accuracy and repeatability of positioning"
    annexes = (
        target_section(report),
        *adjacent_section(report, pictures),
        *_cycles_section(pictures),
        raw_section(report),
    )
    sections = [
        Section("Notes to the results", (ItemList(tuple(_notes(report)), numbered=True),)),
        *drift_section(report, pictures),
        *diagnosis_section(report),
        *_other_section(report),
        *_warning_section(report),
        condition_section(report, results_sha256(report), options_in_words(report) or "defaults"),
        *budget_section(report),
        *(
            replace(annex, heading=f"Annex {letter}: {annex.heading}")
            for letter, annex in zip("ABCD", annexes, strict=False)
        ),
    ]
    results = (
        *_verdict(report),
        figures_block(report),
        *([pictures["iso230_2"]] if "iso230_2" in pictures else []),
    )
    title = f"{title}{f', axis {plain_text(axis, 40)}' if axis else ''}"
    return certificate_of(report, title, edition_name(report.iso230_2.edition), results, sections)


def certificate_of(
    report: CertifiedReport,
    title: str,
    standard: str,
    results: Iterable[Block],
    sections: Iterable[Section],
) -> Document:
    """Return a certificate: results on its first page, then sections; the rest is the same."""
    number, date = prevailing(report, "certificate_number"), report.document_date
    parts = [prevailing(report, key) for key in ("authorised_by", "authorised_as")]
    name = ", ".join(part for part in parts if part)
    signature = ("Place and date", f"Authorised by {name}" if name else "Name and signature")
    return Document(
        title=title,
        subtitle=f"Test certificate, {standard}{', draft' * bool(report.missing_fields)}",
        date=None if date is None else date.isoformat(),
        footer=" · ".join(
            (
                f"Certificate {number}" if number else "Draft",
                plain_text(report.source_name, 60),
                f"SHA-256 {report.source_sha256[:12]}…",
            )
        ),
        author=f"thermaxis {report.version}",
        issuer=issuer(report),
        end="End of the certificate.",
        opening=(
            identification(report),
            *results,
            Paragraph(" ".join(statements(report))),
            Signature(signature),
        ),
        sections=tuple(sections),
    )


def _verdict(report: PositioningReport) -> list[Block]:
    check = report.limits
    if check is None:
        return []
    which = ", ".join(FIGURE_SYMBOLS[c.key] for c in check.figures if c.verdict is check.verdict)
    outcome = {
        LimitVerdict.PASS: f"All limited figures ({which}) pass.",
        LimitVerdict.FAIL: f"{which}: above the limit.",
        LimitVerdict.NOT_DECIDED: f"{which}: not decided; no limited figure fails.",
    }[check.verdict]
    # no break between the sign and what it subtracts
    rule = check.limits.decision_rule.in_words.replace("figure - U", "figure\N{NBSP}-\N{NBSP}U")
    source = plain_text(check.limits.source_name, 80)
    sentence = f"{outcome} Decision rule: {rule}. Limits from {source}."
    return [Verdict(str(check.verdict).upper(), sentence, _reservation(report))]


def _reservation(report: PositioningReport) -> str:
    """Return what keeps a verdict from being one on the standard's test; empty if nothing."""
    said: list[str] = []
    unusual = report.test.cycle is not Cycle.STANDARD
    if report.conditions or unusual:
        said.append("Test conditions of the standard not met: see the notes.")
    if unusual:
        said.append("Not for acceptance unless agreed.")
    if report.limits is not None and report.limits.reservation is not None:
        said.append(f"{sentence_of(report.limits.reservation)}.")
    return " ".join(said)


def _notes(report: PositioningReport) -> list[str]:
    test, result = report.test, report.iso230_2
    number = runs_of_targets(report)
    runs = f"{number} run{'s' * (number != '1')} per direction"
    if test.unidirectional:
        direction = APPROACHES[test.approaches[0]]
        runs = f"{number} run{'s' * (number != '1')}, {direction} only"
    edition = edition_name(result.edition)
    targets = f"{test.target.size} target{'s' * (test.target.size > 1)}"
    notes = [
        f"{targets}, {runs}, {CYCLE_NAMES[test.cycle]}.",
        *_condition_notes(report),
        f"{edition}; factor of s: 2.",
    ]
    absent = [key for key, value in figures_by_key(result).items() if value is None]
    if absent:
        reasons = {absence_reason(key, result, test): None for key in absent}
        listed = ", ".join(FIGURE_SYMBOLS[key] for key in absent)
        notes.append(f"Not evaluated: {listed} ({'; '.join(reasons)}).")
    if report.other_standard is not None:
        name = other_standard_name(report.other_standard)
        notes.append(f"Figures after {name} stand in a section of their own: {UNVERIFIED}.")
    if report.adjacent_difference is not None:
        notes.append(
            "Results of the adjacent-difference method stand in an annex; they do"
            " not change the figures above."
        )
    if report.limits is None:
        notes.append("No limits were stated: this certificate gives no verdict.")
    return [*notes, *map(sentence_of, figure_table(report).notes)]


def _condition_notes(report: PositioningReport) -> list[str]:
    """Return in which respects the run is not the standard's test."""
    if report.conditions:
        listed = "; ".join(plain_text(sentence_of(one), 600) for one in report.conditions)
        return [f"Test conditions of the standard that this run does not meet: {listed}."]
    test = report.test
    notes: list[str] = []
    number = runs_of_targets(report)
    if number != str(RUNS_PER_DIRECTION) and not is_single_run_axis(test):
        asked = f"ISO 230-2 asks for {RUNS_PER_DIRECTION} runs per direction"
        notes.append(f"{asked}; these figures are of {number}.")
    if test.cycle is not Cycle.STANDARD:
        name = CYCLE_NAMES[test.cycle]
        notes.append(f"A {name} is not the standard's: not for acceptance unless agreed.")
    return notes


def _warning_section(report: PositioningReport) -> list[Section]:
    """Return what no other section says."""
    said = [*report.conditions, *(report.drift.warnings if report.drift else ())]
    left = (one for one in (*report.warnings, *unshowable(report)) if one not in said)
    warnings = dict.fromkeys(map(sentence_of, left))
    if not warnings:
        return []
    items = tuple(plain_text(warning, 600) for warning in warnings)
    return [Section("Remarks and warnings", (ItemList(items),))]


def _other_section(report: PositioningReport) -> list[Section]:
    other = report.other_standard
    if other is None:
        return []
    unit = report.test.kind.units.deviation
    decimals = report.figure_decimals
    rows: list[tuple[str, ...]] = []
    for key in type(other).__dataclass_fields__:
        if key == "mark":
            continue
        symbol, name = OTHER_NAMES[key]
        rows.append((symbol, name, fixed(getattr(other, key), decimals)))
    columns = columns_of(f"< | <Figure | Value [{unit}]")
    warning = f"Do not use these figures for acceptance: their formulas are {other.mark}."
    return [
        Section(
            f"Figures after {other_standard_name(other)} ({other.mark})",
            (Paragraph(warning, strong=True), Table(columns, tuple(rows))),
        )
    ]


def _cycles_section(pictures: dict[str, Picture]) -> list[Section]:
    names = [name for name in _OVER_CYCLES if name in pictures]
    if not names:
        return []
    numbers = [list(pictures).index(name) + 1 for name in names]
    words = (
        "With thermal drift the figures of the standard depend on how long the test lasts. Figures"
        f" {numbers[0]} to {numbers[-1]} show the cycles one by one, the figures that fewer cycles"
        " would have given, and one position over the cycles."
    )
    return [
        Section("the run over its cycles", (Paragraph(words), *(pictures[name] for name in names)))
    ]
