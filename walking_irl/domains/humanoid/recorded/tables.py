"""Tables of numbers from other people's files: OpenSim's .mot and .sto, .csv of any dialect, .npz.

A file is read as data only: nothing in it is executed, sizes that it claims are checked against the
bytes that are there, and what cannot be a table is refused in one sentence.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from walking_irl.archives import read_columns
from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError

LARGEST_TEXT = 200_000_000  # [bytes]
LEAST_ROWS = 8
TABLES = (".mot", ".sto", ".csv", ".npz")
MARKERS = (".trc", ".c3d", ".tsv")
NO_NUMBER = ("", "nan", "-nan", "+nan", "na", "n/a", "null", "none", "-", "#n/a")
"""What stands in a cell where nothing was measured."""
HEADER_LINE = re.compile(r"\s*([A-Za-z][\w ]*?)\s*=\s*(.*?)\s*$")
COMMENT = ("#", "%", "//")


@dataclass(frozen=True)
class Table:
    """Columns of one file.

    Attributes:
        path: Where they were read.
        format: What the file is, in words.
        header: Key and value of its header lines, in lower case.
        columns: Numbers by name, as the file spells it; NaN where a cell is empty; shape (n,) each.
    """

    path: Path
    format: str
    header: Mapping[str, str]
    columns: Mapping[str, Array]


def read_table(path: Path) -> Table:
    """The table that a file holds.

    Raises:
        InvalidInputError: If there is no such file, or it is no table of numbers.
    """
    check_readable(path)
    ending = path.suffix.lower()
    if ending in MARKERS:
        raise _markers(path)
    if ending not in TABLES:
        raise InvalidInputError(
            f"{path.name!r} is no recording: expected a file name in {', '.join(TABLES)}"
        )
    if ending == ".npz":
        return Table(path, "NumPy .npz", {}, read_columns(path))
    text = _text(path)
    if text.lstrip().lower().startswith("pathfiletype"):
        raise _markers(path)
    lines = text.splitlines()
    header, format_, names, rows = (_storage if ending in (".mot", ".sto") else _sheet)(path, lines)
    return Table(path, format_, header, _columns(path, names, rows))


def check_readable(path: Path) -> None:
    """Fail unless a path is an ordinary file: pipes and devices would never end.

    Raises:
        InvalidInputError: If it is not.
    """
    try:
        if path.is_file():
            return
        exists, is_folder = path.exists(), path.is_dir()
    except (OSError, ValueError) as error:
        raise InvalidInputError(f"{str(path)[:80]!r} is no file name: {error}") from error
    if not exists:
        raise InvalidInputError(f"there is no file {path}")
    raise InvalidInputError(
        f"{path} is a {'folder' if is_folder else 'pipe or device'}; name an ordinary file"
    )


def _markers(path: Path) -> InvalidInputError:
    return InvalidInputError(
        f"{path.name} holds positions of markers, not joint angles: run inverse kinematics "
        "(OpenSim, Pose2Sim, OpenCap) and give its .mot or .sto file"
    )


def _text(path: Path) -> str:
    """A text file, whatever its byte order mark says."""
    try:
        if path.stat().st_size > LARGEST_TEXT:
            raise InvalidInputError(
                f"{path} is too large for a recording: {path.stat().st_size / 1e6:.0f} MB, at most "
                f"{LARGEST_TEXT / 1e6:.0f} MB"
            )
        content = path.read_bytes()
    except OSError as error:
        raise InvalidInputError(f"cannot read {path}: {error.strerror or error}") from error
    is_utf16 = content[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = content.decode("utf-16" if is_utf16 else "utf-8-sig")
    except UnicodeDecodeError:
        text = "" if is_utf16 else content.decode("latin-1")
    if not text.strip() or "\0" in text:
        raise InvalidInputError(f"{path} is not a readable table: it is empty or not text")
    return text


Parsed = tuple[dict[str, str], str, list[str], Iterator[tuple[int, list[str]]]]


def _storage(path: Path, lines: Sequence[str]) -> Parsed:
    """OpenSim's .mot and .sto: header lines up to ``endheader``, names, rows; both versions."""
    end = next((i for i, s in enumerate(lines) if s.strip().lower() == "endheader"), None)
    if end is None:
        raise InvalidInputError(f"{path} is not an OpenSim file: its header has no endheader line")
    header = {}
    for line in lines[:end]:
        if found := HEADER_LINE.match(line):
            header[found[1].lower()] = found[2].lower()
    kind = header.get("datatype", "double")
    if kind != "double":
        raise InvalidInputError(
            f"{path} holds data of type {kind}, expected double: export joint angles (coordinates)"
        )
    body = [(i + 1, s) for i, s in enumerate(lines) if i > end and s.strip()]
    if not body:
        raise InvalidInputError(f"{path} ends after its header: there are no rows")
    has_tabs = "\t" in body[0][1].strip()

    def cells(line: str) -> list[str]:
        return [c.strip() for c in line.split("\t")] if has_tabs else line.split()

    rows = ((i, cells(s) if has_tabs and "\t" in s else s.split()) for i, s in body[1:])
    names = cells(body[0][1])
    while names and not names[-1]:
        names.pop()
    return (
        header,
        f"OpenSim {path.suffix.lower()}, version {header.get('version', '1')}",
        names,
        rows,
    )


