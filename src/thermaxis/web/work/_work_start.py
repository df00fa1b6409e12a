"""Start another program within limits: run as a file of its own, before anything is imported.

Limits that are set here, in the new process, need no code between fork and exec of a server with
threads. It takes a JSON object and the words of the program as its arguments.
"""

import contextlib
import json
import os
import sys

_SIGKILL = 9
_PR_SET_PDEATHSIG = 1


def _set_limits(limits: dict[str, int]) -> None:
    """Set what the system keeps to: processor time, memory, size of a file, priority."""
    import resource  # noqa: PLC0415 - not on every system
    import signal  # noqa: PLC0415 - with it

    processor_s = limits["processor_s"]
    resource.setrlimit(resource.RLIMIT_CPU, (processor_s, processor_s + 1))
    resource.setrlimit(resource.RLIMIT_AS, (limits["memory_bytes"], limits["memory_bytes"]))
    resource.setrlimit(resource.RLIMIT_FSIZE, (limits["file_bytes"], limits["file_bytes"]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.nice(limits["nice"])
    signal.alarm(limits["alarm_s"])  # outlives exec: an end also where nobody waits any more


def _die_with_parent(parent: int) -> None:
    """Let the system end this process with the one that started it; Linux only."""
    import ctypes  # noqa: PLC0415 - on Linux only

    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, _SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(_SIGKILL)
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as score:  # noqa: PTH123 - no pathlib in so small a program
        score.write("1000")  # who lacks memory takes it from here first, not from the loop


def _main() -> None:
    limits: dict[str, int] = json.loads(sys.argv[1])
    if sys.platform == "linux":
        _die_with_parent(limits["parent"])
    _set_limits(limits)
    os.execv(sys.argv[2], sys.argv[2:])  # noqa: S606 - the words are a list of our own, no shell


if __name__ == "__main__":
    _main()
