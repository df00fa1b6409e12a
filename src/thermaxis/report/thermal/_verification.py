"""The report of a verification: what it says, in which order."""

from collections.abc import Mapping, Sequence

from thermaxis import __version__
from thermaxis.compensation import CompensationModel
from thermaxis.files import model_sha256
from thermaxis.messages import text_of
from thermaxis.report._document import (
    Block,
    Document,
    Fields,
    ItemList,
    Paragraph,
    Picture,
    Section,
    Table,
    columns_of,
)
from thermaxis.report._text import plain_text
from thermaxis.report.thermal._comparison import MOST_LOGS, MOST_OUTPUTS, verification_charts
from thermaxis.report.thermal._figures_table import (
    baseline_words,
    figure_tables,
    table_3,
    validity_table,
)
from thermaxis.report.thermal._fit import leftover_blocks
from thermaxis.report.thermal._panels import ThermalChart
from thermaxis.report.thermal._words import (
    hours,
    log_sha256,
    model_parts_table,
    name_text,
    provenance_section,
    warning_blocks,
)
from thermaxis.thermal import ThermalLog, Verification, VerifiedLog
from thermaxis.thermal.verification import OUTSIDE_SHARE, runs_of

_OPEN = (
    "The free run goes through the cycle that acts on the machine, with its limits open and with"
    " weight 1. What limits would cut off is not in these figures."
)
FREE_RUN_NOTES = (
    (
        "Free run: the model is simulated from the first row of each log without any measured"
        " displacement. Measured and simulated displacement are relative to the start of the log."
    ),
    (
        "Fit = 100 (1 - |measured - simulated| / |measured - mean of measured|) percent, equation"
        " (4) of the paper with the mean of the measured output. 0 is a constant, below 0 is worse."
    ),
    (
        "Peak-to-peak reduced: range of the measured displacement over the range of the residual"
        " (measured minus simulated), which is the compensated machine."
    ),
)
"""What the figures of a free run are."""
_NOTES = (
    *FREE_RUN_NOTES,
    (
        "Static RMSE: left by the static regression on the same inputs that the model carries from"
        " its training; where it carries none, by one that is fitted to this very log."
    ),
    (
        "Persistence RMSE: 'nothing changes from row to row'. It is one step ahead and knows the"
        " displacement of the row before, which no compensation does; it stands here because"
        " one-step figures of models are often shown without it."
    ),
    (
        "The displacement is that of the tool point relative to the workpiece, positive away from"
        " it; the correction is minus the model."
    ),
    "Paper: M. Mareš, O. Horejš, MM Science Journal 2021, DOI 10.17973/MMSJ.2021_07_2021053.",
)
_FIRST = ("figure_13_with_and_without", "figure_13_with_and_without_log_1")
"""Charts that stand beside the results."""


def pictures_of(charts: Sequence[ThermalChart]) -> dict[str, Picture]:
    """Return charts as pictures with numbered captions, by name."""
    return {
        chart.name: Picture(chart.svg().decode("utf-8"), f"Figure {k + 1}. {chart.caption}")
        for k, chart in enumerate(charts)
    }


def verification_document(
    model: CompensationModel, logs: Sequence[ThermalLog], result: Verification
) -> Document:
    """Return the content of the report of a verification."""
    pictures = pictures_of(verification_charts(model, tuple(logs), result))
    names = ", ".join(name_text(log.name, 40) for log in result.logs[:3])
    sha256 = model_sha256(model)
    sections = [
        _result_section(model, result, pictures),
        *_log_sections(result, pictures),
        Section(
            "What the model left over",
            (
                *leftover_blocks({name: runs_of(result, name) for name in result.pooled}),
                *(p for name, p in pictures.items() if name.startswith("residuals")),
            ),
        ),
        _model_section(model, pictures),
        _validity_section(model, logs, result),
        provenance_section(model.provenance, _hashes(logs, result, sha256)),
        Section("How to read this report", (Paragraph(_OPEN), ItemList(_NOTES, numbered=True))),
    ]
    return Document(
        title="Verification of a thermal compensation model",
        subtitle=plain_text(f"Free run against {_logs_words(result)}: {names}", 160),
        date=None,
        footer=f"Model SHA-256 {sha256[:12]}… · {names}",
        author=f"thermaxis {__version__}",
        opening=(
            *warning_blocks(
                [*map(text_of, result.warnings)], [f"of the model: {w}" for w in model.warnings]
            ),
            _summary(model, result, sha256),
        ),
        sections=tuple(sections),
    )


def _logs_words(result: Verification) -> str:
    return "1 log" if len(result.logs) == 1 else f"{len(result.logs)} logs"


