"""Join the logs of two recorders by time."""

import argparse
from pathlib import Path

from thermaxis import __version__
from thermaxis.cli._arguments import add_json, add_mapping, adder
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_csv_name, check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._thermal_logs import read_logs, reading_codes
from thermaxis.codes import printable
from thermaxis.files import write_thermal_log
from thermaxis.messages import sentence_of
from thermaxis.report.tables import Value
from thermaxis.thermal import merge_logs


def _common(text: str) -> tuple[str, str]:
    first, sign, second = text.partition("=")
    first, second = first.strip(), second.strip()
    if not first or (sign and not second):
        raise argparse.ArgumentTypeError(f"'{text}' is no CHANNEL or CHANNEL_OF_A=CHANNEL_OF_B")
    return first, second or first


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("first A", "log whose clock holds", Path)
    add("second B", "log of the other recorder", Path)
    add("-o, --output LOG.csv", "the joined log", Path, required=True)
    add(
        "--shift S",
        "seconds that are added to B's clock (default: found from channels in both logs; else"
        " the times of day)",
        float,
    )
    add(
        "--common CHANNEL[=CHANNEL]",
        "channels of A and B that measure the same, for the search of the shift; may be given"
        " more than once (default: channels of the same name)",
        _common,
        many=True,
    )
    add_json(parser)
    add_mapping(parser)


def run(arguments: argparse.Namespace) -> int:
    """Join and write."""
    output: Path = arguments.output
    check_csv_name(output)
    check_outputs(
        [("--output", output), ("--json", arguments.json)],
        [arguments.first, arguments.second, arguments.mapping],
    )
    with Progress() as progress:
        progress("reading", 0, 0)
        a, b = read_logs(
            [arguments.first, arguments.second], mapping=arguments.mapping, as_logged=True
        )
        progress("joining", 0, 0)
        joined = merge_logs(a.log, b.log, shift_s=arguments.shift, common=arguments.common)
        write_thermal_log(joined, output)
    described = [
        *(printable(sentence_of(remark), 400) for remark in joined.remarks),
        f"written: {output} ({joined.rows} rows, {len(joined.columns)} channels)",
        Value("version", __version__),
        Value("rows", joined.rows),
        Value("channels", list(joined.columns)),
        reading_codes([joined]),
    ]
    show(described, arguments.json)
    return 0
