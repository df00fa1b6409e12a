"""An identification, described once for terminal and JSON."""

from collections.abc import Iterator, Mapping, Sequence

from thermaxis import __version__, thermal
from thermaxis.codes import message_as_json, values_as_json
from thermaxis.messages import remedy_of, sentence, sentence_of, text_of
from thermaxis.report.tables import Part, Section, Table, Value, as_json, messages_of, values_of

_T = 1.96
_MOST_NAMED = 6
_MOST_PARTS = 6
_RULES = {"model": "model", "static": "static", "averages": "fixed averages"}


def _with_interval(value: float, std: float | None) -> str:
    text = f"{value:.4g}"
    return text if std is None else f"{text} ± {_T * std:.2g}"


def _with_intervals(values: Sequence[float], stds: Sequence[float | None]) -> str:
    return "  ".join(map(_with_interval, values, stds)) or "–"


def finding_sentences(findings: Mapping[str, Sequence[thermal.LogFinding]]) -> list[str]:
    """Return findings as sentences; channels of one log of which the same is said share one."""
    said: list[str] = []
    for log, found in findings.items():
        alike: dict[object, list[thermal.LogFinding]] = {}
        for finding in found:
            values = tuple((k, v) for k, v in finding.message.values.items() if k != "name")
            alike.setdefault((finding.message.code, values), []).append(finding)
        for same in alike.values():
            names = ", ".join(finding.channel for finding in same[:_MOST_NAMED])
            more = f" and {len(same) - _MOST_NAMED} more" if len(same) > _MOST_NAMED else ""
            message = same[0].message
            values = {**message.values, "name": names + more} if names else message.values
            said.append(f"{log}: {sentence(message.code, values)}")
    return said


def described(
    result: thermal.Identification,
    records: thermal.Records,
    findings: Mapping[str, Sequence[thermal.LogFinding]],
    remarks: Sequence[str] = (),
) -> list[Part]:
    """Return an identification for terminal and JSON."""
    experiments = max(len(e) for e in records.experiments.values())
    step_s = records.sample_time_s
    sensors = finding_sentences(findings)
    outputs = result.outputs
    return [
        (
            f"method {result.method}, {experiments} experiment(s) at {step_s:g} s;"
            f" {'stable' if result.stable else 'NOT STABLE'}"
        ),
        text_of(result.rule),
        Value("version", __version__),
        Value("method", str(result.method)),
        Value("stable", result.stable),
        Value("rule", text_of(result.rule)),
        Value("rule_code", message_as_json(result.rule)),
        Value("sample_time_s", step_s),
        Section("", [Value("", remarks, "reading"), Value("", sensors, "sensor first")]),
        _selection(result),
        *(Section("", list(_output_text(output))) for output in outputs),
        Table(
            "",
            [_output(output, step_s) for output in outputs],
            key="outputs",
            names=[output.name for output in outputs],
        ),
        _joint(result),
        _beside(result),
        _held_out(result),
        Value("findings", list(_findings(findings))),
        Value("", [*map(text_of, result.warnings)], "warning"),
        *messages_of("warnings", result.warnings, before=[*remarks, *sensors]),
    ]


def _findings(findings: Mapping[str, Sequence[thermal.LogFinding]]) -> Iterator[dict[str, object]]:
    for log, found in findings.items():
        for finding in found:
            yield {
                "log": log,
                "kind": str(finding.kind),
                "channel": finding.channel,
                "text": sentence_of(finding.message),
                "remedy": remedy_of(finding.message),
                "rows": finding.rows,
                "code": finding.message.code,
                "values": values_as_json(finding.message.values),
            }


def _joint(result: thermal.Identification) -> Part:
    joint = result.joint
    if joint is None:
        return Value("joint_gains", None)
    rows = [
        [Value("", channel, "displacement"), Value("", gain, "g", ".3f")]
        for channel, gain in joint.gain_by_channel.items()
    ]
    return Section(
        "joint_gains",
        [
            Table(f"Gain g of the part {joint.part[:30]} by displacement", rows, words=1),
            *values_of(joint, "part", "reference"),
            Value("gains", joint.gain_by_channel),
        ],
    )


def _beside(result: thermal.Identification) -> Table:
    """Return the errors on the training rows, model and baselines side by side."""
    heads = {**_RULES, "one_step": "nothing changes (one step)"}
    rows = [
        [
            Value("", output.name, "output"),
            *(Value("", rmse[k], head, ".2f") for k, head in heads.items() if k in rmse),
        ]
        for output in result.outputs
        if (rmse := output.training_rmse_um)
    ]
    title = "RMSE on the training rows, um: free run of the model as written, and simple rules"
    return Table(title, rows, words=1)


def _held_out(result: thermal.Identification) -> Section:
    """Return what the method is worth on rows that it did not see, beside simple rules."""
    heads = {**_RULES, "hold": "nothing changes"}
    by_rows: dict[str, list[list[Value]]] = {}
    for output in result.outputs:
        held = output.held_out
        if held is None:
            continue
        row = [
            Value("", output.name, "output"),
            Value("", _starts(held.starts), "start"),
            Value("", held.fit_percent, "fit %", ".1f"),
            *(Value("", held.rmse_um.get(k), head, ".2f") for k, head in heads.items()),
        ]
        by_rows.setdefault(text_of(held.what), []).append(row)
    return Section("", [Table(what, rows, words=1) for what, rows in by_rows.items()])


