"""Files: shipped ones are found, results are complete under their name or not there at all."""

from __future__ import annotations

import io
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from walking_irl.errors import InvalidInputError, WalkingIRLError
from walking_irl.workers import interrupts_held

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


def write_file(
    path: Path, content: bytes, error: type[WalkingIRLError] = InvalidInputError
) -> None:
    """Write beside ``path``, then rename: a reader sees the old file or the whole new one.

    Args:
        path: The file.
        content: Its content.
        error: What to raise where it cannot be written; nothing is left behind then.
    """
    check_name(path, error)
    part = _part_of(path)
    with _explained(path, error), interrupts_held():
        try:
            with part.open("xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
        except BaseException:
            part.unlink(missing_ok=True)
            raise


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write JSON; numbers that are not finite become null.

    Raises:
        InvalidInputError: If the file cannot be written.
    """
    write_file(path, (json.dumps(to_plain(content), indent=1, allow_nan=False) + "\n").encode())


def with_arrays(content: bytes, arrays: Mapping[str, Any]) -> bytes:
    """A compressed ``.npz``, empty at first, with more arrays; what it holds stays as it is."""
    file = io.BytesIO()
    file.write(content)
    with ZipFile(file, "a") as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.asanyarray(array), allow_pickle=False)
            archive.writestr(ZipInfo(f"{name}.npy"), member.getvalue(), ZIP_DEFLATED)
    return file.getvalue()


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays by name as a compressed ``.npz``.

    Raises:
        InvalidInputError: If the file cannot be written.
    """
    write_file(path, with_arrays(b"", arrays))


def write_png(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture (height, width, 3) as PNG.

    Raises:
        InvalidInputError: If the file cannot be written.
    """
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(picture).save(content, format="PNG", optimize=True)
    write_file(path, content.getvalue())


def to_plain(value: Any, *, is_exact: bool = False) -> Any:
    """A value as JSON types; numbers that are not finite become None, unless it must be exact.

    JSON has no such numbers; Python's reads and writes them all the same.
    """
    if isinstance(value, Mapping):
        return {str(k): to_plain(v, is_exact=is_exact) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain(v, is_exact=is_exact) for v in value]
    if isinstance(value, np.ndarray | np.generic):
        return to_plain(value.tolist(), is_exact=is_exact)
    is_none = isinstance(value, float) and not math.isfinite(value) and not is_exact
    return None if is_none else value


def check_writable(path: str | Path, error: type[WalkingIRLError] = InvalidInputError) -> Path:
    """Find out before long work that a file cannot be written.

    Creates and removes an empty file beside ``path``; an existing file of that name stays as it is.

    Args:
        path: The file.
        error: What to raise if its folder is missing or read-only, or its name is not a file's.

    Returns:
        The path.
    """
    path = Path(path)
    check_name(path, error)
    with _explained(path, error):
        part = _part_of(path)
        part.open("xb").close()
        part.unlink()
    return path


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
        check_name(path)
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


def check_name(path: Path, error: type[WalkingIRLError] = InvalidInputError) -> None:
    """Raise ``error`` where a path cannot be that of an ordinary file."""
    with _explained(path, error):
        if not path.parent.is_dir():
            raise error(
                f"cannot write {path}: there is no folder {path.parent}; create it or name another"
            )
        if path.is_dir():
            raise error(f"cannot write {path}: it is a folder; name a file")
        if path.exists() and not path.is_file():
            raise error(f"cannot write {path}: it is a device; name an ordinary file")


def _part_of(path: Path) -> Path:
    """Where a file of that name is written before it is complete."""
    return path.with_name(f".{path.name}.{os.getpid()}.part")


@contextmanager
def _explained(path: Path, error: type[WalkingIRLError]) -> Iterator[None]:
    try:
        yield
    except OSError as problem:
        raise error(
            f"cannot write {path}: {problem.strerror or problem}; free space, change the "
            f"permissions of {path.parent} or choose another folder"
        ) from problem