def _summary(model: CompensationModel, result: Verification, sha256: str) -> Fields:
    outputs = ", ".join(name_text(output.name, 30) for output in model.outputs[:8])
    time_s = sum(float(log.time_s[-1]) for log in result.logs)
    return Fields(
        "",
        (
            ("Outputs of the model", outputs),
            ("Logs", f"{_logs_words(result)}, {hours(time_s)}"),
            ("Made with", name_text(model.provenance.program, 60)),
            ("Model", f"SHA-256 {sha256[:16]}…"),
        ),
    )


def _result_section(
    model: CompensationModel, result: Verification, pictures: Mapping[str, Picture]
) -> Section:
    blocks: list[Block] = [
        table_3(model, result),
        baseline_words(result.pooled),
        *figure_tables(result.pooled, "All logs" if len(result.logs) > 1 else "Figures"),
    ]
    quiet = [name_text(log.name) for log in result.logs if log.environmental]
    if quiet:
        blocks.append(
            Paragraph(
                f"Nothing turned in {', '.join(quiet)}: its ranges are environmental temperature"
                " variation errors (ETVE, ISO 230-3)."
            )
        )
    blocks += [p for name, p in pictures.items() if name in _FIRST]
    return Section("Results", tuple(blocks))


def _log_sections(result: Verification, pictures: Mapping[str, Picture]) -> list[Section]:
    several = len(result.logs) > 1
    sections: list[Section] = []
    for number, log in enumerate(result.logs):
        ending = f"_log_{number + 1}" if several else ""
        own = [
            picture
            for name, picture in pictures.items()
            if name.endswith(ending)
            and not name.startswith(("figure_04", "residuals", "bode"))
            and name not in _FIRST
        ]
        if number >= MOST_LOGS:
            own = []
        blocks: list[Block] = [Paragraph(_log_words(log, drawn=bool(own)))]
        if several:
            blocks += figure_tables(
                {o.measured.name: o.figures for o in log.outputs}, name_text(log.name)
            )
        heading = f"Log {name_text(log.name) if log.name else number + 1}"
        sections.append(Section(heading, (*blocks, *own)))
    return sections


def _log_words(log: VerifiedLog, *, drawn: bool) -> str:
    words = f"{log.time_s.size} rows over {hours(float(log.time_s[-1]))}."
    if not drawn:
        return f"{words} Only the first {MOST_LOGS} logs are drawn."
    if len(log.outputs) > MOST_OUTPUTS:
        words += f" The {MOST_OUTPUTS} outputs with the largest RMSE have a chart of their own."
    counted = max(int(output.counted.sum()) for output in log.outputs)
    if counted < log.time_s.size:
        words += (
            f" At most {counted} rows count in the figures: those in which the output was measured"
            " and which were asked for; what was not asked for is hatched."
        )
    return f"{words} Lines that are longer than a chart is wide show their extremes."


def _model_section(model: CompensationModel, pictures: Mapping[str, Picture]) -> Section:
    tables = [model_parts_table(model, k) for k in range(min(len(model.outputs), 20))]
    steps = [p for name, p in pictures.items() if name.startswith(("figure_04", "bode"))]
    return Section("The model", (*tables, *steps))


def _validity_section(
    model: CompensationModel, logs: Sequence[ThermalLog], result: Verification
) -> Section:
    outside = [
        name_text(log.name)
        for log in result.logs
        if any(max(found) >= OUTSIDE_SHARE for found in log.outside.values())
    ]
    if outside:
        words = (
            f"Some input leaves the range of the training in {', '.join(outside[:6])}: there the"
            " model is extrapolated."
        )
    elif any(log.outside for log in result.logs):
        words = (
            f"Some input leaves the range of the training, in less than {OUTSIDE_SHARE:.0%} of the"
            f" rows and by less than {OUTSIDE_SHARE:.0%} of its width."
        )
    else:
        words = "No input leaves the range that was seen in the training, where it is known."
    table = validity_table(model, logs, result.logs)
    return Section("Validity", (Paragraph(words, strong=bool(outside)), table))


def _hashes(logs: Sequence[ThermalLog], result: Verification, sha256: str) -> tuple[Block, ...]:
    rows = tuple(
        (name_text(found.name), str(log.rows), log_sha256(log))
        for log, found in zip(logs, result.logs, strict=True)
    )
    columns = columns_of("*Log | Rows | <SHA-256 of names, times and values")
    words = "Logs of this verification: the hash is of the content as read, not of a file."
    return (Table(columns, rows, words), Fields("", (("SHA-256 of the model", sha256),), code=True))
