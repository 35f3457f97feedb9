"""Where the files of ``models/`` are: beside the package in a checkout, inside it in a wheel."""

from __future__ import annotations

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
