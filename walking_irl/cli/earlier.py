"""Files of earlier runs are kept under a number, not written over."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from pathlib import Path

from rich.console import Console


def keep_earlier(paths: Sequence[Path | None], console: Console) -> None:
    """Number an earlier run's files of the default names, and say so in one line."""
    there = [path for path in paths if path is not None and path.is_file()]
    if there:
        numbers = (n for n in count(1) if not any(_numbered(p, n).exists() for p in there))
        kept = [path.rename(_numbered(path, n)) for n in [next(numbers)] for path in there]
        console.print(f"an earlier run is kept: {', '.join(map(str, kept))}")


def _numbered(path: Path, n: int) -> Path:
    stem, ending = path.name.split(".", 1)
    return path.with_name(f"{stem}.{n}.{ending}")
