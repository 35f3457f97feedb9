"""Walking paths from above: people on their way to each goal, the expert's beside the learner's."""

from __future__ import annotations

import math

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from walking_irl.arrays import Array
from walking_irl.domains.path.walking_path import PathPicture
from walking_irl.recording import style
from walking_irl.recording.drawing import log_pair, text_3d
from walking_irl.recording.experiment import Clock

PACE, LAST_PACE = 4.0, 1.0
"""How many times faster than life walks are played, and the last ones; long ones even faster."""
LONGEST, LAST_LONGEST = 100, 480
"""Most frames of an iteration, the rest at the goal left aside."""
REST = 10
"""Frames at the goal."""
SHOULDERS, HEAD = (0.14, 0.30, 0.10), (0.14, 0.12, 0.12)
"""Half sizes of a person as a symbol on the floor, larger than life [m]."""
SHOULDER_HEIGHT, HEAD_HEIGHT = 0.15, 0.25  # [m]
FLOOR = 0.01
TICK_SECONDS = 0.5
"""Between arrows of the heading along a path [s]."""
TICK = 0.28  # [m]


class PathView:
    """Shows one walk to each goal, all at the same time.

    Args:
        goals: x [m], y [m] and heading [rad] of each goal, shape (n, 3).
        expert: The expert's paths, or None where they are not known.
    """

    curves_name = "Speed [m/s]"

    def __init__(self, goals: Array, expert: PathPicture | None = None) -> None:
        self.goals = goals
        self.expert = expert

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log start and goals, the expert's paths, and the style of people."""
        stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        poses = np.vstack([np.zeros(3), self.goals])
        pads = rr.Cylinders3D(
            lengths=[0.012], radii=[0.3], centers=np.c_[poses[:, :2], np.zeros(len(poses))],
            colors=[style.with_alpha(style.FRAME, 0.45)], fill_mode="solid",
        )  # fmt: skip
        stream.log("world/goals", pads, static=True)
        faces = rr.Arrows3D(
            origins=np.c_[poses[:, :2], np.full(len(poses), 0.02)],
            vectors=0.55 * _towards(poses[:, 2]), colors=[style.INK], radii=[0.025],
        )  # fmt: skip
        stream.log("world/goals/heading", faces, static=True)
        names = ["start"] + [f"goal {i + 1}" for i in range(len(self.goals))]
        at = np.c_[poses[:, :2] - 0.42 * _towards(poses[:, 2])[:, :2], np.zeros(len(poses))]
        at[1:, :2] = poses[1:, :2] + 0.62 * _towards(poses[1:, 2])[:, :2]
        stream.log("world/goals/names", text_3d(at, names), static=True)
        self._log_scale(stream)
        _log_look(stream, "world/learner", len(self.goals), style.LEARNER, 1.0)
        if self.expert is not None:
            _log_look(stream, "world/expert", len(self.goals), style.GHOST, 0.62)
            _log_paths(stream, "world/expert", self.expert, style.GHOST, 0.035, static=True)
        for i in range(len(self.goals)):
            log_pair(stream, curve_path(i), f"goal {i + 1}", self.expert is not None)

    def _log_scale(self, stream: rr.RecordingStream) -> None:
        """A bar of one metre, left of and below everything."""
        points = np.vstack([np.zeros(2), self.goals[:, :2]])
        x, y = points.min(axis=0) - [0.3, 0.6]
        ends = np.array([[x, y, 0.0], [x + 1.0, y, 0.0]])
        up = np.array([0.0, 0.08, 0.0])
        strips = [ends, *([end - up, end + up] for end in ends)]
        bar = rr.LineStrips3D(strips, colors=[style.INK], radii=rr.Radius.ui_points([1.5]))
        stream.log("world/scale", bar, static=True)
        stream.log("world/scale/name", text_3d(ends.mean(axis=0)[None], ["1 m"]), static=True)

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, motion: PathPicture, is_last: bool
    ) -> int:
        """Walk to all goals at once."""
        clock.set(stream)
        _log_paths(stream, "world/learner", motion, style.LEARNER, 0.016)
        shown = [motion] if self.expert is None else [motion, self.expert]
        pace, most = (LAST_PACE, LAST_LONGEST) if is_last else (PACE, LONGEST)
        seconds = max(float(t[-1]) for picture in shown for t in picture.time)
        pace = max(pace, seconds * style.PLAYBACK_RATE / most)
        n = math.ceil(seconds / pace * style.PLAYBACK_RATE) + REST
        time: Array = pace * np.arange(n, dtype=np.float64) / style.PLAYBACK_RATE
        for who, picture in zip(("learner", "expert"), shown, strict=False):
            _log_people(stream, clock, f"world/{who}", *at_times(picture, time))
        for i in range(len(self.goals)):
            speed = np.stack([_speed(picture, i, time) for picture in shown], axis=1)
            values = rr.Scalars.columns(scalars=speed.ravel()).partition([len(shown)] * n)
            stream.send_columns(curve_path(i), clock.columns(n), values)
        return n

    def view(self) -> rrb.View:
        """From above, north up."""
        points = np.vstack([np.zeros(2), self.goals[:, :2]])
        x, y = (points.max(axis=0) + points.min(axis=0)) / 2
        width, depth = np.ptp(points, axis=0) + 1.6
        height = max(0.85 * width, 1.0 * depth)
        return rrb.Spatial3DView(
            origin="/world",
            name="From above: learner (blue) and expert (red)" if self.expert else "From above",
            background=style.PAPER,
            line_grid=rrb.LineGrid3D(
                visible=True,
                spacing=1.0,
                color=style.with_alpha(style.FRAME, 0.5),
                plane=rr.components.Plane3D.XY,
            ),
            eye_controls=rrb.EyeControls3D(
                position=(x, y, height), look_target=(x, y, 0.0), eye_up=(0, 1, 0)
            ),
        )

    def curves(self) -> list[str]:
        """The speed on the way to each goal."""
        return [f"/{curve_path(i)}" for i in range(len(self.goals))]

    def describe(self) -> str:
        """One sentence for the summary."""
        also = ", in red the expert's" if self.expert is not None else ""
        return (
            f"the learner's paths (**blue**{also}), from the start to every "
            f"goal at once, {PACE:g} times as fast as in life and in the end at life's pace; "
            f"arrows along a path show the heading every {TICK_SECONDS:g} s"
        )


