"""Recordings made from model gaits, written as users of OpenSim, spreadsheets or NumPy would."""

import io

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from walking_irl.domains.humanoid.gait.gait import whole_cycle
from walking_irl.domains.humanoid.recorded.axes import HIPS_IN_PELVIS, TO_MODEL
from walking_irl.domains.humanoid.recorded.feet import hips_height
from walking_irl.domains.humanoid.recorded.naming import SIDED

ANGLES = ("tilt", "list", "rotation")


def positions(gait, walker, time):
    """Joint positions of a gait at any times, by the Fourier series of its knots."""
    q, L, T = whole_cycle(gait, walker.mirror), gait.step_length, gait.half_period
    n, phase = len(q), time / (2 * T)
    q[:, 0] -= 2 * L * np.arange(n) / n
    f = np.fft.rfft(q, axis=0)
    k = np.arange(len(f))
    f *= np.where((k == 0) | (k == n / 2), 1, 2)[:, None] / n
    out = np.real(np.exp(2j * np.pi * np.outer(phase, k)) @ f)
    out[:, 0] += 2 * L * phase
    return out


def recording(
    gait,
    walker,
    *,
    cycles=2.2,
    hz=100.0,
    start=0.0,
    noise=0.0,
    heading=25.0,
    belt=0.0,
    size=1.0,
    turn=None,
    rng=None,
):
    """Columns of an OpenSim recording in degrees and metres, y up.

    ``noise`` [deg] is smooth, as errors of markers are; ``size`` is the person's over the model's;
    ``belt`` [m/s] holds the person in place; ``turn`` = (x, radius) bends the way to the left.
    """
    time = np.arange(0, cycles * 2 * gait.half_period * np.sqrt(size), 1 / hz)
    q = positions(gait, walker, time / np.sqrt(size) + start)
    q[:, 0] -= q[0, 0]
    if noise:
        white = rng.normal(size=q[:, 6:].shape)
        smooth = gaussian_filter1d(white, 8, axis=0, mode="wrap")
        q[:, 6:] += np.deg2rad(noise) * smooth / smooth.std()
    q[:, 2] += hips_height(walker)
    q[:, :3] *= size
    q[:, 0] -= belt * time
    way = np.zeros(len(q))
    if turn is not None:
        first, radius = turn
        on = np.maximum(q[:, 0] - first, 0)
        way = on / radius
        x = np.minimum(q[:, 0], first) + (radius - q[:, 1]) * np.sin(way)
        y = radius - (radius - q[:, 1]) * np.cos(way)
        q[:, 0], q[:, 1] = x, y
    turned = Rotation.from_euler("Z", np.deg2rad(heading))
    hips = turned.apply(q[:, :3])
    pelvis = turned * Rotation.from_euler("Z", way[:, None]) * Rotation.from_euler("ZXY", q[:, 3:6])
    opensim = Rotation.from_matrix(TO_MODEL.T @ pelvis.as_matrix() @ TO_MODEL)
    tilt = np.rad2deg(np.unwrap(opensim.as_euler("ZXY"), axis=0))
    origin = hips @ TO_MODEL - opensim.apply(HIPS_IN_PELVIS) * size
    at = {j: i for i, j in enumerate(walker.joints)}
    columns = {"time": time + 3.5}
    columns |= {f"pelvis_{n}": tilt[:, i] for i, n in enumerate(ANGLES)}
    columns |= {f"pelvis_t{a}": origin[:, i] for i, a in enumerate("xyz")}
    for side in "rl":
        for column, joint in SIDED.items():
            columns[f"{column}_{side}"] = np.rad2deg(q[:, at[f"{joint}_{side}"]])
    columns["lumbar_extension"] = -np.rad2deg(q[:, at["lumbar_flexion"]])
    columns["lumbar_bending"] = np.rad2deg(q[:, at["lumbar_bend"]])
    columns["lumbar_rotation"] = np.rad2deg(q[:, at["lumbar_rotation"]])
    return columns


def is_angle(name):
    return name != "time" and not name.startswith("pelvis_t") or name == "pelvis_tilt"


def radians(columns):
    return {n: np.deg2rad(c) if is_angle(n) else c for n, c in columns.items()}


def gait2392(columns):
    """Knees bend to the other side."""
    return {n: -c if n.startswith("knee") else c for n, c in columns.items()}


def z_up(columns):
    """The laboratory lies on its side: its z is up."""
    euler = np.deg2rad(np.column_stack([columns[f"pelvis_{n}"] for n in ANGLES]))
    turn = Rotation.from_euler("X", np.pi / 2)
    tilt = np.rad2deg((turn * Rotation.from_euler("ZXY", euler)).as_euler("ZXY"))
    path = turn.apply(np.column_stack([columns[f"pelvis_t{a}"] for a in "xyz"]))
    out = dict(columns)
    out |= {f"pelvis_{n}": tilt[:, i] for i, n in enumerate(ANGLES)}
    return out | {f"pelvis_t{a}": path[:, i] for i, a in enumerate("xyz")}


