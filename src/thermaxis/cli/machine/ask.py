"""Ask the loop of a machine on this computer, as the user that it runs as.

`acknowledge` a fault, `disable`, `hold`, take a `touch` that was read by hand, or say that a
`datum` was set anew, so that what touches have taught is forgotten; `resume` and `enable` where the
configuration allows it (`ask_enables`). Neither users nor the status server are needed. The answer
comes with the loop's next cycle; exit code 1 where it is refused.
"""

import argparse
import sys
from pathlib import Path

from thermaxis.cli._arguments import adder, number, positive_seconds, refuse_foreign
from thermaxis.compensation import LARGEST_LIMIT_UM, RequestKind
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence_of
from thermaxis.runtime.config import state_file_of
from thermaxis.runtime.host import ASKED_HERE, ask_loop


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("configuration MACHINE.toml", "the machine whose loop is asked", Path)
    add("request REQUEST", "what is asked for", choices=[str(kind) for kind in ASKED_HERE])
    add("--output NAME", "output that was touched")
    micrometres = number("displacement", -LARGEST_LIMIT_UM, LARGEST_LIMIT_UM)
    add("--um U", "what the touch showed, in um, positive away from the workpiece", micrometres)
    add("--age TIME", "time since the touch (default: none)", positive_seconds)


def run(arguments: argparse.Namespace) -> int:
    """Ask, and show the answer."""
    kind, touch = RequestKind(arguments.request), None
    if kind is not RequestKind.TOUCH:
        refuse_foreign(arguments, "touch", "--output", "--um", "--age")
    elif arguments.output is None or arguments.um is None:
        needed = "--output, --um"
        raise ConfigurationError("option_needs", option="touch", needed=needed, file="touch")
    else:
        touch = (arguments.output, arguments.um, arguments.age or 0.0)
    answer = ask_loop(state_file_of(arguments.configuration), kind, touch)
    said = "accepted" if answer.accepted else "refused"
    sys.stdout.write(f"{arguments.request} {said}: {sentence_of(answer.message)}\n")
    return 0 if answer.accepted else 1
