"""An identification as text and as JSON."""

from collections.abc import Mapping, Sequence

from thermaxis import __version__
from thermaxis.cli._text_table import text_table
from thermaxis.errors import printable
from thermaxis.thermal import (
    Identification,
    IdentifiedOutput,
    LogFinding,
    PolynomialResult,
    Records,
)

_T = 1.96
_MOST_NAMED = 6


def _with_interval(value: float, std: float | None, digits: int = 4) -> str:
    text = f"{value:.{digits}g}"
    return text if std is None else f"{text} ± {_T * std:.2g}"


def finding_sentences(findings: Mapping[str, Sequence[LogFinding]]) -> list[str]:
    """Return findings as sentences; channels of one log of which the same is said share one."""
    said: list[str] = []
    for log, found in findings.items():
        channels: dict[str, list[str]] = {}
        for finding in found:
            rest = finding.words.removeprefix(f"{finding.channel} ")
            names = channels.setdefault(rest if rest != finding.words else finding.words, [])
            if rest != finding.words:
                names.append(finding.channel)
        for rest, names in channels.items():
            if len(names) > _MOST_NAMED:
                listed = f"{', '.join(names[:_MOST_NAMED])} and {len(names) - _MOST_NAMED} more"
            else:
                listed = ", ".join(names)
            each = " each" if len(names) > 1 else ""
            said.append(f"{log}: {listed}{each} {rest}" if names else f"{log}: {rest}")
    return said


def identification_as_text(
    result: Identification,
    records: Records,
    findings: Mapping[str, Sequence[LogFinding]],
    remarks: Sequence[str] = (),
) -> str:
    """Return an identification as tables for a terminal."""
    count = {len(e) for e in records.experiments.values()}
    stable = "stable" if result.stable else "NOT STABLE"
    head = f"method {result.method}, {max(count)} experiment(s) at {records.sample_time_s:g} s;"
    parts = [f"{head} {stable}\n{result.rule}\n"]
    said = [f"reading: {printable(remark, 400)}\n" for remark in remarks]
    said += [f"sensor first: {printable(f, 400)}\n" for f in finding_sentences(findings)]
    if said:
        parts.append("".join(said))
    if result.selection is not None:
        parts.append(_selection_text(result))
    parts += [_output_text(output) for output in result.outputs]
    if result.joint is not None:
        parts.append(_joint_text(result))
    parts.append(_beside_text(result))
    parts += [f"warning: {printable(w, 400)}\n" for w in result.warnings]
    return "\n".join(parts)


def _joint_text(result: Identification) -> str:
    if result.joint is None:
        return ""
    rows = [[printable(c, 30), f"{g:.3f}"] for c, g in result.joint.gain_by_channel.items()]
    title = f"Gain g of the part {printable(result.joint.part, 30)} by displacement"
    return text_table(title, ["displacement", "g"], rows, words=1)


def _beside_text(result: Identification) -> str:
    """Return the errors on the training rows, model and baselines side by side."""
    keys = ("model", "static", "averages", "one_step")
    rows = [
        [printable(o.name, 30), *(f"{o.training_rmse_um[key]:.2f}" for key in keys)]
        for o in result.outputs
    ]
    heads = ["output", "model", "static", "fixed averages", "nothing changes (one step)"]
    title = "RMSE on the training rows, um: free run, and what simple rules leave"
    return text_table(title, heads, rows, words=1)


def _selection_text(result: Identification) -> str:
    rows: list[list[str]] = []
    for output in result.outputs:
        base = output.baseline_mae_um
        held = output.validation_mae_um
        rows.append(
            [
                printable(output.name, 30),
                f"{output.fit_percent:.1f}",
                "–" if held is None else f"{held:.2f}",
                *(f"{base[k]:.2f}" if k in base else "–" for k in ("hold", "static", "averages")),
            ]
        )
    heads = ["output", "fit %", "held out", "nothing changes", "static", "fixed averages"]
    title = "Free run: fit on the training rows; mean absolute error on parts held out, um"
    return text_table(title, heads, rows, words=1)


def _output_text(output: IdentifiedOutput) -> str:
    lines = ""
    if output.model is not None and len(output.model.parts) <= 6:
        rows: list[list[str]] = []
        for part, std in zip(output.model.parts, output.std, strict=True):
            rows.append(
                [
                    printable(part.input_name, 30),
                    _with_interval(part.dc_gain, std.dc_gain),
                    _with_interval(part.direct_gain, std.direct_gain),
                    "  ".join(
                        _with_interval(float(g), s)
                        for g, s in zip(part.gains, std.gains, strict=True)
                    )
                    or "–",
                    "  ".join(
                        _with_interval(float(t), s)
                        for t, s in zip(part.time_constants_s, std.time_constants_s, strict=True)
                    )
                    or "–",
                ]
            )
        title = f"{printable(output.name, 30)}: fit {output.fit_percent:.1f} % on the training rows"
        if abs(output.fit_percent - output.fit_from_rest_percent) >= 0.1:
            title += f" ({output.fit_from_rest_percent:.1f} % from rest)"
        if output.noise_std_um is not None:
            title += f", noise {output.noise_std_um:.2g} um"
        if output.slow_noise_std_um is not None:
            title += f", slow drift that no input explains {output.slow_noise_std_um:.2g} um"
        heads = ["input", "DC gain um/K", "direct um/K", "gains um/K", "time constants s"]
        lines = text_table(title, heads, rows, words=1)
        for part, std in zip(output.model.parts, output.std, strict=True):
            lines += "".join(
                f"  {printable(part.input_name, 30)}: {printable(flag, 400)}\n"
                for flag in std.flags
            )
    if output.polynomials is not None:
        lines += _polynomial_text(output.polynomials)
    lines += "".join(
        f"warning: {printable(output.name, 30)}: {printable(w, 400)}\n" for w in output.warnings
    )
    return lines


