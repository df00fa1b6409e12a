"""Ask the loop of a machine on this computer, as the user that it runs as.

`acknowledge` a fault, `disable`, `hold`, or say that a `datum` was set anew, so that what touches
have taught is forgotten; `resume` and `enable` where the configuration allows it
(`ask_enables`). Neither users nor the status server are needed. The answer comes with the loop's
next cycle; exit code 1 where it is refused.
"""

import argparse
import sys
from pathlib import Path

from thermaxis.cli._arguments import adder
from thermaxis.compensation import RequestKind
from thermaxis.messages import sentence_of
from thermaxis.runtime.config import state_file_of
from thermaxis.runtime.host import ASKED_HERE, ask_loop


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("configuration MACHINE.toml", "the machine whose loop is asked", Path)
    add("request REQUEST", "what is asked for", choices=[str(kind) for kind in ASKED_HERE])


def run(arguments: argparse.Namespace) -> int:
    """Ask, and show the answer."""
    answer = ask_loop(state_file_of(arguments.configuration), RequestKind(arguments.request))
    said = "accepted" if answer.accepted else "refused"
    sys.stdout.write(f"{arguments.request} {said}: {sentence_of(answer.message)}\n")
    return 0 if answer.accepted else 1
