"""Commands that pages ask for, run in this process: that they have one of their own, others say."""

import contextlib
import io
import traceback
from collections.abc import Sequence
from types import MappingProxyType

from thermaxis.cli import main
from thermaxis.web.work import Ending, Limits, Outcome, Work, WorkFolder, is_file


class WorkHere(Work):
    """Work whose commands start at once, without limits.

    `tests/unit/screen/test_work.py` holds the laws of the processes, and the pages' system tests
    that every word reaches them.
    """

    async def _outcome_of(
        self, words: Sequence[str], folder: WorkFolder, outputs: Sequence[str], limits: Limits
    ) -> Outcome:
        printed, said = io.StringIO(), io.StringIO()
        with (
            contextlib.chdir(folder.path),
            contextlib.redirect_stdout(printed),
            contextlib.redirect_stderr(said),
        ):
            try:
                code = main(words)
            except SystemExit as stopped:
                code = stopped.code
            except Exception:  # noqa: BLE001 - as Python ends a program
                traceback.print_exc()
                code = 1
        files = {name: folder.path / name for name in outputs if is_file(folder.path / name)}
        return Outcome(
            Ending.DONE, code, printed.getvalue(), said.getvalue(), MappingProxyType(files), folder
        )