def _selection(result: thermal.Identification) -> Part:
    selection = result.selection
    if selection is None:
        return Value("selection", None)
    curve = [
        as_json(values_of(entry, "channels", "score", "excess", "excess_se"))
        for entry in selection.curve
    ]
    return Section(
        "selection",
        [
            *values_of(selection, "channels", "time_constants_s", "sensor_uncertainty_k"),
            Value("curve", curve),
        ],
    )


def _output_text(output: thermal.IdentifiedOutput) -> Iterator[Part]:
    if output.model is not None and len(output.model.parts) <= _MOST_PARTS:
        parts = list(zip(output.model.parts, output.std, strict=True))
        rows = [
            [
                Value("", part.input_name, "input"),
                Value("", _with_interval(part.dc_gain, std.dc_gain), "DC gain um/K"),
                Value("", _with_interval(part.direct_gain, std.direct_gain), "direct um/K"),
                Value("", _with_intervals(part.gains.tolist(), std.gains), "gains um/K"),
                Value(
                    "",
                    _with_intervals(part.time_constants_s.tolist(), std.time_constants_s),
                    "time constants s",
                ),
            ]
            for part, std in parts
        ]
        yield Table(_title(output), rows, words=1)
        for part, std in parts:
            yield from (f"{part.input_name[:30]}: {text_of(flag)}" for flag in std.flags)
    if output.polynomials is not None:
        yield from _polynomials_in_words(output.polynomials)
    yield Value("", [f"{output.name[:30]}: {text_of(w)}" for w in output.warnings], "warning")


def _starts(starts: Sequence[thermal.LogStart]) -> str:
    return "/".join(dict.fromkeys(map(str, starts)))


def _title(output: thermal.IdentifiedOutput) -> str:
    fit = "constant" if output.fit_percent is None else f"fit {output.fit_percent:.1f} %"
    title = f"{output.name[:30]}: {fit} on the training rows"
    if output.starts:
        title += f", start: {_starts(output.starts)}"
    if output.noise_std_um is not None:
        title += f", noise {output.noise_std_um:.2g} um"
    if output.slow_noise_std_um is not None:
        title += f", slow drift that no input explains {output.slow_noise_std_um:.2g} um"
    return title


def _polynomials_in_words(result: thermal.PolynomialResult) -> Iterator[str]:
    shared = result.method == "arx"
    for k, (name, a) in enumerate(zip(result.model.input_names, result.numerators, strict=True)):
        yield f"numerator a of {name[:30]}: {' '.join(f'{v:.8g}' for v in a)}"
        if not shared or k == 0:
            whose = "all inputs" if shared else name[:30]
            listed = " ".join(f"{v:.8g}" for v in result.denominators[k])
            yield f"denominator b of {whose}: {listed}"


def _output(output: thermal.IdentifiedOutput, sample_time_s: float) -> list[Value]:
    held = output.held_out
    return [
        *values_of(output, "fit_percent", "noise_std_um", "slow_noise_std_um", "training_rmse_um"),
        Value("start", [*map(str, output.starts)]),
        Value("held_out", None if held is None else _held_out_json(held)),
        *messages_of("warnings", output.warnings),
        Value("parts", [as_json(part) for part in _parts(output)]),
        Value("offset_um", None if output.model is None else output.model.offset_um),
        *_polynomials(output.polynomials, sample_time_s),
    ]


def _held_out_json(held: thermal.HeldOut) -> dict[str, object]:
    return {
        "what": text_of(held.what),
        "what_code": message_as_json(held.what),
        "start": [*map(str, held.starts)],
        "fit_percent": held.fit_percent,
        "rmse_um": dict(held.rmse_um),
    }


def _parts(output: thermal.IdentifiedOutput) -> Iterator[list[Value]]:
    if output.model is None:
        return
    for part, std in zip(output.model.parts, output.std, strict=True):
        gains = ("direct_gain", "gains", "time_constants_s")
        yield [
            Value("input", part.input_name),
            *values_of(part, *gains, "delay_s", "dc_gain"),
            *(Value(f"std.{key}", getattr(std, key)) for key in gains),
            Value("dc_gain_std", std.dc_gain),
            *messages_of("flags", std.flags),
        ]


def _polynomials(result: thermal.PolynomialResult | None, sample_time_s: float) -> list[Value]:
    if result is None:
        empty = [Value("numerator", None), Value("denominator", None)]
        return [*empty, Value("sample_time_s", sample_time_s)]
    names = result.model.input_names
    shared = result.method == "arx"
    denominators = dict(zip(names, result.denominators, strict=True))
    return [
        Value("numerator", dict(zip(names, result.numerators, strict=True))),
        Value("denominator", result.denominators[0] if shared else denominators),
        Value("sample_time_s", result.model.sample_time_s),
    ]
