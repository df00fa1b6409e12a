"""The report of an identification: what it says, in which order."""

import datetime as dt
from collections.abc import Mapping, Sequence

from thermaxis import __version__
from thermaxis.compensation import Provenance
from thermaxis.errors import DataError
from thermaxis.messages import sentence_of, text_of
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
from thermaxis.report._text import fixed, plain_text
from thermaxis.report.thermal._fit import by_channel, leftover_blocks
from thermaxis.report.thermal._identification_charts import (
    MOST_LOGS,
    MOST_OUTPUTS,
    identification_charts,
    record_length_s,
)
from thermaxis.report.thermal._poles import pole_maps
from thermaxis.report.thermal._steps import INTERVAL
from thermaxis.report.thermal._verification import pictures_of
from thermaxis.report.thermal._words import (
    DASH,
    hours,
    micrometres,
    name_text,
    percent,
    provenance_section,
    significant,
    warning_blocks,
    with_interval,
)
from thermaxis.thermal import (
    Experiment,
    Identification,
    IdentifiedOutput,
    Records,
    ThermalLog,
    ThermalModel,
    check_linearity,
    check_log,
    simulate_from_rest,
)
from thermaxis.thermal.log import REFERENCE_S
from thermaxis.thermal.transfer_function import held

_MOST_CURVE = 40
_MOST_FINDINGS = 40
_MOST_POLES = 60
_NOTES = (
    (
        "Fit = 100 (1 - |measured - simulated| / |measured - mean of measured|) percent, equation"
        " (4) of the paper, in free run of the model file over the training rows. These flatter:"
        " only another test says what the model is worth."
    ),
    (
        "One step: 'nothing changes from row to row' knows the displacement of the row before,"
        " which no compensation does."
    ),
    (
        "DC gain: what a lasting change of 1 K does in the end. ± is a 95 % interval; without it,"
        " the record supports none."
    ),
    (
        "Inputs and outputs are relative to their mean at the start of each record: the machine"
        " must have been in balance with its hall there."
    ),
    (
        "Displacement: tool point relative to the workpiece, positive away from it; the correction"
        " is minus the model. Its limits are set elsewhere, before anything acts on a machine."
    ),
    "Paper: M. Mareš, O. Horejš, MM Science Journal 2021, DOI 10.17973/MMSJ.2021_07_2021053.",
)
_POLYNOMIALS = (
    "The paper calls the numerator a and the denominator b; Ljung writes B for the former, and A"
    " or F for the latter."
)


def identification_document(
    result: Identification,
    records: Records,
    logs: Sequence[ThermalLog],
    provenance: Provenance,
    *,
    reference_s: float | None,
) -> Document:
    """Return the content of the report of an identification."""
    charts = identification_charts(result, records, logs, reference_s=reference_s)
    pictures = pictures_of(charts)
    notes = _NOTES + (_POLYNOMIALS,) * any(output.polynomials for output in result.outputs)
    names = ", ".join(name_text(log.name, 40) for log in logs[:3])
    outputs = ", ".join(name_text(o.name, 30) for o in result.outputs[:6])
    sections = [
        Section("Results", (*_result_tables(result), *_with(pictures, "figure_04_fit"))),
        *_selection_section(result, pictures),
        Section(
            "The model",
            (*_model_blocks(result), *_with(pictures, "figure_04_step", "bode", "poles")),
        ),
        _residual_section(result, records, pictures),
        _records_section(records, logs, reference_s, pictures),
        provenance_section(provenance),
        Section("How to read this report", (ItemList(notes, numbered=True),)),
    ]
    return Document(
        title="Identification of a thermal compensation model",
        subtitle=plain_text(f"{outputs} from {names}", 160),
        date=_date(provenance.date),
        footer=_footer(provenance, names),
        author=f"thermaxis {__version__}",
        opening=(*warning_blocks([*map(text_of, result.messages)]), _summary(result, records)),
        sections=tuple(sections),
    )


def _date(text: str) -> str | None:
    try:
        return dt.date.fromisoformat(text).isoformat()
    except ValueError:
        return None


def _footer(provenance: Provenance, names: str) -> str:
    hashes = [entry.sha256 for entry in provenance.logs if entry.sha256]
    return f"{names} · SHA-256 {hashes[0][:12]}…" if hashes else names


