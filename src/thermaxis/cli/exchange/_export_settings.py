"""What ``thermaxis export`` exports: models with rules and limits of a machine, or stated ones."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeVar

from thermaxis.cli._arguments import number, refuse_both, refuse_foreign
from thermaxis.codes import Message
from thermaxis.compensation import (
    STATED,
    Compensation,
    CompensationModel,
    Limits,
    Output,
    Provenance,
    SensorRules,
    SupervisorRules,
)
from thermaxis.errors import ConfigurationError, require_unique
from thermaxis.files import model_sha256, read_model
from thermaxis.plc import at_position, require_apart
from thermaxis.runtime import MachineConfiguration, read_machine

_Value = TypeVar("_Value")
_Named = tuple[str, _Value]


class ModelSource(NamedTuple):
    """A model and where it was read."""

    name: str
    """Name of the file, without its folder."""
    sha256: str
    """Hash of the model's content."""
    model: CompensationModel


class Exported(NamedTuple):
    """What is exported, before it is at a PLC's cycle."""

    sources: tuple[ModelSource, ...]
    """Models that were read, in their order."""
    compensation: Compensation
    model_sha256: str
    """Hash of the model that is exported."""
    positions_mm: tuple[float, ...]
    """Position by output; empty where there is no line. [mm]"""
    away: tuple[bool, ...]
    """By output, whether a positive motion of its axis moves the tool point away from the
    workpiece; empty where it is not asked."""
    machine: str
    """Name of the machine whose rules these are; empty where they were stated."""
    changed: tuple[Message, ...] = ()
    """What was changed in the models."""
    warnings: tuple[Message, ...] = ()
    """What in the machine's configuration does not fit the export, in words that may stand in a
    remark."""


# ---- words of the command line ------------------------------------------------------------------


_finite = number("number", -1e300, 1e300)


def named_number(text: str) -> _Named[float]:
    """Return a number with or without a name before it: ``Z_um=100``."""
    name, _, value = text.rpartition("=")
    return name, _finite(value)


def named_range(text: str) -> _Named[tuple[float, float]]:
    """Return a range with or without a name before it: ``T_spindle_C=5:80``."""
    name, _, ends = text.rpartition("=")
    lowest, colon, highest = ends.partition(":")
    if not colon:
        raise argparse.ArgumentTypeError(f"'{text}' is no range; write 5:80")
    return name, (_finite(lowest), _finite(highest))


def named_witness(text: str) -> _Named[tuple[str, float]]:
    """Return a channel, the one that it moves with, and how far: ``T_column_C=T_air_C:0.5``."""
    name, _, value = text.rpartition("=")
    other, _, rests_k = value.rpartition(":")
    if not (name and other):
        raise argparse.ArgumentTypeError(f"'{text}' is none; write T_column_C=T_air_C:0.5")
    return name, (other, _finite(rests_k))


def named_direction(text: str) -> _Named[bool]:
    """Return a direction with or without a name before it: ``Z_um=away``."""
    name, _, word = text.rpartition("=")
    if word not in {"away", "towards"}:
        raise argparse.ArgumentTypeError(f"'{word}' is no direction; write away or towards")
    return name, word == "away"


# ---- models -------------------------------------------------------------------------------------


def read_sources(paths: Sequence[Path]) -> tuple[ModelSource, ...]:
    """Read models."""
    models = [(path.name, read_model(path)) for path in paths]
    return tuple(ModelSource(name, model_sha256(model), model) for name, model in models)


def _with_stated_references(source: ModelSource) -> ModelSource:
    """Return a model that refers to its stated temperatures, in place of those at its start."""
    model = source.model
    lacking = [channel for channel in model.channels if channel not in model.reference_c]
    if lacking:
        raise ConfigurationError(
            "no_stated_reference", file=source.name, key="--reference", channels=", ".join(lacking)
        )
    return source._replace(model=replace(model, reference=STATED))


def _at_positions(
    sources: tuple[ModelSource, ...], stated: Sequence[_Named[float]]
) -> tuple[CompensationModel, tuple[float, ...], tuple[str, ...]]:
    """Return one model with an output for every position, the positions, and the models' names."""
    outputs = _placed_outputs(sources, stated)
    positions_mm = tuple(position_mm for _, position_mm in outputs)
    require_apart(positions_mm)
    first = sources[0].model
    for source in sources:
        begins = (source.model.reference, source.model.input_filter_s)
        if begins != (first.reference, first.input_filter_s):
            raise ConfigurationError(
                "models_begin_differently",
                file=source.name,
                reference=source.model.reference,
                filter_s=source.model.input_filter_s,
                first_reference=first.reference,
                first_filter_s=first.input_filter_s,
            )
    model = replace(
        first,
        outputs=tuple(replace(output, name=at_position(at_mm)) for output, at_mm in outputs),
        reference_c=_common_reference(sources),
        longest_gap_s=min(source.model.longest_gap_s for source in sources),
        longest_hold_s=min(source.model.longest_hold_s for source in sources),
        provenance=_common_provenance(sources),
        warnings=tuple(dict.fromkeys(w for source in sources for w in source.model.warnings)),
    )
    return model, positions_mm, tuple(output.name for output, _ in outputs)


