"""Superpose models of separate calibration tests, each with its gain by workpiece diameter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import final

from thermaxis.codes import printable
from thermaxis.compensation import (
    STATED,
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
)
from thermaxis.errors import ConfigurationError

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
    where = f"--gain {printable(text, 60)}"
    remedy = "Write table=0:1,1500:1.6,3000:2.2, and tcp:1 for the tool centre point"
    if not sign or not name.strip() or not listed.strip():
        raise ConfigurationError("this is no gain by diameter", where=where, remedy=remedy)
    tool_gain: float | None = None
    points: dict[float, float] = {}
    for entry in listed.split(","):
        place, colon, gain_word = entry.partition(":")
        gain = _number(gain_word)
        if place.strip().casefold() == TCP and gain is not None and tool_gain is None:
            tool_gain = gain
            continue
        diameter = _number(place)
        if not colon or gain is None or diameter is None or diameter < 0 or diameter in points:
            raise ConfigurationError(
                f"'{printable(entry, 30)}' is no new diameter with its gain",
                where=where,
                remedy=remedy,
            )
        points[diameter] = gain
    if not points:
        raise ConfigurationError("no diameter is stated", where=where, remedy=remedy)
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
        raise ConfigurationError("there is no model to combine", where="models")
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
    for name in wanted:
        if name not in used:
            raise ConfigurationError(
                f"there is no part and no model '{printable(name, 40)}'",
                where="gain",
                remedy=f"Parts and models are: {', '.join(sorted(used))}",
            )
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
            f"part {part.name} has a gain by diameter already",
            where=f"gain {model_name}",
            remedy="Take the model without gain, or leave the new gain out",
        )
    return replace(part, gain_by_diameter=gain.points, tool_gain=gain.tool_gain)


def _check_alike(models: Sequence[tuple[str, CompensationModel]]) -> None:
    first_name, first = models[0]
    for name, model in models[1:]:
        where = f"{first_name} and {name}"
        if model.reference != first.reference:
            raise ConfigurationError(
                "one model refers to its start, the other to stated temperatures",
                where=where,
                remedy="Identify both with the same reference",
            )
        if model.input_filter_s != first.input_filter_s:
            raise ConfigurationError(
                f"their inputs are filtered differently ({first.input_filter_s:g} s and"
                f" {model.input_filter_s:g} s)",
                where=where,
                remedy="Identify both with the same filter",
            )
        if model.reference == STATED:
            for channel, value in model.reference_c.items():
                if first.reference_c.get(channel, value) != value:
                    raise ConfigurationError(
                        f"they state different references of channel {printable(channel, 40)}",
                        where=where,
                        remedy="Identify both with the same reference",
                    )


def _check_parts(name: str, known: Output, parts: tuple[Part, ...]) -> None:
    for part in parts:
        for other in known.parts:
            if (part.plus, part.minus) == (other.plus, other.minus):
                raise ConfigurationError(
                    f"part {part.name} of output {known.name} has the same channels as part"
                    f" {other.name}: its heat would count twice",
                    where=name,
                    remedy="Estimate both in one call of identify, or leave one out",
                )
            if part.name == other.name:
                raise ConfigurationError(
                    f"two parts of output {known.name} are named {part.name}",
                    where=name,
                    remedy="Name the inputs differently when identifying",
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