def _with(pictures: Mapping[str, Picture], *beginnings: str) -> list[Picture]:
    return [picture for name, picture in pictures.items() if name.startswith(beginnings)]


def _summary(result: Identification, records: Records) -> Fields:
    count = max(len(experiments) for experiments in records.experiments.values())
    return Fields(
        "",
        (
            ("Method", str(result.method)),
            ("Stability", "stable" if result.stable else "NOT STABLE: must not run anywhere"),
            ("Experiments", f"{count}, the longest {hours(record_length_s(records))}"),
            ("Sample time", hours(records.sample_time_s)),
        ),
    )


def _result_tables(result: Identification) -> list[Block]:
    keys = ("model", "static", "averages", "one_step")
    rows = tuple(
        (
            name_text(o.name),
            percent(o.fit_percent),
            *(micrometres(o.training_rmse_um.get(key)) for key in keys),
            micrometres(o.noise_std_um),
            micrometres(o.slow_noise_std_um),
        )
        for o in result.outputs
    )
    columns = columns_of(
        "*Output | Fit [%] | RMSE model | Static | Fixed averages | One step | Noise | Slow drift"
    )
    words = (
        "Training rows: fit and RMSE of the free run; RMSE of a static regression and of fixed"
        " exponential averages; of 'nothing changes' one step ahead; noise of one reading and slow"
        " drift that no input explains, standard deviations. In µm."
    )
    blocks: list[Block] = [
        Paragraph(f"How it was chosen: {plain_text(text_of(result.rule), 900).rstrip('.')}."),
        Table(columns, rows, words),
    ]
    by_rows: dict[str, list[IdentifiedOutput]] = {}
    for output in result.outputs:
        if output.held_out is not None:
            by_rows.setdefault(text_of(output.held_out.what), []).append(output)
    blocks += [_held_out_table(what, outputs) for what, outputs in by_rows.items()]
    if len(result.outputs) > MOST_OUTPUTS:
        words = f"The first {MOST_OUTPUTS} of {len(result.outputs)} outputs have charts."
        blocks.append(Paragraph(words))
    return blocks


def _held_out_table(what: str, outputs: Sequence[IdentifiedOutput]) -> Table:
    keys = ("model", "static", "averages", "hold")
    rows = tuple(
        (
            name_text(o.name),
            percent(held.fit_percent),
            *(micrometres(held.rmse_um.get(key)) for key in keys),
        )
        for o in outputs
        if (held := o.held_out) is not None
    )
    columns = columns_of("*Output | Fit [%] | Model | Static | Fixed averages | Last value held")
    return Table(columns, rows, f"{what[:1].upper()}{what[1:]}. RMSE in free run, in µm.")


def _selection_section(result: Identification, pictures: Mapping[str, Picture]) -> list[Section]:
    selection = result.selection
    if selection is None:
        return []
    before: set[str] = set()
    rows: list[tuple[str, ...]] = []
    for entry in selection.curve[:_MOST_CURVE]:
        new = [name for name in entry.channels if name not in before]
        before |= set(entry.channels)
        rows.append(
            (
                str(len(entry.channels)),
                ", ".join(name_text(name, 30) for name in new[:8]),
                fixed(entry.score, 3),
                f"{fixed(entry.excess, 3)} ± {fixed(entry.excess_se, 3)}",
            )
        )
    columns = columns_of(
        "Channels | *What comes in | Error over the best | Excess ± standard error"
    )
    words = "Error in free run on parts held out, by the number of channels."
    lags = ", ".join(significant(tau, 3) for tau in selection.time_constants_s) or "none"
    chosen = (
        f"Chosen: {len(selection.channels)} channels"
        f" ({', '.join(name_text(n, 24) for n in selection.channels[:20])}); time constants {lags}"
        f" s, common to all; uncertainty of the temperatures that holds the gains small:"
        f" {significant(selection.sensor_uncertainty_k, 2)} K."
    )
    blocks: tuple[Block, ...] = (
        Paragraph(chosen),
        Table(columns, tuple(rows), words),
        *_with(pictures, "selection"),
    )
    return [Section("Choice among the candidates", blocks)]


def _model_blocks(result: Identification) -> list[Block]:
    blocks: list[Block] = []
    for output in result.outputs[:20]:
        if output.model is not None:
            blocks += [_parts_table(output), *_flags(output), *_trials(output)]
        if output.polynomials is not None:
            blocks += _polynomial_tables(output)
    return blocks


