"""Files that appear under their name only when they are complete."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from walking_irl.errors import RecordingError
from walking_irl.files import part_of, replace_file


def check_writable(path: str | Path) -> Path:
    """Find out now, before hours of work, that a recording cannot be written.

    Creates and removes an empty file beside ``path``; an existing file of that name stays as it is.

    Returns:
        The path.

    Raises:
        RecordingError: If the folder is missing or read-only, or the name is not one of a file.
    """
    path = Path(path)
    _check_name(path)
    with _explained(path):
        part = part_of(path)
        part.open("xb").close()
        part.unlink()
    return path


def write_atomically(path: str | Path, content: bytes) -> None:
    """Write beside ``path``, then rename: a reader sees the old file or the whole new one.

    Raises:
        RecordingError: If it cannot be written; nothing is left behind.
    """
    path = Path(path)
    _check_name(path)
    with _explained(path):
        replace_file(path, content)


def _check_name(path: Path) -> None:
    if path.is_dir():
        raise RecordingError(
            f"cannot write the recording: expected a file name, got the directory {path}; "
            f"add a name such as {path / 'walking.rrd'}"
        )
    if path.exists() and not path.is_file():
        raise RecordingError(
            f"cannot write the recording: expected a file name, got the device {path}; "
            "choose a name in an ordinary directory"
        )
    if not path.parent.is_dir():
        raise RecordingError(
            f"cannot write the recording {path}: the directory {path.parent} does not exist; "
            "create it or choose another"
        )


@contextlib.contextmanager
def _explained(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise RecordingError(
            f"cannot write the recording {path}: {reason}; free space, change the permissions of "
            f"{path.parent} or choose another directory"
        ) from error
