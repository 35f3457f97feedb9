"""The file of a recording: it appears at the end, complete, or not at all."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import rerun as rr

from walking_irl.errors import RecordingError
from walking_irl.files import check_writable, write_file
from walking_irl.recording.reader import APPLICATION_ID
from walking_irl.workers import interrupts_heard, interrupts_held

FLUSH_SECONDS = 60.0


def open_stream() -> tuple[rr.RecordingStream, rr.MemoryRecording]:
    """A stream whose content stays in memory and does not depend on the clock.

    Raises:
        RecordingError: If Rerun is disabled.
    """
    stream = rr.RecordingStream(
        APPLICATION_ID, send_properties=False, batcher_config=rr.ChunkBatcherConfig.NEVER()
    )
    if not stream.is_enabled():
        raise RecordingError(
            "cannot record: Rerun is disabled by the environment variable RERUN; unset it"
        )
    stream.set_log_time_enabled(False)
    return stream, stream.memory_recording()


def save_stream(
    stream: rr.RecordingStream,
    memory: rr.MemoryRecording,
    path: Path,
    text: str,
    known: dict[str, Any],
) -> None:
    """Add the summary (markdown) and the property ``experiment``, and write the file.

    Raises:
        RecordingError: If it cannot be written.
    """
    markdown = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
    stream.log("summary", markdown, static=True)
    stream.send_property("experiment", rr.AnyValues(**known))
    stream.flush(timeout_sec=FLUSH_SECONDS)  # once: every chunk costs a kilobyte
    write_file(path, memory.drain_as_bytes(), RecordingError)


class RecordingFile(ABC):
    """Context manager that keeps a recording in memory and writes it when the block ends.

    Also after an exception or Ctrl-C: the file then holds what was done until then and says so.

    Args:
        path: The ``.rrd`` file; whether it can be written is checked now.

    Raises:
        RecordingError: If ``path`` cannot be written, now or at the end, or Rerun is disabled.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = check_writable(path, RecordingError)

    def __enter__(self) -> Self:
        self._heard = interrupts_heard()
        self._stream, self._memory = open_stream()
        self._begin()
        self._stream.flush(timeout_sec=FLUSH_SECONDS)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        ending = None if kind is None else _ending(kind, interrupts_heard() > self._heard)
        try:
            with interrupts_held():  # a second Ctrl-C, or one at the very end
                save_stream(self._stream, self._memory, self.path, *self._end(ending))
        except RecordingError as failure:
            if error is None:
                raise
            error.add_note(str(failure))  # the first error matters more

    @abstractmethod
    def _begin(self) -> None:
        """Log what never changes."""

    @abstractmethod
    def _end(self, ending: str | None) -> tuple[str, dict[str, Any]]:
        """The summary and the properties; ``ending`` says why the block was cut short."""


def _ending(kind: type[BaseException], was_interrupted: bool) -> str:
    """An interrupt may have another name by now: see :func:`.interrupts_kept`."""
    is_interrupt = was_interrupted or kind is KeyboardInterrupt
    return "interrupted" if is_interrupt else kind.__name__
