"""Files: shipped ones are found, results are complete under their name or not there at all."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from walking_irl.errors import InvalidInputError

_PACKAGE = Path(__file__).resolve().parent


def model_path(name: str) -> Path:
    """Path of a file of ``models/``.

    Args:
        name: File name, for example ``humanoid.xml``.

    Raises:
        InvalidInputError: If there is no such file; the message lists those that exist.
    """
    folders = [_PACKAGE / "_models", _PACKAGE.parent / "models"]
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    exist = sorted(p.name for f in folders if f.is_dir() for p in f.iterdir() if p.is_file())
    raise InvalidInputError(f"no model file {name!r}; there are {', '.join(exist) or 'none'}")


def write_file(path: Path, content: bytes) -> None:
    """Write beside the target and rename, so that no half-written file stays.

    Raises:
        InvalidInputError: If the file cannot be written; what was there before is still there.
    """
    _check_name(path)
    try:
        replace_file(path, content)
    except OSError as error:
        raise InvalidInputError(f"cannot write {path}: {error.strerror or error}") from error


def part_of(path: Path) -> Path:
    """Where a file of that name is written before it is complete."""
    return path.with_name(f".{path.name}.{os.getpid()}.part")


def replace_file(path: Path, content: bytes) -> None:
    """Write beside ``path``, then rename: a reader sees the old file or the whole new one.

    Raises:
        OSError: If it cannot be written; nothing is left behind.
    """
    part = part_of(path)
    try:
        with part.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def check_outputs(paths: Sequence[Path | None], inputs: Sequence[Path | None] = ()) -> None:
    """Fail before long work where a result could not be written after it.

    Args:
        paths: Files that will be written.
        inputs: Files that are read, and must stay as they are.

    Raises:
        InvalidInputError: If a folder is missing or read-only, two results have one name or an
            input's, or a name is a folder's or a device's.
    """
    given = [path for path in paths if path is not None]
    read = [path.resolve() for path in inputs if path is not None]
    written = [path.resolve() for path in given]
    for path in given:
        _check_name(path)
        if written.count(path.resolve()) > 1:
            raise InvalidInputError(f"two results cannot both be written to {path}; name two files")
        if path.resolve() in read:
            raise InvalidInputError(f"{path} is read; name another file for the result")
        if not os.access(path.parent, os.W_OK):
            raise InvalidInputError(f"cannot write {path}: the folder {path.parent} is read-only")


def check_ending(path: Path | None, *endings: str) -> None:
    """Fail where a file's name has another ending than its content.

    Raises:
        InvalidInputError: If it has.
    """
    if path is not None and path.suffix not in endings:
        raise InvalidInputError(f"expected a file name in {' or '.join(endings)}, got {path}")


def _check_name(path: Path) -> None:
    try:
        if not path.parent.is_dir():
            raise InvalidInputError(f"cannot write {path}: there is no folder {path.parent}")
        if path.is_dir():
            raise InvalidInputError(f"cannot write {path}: it is a folder; name a file")
        if path.exists() and not path.is_file():
            raise InvalidInputError(f"cannot write {path}: it is a device; name an ordinary file")
    except OSError as error:
        raise InvalidInputError(f"cannot write {path}: {error.strerror or error}") from error