def clinical(columns):
    """Signs and names of a gait laboratory; the thorax is left out.

    Its pelvis turns, then lists, then tilts (R. Baker 2001, Gait Posture 13:1); OpenSim's tilts
    first, about an axis of the laboratory: other angles where a walk heads 25 degrees aside.
    """
    opensim = np.deg2rad(np.column_stack([columns[f"pelvis_{n}"] for n in ANGLES]))
    pelvis = TO_MODEL @ Rotation.from_euler("ZXY", opensim).as_matrix() @ TO_MODEL.T
    rotation, side_down, tilt = np.rad2deg(Rotation.from_matrix(pelvis).as_euler("ZXY")).T
    out = {"time": columns["time"], "pelvis_tilt": tilt}
    out |= {"pelvis_obliquity": -side_down, "pelvis_rotation": rotation}
    for side in "rl":
        for name in ("hip_flexion", "hip_adduction", "hip_rotation"):
            out[f"{name}_{side}"] = columns[f"{name}_{side}"]
        out[f"knee_flexion_{side}"] = columns[f"knee_angle_{side}"]
        out[f"ankle_dorsiflexion_{side}"] = columns[f"ankle_angle_{side}"]
    return out | {n: columns[n] for n in columns if n[:8] == "pelvis_t" and n != "pelvis_tilt"}


def part(columns, rows):
    """Some rows of every column."""
    return {n: c[rows] for n, c in columns.items()}


def with_gaps(columns, first, last, names=None):
    """Cells from row ``first`` to ``last`` are empty."""
    out = {n: c.copy() for n, c in columns.items()}
    for name in names or [n for n in out if n != "time"]:
        out[name][first:last] = np.nan
    return out


def storage(columns, *, version=1, degrees="yes", paths=False, end="\n", wide=False):
    """Text of a .mot or .sto file; ``degrees`` None leaves the line out."""
    space = "  =  " if wide else "="
    lines = ["Coordinates"] if version == 1 else ["DataType=double", "OpenSimVersion=4.4"]
    lines += [f"version{space}{version}", f"nRows{space}{len(columns['time'])}"]
    lines += [f"nColumns{space}{len(columns)}"]
    lines += [f"inDegrees{space}{degrees}"] if degrees else []
    lines += ["", "Units are S.I. units (second, meters, Newtons, ...)", ""] if wide else []
    lines += ["endheader"]
    names = [f"/jointset/any/{n}/value" if paths and n != "time" else n for n in columns]
    gap = "   " if wide else "\t"
    lines += [gap.join(names)]
    lines += [gap.join("" if v != v else f"{v:.8g}" for v in row) for row in rows_of(columns)]
    return end.join(lines) + end


def sheet(columns, *, split=",", point=".", names=None, comment=None, units=None):
    """Text of a .csv file."""
    lines = [f"# {comment}"] if comment else []
    lines += [split.join(names or columns)]
    lines += [split.join(units)] if units else []
    lines += [split.join(f"{v:.8g}".replace(".", point) for v in r) for r in rows_of(columns)]
    return "\n".join(lines) + "\n"


def rows_of(columns):
    return zip(*columns.values(), strict=True)


def npz(columns):
    """Content of an .npz file."""
    out = io.BytesIO()
    np.savez_compressed(out, **columns)
    return out.getvalue()


def force_plates(gait, walker, *, size=1.0, start=0.0, cycles=2.2, hz=200.0, by_side=True):
    """Columns of the ground reaction forces of the same walk [N], as force plates give them."""
    from walking_irl.domains.humanoid.gait.realism import gait_cycle

    cycle = gait_cycle(walker, gait)
    phase0 = np.argmin(np.abs(whole_cycle(gait, walker.mirror) - cycle.q[0]).sum(1)) / len(cycle.q)
    time = np.arange(0, cycles * 2 * gait.half_period * np.sqrt(size), 1 / hz)
    phase = (time / np.sqrt(size) + start) / (2 * gait.half_period) - phase0
    at = np.arange(len(cycle.q)) / len(cycle.q)
    columns = {"time": time + 3.5}
    for i, side in enumerate("rl"):
        name = side if by_side else str(2 - i)
        vertical = np.interp(phase % 1.0, at, cycle.force[:, i], period=1.0) * walker.weight
        columns |= {f"ground_force_{name}_v{a}": 0 * vertical for a in "xz"}
        columns[f"ground_force_{name}_vy"] = vertical
        columns |= {f"ground_force_{name}_p{a}": 0 * vertical for a in "xyz"}
    return columns
