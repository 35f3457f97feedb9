"""Standard output whose reader may leave: ``walking-irl ... | head`` does not end the work."""

from __future__ import annotations

import os
from typing import Any, TextIO


class Output:
    """A text file that takes everything; once its pipe is broken, it goes nowhere.

    Args:
        file: Standard output.
    """

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def write(self, text: str) -> int:
        """Write, as far as somebody reads."""
        try:
            return self._file.write(text)
        except BrokenPipeError:
            self._discard()
            return len(text)

    def flush(self) -> None:
        """Flush, as far as somebody reads."""
        try:
            self._file.flush()
        except BrokenPipeError:
            self._discard()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def _discard(self) -> None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), self._file.fileno())
