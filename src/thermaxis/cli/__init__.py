"""The command ``thermaxis``: one module per command, each imported when it is needed."""

import argparse
import os
import re
import sys
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import PurePath
from typing import NoReturn, Protocol, cast

from thermaxis import __version__
from thermaxis.codes import message_as_json
from thermaxis.errors import ThermaxisError

GROUPS = {
    "axis": {
        "app": "open a page in the browser on which measured files are dropped",
        "evaluate": "evaluate a positioning run: ISO 230-2 and adjacent differences",
        "plan": "choose the targets of a run, its duration and the uncertainty to expect",
        "program": "write the NC program of a plan for a control",
        "correct": "write the compensation table of a measured axis for a control",
        "check-table": "read a control's compensation table back and show what it leaves",
        "trend": "show the figures of one axis over several runs",
        "field": "compare thermal fields of a table before and after a run",
        "montecarlo": "scatter of differences by Monte Carlo, equation (10) of the method",
        "generate": "write an example run of a virtual machine",
    },
    "thermal": {
        "channels": "show what is in logs, and which sensor is doubtful",
        "identify": "identify a compensation model from thermal logs",
        "verify": "compare a compensation model in free run with measured logs",
        "simulate": "run a compensation model along a log",
        "compare": "compare several compensation models on one log",
        "combine": "superpose compensation models, with a gain by workpiece diameter",
        "merge": "join the logs of two recorders by time",
        "thermal-test": "plan a thermal test, or evaluate one of the four of ISO 230-3",
    },
    "machine": {
        "demo": "try loop and pages at a virtual lathe that can be broken: one command, no file",
        "machine": "run a virtual machine: an OPC UA server, or a log",
        "record": "record nodes of OPC UA servers into logs that identify reads",
        "machine-file": "write the beginning of a machine.toml from what a server shows",
        "check": "check the configuration of a machine, and the machine itself",
        "commission": "prove sign and size of an offset on the machine",
        "rehearse": "let a configuration compensate the virtual lathe, hours in seconds",
        "run": "compensate a machine: the loop",
        "ask": "acknowledge, disable or hold the loop of a machine on this computer",
        "screen": "serve the operator's and the engineer's pages of a running loop",
        "relearn": "propose a better model where the newest touches of a machine show one",
        "history": "export, list, check or ship what the loop has recorded",
        "user": "add, remove or list the users of the status server",
        "certificate": "make, show or fetch certificates for OPC UA",
        "hal": "write the part of a LinuxCNC machine's HAL file that applies the offsets",
    },
    "fleet": {
        "fleet": "verify the models of many machines every night, from what they ship",
    },
    "exchange": {
        "convert": "write any measured run as tidy CSV",
        "export": "write a compensation model as a function block for a PLC",
        "vectors": "write test vectors, against which other programs are held",
        "doctor": "print what a bug report needs",
    },
}
"""Commands with their summaries, by the folder they stand in, in the order of the work."""
COMMANDS = {name: summary for group in GROUPS.values() for name, summary in group.items()}
"""Summary of every command."""
TITLES = {
    "axis": "measure an axis",
    "thermal": "identify thermal models",
    "machine": "at the machine",
    "fleet": "many machines",
    "exchange": "exchange with other programs",
}


_EXTRAS = {
    "argon2": "machine",
    "asyncua": "machine",
    "cryptography": "machine",
    "fsspec": "machine",
    "prometheus_client": "machine",
    "sqlalchemy": "machine",
    "websockets": "machine",
    "dask": "fleet",
    "distributed": "fleet",
    "psycopg": "postgresql",
}


class Command(Protocol):
    """What every command module offers; its docstring is the description in ``--help``."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare the command's arguments."""
        ...

    def run(self, arguments: argparse.Namespace) -> int:
        """Run the command and return the exit code."""
        ...


def _load(name: str) -> Command:
    group = next(group for group, commands in GROUPS.items() if name in commands)
    module = import_module(f"thermaxis.cli.{group}.{name.replace('-', '_')}")
    return cast("Command", cast("object", module))


