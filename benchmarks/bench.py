"""What the benchmarks share: medians of repeated timings, and tables."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np


def seconds(call: Callable[[], Any]) -> float:
    """Processor time of one call [s]: other programs on the machine do not count."""
    start = time.process_time()
    call()
    return time.process_time() - start


def medians(calls: Sequence[Callable[[], Any]], repeats: int) -> list[float]:
    """Median processor time of each call [s].

    The calls take turns, so that a slow moment of the machine does not fall on one of them alone.
    """
    times = [[seconds(call) for call in calls] for _ in range(repeats)]
    return [float(t) for t in np.median(times, axis=0)]


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns under a header, the first aligned left."""
    cells = [list(header), *(list(row) for row in rows)]
    widths = [max(len(row[c]) for row in cells) for c in range(len(header))]
    lines = []
    for row in cells:
        first = row[0].ljust(widths[0])
        rest = [cell.rjust(w) for cell, w in zip(row[1:], widths[1:], strict=True)]
        lines.append("  ".join([first, *rest]).rstrip())
    lines.insert(1, "-" * max(len(line) for line in lines))
    return "\n".join(lines)


def verdict(text: str, is_met: bool) -> str:
    """A headline that says whether its target is met."""
    return f"{text}: {'met' if is_met else 'NOT MET'}"
