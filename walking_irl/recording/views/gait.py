"""The learner's walker, the expert's as a ghost with it, and what moves them: ``/world``."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from walking_irl.arrays import Array
from walking_irl.recording import style
from walking_irl.recording.experiment import Clock
from walking_irl.recording.views.body_geometry import body_names, log_body
from walking_irl.recording.views.motion import Frames, check_rollout, play
from walking_irl.types import Rollout

FORCE_SCALE = 1.0e-3  # [m/N]
GHOST = style.with_alpha(style.GHOST, 0.62)
MAIN_JOINTS = ("hip_flexion_r", "knee_r", "ankle_r")
SPEED, FORCE = "curves/speed", "curves/vertical_force"
BESIDE = 0.9
"""How far to the learner's left the ghost walks [m]."""
TRAIL_FRAMES = 80
CYCLES, LAST_CYCLES = 2, 8
"""Gait cycles played per iteration."""
LONGEST_CYCLE = 1.8
"""A rollout up to this long is one cycle, to be repeated; a longer one is played as it is [s]."""
LONG_SECONDS, LAST_LONG_SECONDS = 2.4, 9.0
"""How much of a long rollout is played per iteration [s]."""


class WalkerView:
    """Shows walks of one body.

    Learner and ghost start every iteration side by side and in the same phase, and then walk at
    their own pace: what differs is what can be seen. The learner never jumps in x.

    Attributes:
        names: Of learner and ghost.
        title: Of the view with both.
        eye: Where the camera is, and what it looks at [m].

    Args:
        model: The body; ``nq == nv`` and its first joint is x.
        expert: The expert's walk, or None where there is no ghost to show.
    """

    curves_name = "Joints [deg]"
    names = ("learner", "expert")
    title = "Walking: learner, and the expert as a red ghost"
    eye = ((2.0, -1.6, 1.2), (0.0, 0.4, 0.84))

    def __init__(self, model: mujoco.MjModel, expert: Rollout | None = None) -> None:
        self.model = model
        self.expert = expert
        if expert is not None:
            check_rollout(model, expert)
        self._x = 0.0
        self._played: Frames | None = None
        self._names = body_names(model)

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log bodies, and the style of everything that moves."""
        stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        log_body(stream, self.model, "world/walker")
        if self.expert is not None:
            log_body(stream, self.model, "world/expert", GHOST)
        arrows = rr.Arrows3D.from_fields(colors=[style.FORCE], radii=[0.018])
        stream.log("world/contacts", arrows, static=True)
        trail = rr.Points3D.from_fields(colors=[style.TRAIL], radii=[0.009])
        stream.log("world/com_trail", trail, static=True)
        for _, name in self._hinges():
            lines = rr.SeriesLines(names=[name])
            if self.expert is None and name in MAIN_JOINTS:
                colour = style.OTHERS[MAIN_JOINTS.index(name)]
                lines = rr.SeriesLines(names=[name], colors=[colour], widths=[2.0])
            if self.expert is not None:
                names = [f"{name} {who}" for who in self.names]
                lines = rr.SeriesLines(names=names, colors=[style.LEARNER, style.EXPERT])
            stream.log(_joint_path(name), lines, static=True)
        names = ["walker"] if self.expert is None else list(self.names)
        colours = [style.LEARNER, style.EXPERT][: len(names)]
        for path in (SPEED, FORCE):
            stream.log(path, rr.SeriesLines(names=names, colors=colours), static=True)

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, motion: Rollout, is_last: bool
    ) -> int:
        """Play some cycles of a walk, from where the last one ended."""
        check_rollout(self.model, motion)
        n = _n_frames(motion, is_last)
        learner = play(self.model, motion, n, self._x)
        self._log_walker(stream, clock, "world/walker", learner)
        index = clock.columns(n)
        follow = np.c_[learner.com[:, :1], np.zeros((n, 2))]
        stream.send_columns("world/follow", index, rr.Transform3D.columns(translation=follow))
        stream.send_columns("world/com_trail", index, rr.Points3D.columns(positions=learner.com))
        arrows = rr.Arrows3D.columns(
            origins=learner.force_at, vectors=FORCE_SCALE * learner.force
        ).partition(learner.n_contacts)
        stream.send_columns("world/contacts", index, arrows)
        shown = [learner]
        if self.expert is not None:
            ghost = self._ghost(self.expert, n)
            self._log_walker(stream, clock, "world/expert", beside(ghost))
            shown.append(ghost)
        self._log_joints(stream, clock, np.stack([f.q for f in shown], axis=2))
        for path, of in ((SPEED, speed), (FORCE, self._load)):
            values = rr.Scalars.columns(scalars=np.stack([of(f) for f in shown], axis=1).ravel())
            stream.send_columns(path, index, values.partition([len(shown)] * n))
        self._x += distance(motion, n)
        return n

    def view(self) -> rrb.View | rrb.Container:
        """The camera walks along."""
        since = rrb.VisibleTimeRange(
            "frame",
            start=rrb.TimeRangeBoundary.cursor_relative(seq=-TRAIL_FRAMES),
            end=rrb.TimeRangeBoundary.cursor_relative(),
        )
        return rrb.Spatial3DView(
            origin="/world/follow",
            contents=["/world/**"],
            name="Walking" if self.expert is None else self.title,
            background=style.PAPER,
            line_grid=rrb.LineGrid3D(
                visible=True,
                spacing=0.5,
                color=style.with_alpha(style.FRAME, 0.6),
                plane=rr.components.Plane3D.XY,
            ),
            eye_controls=rrb.EyeControls3D(
                position=self.eye[0], look_target=self.eye[1], eye_up=(0, 0, 1)
            ),
            overrides={"/world/com_trail": [rrb.VisibleTimeRanges([since])]},
        )

    def curves(self) -> list[str]:
        """The joints of the right leg that move most, or all joints of a body without them."""
        names = [name for _, name in self._hinges()]
        return [
            f"/{_joint_path(n)}" for n in names if n in MAIN_JOINTS or not {*MAIN_JOINTS} & {*names}
        ]

    def plots(self) -> dict[str, list[str]]:
        """Further curves, by name and unit."""
        return {"Speed [m/s]": [f"/{SPEED}"], "Vertical force [body weights]": [f"/{FORCE}"]}

    def describe(self) -> str:
        """One sentence for the summary."""
        ghost = " with the expert as a **red ghost**" if self.expert is not None else ""
        return (
            f"the learner's gait{ghost}; they start each iteration together, "
            "and orange arrows are ground reaction forces"
        )

    def _ghost(self, expert: Rollout, n: int) -> Frames:
        """The expert's walk from where the learner is; it is the same one in every iteration."""
        if self._played is None or len(self._played) < n:
            self._played = play(self.model, expert, n, 0.0)
        return self._played.part(n, self._x)

    def _load(self, frames: Frames) -> Array:
        """Vertical ground reaction force on all feet [body weights], shape (n,)."""
        owner = np.repeat(np.arange(len(frames)), frames.n_contacts.astype(int))
        total = np.bincount(owner, frames.force[:, 2], minlength=len(frames))
        gravity = abs(float(self.model.opt.gravity[2]))
        return np.asarray(total / (float(self.model.body_subtreemass[0]) * gravity))

    def _log_walker(
        self, stream: rr.RecordingStream, clock: Clock, root: str, frames: Frames
    ) -> None:
        index = clock.columns(len(frames))
        for b, name in self._names.items():
            pose = rr.Transform3D.columns(
                translation=frames.position[:, b], quaternion=frames.orientation[:, b]
            )
            stream.send_columns(f"{root}/{name}", index, pose)

    def _log_joints(self, stream: rr.RecordingStream, clock: Clock, q: Array) -> None:
        """Angles of shape (n, nv, walkers)."""
        n, _, n_walkers = q.shape
        for j, name in self._hinges():
            degrees = rr.Scalars.columns(scalars=np.rad2deg(q[:, j]).ravel())
            stream.send_columns(
                _joint_path(name), clock.columns(n), degrees.partition([n_walkers] * n)
            )

    def _hinges(self) -> list[tuple[int, str]]:
        hinge = mujoco.mjtJoint.mjJNT_HINGE
        is_hinge = self.model.jnt_type == hinge
        return [(j, self.model.joint(j).name) for j in np.flatnonzero(is_hinge).tolist()]