_NEGATIVE_WORD = re.compile(r"-\.?\d")


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line: the usage of a command may take thirty."""

    def parse_known_args(  # pyright: ignore[reportIncompatibleMethodOverride] - one of its overloads
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Refuse what is unknown here, where the help is the command's own."""
        # argparse takes -10:510 and -3h for options unless they count as negative numbers
        self._negative_number_matcher = _NEGATIVE_WORD
        found, unknown = super().parse_known_args(args, namespace or argparse.Namespace())
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found, unknown

    def error(self, message: str) -> NoReturn:
        """Write the error and leave."""
        self.exit(2, f"{self.prog}: error: {message} (see {self.prog} --help)\n")


def build_parser(
    names: Iterable[str] = tuple(COMMANDS), *, whole: bool = True
) -> argparse.ArgumentParser:
    """Return the parser of the command line for some commands, whole with their arguments."""
    parser = _Parser(
        prog="thermaxis",
        description="Measure machine axes without thermal drift, and compensate thermal errors.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"thermaxis {__version__}")
    # argparse shows sub-commands as one list; their groups are shown by the epilog.
    parser.usage = "thermaxis [-h] [--version] COMMAND ..."
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = "\n\n".join(
        "\n".join([f"{TITLES[group]}:", *(f"  {n:<12} {s}" for n, s in commands.items())])
        for group, commands in GROUPS.items()
    )
    commands = parser.add_subparsers(
        dest="command", metavar="COMMAND", prog="thermaxis", help=argparse.SUPPRESS
    )
    for name in names:
        command = commands.add_parser(name, help=COMMANDS[name], allow_abbrev=False)
        if whole:
            module = _load(name)
            command.description = module.__doc__
            module.add_arguments(command)
    return parser


def _write_as_utf8() -> None:
    """Let µ and ↑ reach any terminal or pipe; what a terminal cannot show is replaced."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None and (getattr(stream, "encoding", "") or "").lower() != "utf-8":
            reconfigure(encoding="utf-8", errors="replace")


def _refuse(why: str) -> int:
    sys.stderr.write(f"thermaxis: error: {why}\n")
    return 2


def _pipe_was_closed() -> int:
    """Stop quietly when the reader of the output has gone, as `head` does."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _lacking(error: ModuleNotFoundError, words: Sequence[str]) -> str:
    """Return what to install; a module of our own that is missing is no matter of the user's."""
    extra = _EXTRAS.get((error.name or "").partition(".")[0])
    if extra is None:
        raise error
    if extra == "machine" and not GROUPS["fleet"].keys().isdisjoint(words[:1]):
        extra = "fleet"  # has the packages of the other, too
    wanted = f"pip install 'thermaxis[{extra}]'"
    return f"this command needs the package {error.name}. Install it: {wanted}."


def execute(words: Sequence[str]) -> int:
    """Run a command and return its exit code; what is wrong is raised as an error."""
    wanted = next((word for word in words if not word.startswith("-")), "")
    known = wanted in COMMANDS
    offered = COMMANDS if set(words) - {"-h", "--help", "--version"} else ()
    parser = build_parser((wanted,) if known else offered, whole=known)
    namespace = parser.parse_args(words)
    if namespace.command is None:
        parser.print_help()
        return 0
    _write_as_utf8()
    try:
        return _load(namespace.command).run(namespace)
    except ThermaxisError as error:
        named = _as_given(error, words)
        if getattr(namespace, "json", None) == "-":  # where a result alone was asked for
            _write_error(named)
        raise named from error.__cause__


def _as_given(error: ThermaxisError, words: Sequence[str]) -> ThermaxisError:
    """Return the error with its file as it was given: a log is known by its name without ending."""
    file = error.place.file
    given = [word for word in words if file and PurePath(word).stem == file]
    return error.at(error.place._replace(file=given[0])) if len(given) == 1 else error


def _write_error(error: ThermaxisError) -> None:
    """Write an error as JSON: code, values, place, and the sentence for people."""
    import json  # noqa: PLC0415 - most starts need none

    said = message_as_json(error.message) | {"code": error.code, "text": str(error)}
    sys.stdout.write(json.dumps({"error": said}, indent=2, allow_nan=False) + "\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    The matrices are small: threads of the linear algebra would only wait for each other, on a busy
    computer ten times as long as the work takes.
    """
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        return execute(words)
    except ThermaxisError as error:
        return _refuse(str(error))
    except ModuleNotFoundError as error:
        return _refuse(_lacking(error, words))
    except BrokenPipeError:
        return _pipe_was_closed()
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        return _refuse(f"{place}{error.strerror or error}. Check the name and the permissions.")
    except KeyboardInterrupt:
        return 130
