"""Reads recordings back, offline, for tests and ``walking-irl inspect``."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk, RrdReader

from walking_irl.errors import RecordingError

APPLICATION_ID = "walking_irl"
EXPERIMENT = "/__properties/experiment"
MAGIC = b"RRF2"


class Column(NamedTuple):
    """One component over time, sorted; rows without it are left out."""

    times: NDArray[np.int64]
    """Sequence numbers, or nanoseconds."""
    rows: list[list[Any]]


class Recording:
    """A recording file, read once into memory.

    Args:
        path: The ``.rrd`` file.

    Raises:
        RecordingError: If the file is missing, no recording, truncated, or of another program.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = _check_file(Path(path))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", rr.error_utils.RerunWarning)
                reader = RrdReader(self.path)
                found = reader.recordings()
                reader.store()  # needs the footer, which a truncated file lacks
                self._chunks: list[Chunk] = list(reader.stream())
        except (Exception, rr.error_utils.RerunWarning) as error:
            raise RecordingError(
                f"{path} is damaged or was cut off while it was written; record it again"
            ) from error
        ids = {entry.application_id for entry in found}
        if ids != {APPLICATION_ID}:
            raise RecordingError(
                f"{path} is a recording of {', '.join(sorted(ids)) or 'nothing'}; "
                f"expected one of {APPLICATION_ID}"
            )
        self.has_blueprint = bool(reader.blueprints())

    @property
    def entities(self) -> list[str]:
        """Paths of all entities, sorted."""
        return sorted({c.entity_path for c in self._chunks})

    @property
    def timelines(self) -> list[str]:
        """Names of all timelines, sorted."""
        return sorted({t for c in self._chunks for t in c.timeline_names})

    def column(self, entity: str, component: str, timeline: str = "frame") -> Column:
        """A component over time, such as ("/cpirl/regret", "Scalars:scalars").

        Raises:
            RecordingError: If there is no such column.
        """
        times: list[NDArray[np.int64]] = []
        rows: list[list[Any]] = []
        for batch in self._batches(entity):
            if timeline not in batch.schema.names or component not in batch.schema.names:
                continue
            values = batch.column(component).to_pylist()
            has = np.array([v is not None for v in values])
            t = batch.column(timeline).cast("int64").to_numpy(zero_copy_only=False)
            times.append(t[has])
            rows += [v for v in values if v is not None]
        if not times:
            raise RecordingError(f"{self.path} has no {component} of {entity} over {timeline}")
        flat = np.concatenate(times)
        order = np.argsort(flat, kind="stable")
        return Column(flat[order], [rows[i] for i in order])

    def static(self, entity: str) -> dict[str, list[Any]]:
        """All static components of an entity; the last value of each."""
        values: dict[str, list[Any]] = {}
        for batch in self._batches(entity, static=True):
            for name in batch.schema.names:
                last = batch.column(name)[-1].as_py()
                if isinstance(last, list):
                    values[name] = last
        return values

    @property
    def properties(self) -> dict[str, Any]:
        """The property ``experiment``: single values as such, others as lists."""
        return {k: v[0] if k in SINGLE else v for k, v in self.static(EXPERIMENT).items()}

    @property
    def summary(self) -> str:
        """The markdown text beside the pictures."""
        return str(self.static("/summary")["TextDocument:text"][0])

    def _batches(self, entity: str, static: bool = False) -> Iterator[Any]:
        for chunk in self._chunks:
            if chunk.entity_path == entity and chunk.is_static == static:
                yield chunk.to_record_batch()


SINGLE = (
    *("domain", "method", "loss", "centre", "mode", "seed", "iterations", "ending", "status"),
    *("certificate", "rule", "how_sure", "volume_ratio", "condition_number", "weakest", "gauge"),
)
"""Properties that are one value."""


def check_recording(path: str | Path) -> Path:
    """The path of a readable recording of this package; RecordingError if it is not."""
    return Recording(path).path


def inspect_recording(path: str | Path) -> dict[str, Any]:
    """What a recording holds, ready for JSON.

    Returns:
        application_id, domain, method (of ``recover --method``), loss (of its policy, relative),
        objectives, units, centre, mode, seed, w_expert (or None), w, rule,
        intervals (K, 2), physical_intervals (K, 2), status, ending (None for a whole run),
        certificate, bracket, how_sure, half widths by cause (from_noise, from_gap, from_solver;
        (K,) each), volume_ratio, condition_number, weakest, gauge, noise, iterations,
        frames, entities, timelines, has_blueprint, versions. What is not known is None.

    Raises:
        RecordingError: If the file is missing, no recording, truncated, or of another program.
    """
    recording = Recording(path)
    known = recording.properties
    pairs = {key: known.get(key) for key in ("intervals", "physical_intervals")}
    keys = ("domain", "method", "loss", "objectives", "units", "centre", "mode", "seed",
            "w_expert", "w", "rule", "status", "ending", "certificate", "bracket", "how_sure",
            "from_noise", "from_gap", "from_solver", "volume_ratio", "condition_number",
            "weakest", "gauge", "noise", "iterations")  # fmt: skip
    return {
        "application_id": APPLICATION_ID,
        **{key: known.get(key) for key in keys},
        **{k: None if v is None else np.reshape(v, (-1, 2)).tolist() for k, v in pairs.items()},
        "frames": _n_frames(recording),
        "entities": recording.entities,
        "timelines": recording.timelines,
        "has_blueprint": recording.has_blueprint,
        "versions": dict(v.split(" ", 1) for v in known.get("versions", [])),
    }


def _n_frames(recording: Recording) -> int:
    last = [
        int(batch.column("frame").cast("int64").to_numpy(zero_copy_only=False).max())
        for entity in recording.entities
        for batch in recording._batches(entity)
        if "frame" in batch.schema.names and batch.num_rows
    ]
    return max(last, default=-1) + 1


def _check_file(path: Path) -> Path:
    if not path.exists():
        raise RecordingError(f"there is no recording {path}; check the name")
    if not path.is_file():
        raise RecordingError(f"expected a recording file, {path} is a folder, a pipe or a device")
    try:
        with path.open("rb") as file:
            start = file.read(len(MAGIC))
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {(error.strerror or '').lower()}") from error
    if start != MAGIC:
        raise RecordingError(f"{path} is not a Rerun recording (.rrd)")
    return path
