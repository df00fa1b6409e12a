"""The files of an export: library, block, test vectors, guide and report, as text."""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import replace
from hashlib import sha256
from typing import NamedTuple, cast, final

from thermaxis import plc
from thermaxis.cli._arguments import refuse_foreign
from thermaxis.cli.exchange._export_places import typed_place
from thermaxis.cli.exchange._export_settings import Exported, exported_of
from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.plc import remark_text, setting_warnings
from thermaxis.plc.guide import LARGEST_S7_300_BYTES, REPORT_ENDING, TEMPCOMP, instance_bytes

_C = {"c", "fmu"}
_SCL = {"scl", TEMPCOMP}
_ST = {"st", "plcopen"}


@final
class Export(NamedTuple):
    """An export before it is written."""

    settings: plc.PlcSettings
    line: plc.LineSettings | None
    """The line; None where there is none."""
    files: Mapping[str, bytes]
    """Content by name; the report is the last."""
    report: Mapping[str, object]
    remarks: tuple[Message, ...]
    """What the user must know besides the model's warnings."""


def export_of(arguments: argparse.Namespace) -> Export:
    """Return what ``thermaxis export`` writes."""
    try:
        return _export_of(arguments)
    except ConfigurationError as error:
        raise error.at(typed_place(error.place, arguments)) from error


def _export_of(arguments: argparse.Namespace) -> Export:
    target, double = target_of(arguments)
    exported = exported_of(arguments, tempcomp=target.dialect == TEMPCOMP)
    condemned = exported.compensation.model.provenance.condemned
    if condemned and not arguments.condemned:
        raise ConfigurationError("condemned", outputs=condemned)
    line = _line_of(arguments, exported) if exported.positions_mm else None
    compensation = exported.compensation
    if arguments.model_only:
        compensation = replace(compensation, touches={})
    settings = plc.export_settings(
        compensation,
        cycle_s=arguments.cycle_s,
        name=_name_of(arguments, exported, line),
        double=double,
        model_sha256=exported.model_sha256,
    )
    settings = replace(settings, notes=(*exported.changed, *settings.notes))
    model_only: bool = arguments.model_only
    if model_only:
        refuse_foreign(arguments, "a block with sensors' rules", "--frozen-s", "--moves-with")
    if exported.away:
        refuse_foreign(arguments, "every dialect but sinumerik-tempcomp", "--model-only")
    # Whatever the library cannot carry is refused before the vectors are made, which take long.
    block = plc.Block(settings=settings, line=line, model_only=model_only)
    tested = None if model_only else plc.vectors_of(settings, line)
    stem = settings.names.block
    told: list[str] = []
    if exported.machine:
        told.append(f"Rules and limits of the machine {remark_text(exported.machine)}")
    told += [f"Warning: {plc.remark_of(one)}." for one in exported.warnings]
    if tested is not None:
        told.append(f"Test vectors: {stem}.vectors.csv, SHA-256")
        told.append(f"  {sha256(tested.text.encode('utf-8')).hexdigest()}")
    block = replace(block, remarks=tuple(told))
    # A unit has no self-test: no scan of a PLC calls it.
    tests = tested is not None and target.dialect != "fmu"
    self_test = plc.self_test_of(block) if tests else None
    files = program_files(block, target, self_test)
    vectors, interlocks = f"{stem}.vectors.csv", exported.compensation.interlocks
    away = () if line is not None else exported.away
    facts = plc.GuideFacts(
        target, tuple(files), vectors, interlocks, line, away, exported.warnings, self_test
    )
    if tested is not None:
        files[vectors] = tested.text.encode("ascii")
    files[f"{stem}.guide.md"] = plc.guide_text(settings, block, facts).encode("utf-8")
    sources = tuple((source.name, source.sha256) for source in exported.sources)
    size = None if target.dialect in _C else instance_bytes(block.st().values())
    facts_of = plc.ReportFacts(
        target, sources, line, tested, size, exported.machine, exported.warnings
    )
    report = plc.report_of(settings, facts_of, files)
    files[stem + REPORT_ENDING] = plc.report_text(report).encode("ascii")
    return Export(
        settings,
        line,
        files,
        report,
        (
            *setting_warnings(settings),
            *exported.warnings,
            *_remarks(exported, target, size, arguments),
        ),
    )


def target_of(arguments: argparse.Namespace) -> tuple[plc.Target, bool]:
    """Return who gets the program, and whether its numbers are LREAL."""
    dialect: str = arguments.dialect
    cpu: str | None = arguments.cpu
    flavour: str | None = arguments.flavour
    if dialect not in _SCL:
        refuse_foreign(arguments, "SCL", "--cpu")
    if dialect not in _ST:
        refuse_foreign(arguments, "ST", "--flavour")
    if dialect in _SCL:
        if cpu == "s7-300" and arguments.real == "64":
            raise ConfigurationError("no_lreal_in_cpu", key="--real")
        double = arguments.real != "32" if cpu != "s7-300" else False
        return plc.Target(dialect, cpu or ("s7-1500" if double else "s7-300")), double
    variant = (flavour or "iec") if dialect in _ST else dialect
    return plc.Target(dialect, "" if variant == "c" else variant), arguments.real != "32"


def program_files(
    block: plc.Block, target: plc.Target, self_test: plc.SelfTest | None = None
) -> dict[str, bytes]:
    """Return library, block and self-test as the files of a target."""
    if target.dialect == "fmu":
        return plc.fmu_files(block)
    flavour, cpu = cast("plc.StFlavour", target.variant), cast("plc.SclCpu", target.variant)
    texts: dict[str, str] = {}
    for part in (block, *([self_test] if self_test else [])):
        if target.dialect == "c":
            texts |= part.c()
        elif target.dialect in _ST:
            texts |= part.st("iec" if target.dialect == "plcopen" else flavour)
        else:
            texts |= part.scl(cpu)
    if target.dialect == "plcopen":
        texts = {f"{block.name}.xml": plc.plcopen_xml(texts.values(), block.name, flavour)}
    if target.dialect == TEMPCOMP and block.line is None:
        double = block.settings.double
        texts[f"{plc.SINUMERIK}.scl"] = plc.sinumerik_library(double=double, cpu=cpu)
    return {name: text.encode("ascii") for name, text in texts.items()}


def _line_of(arguments: argparse.Namespace, exported: Exported) -> plc.LineSettings:
    return plc.LineSettings(
        positions_mm=exported.positions_mm,
        away=exported.away[0],
        reference_mm=arguments.reference_position,
    )


def _name_of(
    arguments: argparse.Namespace, exported: Exported, line: plc.LineSettings | None
) -> str:
    if arguments.name is not None:
        return str(arguments.name)
    first = exported.sources[0]
    if line is not None and len(exported.sources) > 1:
        return first.model.outputs[0].name.removesuffix("_um")
    return first.name.removesuffix(".json")


def _remarks(
    exported: Exported, target: plc.Target, size: int | None, arguments: argparse.Namespace
) -> Iterator[Message]:
    asked = arguments.machine or arguments.frozen_s or arguments.moves_with
    if not (asked or arguments.model_only):
        hours = exported.compensation.rules[0].frozen_s / 3600.0
        yield Message("remark-frozen_by_default", {"hours": hours})
    if target.variant == "s7-300" and size and size > LARGEST_S7_300_BYTES:
        yield Message("remark-large_instance", {"size": size})
    if exported.compensation.redundant:
        yield Message("remark-no_redundant_in_block")
    if len(exported.compensation.interlocks) > 1:
        yield Message("remark-one_interlock", {"interlocks": exported.compensation.interlocks})
