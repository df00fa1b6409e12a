"""Write the part of a LinuxCNC machine's HAL file that applies the offsets of a configuration.

They are added below the motion controller; clamp, rate and watchdog are those of the configuration,
which names LinuxCNC as its sink. What else the machine's HAL file needs stands at the head of the
result.
"""

import argparse
import sys
from pathlib import Path

from thermaxis.cli._arguments import adder
from thermaxis.cli._outputs import check_outputs, check_table_name, write_ascii
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import read_machine
from thermaxis.runtime.sinks import LinuxCncSettings, hal_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("configuration MACHINE.toml", "configuration of the machine", Path)
    add("-o, --output FILE", "write the lines to this file (default: to standard output)")


def run(arguments: argparse.Namespace) -> int:
    """Write the lines."""
    path: Path = arguments.configuration
    output: str | None = arguments.output
    if output is not None:
        check_table_name(output)
        check_outputs([("-o", output)], [path])
    settings = read_machine(path).sink.linuxcnc
    if settings is None:
        raise ConfigurationError("sink_not_linuxcnc", file=path, key="sink.kind")
    if output is None:
        sys.stdout.write(hal_text(settings))
        return 0
    write_ascii(output, hal_text(settings, Path(output).name))
    sys.stdout.write(_summary(settings, output))
    return 0


def _summary(settings: LinuxCncSettings, output: str) -> str:
    lines = [f"{output}: {len(settings.outputs)} offset(s)"]
    for name, one in settings.outputs.items():
        lines.append(
            f"  {name}: joint {one.joint}, at most {one.limits.total_um:g} µm and"
            f" {one.limits.largest_rate_um_per_s:g} µm/s; {one.sign}"
        )
    lines += [
        f"  without a write for {settings.watchdog_s:g} s the machine takes the offsets back",
        "Two changes in the machine's own HAL file stand at the head of it.",
    ]
    return "\n".join(lines) + "\n"
