"""Whose names and signs a table uses, and its columns as the model's joints in radians and metres.

Three conventions are known. OpenSim's (gait2392, Rajagopal, OpenCap, AddBiomechanics) turns the
same axes in the same order as the model, so its values carry over one to one but for the pelvis;
knee flexion is negative in gait2392 and positive in Rajagopal. The clinical one (R. Baker 2001,
Gait Posture 13:1; CGM) has pelvic tilt forwards, obliquity right side up, and the thorax in the
laboratory. The third is the model's own, as ``walking-irl gait --save`` writes it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.recorded.tables import Table
from walking_irl.errors import InvalidInputError

CONVENTIONS = ("opensim", "clinical", "own")
UNIT = re.compile(r"^(.*?)[\s_]*[\[(]\s*(deg|rad|degrees|radians|°|mm|cm|m|s|ms|%)\s*[\])]$", re.I)
TRANSLATIONS = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
DEGREES_FROM = 3.0
"""Knees that bend by more than this count in degrees: as radians they would be torn."""
WALKING_KNEE = 0.2
"""Range of the knee below which a size says nothing of the unit."""
TOO_EMPTY = 0.5
"""Share of empty cells from which a column counts as missing."""

SPELLINGS: Mapping[str, str] = {
    "t": "time",
    "knee_flexion": "knee_angle",
    "knee": "knee_angle",
    "ankle_dorsiflexion": "ankle_angle",
    "ankle_flexion": "ankle_angle",
    "ankle": "ankle_angle",
    "subtalar": "subtalar_angle",
    "shoulder_flexion": "arm_flex",
    "elbow_flexion": "elbow_flex",
    "trunk_tilt": "thorax_tilt",
    "trunk_obliquity": "thorax_obliquity",
    "trunk_rotation": "thorax_rotation",
    "percent_of_cycle": "percent",
    "gait_cycle": "percent",
    "cycle": "percent",
    "%": "percent",
}
"""Other names, without the side, of what OpenSim or the clinic calls so."""
LEG = ("hip_flexion", "knee_angle", "ankle_angle")
SIDED: Mapping[str, str] = {
    "hip_flexion": "hip_flexion",
    "hip_adduction": "hip_adduction",
    "hip_rotation": "hip_rotation",
    "knee_angle": "knee",
    "ankle_angle": "ankle",
    "subtalar_angle": "subtalar",
    "arm_flex": "shoulder",
    "elbow_flex": "elbow",
}
"""Column without its side, and the model's joint."""
MIDDLE = {
    "opensim": (
        *("pelvis_tilt", "pelvis_list", "pelvis_rotation"),
        *("lumbar_extension", "lumbar_bending", "lumbar_rotation"),
    ),
    "clinical": (
        *("pelvis_tilt", "pelvis_obliquity", "pelvis_rotation"),
        *("thorax_tilt", "thorax_obliquity", "thorax_rotation"),
    ),
}
CLINICAL_ONLY = ("pelvis_obliquity", "thorax_tilt", "thorax_obliquity", "thorax_rotation")


@dataclass(frozen=True)
class Channels:
    """Columns with the names of one convention, in seconds, radians and metres.

    Attributes:
        convention: One of CONVENTIONS.
        unit: "degrees" or "radians", as found.
        time: Shape (n,) [s]; or share of the cycle, where ``is_percent``.
        angles: Angles by OpenSim's or the clinic's name (knees flexed positive), or the model's.
        path: Position of the pelvis by OpenSim's name [m]; empty where there is none.
        missing: Columns that the model could use and the file has not.
        notes: What was decided on the way, a sentence each.
        is_percent: Whether time is a share of the gait cycle.
    """

    convention: str
    unit: str
    time: Array
    angles: Mapping[str, Array]
    path: Mapping[str, Array]
    missing: tuple[str, ...]
    notes: tuple[str, ...] = field(default=())
    is_percent: bool = False


