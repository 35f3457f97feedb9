"""Wall time by part; clocks wrap what algorithms call, so that those know nothing of them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from typing import Any

from walking_irl.arrays import Array
from walking_irl.types import Forward, Response

PARTS = ("total", "forward", "centre", "expert", "recording")


class Stopwatch:
    """Seconds by part of a run."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PARTS, 0.0)
        self._start = time.perf_counter()

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Add the time of a block."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] += time.perf_counter() - start

    def finish(self) -> dict[str, float]:
        """All parts, rounded."""
        self.seconds["total"] = time.perf_counter() - self._start
        return {k: round(v, 3) for k, v in self.seconds.items()}


class Timed:
    """A forward solver that counts its calls and its time; in another process it is the plain one.

    Attributes:
        n: Calls so far.
        seconds: Their time; whoever reads it may set it back.
    """

    def __init__(self, forward: Forward) -> None:
        self.forward = forward
        self.n, self.seconds = 0, 0.0

    def __call__(self, w: Array) -> Response:
        """The solver's answer."""
        start = time.perf_counter()
        try:
            return self.forward(w)
        finally:
            self.seconds += time.perf_counter() - start
            self.n += 1

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles as the solver that it wraps."""
        return copy, (self.forward,)
