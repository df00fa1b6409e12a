#!/usr/bin/python3
"""What an operator does: switch on, home, run the program, wait for its end.

LinuxCNC starts this file as its display and lives exactly as long as it does. What was seen goes
into ``result.json``; the end of this file is the clean end of LinuxCNC.
"""

import json
import os
import time
from pathlib import Path

import linuxcnc
from panel import LONGEST_S, Operator, RefusedError

SETTLE_S = 0.2


def run(operator: Operator, program: Path, limit_s: float) -> None:
    """Run a program to its end."""
    status, command, idle = operator.status, operator.command, linuxcnc.INTERP_IDLE
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete(LONGEST_S)
    command.program_open(str(program))
    command.wait_complete(LONGEST_S)
    command.auto(linuxcnc.AUTO_RUN, 0)
    operator.wait("start of the program", lambda: status.interp_state != idle)
    operator.wait("end of the program", lambda: status.interp_state == idle, limit_s)
    operator.wait("standstill", lambda: status.inpos)


def main() -> None:
    """Do the job."""
    job = json.loads(Path("job.json").read_text(encoding="ascii"))
    failure = ""
    linuxcnc.nmlfile = str(Path("machine.nml").resolve())
    operator = Operator(heeds_messages=job["heeds_messages"])
    try:
        operator.switch_on()
        operator.home()
        run(operator, Path("program.ngc").resolve(), job["limit_s"])
        time.sleep(SETTLE_S)  # the virtual axis reads on until the last servo period
    except (RefusedError, linuxcnc.error) as error:
        failure = str(error)
    operator.status.poll()
    result = {
        "failure": failure,
        "said": operator.said,
        "user": os.getuid(),
        "outputs": operator.status.aout[:2],
    }
    Path("result.json").write_text(json.dumps(result), encoding="ascii")


if __name__ == "__main__":
    main()