def _parts_table(output: IdentifiedOutput) -> Table:
    assert output.model is not None  # noqa: S101 - asked for only then
    rows: list[tuple[str, ...]] = []
    for part, std in zip(output.model.parts, output.std, strict=True):
        gains = [
            with_interval(float(g), s, INTERVAL) for g, s in zip(part.gains, std.gains, strict=True)
        ]
        taus = [
            with_interval(float(t), s, INTERVAL)
            for t, s in zip(part.time_constants_s, std.time_constants_s, strict=True)
        ]
        rows.append(
            (
                name_text(part.input_name, 30),
                with_interval(part.dc_gain, std.dc_gain, INTERVAL),
                with_interval(float(part.direct_gain), std.direct_gain, INTERVAL),
                "; ".join(gains) or DASH,
                "; ".join(taus) or DASH,
                f"{part.delay_s:g}",
            )
        )
    columns = columns_of("<Input | DC gain | Direct | *Gains of the lags | *Time constants | Delay")
    known = any(std.dc_gain is not None for std in output.std)
    words = (
        f"Parts of {name_text(output.name)}: gains in µm/K, time constants and delays in s; offset"
        f" {significant(output.model.offset_um, 3)} µm."
        f" {'±: 95 % intervals.' if known else 'No intervals: nothing here supports one.'}"
    )
    return Table(columns, tuple(rows), words)


def _trials(output: IdentifiedOutput) -> list[Block]:
    """Return the lags that were tried, and the test to make next."""
    best = max((trial.log_evidence for trial in output.trials), default=0.0)
    rows = tuple(
        (
            "given" if trial.given else str(len(trial.time_constants_s)),
            "; ".join(significant(tau_s) for tau_s in trial.time_constants_s),
            fixed(trial.log_evidence - best, 1),
            micrometres(trial.held_out_um),
            "taken" if trial.chosen else "",
        )
        for trial in output.trials
    )
    columns = columns_of("<Lags | *Time constants [s] | Log evidence | Held out [µm] | *")
    words = (
        f"Lags tried for {name_text(output.name)}; evidence less the highest; free run held out."
    )
    asked = [] if output.next_test is None else [text_of(output.next_test.message)]
    tables: list[Block] = [Table(columns, rows, words)] if rows else []
    return [*tables, *(Paragraph(plain_text(f"{output.name}: {one}", 900)) for one in asked)]


def _flags(output: IdentifiedOutput) -> list[Block]:
    assert output.model is not None  # noqa: S101 - asked for only then
    said = [
        plain_text(f"{output.name}, {part.input_name}: {text_of(flag)}", 400)
        for part, std in zip(output.model.parts, output.std, strict=True)
        for flag in std.flags
    ]
    return (
        [Paragraph("What the record does not support", strong=True), ItemList(tuple(said))]
        if said
        else []
    )


def _polynomial_tables(output: IdentifiedOutput) -> list[Block]:
    found = output.polynomials
    assert found is not None  # noqa: S101 - asked for only then
    rows = tuple(
        (
            name_text(name, 30),
            "; ".join(f"{value:.9g}" for value in a),
            "; ".join(f"{value:.9g}" for value in b),
        )
        for name, a, b in zip(
            found.model.input_names, found.numerators, found.denominators, strict=True
        )
    )
    columns = columns_of("<Input | *Numerator a0, a1, … | *Denominator b0, b1, …")
    words = (
        f"Coefficients of {name_text(output.name)} at {found.model.sample_time_s:g} s (Tables 1 and"
        " 2 of the paper). Printed digits lose the DC gain of slow models; the model file stores"
        " gains and time constants."
    )
    poles: list[tuple[str, ...]] = []
    for of_input in pole_maps(output):
        for k, pole in enumerate(of_input.poles):
            std = float(of_input.time_constants_std_s[k])
            near = [j for i, j in of_input.cancelling if i == k]
            poles.append(
                (
                    name_text(of_input.input_name, 30),
                    f"{pole.real:.6f}" + (f" {pole.imag:+.6f}i" if pole.imag else ""),
                    fixed(abs(pole), 6),
                    with_interval(float(of_input.time_constants_s[k]), std, INTERVAL),
                    "a zero nearly cancels it" if near else "",
                )
            )
    pole_columns = columns_of("<Input | Pole | Modulus | Time constant [s] | *")
    tables: list[Block] = [Table(columns, rows, words)]
    if poles:
        tables.append(Table(pole_columns, tuple(poles[:_MOST_POLES]), "Poles in z, slowest first."))
    return tables