def curve_path(i: int) -> str:
    """Entity of the speed on the way to goal ``i``."""
    return f"curves/{rr.escape_entity_path_part(f'goal {i + 1}')}"


def at_times(picture: PathPicture, time: Array) -> tuple[Array, Array]:
    """Positions (n, goals, 2) and headings (n, goals) at some times; who arrives stays there."""
    points, headings = [], []
    for t, xy, heading in zip(picture.time, picture.points, picture.heading, strict=True):
        points.append(np.stack([np.interp(time, t, x) for x in xy.T], axis=1))
        headings.append(np.interp(time, t, heading))
    return np.stack(points, axis=1), np.stack(headings, axis=1)


def _speed(picture: PathPicture, i: int, time: Array) -> Array:
    """Speed on the way to goal ``i`` [m/s], shape (n,)."""
    t, xy = picture.time[i], picture.points[i]
    speed = np.linalg.norm(np.diff(xy, axis=0), axis=1) / np.diff(t)
    middle = (t[1:] + t[:-1]) / 2
    return np.asarray(np.interp(time, middle, speed, left=0.0, right=0.0))


def _towards(heading: Array) -> Array:
    """Unit vectors on the floor, shape (n, 3)."""
    return np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=-1)


def _log_look(
    stream: rr.RecordingStream, root: str, n: int, colour: style.Colour, alpha: float
) -> None:
    """Sizes and colours of ``n`` people: shoulders, then head."""
    skin = style.with_alpha(style.SKIN if alpha == 1.0 else colour, alpha)
    look = rr.Ellipsoids3D.from_fields(
        half_sizes=[SHOULDERS] * n + [HEAD] * n,
        colors=[style.with_alpha(colour, alpha)] * n + [skin] * n,
        fill_mode="solid",
    )
    stream.log(f"{root}/people", look, static=True)


def _log_people(
    stream: rr.RecordingStream, clock: Clock, root: str, at: Array, heading: Array
) -> None:
    n, people = heading.shape
    height = np.broadcast_to(np.repeat([SHOULDER_HEIGHT, HEAD_HEIGHT], people), (n, 2 * people))
    centres = np.concatenate([np.tile(at, (1, 2, 1)), height[..., None]], axis=2)
    half = np.tile(heading, (1, 2)) / 2
    turn = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=2)
    columns = rr.Ellipsoids3D.columns(
        centers=centres.reshape(-1, 3), quaternions=turn.reshape(-1, 4)
    )
    stream.send_columns(f"{root}/people", clock.columns(n), columns.partition([2 * people] * n))


def _log_paths(
    stream: rr.RecordingStream, root: str, picture: PathPicture, colour: style.Colour,
    radius: float, static: bool = False,
) -> None:  # fmt: skip
    """The way to every goal, with arrows of the heading along it; thinner ones lie above."""
    z = FLOOR * (1.0 + 0.035 / radius)
    strips = [np.c_[xy, np.full(len(xy), z)] for xy in picture.points]
    stream.log(
        f"{root}/path", rr.LineStrips3D(strips, colors=[colour], radii=[radius]), static=static
    )
    origins, vectors = [], []
    for i, t in enumerate(picture.time):
        ticks = np.arange(TICK_SECONDS, t[-1], TICK_SECONDS)
        at, heading = (x[:, i] for x in at_times(picture, ticks))
        origins.append(np.c_[at, np.full(len(at), z)])
        vectors.append(TICK * _towards(heading))
    arrows = rr.Arrows3D(
        origins=np.vstack(origins), vectors=np.vstack(vectors), colors=[colour], radii=[radius]
    )
    stream.log(f"{root}/heading", arrows, static=static)