def _placed_outputs(
    sources: tuple[ModelSource, ...], stated: Sequence[_Named[float]]
) -> list[tuple[Output, float]]:
    """Return outputs with their positions, in the order in which they were stated."""
    if len(sources) > 1:
        if any(name for name, _ in stated) or len(stated) != len(sources):
            raise ConfigurationError(
                "models_and_positions_differ",
                key="--at",
                models=len(sources),
                positions=len(stated),
            )
        for source in sources:
            if len(source.model.outputs) != 1:
                raise ConfigurationError(
                    "model_has_several_outputs", file=source.name, outputs=len(source.model.outputs)
                )
        pairs = zip(sources, stated, strict=True)
        return [(source.model.outputs[0], at_mm) for source, (_, at_mm) in pairs]
    known = {output.name: output for source in sources for output in source.model.outputs}
    positions = dict(stated)
    if len(positions) != len(stated) or set(positions) - set(known) or len(positions) < 2:
        raise ConfigurationError("line_needs_two_positions", key="--at", known=", ".join(known))
    return [(known[name], at_mm) for name, at_mm in positions.items()]


def _common_reference(sources: tuple[ModelSource, ...]) -> dict[str, float]:
    reference_c: dict[str, float] = {}
    for source in sources:
        for channel, value_c in source.model.reference_c.items():
            if source.model.reference == STATED and reference_c.get(channel, value_c) != value_c:
                raise ConfigurationError(
                    "reference_temperatures_differ",
                    file=source.name,
                    channel=channel,
                    value_c=value_c,
                    other_c=reference_c[channel],
                )
            reference_c.setdefault(channel, value_c)
    return reference_c


def _common_provenance(sources: tuple[ModelSource, ...]) -> Provenance:
    if len(sources) == 1:
        return sources[0].model.provenance
    origins = [source.model.provenance for source in sources]
    dates = sorted({origin.date for origin in origins if origin.date})
    return Provenance(
        method="models at positions: "
        + ", ".join(f"{source.name} {source.sha256[:12]}" for source in sources),
        program=origins[0].program,
        date=" ".join(dates),
        logs=tuple(dict.fromkeys(log for origin in origins for log in origin.logs)),
    )


# ---- rules and limits ---------------------------------------------------------------------------


def exported_of(arguments: argparse.Namespace, *, tempcomp: bool) -> Exported:
    """Return what the words of the command line ask for."""
    read = sources = read_sources(arguments.models)
    changed: tuple[Message, ...] = ()
    if arguments.reference is not None:
        sources = tuple(_with_stated_references(source) for source in read)
        if any(a.model != b.model for a, b in zip(read, sources, strict=True)):
            changed = (Message("change-references_stated"),)
    positions: tuple[float, ...] = ()
    # One position makes no line: an offset is the same at every position.
    if tempcomp and max(len(sources), len(arguments.at)) > 1:
        model, positions, origins = _at_positions(sources, arguments.at)
    else:
        source, *others = sources
        if others:
            raise ConfigurationError("block_has_one_model", key="MODEL", models=len(sources))
        refuse_foreign(arguments, "a line through positions", "--reference-position")
        if not tempcomp:
            refuse_foreign(arguments, "--dialect sinumerik-tempcomp", "--at", "--positive")
        model = source.model
        origins = tuple(output.name for output in model.outputs)
        if arguments.at:
            _by_name(arguments.at, origins, "--at", "OUTPUT=MM", "Z_um=100")
    away: tuple[bool, ...] = ()
    if tempcomp:
        if not arguments.positive or (positions and any(name for name, _ in arguments.positive)):
            raise ConfigurationError("direction_not_stated", key="--positive")
        form = "OUTPUT=away|towards"
        stated = _by_name(arguments.positive, origins, "--positive", form, "Z_um=away")
        away = tuple(stated[origin] for origin in origins)
    machine, warnings = "", tuple[Message, ...]()
    if arguments.machine is not None:
        for option in ("--limit", "--rate", "--plausible", "--frozen-s", "--moves-with"):
            refuse_both(arguments, option, "--machine")
        compensation, configuration = _of_machine(arguments.machine, model, origins)
        machine = configuration.name
        warnings = tuple(_machine_warnings(configuration, read, arguments.cycle_s))
    else:
        compensation = _stated(model, origins, arguments)
    digest = read[0].sha256 if model == read[0].model else model_sha256(model)
    return Exported(sources, compensation, digest, positions, away, machine, changed, warnings)


