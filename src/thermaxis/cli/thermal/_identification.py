"""An identification, described once for terminal and JSON."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest

from thermaxis import __version__, thermal
from thermaxis.codes import NOWHERE, message_as_json, values_as_json
from thermaxis.messages import remedy_of, sentence, sentence_of, text_of
from thermaxis.report.tables import (
    Part,
    Section,
    Table,
    Value,
    as_json,
    as_text,
    messages_of,
    values_of,
)

_T = 1.96
_MOST_NAMED = 6
_MOST_LINES = 40
_MOST_OUTPUTS, _MOST_PARTS, _MOST_TRIED, _MOST_NOTES = 5, 6, 5, 6
_RULES = {
    "model": "model", "static": "static", "averages": "fixed averages", "hold": "nothing changes"
}  # fmt: skip
_FIRST = thermal.VERDICTS | {
    "warning-trained_badly", "warning-simple_left_less",
    "warning-drift_held_out", "warning-probe_drift",
}  # fmt: skip


def _with_interval(value: float, std: float | None) -> str:
    half = _T * (std or 0.0)
    if half <= 0.0:
        return f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
    decimals = min(9, max(0, 1 - math.floor(math.log10(half))))
    return f"{value:.{decimals}f} ± {half:.{decimals}f}"


def _with_intervals(values: Sequence[float], stds: Sequence[float | None]) -> str:
    return "  ".join(_with_interval(*one) for one in zip_longest(values, stds)) or "–"


def _few(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return ", ".join(names[:_MOST_NAMED]) + more


def finding_sentences(findings: Mapping[str, Sequence[thermal.LogFinding]]) -> list[str]:
    """Return findings as sentences; channels of which the same is said share one, and logs."""
    said: dict[str, list[str]] = {}
    for log, found in findings.items():
        alike: dict[object, list[thermal.LogFinding]] = {}
        for finding in found:
            values = tuple((k, v) for k, v in finding.message.values.items() if k != "name")
            alike.setdefault((finding.message.code, values), []).append(finding)
        for same in alike.values():
            names = _few([finding.channel for finding in same])
            message = same[0].message
            values = {**message.values, "name": names} if names else message.values
            said.setdefault(sentence(message.code, values), []).append(log)
    return [f"{_few(logs)}: {text}" for text, logs in said.items()]


def described(
    result: thermal.Identification,
    records: thermal.Records,
    findings: Mapping[str, Sequence[thermal.LogFinding]],
    remarks: Sequence[str] = (),
    *,
    beside: int = 0,
) -> list[Part]:
    """Return an identification for terminal and JSON; the JSON has all, the terminal a screen.

    `beside` are the lines that the terminal shows besides. [1]
    """
    step_s = records.sample_time_s
    sensors = finding_sentences(findings)
    return [
        *_text(result, records, remarks, sensors, _MOST_LINES - beside),
        Value("version", __version__),
        Value("method", str(result.method)),
        Value("stable", result.stable),
        Value("rule", text_of(result.rule)),
        Value("rule_code", message_as_json(result.rule)),
        Value("sample_time_s", step_s),
        _selection(result),
        Table(
            "",
            [_output(output, step_s) for output in result.outputs],
            key="outputs",
            names=[output.name for output in result.outputs],
        ),
        Value("findings", list(findings_as_json(findings))),
        *messages_of("warnings", result.warnings, before=[*remarks, *sensors]),
    ]


def _text(
    result: thermal.Identification,
    records: thermal.Records,
    remarks: Sequence[str],
    sensors: Sequence[str],
    most: int,
) -> list[Part]:
    """Return what the terminal shows: the result, the model, how sure it is, what to measure next.

    Tables that are not needed and notes are shown as far as they fit on a screen.
    """
    outputs, every = result.outputs[:_MOST_OUTPUTS], records.experiments.values()
    several = len(result.outputs) > 1
    count, longest_h = (
        max(map(len, every)),
        max(e.duration_s for each in every for e in each) / 3600,
    )
    head = f"{result.method}: {count} log{'s' * (count > 1)}, the longest {longest_h:.3g} h, rows"
    head += f" every {records.sample_time_s:g} s{'' if result.stable else '; NOT STABLE'}"
    shown: list[Part] = [
        head,
        *map(_headline, outputs),
        *dict.fromkeys(text_of(o.held_out.what) for o in outputs if o.held_out is not None),
        _errors(outputs),
        _model(result.outputs),
        _joint(result),
    ]
    asked = [o for o in result.outputs if o.next_test is not None]
    last: list[Part] = []
    if asked:
        output = max(asked, key=_uncertainty)
        last = ["", _next_test_text(output) + (f" ({output.name})" if several else "")]
    first, notes = _notes(result, several=several)
    notes = [*first, *(f"reading: {remark}" for remark in remarks), *notes]
    notes += map(text_of, result.warnings)
    notes += [f"sensor first: {sensor}" for sensor in sensors]
    for more in () if several else (_tried(outputs[0]), _polynomials_in_words(outputs[0])):
        if _lines([*shown, *more, *notes[:_MOST_NOTES], *last]) <= most:
            shown += more
    for k, note in enumerate(notes):
        rest = f"{len(notes) - k} more: --json, --report"
        if k >= len(first[:1]) and _lines([*shown, note, rest, *last]) > most:
            shown.append(rest)
            break
        shown.append(note)
    return [*shown, *last]


def _lines(parts: Sequence[Part]) -> int:
    return as_text(parts).count("\n")


def _uncertainty(output: thermal.IdentifiedOutput) -> float:
    asked = output.next_test
    return 0.0 if asked is None else max(asked.settled_um.values(), default=0.0)


def _next_test_text(output: thermal.IdentifiedOutput) -> str:
    asked = output.next_test
    return "" if asked is None else text_of(asked.message).replace("\xa0", " ")


def _headline(output: thermal.IdentifiedOutput) -> str:
    """Return what a model is worth in one line."""
    trained, held, name = output.trained, output.held_out, output.name[:30]
    if trained is None:
        return f"{name}: no model"
    fit = "constant" if trained.fit_percent is None else f"fit {trained.fit_percent:.1f} %"
    line = f"{name}: {trained.uncompensated_um:.3g} um peak to peak, the model leaves"
    line += f" {trained.residual_um:.3g} um ({fit})"
    if held is None or held.fit_percent is None:
        return line
    return f"{line}; on rows held out fit {held.fit_percent:.1f} %"


def _notes(result: thermal.Identification, *, several: bool) -> tuple[list[str], list[str]]:
    """Return verdicts, and what else must be known of outputs and parts; alike ones together."""
    verdicts: dict[str, list[str]] = {}
    said: dict[str, list[str]] = {}
    for output in result.outputs:
        slow = output.slow_noise_std_um
        noise = "noise" if slow is not None else "noise and what drifts from touch to touch"
        stds = {noise: output.noise_std_um, "drift beside it": slow}
        listed = ", ".join(f"{what} {um:.2g} um" for what, um in stds.items() if um is not None)
        for warning in output.warnings:
            text = text_of(replace(warning, place=NOWHERE))
            group = verdicts if warning.code in _FIRST else said
            group.setdefault(text, []).append(warning.place.file or output.name)
        names = () if output.model is None else output.model.input_names
        for name, std in zip(names, output.std, strict=bool(output.std)):
            for flag in std.flags:
                part = f"{output.name} {name}" if several else name
                said.setdefault(text_of(flag), []).append(part)
        if listed and not several:
            said.setdefault(f"{listed} (standard deviations)", []).append(output.name)
    both = [[f"{_few(n)}: {text}" for text, n in one.items()] for one in (verdicts, said)]
    return both[0], both[1]


def _errors(outputs: Sequence[thermal.IdentifiedOutput]) -> Table:
    """Return the errors of model and simple rules on the training rows and on those held out."""
    rows: list[list[Value]] = []
    for output in outputs:
        unfit = {warning.code for warning in output.warnings} & thermal.VERDICTS
        every = {"training": (output.starts, output.training_rmse_um)}
        if output.held_out is not None:
            every["held out"] = (output.held_out.starts, output.held_out.rmse_um)
        for label, (starts, rmse) in every.items():
            values = [Value("", rmse.get(key), head, ".2f") for key, head in _RULES.items()]
            advice = "do not use it" if unfit and label == "held out" else ""
            start = "/".join(dict.fromkeys(map(str, starts)))
            words = [Value("", output.name, "output"), Value("", label, "rows")]
            words.append(Value("", start, "start"))
            rows.append([*words, *values, Value("", advice, "")])
    return Table("RMSE in free run, um: model as written, and simple rules", rows, words=3)


def _model(outputs: Sequence[thermal.IdentifiedOutput]) -> Table:
    """Return gains and lags of the parts, with 95 % intervals where there are some."""
    models = [(o, o.model) for o in outputs if o.model is not None]
    found = [
        (o, *both) for o, model in models for both in zip(model.parts, o.std, strict=bool(o.std))
    ]
    late = any(part.delay_s or std.delay_interval_s for _, part, std in found)
    common = len({tuple(part.time_constants_s) for _, part, _ in found}) == 1
    rows: list[list[Value]] = []
    for output, part, std in found[:_MOST_PARTS]:
        lags_s = part.time_constants_s.tolist()
        gains = [_with_interval(*one) for one in zip(part.gains.tolist(), std.gains, strict=True)]
        each = [Value("", g, f"at {t:.0f} s") for g, t in zip(gains, lags_s, strict=True)]
        if not common:
            each = [Value("", "  ".join(gains) or "–", "gains of the lags")]
            each.append(Value("", _with_intervals(lags_s, ()), "time constants s"))
        row = [
            Value("", output.name, "output" if len(outputs) > 1 else None),
            Value("", part.input_name, "input"),
            Value("", _delay(part.delay_s, std), "delay s" if late else None),
            Value("", _with_interval(part.dc_gain, std.dc_gain), "DC gain"),
            Value("", _with_interval(part.direct_gain, std.direct_gain), "direct"),
            *each,
        ]
        rows.append(row)
    title = "Model, um/K"
    if any(std.dc_gain is not None for *_, std in found):
        title += ", ± 95 %"
    if common and found[0][1].gains.size:
        _, part, std = found[0]
        title += (
            f"; lags of {_with_intervals(part.time_constants_s.tolist(), std.time_constants_s)} s"
        )
    if len(found) > len(rows):
        title += f"; the first {len(rows)} of {len(found)} parts, all by --json, --report"
    return Table(title, rows, words=1 + (len(outputs) > 1))


def _delay(delay_s: float, std: thermal.PartStd) -> str:
    ends = std.delay_interval_s
    return f"{delay_s:g}" if ends is None else f"{ends[0]:g} to {ends[1]:g}, used {delay_s:g}"


def _tried(output: thermal.IdentifiedOutput) -> list[Part]:
    """Return sets of lags, or orders, that were tried."""
    rows: list[list[Value]] = []
    best = max((trial.log_evidence for trial in output.trials), default=0.0)
    for trial in output.trials:
        row = [
            Value("", "given" if trial.given else str(len(trial.time_constants_s)), "lags"),
            Value("", trial.log_evidence - best, "log evidence", ".1f"),
            Value("", trial.held_out_um, "held out um", ".2f"),
            Value("", _with_intervals(trial.time_constants_s, ()), "time constants s"),
        ]
        rows.append([*row, Value("", "taken" if trial.chosen else "", "")])
    search = () if output.polynomials is None else output.polynomials.search
    for trial in sorted(search, key=lambda one: one.rmse_um)[:_MOST_TRIED]:
        row = [
            Value("", str(trial.denominator_order), "na"),
            Value("", trial.numerator_order + 1, "nb"),
            Value("", trial.rmse_um, "held out um", ".2f"),
        ]
        rows.append([*row, Value("", "taken" if trial.chosen else "", "")])
    return [Table("Tried, each judged in free run on parts held out", rows, words=1)]


def findings_as_json(
    findings: Mapping[str, Sequence[thermal.LogFinding]],
) -> Iterator[dict[str, object]]:
    """Return findings as JSON has them."""
    for log, found in findings.items():
        for finding in found:
            yield {
                "log": log,
                "kind": str(finding.kind),
                "channel": finding.channel,
                "text": sentence_of(finding.message),
                "remedy": remedy_of(finding.message),
                "serious": finding.serious,
                "rows": finding.rows,
                "time_s": finding.time_s,
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


def _polynomials_in_words(output: thermal.IdentifiedOutput) -> list[Part]:
    found = output.polynomials
    if found is None:
        return []
    names, shared = found.model.input_names, found.method == "arx"
    lines = [
        f"numerator a of {name[:30]}: {' '.join(f'{v:.8g}' for v in a)}"
        for name, a in zip(names, found.numerators, strict=True)
    ]
    for name, b in zip(["all inputs"] if shared else names, found.denominators, strict=False):
        lines.append(f"denominator b of {name[:30]}: {' '.join(f'{v:.8g}' for v in b)}")
    return [*lines, ""]


def _output(output: thermal.IdentifiedOutput, sample_time_s: float) -> list[Value]:
    held = output.held_out
    return [
        *values_of(output, "fit_percent", "noise_std_um", "slow_noise_std_um", "training_rmse_um"),
        Value("peak_to_peak_um", _peak_to_peak(output.trained)),
        Value("start", [*map(str, output.starts)]),
        Value("held_out", None if held is None else _held_out_json(held)),
        *messages_of("warnings", output.warnings),
        Value("parts", [as_json(part) for part in _parts(output)]),
        Value("orders", [as_json(trial) for trial in _orders(output)]),
        Value("next_test", _next_test(output)),
        Value("offset_um", None if output.model is None else output.model.offset_um),
        *_polynomials(output.polynomials, sample_time_s),
    ]


def _orders(output: thermal.IdentifiedOutput) -> Iterator[list[Value]]:
    for trial in output.trials:
        own = ("time_constants_s", "log_evidence", "held_out_um", "given", "chosen")
        yield [*values_of(trial, *own), Value("na", None), Value("nb", None)]
    for trial in () if output.polynomials is None else output.polynomials.search:
        yield [
            *(Value(key, None) for key in ("time_constants_s", "log_evidence")),
            Value("held_out_um", trial.rmse_um),
            Value("given", value=False),
            Value("chosen", trial.chosen),
            Value("na", trial.denominator_order),
            Value("nb", trial.numerator_order + 1),
        ]


def _next_test(output: thermal.IdentifiedOutput) -> dict[str, object] | None:
    asked = output.next_test
    if asked is None:
        return None
    said = {"text": _next_test_text(output), "text_code": message_as_json(asked.message)}
    tests = [
        {
            "input": test.input,
            "level_k": test.level_k,
            "on_s": test.on_s,
            "settled_um": asked.settled_um.get(test.input),
        }
        for test in asked.tests
    ]
    return {**said, "unmoved": asked.unmoved, "tests": tests}


def _peak_to_peak(trained: thermal.VerificationFigures | None) -> dict[str, float] | None:
    if trained is None:
        return None
    return {
        "uncompensated": trained.uncompensated_um,
        "residual": trained.residual_um,
        "reduction": trained.reduction,
    }


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
            Value("delay_interval_s", std.delay_interval_s),
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
