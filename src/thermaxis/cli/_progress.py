"""A progress bar on standard error, shown only once something takes longer than a second."""

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING, final

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID

PATIENCE_S = 1.0


@final
class Progress:
    """Call it with the step, the steps done and their number; use it in a ``with`` statement."""

    def __init__(self) -> None:
        self._since_s = time.monotonic()
        self._bar: RichProgress | None = None
        self._tasks: dict[int, TaskID] = {}

    def __enter__(self) -> "Progress":
        """Start waiting."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, step: str, done: int, total: int) -> None:
        """Show that `done` of `total` steps are done and which one comes now."""
        if not sys.stderr.isatty() or time.monotonic() - self._since_s < PATIENCE_S:
            return
        if self._bar is None:
            from rich.console import Console  # noqa: PLC0415  only where a bar is shown
            from rich.progress import Progress as RichProgress  # noqa: PLC0415

            self._bar = RichProgress(console=Console(stderr=True), transient=True)
            self._bar.start()
        task = self._tasks.get(total)
        if task is None:
            task = self._tasks[total] = self._bar.add_task(step, total=total)
        self._bar.update(task, completed=done, description=step)