def _of_machine(
    path: Path, model: CompensationModel, origins: tuple[str, ...]
) -> tuple[Compensation, MachineConfiguration]:
    configuration = read_machine(path)
    rules = configuration.rules
    outputs = tuple(output.name for output in model.outputs)
    if outputs == origins:
        return rules.applied_to(model), configuration
    lacking = sorted(set(origins) - set(rules.limits))
    if lacking:
        raise ConfigurationError(
            "no_limits_of_output",
            file=path,
            outputs=", ".join(lacking),
            known=", ".join(rules.limits),
        )
    limits = {name: rules.limits[origin] for name, origin in zip(outputs, origins, strict=True)}
    return replace(rules, limits=limits, touches={}).applied_to(model), configuration


def _machine_warnings(
    configuration: MachineConfiguration, sources: tuple[ModelSource, ...], cycle_s: float
) -> Iterator[Message]:
    """Yield what was set up for another model or another cycle than the exported ones."""
    own_s = configuration.rules.cycle_s
    if own_s != cycle_s:
        values = {"cycle_s": cycle_s, "machine_cycle_s": own_s}
        times = float(f"{cycle_s / own_s:.3g}")
        yield Message("warning-cycle_of_machine", {**values, "times": times})
    model = configuration.model
    if any(source.sha256 != model.sha256 for source in sources):
        exported = tuple(_with_hash(source.name, source.sha256) for source in sources)
        own = _with_hash(model.path.name, model.sha256)
        yield Message("warning-model_of_machine", {"model": own, "exported": exported})


def _with_hash(name: str, sha256: str) -> Message:
    return Message("text-model_with_hash", {"name": name, "sha256": sha256[:12]})


def _stated(
    model: CompensationModel, origins: tuple[str, ...], arguments: argparse.Namespace
) -> Compensation:
    outputs = tuple(output.name for output in model.outputs)
    largest = _by_name(arguments.limit, origins, "--limit", "OUTPUT=UM", "Z_um=100")
    rates = _by_name(arguments.rate, origins, "--rate", "OUTPUT=UM_PER_S", "Z_um=0.5")
    witness = _only(arguments.moves_with, model.channels, "--moves-with")
    channels = (*model.channels, *(other for other, _ in witness.values()))
    form = "CHANNEL=LOW:HIGH"
    ranges = _by_name(arguments.plausible, channels, "--plausible", form, "5:80")
    frozen_s = _only(arguments.frozen_s, channels, "--frozen-s")
    sensors: dict[str, SensorRules] = {}
    for channel, (lowest_c, highest_c) in ranges.items():
        other, rests_k = witness.get(channel, ("", 0.0))
        rules = SensorRules(
            lowest_c=lowest_c, highest_c=highest_c, moves_with=other, rests_k=rests_k
        )
        longest_s = frozen_s.get(channel, frozen_s.get("", rules.frozen_s))
        sensors[channel] = replace(rules, frozen_s=longest_s)
    return Compensation(
        model=model,
        sensors=sensors,
        limits={
            name: Limits(largest[origin], rates[origin])
            for name, origin in zip(outputs, origins, strict=True)
        },
        supervisor=SupervisorRules(),
    )


def _by_name(
    stated: Sequence[_Named[_Value]], wanted: tuple[str, ...], option: str, form: str, example: str
) -> Mapping[str, _Value]:
    """Return what was stated of every name; one without a name counts for all the others."""
    found = _only(stated, wanted, option)
    lacking = [name for name in wanted if name not in found and "" not in found]
    if lacking:
        raise ConfigurationError(
            "not_stated_for",
            key=option,
            names=", ".join(lacking),
            option=option,
            form=form,
            example=example,
        )
    return {name: found[name] if name in found else found[""] for name in wanted}


def _only(
    stated: Sequence[_Named[_Value]], known: Sequence[str], option: str
) -> Mapping[str, _Value]:
    """Return what was stated by name, of known names alone."""
    found = dict(stated)
    require_unique(option, [name or option for name, _ in stated])
    foreign = [name for name in found if name and name not in known]
    if foreign:
        raise ConfigurationError(
            "unknown_name",
            key=option,
            name=", ".join(foreign),
            known=", ".join(dict.fromkeys(known)),
        )
    return found
