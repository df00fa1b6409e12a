"""Superpose models of separate calibration tests, each with its gain by workpiece diameter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import final

from thermaxis.codes import Place
from thermaxis.compensation import (
    STATED,
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
)
from thermaxis.errors import ConfigurationError, require_known

TCP = "tcp"
"""Word for the tool centre point among the diameters of a gain."""


@final
@dataclass(frozen=True, slots=True)
class DiameterGain:
    """Gain g of a part by clamping diameter."""

    points: tuple[GainPoint, ...]
    """Gain by diameter, increasing."""
    tool_gain: float
    """Gain at the tool centre point. [1]"""


def parse_gain(text: str) -> tuple[str, DiameterGain]:
    """Read a gain by diameter.

    Parameters
    ----------
    text : str
        ``name=diameter:gain,diameter:gain,...`` with diameters in mm; ``tcp:gain`` states the
        gain at the tool centre point, which is 1 unless stated.

    Returns
    -------
    name : str
        Name of the part, or of the model whose parts are meant.
    gain : DiameterGain
        The gain.

    Raises
    ------
    ConfigurationError
        If the text is something else, a number is none, or diameters repeat.

    References
    ----------
    Mareš and Horejš 2021, equation (6).
    """
    name, sign, listed = text.partition("=")
    if not sign or not name.strip() or not listed.strip():
        raise ConfigurationError("no_gain_by_diameter", text=text, key="--gain")
    tool_gain: float | None = None
    points: dict[float, float] = {}
    for entry in listed.split(","):
        at, colon, gain_word = entry.partition(":")
        gain = _number(gain_word)
        if at.strip().casefold() == TCP and gain is not None and tool_gain is None:
            tool_gain = gain
            continue
        diameter = _number(at)
        if not colon or gain is None or diameter is None or diameter < 0 or diameter in points:
            raise ConfigurationError("no_new_diameter", text=entry, key="--gain")
        points[diameter] = gain
    if not points:
        raise ConfigurationError("no_diameter", key="--gain")
    return name.strip(), DiameterGain(
        tuple(GainPoint(d, points[d]) for d in sorted(points)),
        1.0 if tool_gain is None else tool_gain,
    )


def _number(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if abs(value) <= 1e6 else None


def combine_models(
    models: Sequence[tuple[str, CompensationModel]],
    gains: Mapping[str, DiameterGain] | None = None,
) -> CompensationModel:
    """Superpose models, equations (7) and (8): outputs of the same name are added.

    Parameters
    ----------
    models : sequence of (str, CompensationModel)
        At least one model with the name by which `gains` and messages call it.
    gains : mapping, optional
        Gain by diameter, by name of a part or else of a model, all of whose parts get it.
        Default: none.

    Returns
    -------
    CompensationModel
        The superposed model; logs, figures and warnings of all are kept.

    Raises
    ------
    ConfigurationError
        If there is no model, the same part would act twice, the models refer to different
        references or filter their inputs differently, a gain has no part, or a part has a gain
        already.

    References
    ----------
    Mareš and Horejš 2021, equations (5) to (8).
    """
    if not models:
        raise ConfigurationError("no_model", key="models")
    _check_alike(models)
    wanted = dict(gains or {})
    outputs: dict[str, Output] = {}
    for name, model in models:
        for output in model.outputs:
            parts = tuple(_with_gain(part, name, wanted) for part in output.parts)
            known = outputs.get(output.name)
            if known is None:
                outputs[output.name] = replace(output, parts=parts)
            else:
                _check_parts(name, known, parts)
                outputs[output.name] = Output(
                    output.name, (*known.parts, *parts), known.offset_um + output.offset_um
                )
    used = {name for name, _ in models} | {
        part.name for _, model in models for output in model.outputs for part in output.parts
    }
    require_known("gain", wanted, sorted(used))
    first = models[0][1]
    return replace(
        first,
        outputs=tuple(outputs.values()),
        sample_time_s=min(model.sample_time_s for _, model in models),
        reference_c={c: v for _, model in reversed(models) for c, v in model.reference_c.items()},
        longest_gap_s=min(model.longest_gap_s for _, model in models),
        longest_hold_s=min(model.longest_hold_s for _, model in models),
        provenance=_joined_provenance(models),
        warnings=tuple(
            dict.fromkeys(f"{name}: {w}" for name, model in models for w in model.warnings)
        ),
    )


def _with_gain(part: Part, model_name: str, gains: Mapping[str, DiameterGain]) -> Part:
    gain = gains.get(part.name, gains.get(model_name))
    if gain is None:
        return part
    if part.gain_by_diameter:
        raise ConfigurationError(
            "gain_stated_already", part=part.name, key="gain", channel=model_name
        )
    return replace(part, gain_by_diameter=gain.points, tool_gain=gain.tool_gain)


def _check_alike(models: Sequence[tuple[str, CompensationModel]]) -> None:
    first_name, first = models[0]
    for name, model in models[1:]:
        place = Place(f"{first_name}, {name}")
        if model.reference != first.reference:
            raise ConfigurationError("references_differ", place=place)
        if model.input_filter_s != first.input_filter_s:
            raise ConfigurationError(
                "filters_differ",
                first_s=first.input_filter_s,
                other_s=model.input_filter_s,
                place=place,
            )
        if model.reference == STATED:
            for channel, value in model.reference_c.items():
                if first.reference_c.get(channel, value) != value:
                    raise ConfigurationError(
                        "references_differ", place=place._replace(channel=channel)
                    )


def _check_parts(name: str, known: Output, parts: tuple[Part, ...]) -> None:
    for part in parts:
        for other in known.parts:
            if (part.plus, part.minus) == (other.plus, other.minus):
                raise ConfigurationError(
                    "heat_counted_twice",
                    part=part.name,
                    other=other.name,
                    file=name,
                    channel=known.name,
                )
            if part.name == other.name:
                raise ConfigurationError(
                    "part_name_twice", part=part.name, file=name, channel=known.name
                )


def _joined_provenance(models: Sequence[tuple[str, CompensationModel]]) -> Provenance:
    if len(models) == 1:
        return models[0][1].provenance
    parts = [(name, model.provenance) for name, model in models]
    figures = {f"{name}.{k}": v for name, p in parts for k, v in p.figures.items()}
    return Provenance(
        method="; ".join(dict.fromkeys(f"{name}: {p.method}" for name, p in parts)),
        program=parts[0][1].program,
        date=max(p.date for _, p in parts),
        logs=tuple(dict.fromkeys(log for _, p in parts for log in p.logs)),
        figures=figures,
    )