def channels(table: Table, joints: tuple[str, ...], convention: str | None = None) -> Channels:
    """The columns of a table, named and converted.

    Args:
        table: What was read.
        joints: Names of the model's joints.
        convention: Whose signs it uses; None decides by the names.

    Raises:
        InvalidInputError: If an obligatory column is missing, or the table holds markers.
    """
    if len({len(c) for c in table.columns.values()}) > 1:
        raise InvalidInputError(f"{table.path} needs columns of one length")
    named, units = _named(table, joints)
    if "root_pitch" in named:
        return _own(table, named, joints)
    kind = convention or ("clinical" if _is_clinical(table, named) else "opensim")
    named, one_sided = _both_sides(named)
    _check_obligatory(table, named)
    notes: list[str] = []
    angular, unit = _radians(table, named, units, notes)
    _flex_knees(angular, notes)
    path = _metres(named, units, notes)
    wanted = [*MIDDLE[kind], *(f"{n}_{s}" for n in SIDED for s in "rl"), *TRANSLATIONS]
    missing = tuple(n for n in wanted if n not in angular and n not in path)
    if one_sided:
        notes.append("one side only: the other is taken as its mirror image half a cycle later")
    is_percent = "time" not in named
    time = named["percent"] / 100 if is_percent else _seconds(table, named["time"], units, notes)
    return Channels(kind, unit, time, angular, path, missing, tuple(notes), is_percent)


def _named(table: Table, joints: tuple[str, ...]) -> tuple[dict[str, Array], dict[str, str]]:
    """Columns by OpenSim's or the clinic's names, and the units that names state."""
    named: dict[str, Array] = {}
    units: dict[str, str] = {}
    spelt = {n.strip().lower() for n in table.columns}
    is_own = "root_pitch" in spelt and any(j in spelt for j in joints)
    for raw, column in table.columns.items():
        name, unit = raw.strip(), ""
        if found := UNIT.match(name):
            name, unit = found[1], found[2].lower()
        parts = [p for p in name.split("/") if p]
        if parts and parts[-1].lower() in ("speed", "activation", "acceleration"):
            continue
        if parts and parts[-1].lower() == "value":
            parts.pop()
        name = re.sub(r"[\s.-]+", "_", parts[-1].strip()).lower() if parts else raw
        if not is_own:
            name = _spelling(name)
        empty = float(np.mean(~np.isfinite(column))) if len(column) else 1.0
        if name in named or empty > TOO_EMPTY:
            continue
        named[name], units[name] = column, unit
    return named, units


def _spelling(name: str) -> str:
    for long, short in (("right", "r"), ("left", "l")):
        if name.startswith(f"{long}_"):
            name = f"{name.removeprefix(f'{long}_')}_{short}"
        elif name.endswith(f"_{long}"):
            name = f"{name.removesuffix(long)}{short}"
    side = name[-2:] if name[-2:] in ("_r", "_l") else ""
    stem = name.removesuffix(side) if side else name
    return SPELLINGS.get(stem, stem) + side


def _is_clinical(table: Table, named: Mapping[str, Array]) -> bool:
    raw = " ".join(table.columns).lower()
    return any(n in named for n in CLINICAL_ONLY) or "dorsiflexion" in raw or "knee_flexion" in raw


def _both_sides(named: dict[str, Array]) -> tuple[dict[str, Array], bool]:
    """Columns of both sides, where a mean cycle states one without naming it."""
    if "percent" not in named or not all(n in named for n in LEG):
        return named, False
    at = named["percent"]
    span = at[-1] - at[0]
    if not (abs(span - 100) < 3 and len(at) >= 8):
        return named, False
    period = at[0] + 100.0
    out = dict(named)
    for name in [n for n in SIDED if n in named]:
        out[f"{name}_r"] = named[name]
        x = np.interp((at + 50 - at[0]) % 100 + at[0], at, named[name], period=period - at[0])
        out[f"{name}_l"] = x
    return out, True


def _check_obligatory(table: Table, named: Mapping[str, Array]) -> None:
    needed = [f"{n}_{s}" for n in LEG for s in "rl"]
    lacking = [n for n in needed if n not in named]
    if "time" not in named and "percent" not in named:
        lacking.insert(0, "time")
    is_points = all(any(n.endswith(e) for n in named) for e in ("_x", "_y", "_z"))
    if is_points and set(needed) <= set(lacking):
        raise InvalidInputError(
            f"{table.path} holds positions, not joint angles: run inverse kinematics and give its "
            ".mot or .sto file"
        )
    if lacking:
        raise InvalidInputError(
            f"{table.path} misses {', '.join(lacking)}; a walk needs time and hip_flexion, "
            "knee_angle and ankle_angle of both legs (_r, _l)"
        )