def _sheet(path: Path, lines: Sequence[str]) -> Parsed:
    """Comma, semicolon or tab separated values, with or without decimal commas and comments."""
    body = [
        (i + 1, s) for i, s in enumerate(lines) if s.strip() and not s.lstrip().startswith(COMMENT)
    ]
    header = {}
    for line in lines:
        is_comment = line.lstrip().startswith(COMMENT)
        if is_comment and (found := HEADER_LINE.match(line.lstrip().lstrip("#%/"))):
            header[found[1].lower()] = found[2].lower()
    split = next((d for d in ";\t" if any(s.count(d) > 1 for _, s in body[:3])), ",")
    table = [(i, [c.strip().strip("\"'").strip() for c in s.split(split)]) for i, s in body]
    while table and sum(map(bool, table[0][1])) < 2:  # a title
        table.pop(0)
    if not table or all(_is_number(c, split) for c in table[0][1]):
        raise InvalidInputError(
            f"{path} is not a readable .csv table: its first row must name the columns"
        )
    (_, names), *rest = table
    while names and not names[-1]:
        names.pop()
    if rest and not any(_is_number(c, split) for c in rest[0][1] if c):  # a row of units
        units = rest[0][1]
        if any(u.strip("[]()").lower() in UNITS for u in units):
            names = [
                f"{n} ({u.strip('[]()')})" if u else n for n, u in zip(names, units, strict=False)
            ]
            rest = rest[1:]
    kind = {";": "semicolons", "\t": "tabs", ",": "commas"}[split]
    rows = ((i, [_point(c, split) for c in row]) for i, row in rest)
    return header, f".csv with {kind}", names, rows


UNITS = {"deg", "rad", "m", "mm", "cm", "s", "ms", "%", "degrees", "radians", "n"}


def _point(cell: str, split: str) -> str:
    """A cell with a decimal point, where commas do not separate cells."""
    return cell.replace(",", ".") if split != "," else cell


def _is_number(cell: str, split: str) -> bool:
    cell = _point(cell, split)
    if cell.lower() in NO_NUMBER:
        return False
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _columns(
    path: Path, names: Sequence[str], rows: Iterator[tuple[int, list[str]]]
) -> dict[str, Array]:
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise InvalidInputError(
            f"{path} is not a readable table: column {twice[0]!r} appears twice"
        )
    if "" in names:
        raise InvalidInputError(f"{path} is not a readable table: a column has no name")
    table = [_numbers(path, names, line, cells) for line, cells in rows]
    if len(table) < LEAST_ROWS:
        raise InvalidInputError(
            f"{path} is too short: expected at least {LEAST_ROWS} rows of data, got {len(table)}"
        )
    return dict(zip(names, np.array(table).T, strict=True))


def _numbers(path: Path, names: Sequence[str], line: int, cells: list[str]) -> list[float]:
    """One row; empty cells at its end may be left out, or be more than there are names."""
    while len(cells) > len(names) and not cells[-1]:
        cells.pop()
    if len(cells) > len(names):
        raise InvalidInputError(
            f"{path} is not a readable table: line {line} has {len(cells)} cells, expected "
            f"{len(names)}"
        )
    out = [np.nan] * len(names)
    for j, cell in enumerate(cells):
        try:
            out[j] = np.nan if cell.lower() in NO_NUMBER else float(cell)
        except ValueError as error:
            raise InvalidInputError(
                f"{path} is not a readable table: {names[j]} in line {line} is {cell[:40]!r}, "
                "expected a number"
            ) from error
    return out
