"""Write a compensation model as a function block that does what `thermaxis run` does.

Quality rules, model, supervisor and limits are in it. DIR gets the library of fixed blocks, the
block of the model, test vectors, a commissioning guide and a report. Limits and rules are those of
--machine, or stated: nothing that acts has a default.
"""

import argparse
import sys
from pathlib import Path
from typing import cast

from thermaxis import plc
from thermaxis.cli._arguments import adder, positive_seconds
from thermaxis.cli._json import write_json
from thermaxis.cli.exchange._export_files import Export, export_of
from thermaxis.cli.exchange._export_folder import require_folder, write_folder
from thermaxis.cli.exchange._export_settings import (
    named_direction,
    named_number,
    named_range,
    named_witness,
)
from thermaxis.codes import printable
from thermaxis.plc import line_bounds, restart_warning


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("models MODEL", "compensation model (JSON)", Path, nargs="+")
    add(
        "--dialect",
        "scl: Siemens; st: IEC 61131-3; plcopen: the same as one XML file; c: C99; fmu:"
        " co-simulation units of FMI 3.0 and 2.0 with C sources; sinumerik-tempcomp: SCL for the"
        " temperature compensation of an axis, one offset, or a straight line through models at"
        " positions",
        choices=("scl", "st", "plcopen", "c", "fmu", "sinumerik-tempcomp"),
        required=True,
    )
    add(
        "--cycle-s S",
        "time from call to call, 0.1 to 60; in REAL a multiple of 1/128 s [s]",
        positive_seconds,
        required=True,
    )
    add(
        "-o, --output DIR",
        "folder: new, empty, or with an older export that was not changed; written whole or not"
        " at all",
        Path,
        required=True,
    )
    add(
        "--real",
        "bits of a number: 64 LREAL, 32 REAL (default: 64; 32 for --cpu s7-300)",
        choices=("32", "64"),
    )
    add(
        "--cpu",
        "of SCL: s7-1500 (also SINUMERIK ONE) or s7-300 (also 840D sl; REAL only) (default:"
        " s7-1500; s7-300 with --real 32)",
        choices=("s7-1500", "s7-300"),
    )
    add("--flavour", "of ST and PLCopen XML (default: iec)", choices=("iec", "twincat", "codesys"))
    add(
        "--name NAME",
        "of the block, behind tx_ (default: that of the model's file; with several models that"
        " of the first one's output, without _um)",
    )
    add(
        "--model-only",
        "model, limits and rate alone, without sensors, supervisor and requests, for a PLC that"
        " has its own",
        bool,
    )
    add("--condemned", "export it although its identification says: do not use it", bool)
    add(
        "--reference",
        "take the temperatures that the model states as its references, in place of those at"
        " the start (default: as the model says)",
        choices=("stated",),
    )
    add(
        "--machine MACHINE.toml",
        "take limits, sensor rules, supervisor and validity from there",
        Path,
    )
    for usage, text, kind in (
        ("--limit OUTPUT=UM", "largest magnitude of a correction [um]", named_number),
        ("--rate OUTPUT=UM_PER_S", "its largest change in a second [um/s]", named_number),
        ("--plausible CHANNEL=LOW:HIGH", "range that is believed [degC]", named_range),
    ):
        add(usage, f"{text}; without a name for all the others", kind, many=True)
    add(
        "--frozen-s CHANNEL=S",
        "longest time without any change, 0 for any; without a name for all the others (default:"
        " 14400) [s]",
        named_number,
        many=True,
    )
    add(
        "--moves-with CHANNEL=OTHER:K",
        "it may stand for six times as long while OTHER goes no further than K; both as"
        " `thermaxis channels` tells them from logs",
        named_witness,
        many=True,
    )
    add(
        "--at MM",
        "position of the axis, once for every MODEL in their order; --at OUTPUT=MM for"
        " outputs of one model [mm] (default: an offset, the same at every position)",
        named_number,
        many=True,
    )
    add(
        "--positive OUTPUT=away|towards",
        "where a positive motion of its axis moves the tool point, seen from the workpiece; without"
        " a name for all the others (default: must be stated for sinumerik-tempcomp)",
        named_direction,
        many=True,
    )
    add(
        "--reference-position MM",
        "reference position of the line (default: the mean of the positions) [mm]",
        float,
    )
    add("--json FILE|-", "write the report here too; - for standard output alone")


def run(arguments: argparse.Namespace) -> int:
    """Export and write."""
    folder: Path = arguments.output
    require_folder(folder)
    export = export_of(arguments)
    write_folder(folder, export.files)
    if arguments.json is not None:
        write_json(export.report, arguments.json)
    if arguments.json != "-":
        sys.stdout.write(_summary(export, folder))
    return 0


def _summary(export: Export, folder: Path) -> str:
    settings = export.settings
    model = settings.compensation.model
    layout = model.layout
    numbers = "LREAL" if settings.double else "REAL"
    lines = [
        (
            f"{settings.names.block}: {len(model.outputs)} output(s), {len(layout.parts)} part(s),"
            f" {len(layout.taus_s)} section(s), {len(model.channels)} temperature(s);"
            f" every {settings.cycle_s:g} s in {numbers}"
        )
    ]
    all_bounds = settings.compensation.bounds
    for output, bounds, step_um in zip(model.outputs, all_bounds, settings.steps_um, strict=True):
        lines.append(
            f"  {printable(output.name, 40)}: at most {bounds.total_um:g} µm and"
            f" {bounds.largest_rate_um_per_s:g} µm/s, at most {step_um:.6g} µm in one call"
        )
    if export.line is not None:
        k0_mm, slope = line_bounds(settings, export.line)
        lines.append(
            f"  line: K0 at {export.line.origin_mm:g} mm at most {k0_mm} mm,"
            f" slope at most {slope} mm/mm"
        )
    restart = restart_warning(settings)
    warned = [plc.remark_of(one) for one in (restart, *export.remarks) if one is not None]
    lines += [f"changed: {plc.remark_of(note)}" for note in settings.notes]
    lines += [f"warning: {printable(text, 400)}" for text in (*model.warnings, *warned)]
    lines += [f"written: {printable(str(folder / name))}" for name in export.files]
    lines.append(f"not checked: {'; '.join(cast('list[str]', export.report['not_checked']))}")
    return "\n".join(lines) + "\n"