def _residual_section(
    result: Identification, records: Records, pictures: Mapping[str, Picture]
) -> Section:
    said: list[str] = []
    for output in result.outputs:
        name = name_text(output.name)
        if output.model is None:
            said.append(f"{name}: the model is not stable, so nothing was simulated.")
        else:
            experiments = records.experiments[result.reference_of(output.name)]
            said.append(f"{name}: {_linearity_words(output.model, records, experiments)}")
    return Section(
        "What the model left over",
        (
            *leftover_blocks(by_channel(result.outputs)),
            Paragraph("Heating against cooling (the paper's check of linearity):"),
            ItemList(tuple(said)),
            *_with(pictures, "residuals"),
        ),
    )


def _linearity_words(
    model: ThermalModel, records: Records, experiments: Sequence[Experiment]
) -> str:
    names = [definition.name for definition in records.inputs]
    columns = [names.index(name) for name in model.input_names]
    simulated = [
        simulate_from_rest(model, e.sample_time_s, held(e.u[:, columns])[0]) for e in experiments
    ]
    try:
        found = check_linearity(experiments, simulated)
    except DataError as error:
        return f"not compared, {plain_text(sentence_of(error.message).rstrip('.'))}."
    heating = with_interval(found.heating_gain, found.heating_gain_std, INTERVAL)
    cooling = with_interval(found.cooling_gain, found.cooling_gain_std, INTERVAL)
    share = abs(found.difference) / max(abs(found.heating_gain), abs(found.cooling_gain), 1e-9)
    verdict = (
        "no difference is found, which is no proof that there is none"
        if found.linear
        else f"a difference of {100.0 * share:.1f} % is found, which one linear model cannot follow"
    )
    return (
        f"measured over simulated change is {heating} in heating and {cooling} in cooling"
        f" (p = {found.p_linear:.2g}): {verdict}."
    )


def _records_section(
    records: Records,
    logs: Sequence[ThermalLog],
    reference_s: float | None,
    pictures: Mapping[str, Picture],
) -> Section:
    rows = tuple(
        (
            name_text(definition.name, 30),
            name_text(definition.expression),
            significant(float(records.lowest_k[k]), 3),
            significant(float(records.highest_k[k]), 3),
        )
        for k, definition in enumerate(records.inputs[:60])
    )
    columns = columns_of("<Input | *Channels | Lowest | Highest")
    words = (
        "Where the model is valid: range of every input relative to its reference, in K (or the"
        " unit of its channel)."
    )
    relative = (
        "Inputs and outputs are relative to the start of each record: their mean over the first"
        f" {hours(reference_s or REFERENCE_S)}."
    )
    if len(logs) > MOST_LOGS:
        relative += f" The first {MOST_LOGS} of {len(logs)} logs are drawn."
    return Section(
        "Records",
        (
            Paragraph(relative),
            Table(columns, rows, words),
            *_sensor_words(records, logs),
            *_with(pictures, "figure_03"),
        ),
    )


def _sensor_words(records: Records, logs: Sequence[ThermalLog]) -> list[Block]:
    """Return the faults of the channels that were used: sensor first, then the model."""
    used = [
        *records.experiments,
        *(channel for definition in records.inputs for channel in definition.channels),
    ]
    wanted = {channel.casefold() for channel in used}
    said: list[str] = []
    for log in logs:
        names = [name for name in log.columns if name.casefold() in wanted]
        found = check_log(log.select(names)) if names else ()
        said += [
            plain_text(f"{log.name}: {sentence_of(finding.message)}", 400) for finding in found
        ]
    if not said:
        return [Paragraph("Sensor first: no fault was found in the channels that were used.")]
    more = len(said) - _MOST_FINDINGS
    shown = said[:_MOST_FINDINGS] + ([f"… and {more} more"] if more > 0 else [])
    words = "Sensor first: what was found in the channels that were used."
    return [Paragraph(words), ItemList(tuple(shown))]