def _radians(
    table: Table, named: Mapping[str, Array], units: Mapping[str, str], notes: list[str]
) -> tuple[dict[str, Array], str]:
    """All angles in radians; what names or header say, checked against the size of the knees."""
    middles = {*MIDDLE["opensim"], *MIDDLE["clinical"]}
    angular = {
        n: v for n, v in named.items() if n in middles or n[:-2] in SIDED and n[-2:] in ("_r", "_l")
    }
    knees = np.concatenate([named["knee_angle_r"], named["knee_angle_l"]])
    largest, span = float(np.nanmax(np.abs(knees))), float(np.nanmax(knees) - np.nanmin(knees))
    stated = units.get("knee_angle_r", "")[:3].replace("°", "deg") or {
        **dict.fromkeys(("yes", "true", "1"), "deg"),
        **dict.fromkeys(("no", "false", "0"), "rad"),
    }.get(table.header.get("indegrees", ""), "")
    by_size = "deg" if largest > DEGREES_FROM else "rad"
    unit = by_size
    words = {"deg": "degrees", "rad": "radians"}
    if not stated:
        notes.append(
            f"no inDegrees line and no unit in the names: taken as {words[by_size]} by size"
        )
    elif stated != by_size:
        if by_size == "rad" and span < WALKING_KNEE:
            unit = stated
        else:
            notes.append(
                f"inDegrees or the names say {words[stated]}, but the knees reach {largest:.3g}: "
                f"taken as {words[by_size]}"
            )
    if unit == "deg":
        angular = {n: np.deg2rad(v) for n, v in angular.items()}
    return angular, words[unit]


def _flex_knees(angular: dict[str, Array], notes: list[str]) -> None:
    """Knee flexion positive: gait2392's is negative."""
    mean = np.nanmean(np.concatenate([angular["knee_angle_r"], angular["knee_angle_l"]]))
    if mean < 0:
        for side in "rl":
            angular[f"knee_angle_{side}"] = -angular[f"knee_angle_{side}"]
        notes.append("knee flexion is negative in the file (gait2392): turned round")


def _metres(
    named: Mapping[str, Array], units: Mapping[str, str], notes: list[str]
) -> dict[str, Array]:
    """Path of the pelvis in metres."""
    path = {n: named[n] for n in TRANSLATIONS if n in named}
    if not path:
        return {}
    size = max(float(np.nanmedian(np.abs(v))) for v in path.values())
    stated = {units.get(n, "") for n in path} & {"mm", "cm"}
    if stated == {"mm"} or size > 400:
        factor, word = 1e-3, "millimetres"
    elif stated == {"cm"} or 40 < size <= 400 and "pelvis_ty" in path and _is_height(path, 100):
        factor, word = 1e-2, "centimetres"
    else:
        return path
    notes.append(f"the pelvis moves in {word}: taken so")
    return {n: v * factor for n, v in path.items()}


def _is_height(path: Mapping[str, Array], unit: float) -> bool:
    return any(0.4 < float(np.nanmedian(v)) / unit < 1.6 for v in path.values())


def _seconds(table: Table, time: Array, units: Mapping[str, str], notes: list[str]) -> Array:
    steps = np.diff(np.sort(time[np.isfinite(time)]))
    steps = steps[steps > 0]
    if len(steps) == 0:
        raise InvalidInputError(f"{table.path} has no increasing time")
    step = float(np.median(steps))
    if units.get("time") == "ms" or 2 <= step <= 50:
        notes.append("time is in milliseconds")
        return time / 1000
    if step > 0.1:
        raise InvalidInputError(
            f"{table.path} has a row every {step:.3g} s: expected time in seconds, at "
            "least 10 rows a second (frame numbers? divide them by the frame rate)"
        )
    return time


def _own(table: Table, named: dict[str, Array], joints: tuple[str, ...]) -> Channels:
    """The model's own names: radians, metres, root relative to upright standing."""
    sagittal = [f"{j}_{s}" for j in ("hip_flexion", "knee", "ankle") for s in "rl"]
    lacking = [n for n in ["time", "root_x", *sagittal] if n not in named]
    if lacking:
        raise InvalidInputError(f"{table.path} misses {', '.join(lacking)}")
    angles = {n: named[n] for n in joints if n in named}
    missing = tuple(n for n in joints if n not in named)
    return Channels("own", "radians", named["time"], angles, {}, missing)
