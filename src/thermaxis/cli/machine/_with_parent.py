"""Run a command that ends with the program that started it, in whatever way that ends.

Whoever starts it gives it a pipe as standard input, and writes nothing.
"""

import os
import sys
import threading

from thermaxis.cli import main


def _end_with_parent() -> None:
    """Wait for the pipe's end; a thread, since the command may have its own ideas of signals."""
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_end_with_parent, daemon=True).start()
    raise SystemExit(main())
