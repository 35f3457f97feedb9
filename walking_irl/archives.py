"""Arrays of .npz files that others have made: checked before memory is taken, never unpickled.

An .npz file is a ZIP of arrays, each a short header (dtype, order, shape) and its numbers. A
header may claim any shape and a compressed kilobyte may hold gigabytes, so shapes are compared with
the bytes that are there, and bytes are counted while they are unpacked.
"""

from __future__ import annotations

import io
import zlib
from math import prod
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile, ZipInfo

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError, reason

LARGEST = 400_000_000
"""Bytes that all arrays of one file may take."""
TOO_LARGE = f"its arrays take more than {LARGEST / 1e6:.0f} MB"
MOST_ARRAYS = 2000
UNREADABLE = (
    OSError,
    ValueError,
    EOFError,
    TypeError,
    KeyError,
    SyntaxError,
    RecursionError,
    NotImplementedError,
    RuntimeError,  # encrypted members
    BadZipFile,
    zlib.error,
)
"""What files raise that are no archives of arrays, or hold others than were meant."""


def read_arrays(path: Path) -> dict[str, Any]:
    """All arrays of an .npz file by name.

    Raises:
        InvalidInputError: If it is not such a file, holds Python objects, or is larger than
            LARGEST.
    """
    try:
        with ZipFile(path) as archive:
            members = archive.infolist()
            if len(members) > MOST_ARRAYS:
                raise ValueError(f"it holds {len(members)} arrays, at most {MOST_ARRAYS}")
            out, left = {}, LARGEST
            for member in members:
                content = _unpacked(archive, member, left)
                left -= len(content)
                out[member.filename.removesuffix(".npy")] = _array(member.filename, content)
            return out
    except UNREADABLE as error:
        raise InvalidInputError(f"{path} is not a readable .npz table: {reason(error)}") from error


def read_columns(path: Path) -> dict[str, Array]:
    """Columns of numbers of an .npz file by name, of whatever lengths.

    Raises:
        InvalidInputError: As :func:`read_arrays`, or if an array does not hold numbers.
    """
    columns = {}
    arrays = read_arrays(path)
    if {"joints", "time", "q", "v", "u"} <= set(arrays):
        raise InvalidInputError(
            f"{path} holds rollouts that walking-irl recover has written: give it to "
            "walking-irl recover --demonstration"
        )
    for name, array in arrays.items():
        if array.dtype.kind not in "fiub":
            raise InvalidInputError(
                f"{path} is not a readable .npz table: {name} holds {array.dtype}, expected numbers"
            )
        columns[name] = np.asarray(array, dtype=float).ravel()
    return columns


def _unpacked(archive: ZipFile, member: ZipInfo, most: int) -> bytes:
    if member.file_size > most:
        raise ValueError(TOO_LARGE)
    with archive.open(member) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise ValueError(TOO_LARGE)
    return content


def _array(name: str, content: bytes) -> Any:
    """An array from the content of an .npy file."""
    file = io.BytesIO(content)
    version = np.lib.format.read_magic(file)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:
        raise ValueError(f"{name} has version {version} of the format, expected 1.0 or 2.0")
    shape, is_fortran, dtype = readers[version](file)
    if dtype.hasobject:
        raise ValueError(f"{name} holds Python objects, expected numbers")
    there = len(content) - file.tell()
    if any(n < 0 for n in shape) or prod(shape) * dtype.itemsize != there:
        raise ValueError(f"{name} claims shape {shape}, which its {there} bytes do not fill")
    flat = np.frombuffer(content, dtype, offset=file.tell())
    return flat.reshape(shape[::-1]).T if is_fortran else flat.reshape(shape)