def beside(ghost: Frames) -> Frames:
    """The same walk, moved to the learner's left."""
    return replace(ghost, position=ghost.position + [0.0, BESIDE, 0.0])


def speed(frames: Frames) -> Array:
    """Forward speed of the centre of mass [m/s], shape (n,)."""
    if len(frames) < 2:
        return np.zeros(len(frames))
    return np.asarray(np.gradient(frames.com[:, 0]) * style.PLAYBACK_RATE)


def _joint_path(name: str) -> str:
    return f"joints/{rr.escape_entity_path_part(name)}"


def distance(motion: Rollout, n_frames: int) -> float:
    """How far a walk has come after ``n_frames`` frames, when the next one begins [m]."""
    seconds = n_frames / style.PLAYBACK_RATE
    lap, rest = divmod(seconds, float(motion.time[-1] - motion.time[0]))
    x = motion.q[:, 0] - motion.q[0, 0]
    return float(lap * x[-1] + np.interp(rest, motion.time - motion.time[0], x))


def _n_frames(motion: Rollout, is_last: bool) -> int:
    length = float(motion.time[-1] - motion.time[0])
    seconds = length * (LAST_CYCLES if is_last else CYCLES)
    if length > LONGEST_CYCLE:
        seconds = min(length, LAST_LONG_SECONDS if is_last else LONG_SECONDS)
    return max(1, round(seconds * style.PLAYBACK_RATE))
