"""Progress of a known number of jobs, with the time left."""

from __future__ import annotations

import time
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn


class Counted:
    """A bar in a terminal, a line a job elsewhere; jobs that were done before take no time.

    Args:
        console: Where it is shown.
        what: What is counted, for example "experts".
        is_quiet: Whether it is not.

    Attributes:
        n_done: Jobs done so far.
    """

    def __init__(self, console: Console, what: str, is_quiet: bool = False) -> None:
        self.console, self.what, self.is_quiet = console, what, is_quiet
        self.n_done = self._n_called = 0
        self._start = time.monotonic()
        self.bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[left]}"),
            console=console,
            transient=True,
            disable=is_quiet or not console.is_terminal,
        )
        self._task = self.bar.add_task(what, total=None, left="")

    def __enter__(self) -> Self:
        self.bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.bar.stop()

    def __call__(self, name: str, done: int, total: int) -> None:
        """One more is done."""
        self.n_done, self._n_called = done, self._n_called + 1
        seconds = (time.monotonic() - self._start) / self._n_called * (total - done)
        left = f"about {duration(seconds)} left" if done < total else "done"
        self.bar.update(self._task, completed=done, total=total, left=left)
        if not self.is_quiet and not self.console.is_terminal:
            self.console.print(f"{name}: {done} of {total} {self.what}, {left}")


def duration(seconds: float) -> str:
    """A duration in words.

    >>> duration(4.2), duration(95), duration(7400)
    ('4 s', '2 min', '2 h 3 min')
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"
