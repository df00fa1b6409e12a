"""What the texts of model and main block are filled with: channels, outputs, parts, inputs."""

from dataclasses import asdict
from math import expm1, isfinite
from typing import Any, TypeAlias

from thermaxis.compensation import STATED, Part
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.tree import noted, remark_text

Items: TypeAlias = list[dict[str, Any]]
"""Values of several things of one kind, in their order."""


def channel_values(settings: PlcSettings) -> Items:
    """Return what the texts know of every channel: numbers from 1, texts, rules."""
    compensation = settings.compensation
    model = compensation.model
    return [
        {
            "k": k,
            "stem": stem,
            "text": remark_text(channel),
            "owner": channel,
            "reference_c": model.reference_c.get(channel),
            "lowest_c": rule.lowest_c,
            "highest_c": rule.highest_c,
            "step_k": rule.step_k,
            "two_steps_k": 2.0 * rule.step_k,
            "rate_step_k": rule.largest_rate_k_per_s * settings.cycle_s,
            "frozen_s": rule.frozen_s,
        }
        for k, (stem, channel, rule) in enumerate(
            zip(settings.names.channels, model.channels, compensation.rules, strict=True), 1
        )
    ]


def output_values(settings: PlcSettings) -> Items:
    """Return what the texts know of every output."""
    compensation = settings.compensation
    outputs = zip(
        settings.names.outputs,
        compensation.model.outputs,
        compensation.bounds,
        settings.steps_um,
        strict=True,
    )
    return [
        {
            "k": k,
            "stem": stem,
            "text": remark_text(output.name),
            "owner": output.name,
            "rate_step_um": step_um,
            **asdict(bounds),
        }
        for k, (stem, output, bounds, step_um) in enumerate(outputs, 1)
    ]


def part_values(settings: PlcSettings) -> Items:
    """Return what the texts know of every part."""
    parts = settings.compensation.model.layout.parts
    stems = settings.names.parts
    return [
        {"k": k, "stem": stem, "text": remark_text(part.name)}
        for k, (stem, part) in enumerate(zip(stems, parts, strict=True), 1)
    ]


def model_values(settings: PlcSettings) -> dict[str, Any]:
    """Return what the text of the model is filled with."""
    compensation = settings.compensation
    model = compensation.model
    layout = model.layout
    stated, filtered = model.reference == STATED, model.input_filter_s > 0.0
    acting = "acting" if filtered else "input"
    wires = _wires(settings)
    delays: dict[tuple[int, int], str] = {}
    for k in layout.delayed:
        wire, cycles = layout.driven[k], settings.delay_cycles(layout.parts[k])
        if cycles:
            delays.setdefault((wire, cycles), f"late{len(delays) + 1}_k")

    def acts(part: Part, wire: int) -> str:
        """Return the input that acts on a part until the next call."""
        return delays.get((wire, settings.delay_cycles(part)), f"{acting}{wire + 1}_k")

    sections = [
        {
            "i": i,
            "tau_s": noted(tau_s),
            "alpha": _alpha(settings, tau_s),
            "acts": acts(layout.parts[owner], wire),
            "start_k": f"new{wire + 1}_k" if stated else "zero",
        }
        for i, (tau_s, wire, owner) in enumerate(
            zip(layout.taus_s, layout.drives, layout.owners, strict=True), 1
        )
    ]
    parts = part_values(settings)
    gained = {k: n for n, k in enumerate(layout.gained, 1)}
    for k, (values, part) in enumerate(zip(parts, layout.parts, strict=True)):
        values["gained"] = gained.get(k, 0)
        values["term"] = _terms(settings, k, acts(part, layout.driven[k]))
        values["n"] = layout.driven[k] + 1
        values["lowest_k"], values["highest_k"] = part.lowest_k, part.highest_k
    outputs = output_values(settings)
    for values, (first, behind, offset_um) in zip(outputs, layout.spans, strict=True):
        own = parts[first:behind]
        values["offset_um"] = offset_um
        values["first_part"], values["other_part"] = own[0]["stem"], own[1:]
        values["own_range"] = _ranged(own)
    ranged = _ranged(parts)
    return {
        "channel": channel_values(settings),
        "wire": wires,
        "delay": [
            {"m": m, "n": wire + 1, "cycles": cycles} for m, (wire, cycles) in enumerate(delays, 1)
        ],
        "section": sections,
        "part": parts,
        "output": outputs,
        "ranged_part": ranged,
        "stated": stated,
        "rest": "in the steady state" if stated else "at rest",
        "filtered": filtered,
        "acting": acting,
        "filter_s": noted(model.input_filter_s),
        "filter_alpha": _alpha(settings, model.input_filter_s) if filtered else 0.0,
        "differences": any(wire["minus"] for wire in wires),
        "several_terms": any(len(values["term"]) > 1 for values in parts),
        "weighted": bool(ranged),
        "longest_hold_s": model.longest_hold_s,
        "cycle_s": settings.cycle_s,
        "margin_k": compensation.validity_margin_k,
        "lowest_weight": compensation.lowest_weight,
    }


def _alpha(settings: PlcSettings, tau_s: float) -> float:
    """Return the share of a cycle of a first-order lag. [1]"""
    return -expm1(-settings.cycle_s / tau_s)


def _wires(settings: PlcSettings) -> Items:
    """Return the inputs of the model: differences to references, and of two channels."""
    model = settings.compensation.model
    channels = [remark_text(channel) for channel in model.channels]
    return [
        {
            "n": n,
            "text": channels[plus] + (f" - {channels[minus]}" if minus >= 0 else ""),
            "plus": plus + 1,
            "minus": minus + 1 if minus >= 0 else 0,
            "ranged": isfinite(lowest_k) and isfinite(highest_k),
            "lowest_k": lowest_k,
            "highest_k": highest_k,
        }
        for n, ((plus, minus), (lowest_k, highest_k)) in enumerate(
            zip(model.layout.wires, model.layout.ranges, strict=True), 1
        )
    ]


def _terms(settings: PlcSettings, k: int, acts: str) -> Items:
    """Return the terms of a part: the direct one, where it is not zero or alone, and sections."""
    layout = settings.compensation.model.layout
    part = layout.parts[k]
    terms: Items = []
    if part.direct_gain_um_per_k != 0.0 or not part.sections:
        terms.append(
            {
                "gain": f"direct{k + 1}_um_per_k",
                "gain_um_per_k": part.direct_gain_um_per_k,
                "meaning": "direct gain",
                "of": acts,
            }
        )
    own = [i for i, owner in enumerate(layout.owners, 1) if owner == k]
    terms += [
        {
            "gain": f"gain{i}_um_per_k",
            "gain_um_per_k": section.gain_um_per_k,
            "meaning": f"gain of section {i}",
            "of": f"lag{i}.x_k",
        }
        for i, section in zip(own, part.sections, strict=True)
    ]
    return [{**term, "first": number == 0} for number, term in enumerate(terms)]


def _ranged(parts: Items) -> Items:
    return [p for p in parts if p["lowest_k"] is not None and p["highest_k"] is not None]