def _polynomial_text(result: PolynomialResult) -> str:
    lines = ""
    shared = result.method == "arx"
    for k, (name, a) in enumerate(zip(result.model.input_names, result.numerators, strict=True)):
        listed = " ".join(f"{v:.8g}" for v in a)
        lines += f"  numerator a of {printable(name, 30)}: {listed}\n"
        if not shared or k == 0:
            whose = "all inputs" if shared else printable(name, 30)
            listed = " ".join(f"{v:.8g}" for v in result.denominators[k])
            lines += f"  denominator b of {whose}: {listed}\n"
    return lines


# ---- JSON ---------------------------------------------------------------------------------------


def identification_as_json(
    result: Identification,
    records: Records,
    findings: Mapping[str, Sequence[LogFinding]],
    remarks: Sequence[str] = (),
) -> dict[str, object]:
    """Return an identification with the keys of the command's JSON."""
    content: dict[str, object] = {
        "version": __version__,
        "method": str(result.method),
        "stable": result.stable,
        "rule": result.rule,
        "sample_time_s": records.sample_time_s,
        "outputs": {o.name: _output_as_json(o, records.sample_time_s) for o in result.outputs},
        "findings": [
            {
                "log": log,
                "kind": str(finding.kind),
                "channel": finding.channel,
                "text": finding.words,
                "remedy": finding.remedy,
                "rows": None if finding.rows is None else list(finding.rows),
            }
            for log, found in findings.items()
            for finding in found
        ],
        "warnings": [*remarks, *finding_sentences(findings), *result.warnings],
    }
    content["joint_gains"] = None
    if result.joint is not None:
        content["joint_gains"] = {
            "part": result.joint.part,
            "reference": result.joint.reference,
            "gains": dict(result.joint.gain_by_channel),
        }
    selection = result.selection
    content["selection"] = None
    if selection is not None:
        content["selection"] = {
            "channels": list(selection.channels),
            "time_constants_s": list(selection.time_constants_s),
            "sensor_uncertainty_k": selection.sensor_uncertainty_k,
            "curve": [
                {
                    "channels": list(entry.channels),
                    "score": entry.score,
                    "excess": entry.excess,
                    "excess_se": entry.excess_se,
                }
                for entry in selection.curve
            ],
        }
    return content


def _output_as_json(output: IdentifiedOutput, sample_time_s: float) -> dict[str, object]:
    content: dict[str, object] = {
        "fit_percent": output.fit_percent,
        "fit_from_rest_percent": output.fit_from_rest_percent,
        "noise_std_um": output.noise_std_um,
        "slow_noise_std_um": output.slow_noise_std_um,
        "validation_mae_um": output.validation_mae_um,
        "baseline_mae_um": dict(output.baseline_mae_um),
        "training_rmse_um": dict(output.training_rmse_um),
        "parts": _parts_as_json(output),
        "offset_um": None if output.model is None else float(output.model.offset_um),
        "numerator": None,
        "denominator": None,
        "sample_time_s": sample_time_s,
        "warnings": list(output.warnings),
    }
    if output.polynomials is not None:
        content |= _polynomials_as_json(output.polynomials)
    return content


def _parts_as_json(output: IdentifiedOutput) -> list[dict[str, object]]:
    if output.model is None:
        return []
    return [
        {
            "input": part.input_name,
            "direct_gain": float(part.direct_gain),
            "gains": part.gains.tolist(),
            "time_constants_s": part.time_constants_s.tolist(),
            "delay_s": float(part.delay_s),
            "std": {
                "direct_gain": std.direct_gain,
                "gains": list(std.gains),
                "time_constants_s": list(std.time_constants_s),
            },
            "dc_gain": part.dc_gain,
            "dc_gain_std": std.dc_gain,
            "flags": list(std.flags),
        }
        for part, std in zip(output.model.parts, output.std, strict=True)
    ]


def _polynomials_as_json(result: PolynomialResult) -> dict[str, object]:
    names = result.model.input_names
    denominators = {n: b.tolist() for n, b in zip(names, result.denominators, strict=True)}
    return {
        "numerator": {n: a.tolist() for n, a in zip(names, result.numerators, strict=True)},
        "denominator": denominators[names[0]] if result.method == "arx" else denominators,
        "sample_time_s": result.model.sample_time_s,
    }
