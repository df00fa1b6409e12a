"""The certificate's sections on the drift, on uncertainties and on the diagnosis."""

import math

from thermaxis.messages import sentence_of
from thermaxis.positioning import DriftResult
from thermaxis.report._document import (
    Block,
    ItemList,
    Paragraph,
    Picture,
    Section,
    Table,
    columns_of,
)
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import ARROWS
from thermaxis.report._text import fixed, plain_text, with_u
from thermaxis.report.certificate._number_tables import number_table, numbered_positions
from thermaxis.report.charts import (
    detail_decimals,
    growth_unit,
    reference_place,
    time_words,
)

_HEADING = "Drift eliminated (not results of ISO 230-2)"
_WHAT_IT_IS = (
    "The values of this section are not results of ISO 230-2 and do not replace them. Method: each"
    " deviation is taken as the mean of its target and approach, plus a(t), plus b(t) times the"
    " distance from the mean position, plus noise; a and b are smooth functions of time whose"
    " smoothness the run itself tells (restricted maximum likelihood)."
)
_PROMPTS = (
    "Prompts to look, not verdicts: found in mean deviations, reversal values and residuals, the"
    " largest effect on the accuracy of the axis first."
)
_MODELS = {"line": "a straight line in time", "smooth": "a smooth curve in time"}


def drift_section(report: PositioningReport, pictures: dict[str, Picture]) -> list[Section]:
    """Return the section on the run without its drift; none if it was not evaluated."""
    drift = report.drift
    if drift is None:
        return []
    points = (
        _model(drift),
        _state(report, drift),
        _noise(report, drift),
        *(_as_sentence(plain_text(sentence_of(warning), 600)) for warning in drift.warnings),
    )
    blocks: tuple[Block, ...] = (
        Paragraph(_WHAT_IT_IS),
        ItemList(points),
        _drift_table(report, drift),
        *([pictures["drift"]] if "drift" in pictures else []),
    )
    return [Section(_HEADING, blocks)]


def diagnosis_section(report: PositioningReport) -> list[Section]:
    """Return the section of what is wrong with the axis; none if nothing is said of it."""
    if not report.diagnosis:
        return []
    items = tuple(plain_text(sentence_of(finding.message), 600) for finding in report.diagnosis)
    return [Section("Diagnosis", (Paragraph(_PROMPTS), ItemList(items, numbered=True)))]


def level_tables(report: PositioningReport) -> tuple[Table, ...]:
    """Return the mean deviations without drift of each target; none where there is no drift."""
    drift = report.drift
    if drift is None:
        return ()
    units, decimals = report.test.kind.units, detail_decimals(report)
    numbers = [
        column
        for a in report.test.approaches
        for column in (
            (f"mean {ARROWS[a]}", drift.level[:, a], decimals),
            (f"u {ARROWS[a]}", drift.level_std[:, a], decimals),
        )
    ]
    caption = (
        f"Mean deviations without drift at t₀ ({_reference_words(report, drift)}), in"
        f" {units.deviation}, with their standard uncertainties u (k = 1); not results of"
        " ISO 230-2."
    )
    cells = numbered_positions(report.test.target)
    return (number_table(f"<i | Target [{units.position}]", cells, numbers, caption),)


def _probability(p: float) -> str:
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.2g}"


def _model(drift: DriftResult) -> str:
    p = f"{_probability(drift.p_no_drift)}; tested at the 1 % level"
    if not drift.significant:
        return f"No drift is seen ({p}): the run is left as it was."
    bow = ", with a bow of the axis" if drift.bow is not None else ""
    steps = f", with {len(drift.changes)} step(s)" if drift.changes else ""
    return (
        f"Model: {_MODELS[str(drift.model)]}{bow}{steps} (probability of so much change without any"
        f" drift: {p})."
    )


def _reference_words(report: PositioningReport, drift: DriftResult) -> str:
    time_s = drift.reference_time_s
    if time_s is None:
        return f"at reading {reference_place(report):.1f} in the order of acquisition"
    duration_s = float(drift.time_s[-1])
    amount = f"{time_s / 3600.0:.2f} h" if duration_s >= 3600.0 else f"{time_s / 60.0:.1f} min"
    return f"{amount} after the first reading"


def _state(report: PositioningReport, drift: DriftResult) -> str:
    when = _reference_words(report, drift)
    words = f"Mean deviations and figures are those of the thermal state at t₀, {when}."
    time = time_words(report)
    return f"{words} {_as_sentence(time)}" if time else words


def _noise(report: PositioningReport, drift: DriftResult) -> str:
    unit = report.test.kind.units.deviation
    decimals = detail_decimals(report)
    noise = ", ".join(
        f"{ARROWS[a]} {fixed(float(drift.noise_std[a]), decimals)}" for a in report.test.approaches
    )
    return (
        f"Standard deviation of the noise per approach: {noise} {unit}; of all residuals:"
        f" {fixed(drift.residual_std, decimals)} {unit}, with {drift.degrees_of_freedom:.0f}"
        f" degrees of freedom (readings less {drift.effective_parameters:.0f} effective"
        " parameters)."
    )


def _as_sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."


def _with_band(value: float, band: float) -> str:
    if not (math.isfinite(value) and math.isfinite(band) and band > 0.0):
        return fixed(value, 2)
    return with_u(value, band)


def _drift_table(report: PositioningReport, drift: DriftResult) -> Table:
    unit = report.test.kind.units.deviation
    columns = columns_of(
        "<Drift relative to t₀ | at the first reading | at the last reading | from first to last"
    )
    growth = "thermal growth" if unit == "µm" else "change of scale"
    factor = drift.coverage_factor
    rows: list[tuple[str, ...]] = []
    for label, total, values, std in (
        (
            f"a, shift of the whole axis [{unit}]",
            _with_band(drift.total, drift.total_within),
            drift.common,
            drift.common_std,
        ),
        (
            f"b, {growth} [{growth_unit(report)}]",
            _with_band(drift.total_per_m, drift.total_per_m_within),
            1e3 * drift.slope,
            1e3 * drift.slope_std,
        ),
    ):
        ends = (_with_band(float(values[k]), factor * float(std[k])) for k in (0, -1))
        rows.append((label, *ends, total))
    if drift.bow is not None:
        ends = [float(drift.bow[k]) for k in (0, -1)]
        cells = (fixed(end, 2) for end in (*ends, ends[1] - ends[0]))
        rows.append((f"bow, mid-axis against the ends [{unit}]", *cells))
    caption = (
        f"Drift over the run, ± {factor:g} standard uncertainties (from first to last: the sum of"
        " those at both ends, which is their upper bound)."
        f"{' Those of the bow are not evaluated.' if drift.bow is not None else ''}"
    )
    return Table(columns, tuple(rows), caption)
