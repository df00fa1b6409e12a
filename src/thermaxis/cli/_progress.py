"""A progress bar on standard error, shown only once something takes longer than a second."""

import json
import os
import sys
from pathlib import Path
from threading import Lock, Timer
from types import TracebackType
from typing import TYPE_CHECKING, final

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress

PATIENCE_S = 1.0
VARIABLE = "THERMAXIS_PROGRESS"
"""Names a file into which each step is written as JSON, for a program that waits."""


@final
class Progress:
    """Call it with the step, the steps done and their number; use it in a ``with`` statement.

    A number of steps of zero means that it is not known. The bar appears by itself when a
    second has passed, also in the middle of a step, and only on a terminal. Where `VARIABLE` names
    a file, the step stands there.
    """

    def __init__(self) -> None:
        self._step = ("", 0, 0)
        self._bar: RichProgress | None = None
        self._file = os.environ.get(VARIABLE, "")
        self._lock = Lock()
        self._timer = Timer(PATIENCE_S, self._show)
        self._timer.daemon = True

    def __enter__(self) -> "Progress":
        """Start waiting."""
        if sys.stderr.isatty():
            self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Remove the bar."""
        self._timer.cancel()
        self.hide()

    def __call__(self, step: str, done: int, total: int) -> None:
        """Show that `done` of `total` steps are done and which one comes now."""
        with self._lock:
            self._step = (step, done, total)
            if self._file:
                told = {"step": step, "done": done, "total": total}
                Path(self._file).write_text(json.dumps(told), "utf-8")
            if self._bar is not None:
                task = self._bar.task_ids[0]
                self._bar.update(task, description=step, completed=done, total=total or None)

    def hide(self) -> None:
        """Remove the bar, if there is one, so that something else can be printed."""
        with self._lock:
            if self._bar is not None:
                self._bar.stop()
                self._bar = None

    def _show(self) -> None:
        from rich.console import Console  # noqa: PLC0415  only where a bar is shown
        from rich.progress import Progress as RichProgress  # noqa: PLC0415  see above

        with self._lock:
            step, done, total = self._step
            self._bar = RichProgress(console=Console(stderr=True), transient=True)
            self._bar.add_task(step, completed=done, total=total or None)
            self._bar.start()
