"""The linear-quadratic regulator: states over time, and one state over another."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from walking_irl.arrays import Array
from walking_irl.domains.lqr import LQRPicture
from walking_irl.recording import style
from walking_irl.recording.drawing import log_pair, outline, text_2d
from walking_irl.recording.experiment import Clock

FRAMES_PER_STEP, REST, LAST_REST = 3, 12, 60
"""Frames from one step to the next, and after the last one."""
SIDE, GAP = 1.0, 0.3
"""Of a chart."""


class LQRView:
    """Shows trajectories from the domain's start; all charts are in units of the start's state.

    Above, each axis over time; below, each axis over the next one.

    Args:
        names: Of the K axes.
        n_steps: Steps of a trajectory.
        expert: The expert's trajectory, or None where it is not known.
    """

    curves_name = "States"

    def __init__(self, names: list[str], n_steps: int, expert: LQRPicture | None = None) -> None:
        self.names, self.n_steps = names, n_steps
        self.expert = expert
        K = len(names)
        pairs = [(j, (j + 1) % K) for j in range(K)] if K > 2 else [(0, 1)][: K - 1]
        self._pairs = pairs
        columns = np.r_[np.arange(K), np.arange(len(pairs))]
        rows = np.r_[np.zeros(K), np.ones(len(pairs))]
        self._corner = np.c_[columns, rows] * (SIDE + GAP)  # upper left, shape (n, 2)

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log the charts, and the expert's trajectory."""
        boxes = outline(self._corner, self._corner + SIDE)
        frame = rr.LineStrips2D(boxes, colors=[style.FRAME], radii=rr.Radius.ui_points([1.0]))
        stream.log("world/frame", frame, static=True)
        titles = [f"{name} over time" for name in self.names]
        titles += [f"{self.names[j]} over {self.names[i]}" for i, j in self._pairs]
        at = self._corner + [SIDE / 2, -0.17]
        stream.log("world/names", text_2d(at, titles), static=True)
        self._log_ticks(stream)
        if self.expert is not None:
            lines = self._lines(self.expert)
            log_lines(stream, "world/expert/trajectory", lines, style.GHOST, 3.2, static=True)
        for who, colour, size in (("learner", style.LEARNER, 5.0), ("expert", style.EXPERT, 6.5)):
            if who == "learner" or self.expert is not None:
                dots = rr.Points2D.from_fields(
                    colors=[colour], radii=rr.Radius.ui_points([size]), draw_order=40.0 - size
                )
                stream.log(f"world/{who}/now", dots, static=True)
        for name in self.names:
            log_pair(stream, curve_path(name), name, self.expert is not None)

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, motion: LQRPicture, is_last: bool
    ) -> int:
        """Play the trajectory of one policy."""
        clock.set(stream)
        log_lines(stream, "world/learner/trajectory", self._lines(motion), style.LEARNER, 1.4)
        n_steps = len(motion.states) - 1
        n = n_steps * FRAMES_PER_STEP + (LAST_REST if is_last else REST)
        step = np.minimum(np.arange(n) / FRAMES_PER_STEP, n_steps)
        self._log_points(stream, clock, "world/learner/now", motion, step)
        shown = [motion]
        if self.expert is not None:
            self._log_points(stream, clock, "world/expert/now", self.expert, step)
            shown.append(self.expert)
        now = np.stack([at_steps(p.states, step) for p in shown], axis=2)  # (n, K, walkers)
        for j, name in enumerate(self.names):
            values = rr.Scalars.columns(scalars=now[:, j].ravel()).partition([len(shown)] * n)
            stream.send_columns(curve_path(name), clock.columns(n), values)
        return n

    def view(self) -> rrb.View:
        """All charts in one plane."""
        width, height = self._corner.max(axis=0) + SIDE
        return rrb.Spatial2DView(
            origin="/world",
            name="States: learner (blue) and expert (red)" if self.expert else "States",
            background=style.PAPER,
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-0.15, width + 0.1), y_range=(-0.28, height + 0.15)
            ),
        )

    def curves(self) -> list[str]:
        """The state of each axis."""
        return [f"/{curve_path(name)}" for name in self.names]

    def describe(self) -> str:
        """One sentence for the summary."""
        also = ", **red** is the expert's" if self.expert is not None else ""
        return (
            "every axis on its way from the start to zero under the learner's gains "
            f"(**blue**{also}): above over time, below one axis over another; 1 is each axis's "
            "start"
        )

    def _log_ticks(self, stream: rr.RecordingStream) -> None:
        """0 and 1 on every axis of a state, and the number of steps under time's."""
        K, at, labels = len(self.names), [], []
        for i, corner in enumerate(self._corner):
            end = f"{self.n_steps} steps" if i < K else "1"
            at += list(corner + np.array([[-0.07, -0.05], [-0.07, 0.92], [0.93, 1.01]]))
            labels += ["1", "0", end]
        stream.log("world/ticks", text_2d(np.array(at), labels), static=True)

    def _lines(self, picture: LQRPicture) -> Array:
        """The whole trajectory in every chart, shape (n_charts, T + 1, 2)."""
        return self._places(picture, np.arange(len(picture.states), dtype=np.float64))

    def _places(self, picture: LQRPicture, step: Array) -> Array:
        """Where the states at some steps lie in every chart, shape (n_charts, n, 2)."""
        n_steps = len(picture.states) - 1
        x = at_steps(picture.states / picture.states[0], step)
        charts = [np.c_[step / n_steps, 1.0 - x[:, j]] for j in range(x.shape[1])]
        charts += [np.c_[x[:, i], 1.0 - x[:, j]] for i, j in self._pairs]
        return np.asarray(self._corner[:, None] + SIDE * np.stack(charts))

    def _log_points(
        self, stream: rr.RecordingStream, clock: Clock, path: str, picture: LQRPicture,
        step: Array,
    ) -> None:  # fmt: skip
        places = self._places(picture, step).transpose(1, 0, 2)
        points = rr.Points2D.columns(positions=places.reshape(-1, 2))
        stream.send_columns(
            path, clock.columns(len(step)), points.partition([len(self._corner)] * len(step))
        )


def curve_path(name: str) -> str:
    """Entity of one axis's state."""
    return f"curves/{rr.escape_entity_path_part(name)}"


def at_steps(states: Array, step: Array) -> Array:
    """States between the steps, shape (T + 1, K) -> (n, K)."""
    steps = np.arange(len(states))
    return np.stack([np.interp(step, steps, x) for x in states.T], axis=1)


def log_lines(
    stream: rr.RecordingStream, path: str, lines: Array, colour: style.Colour, width: float,
    static: bool = False,
) -> None:  # fmt: skip
    """Log curves of shape (n, T, 2); wider ones lie below."""
    strips = rr.LineStrips2D(
        lines, colors=[colour], radii=rr.Radius.ui_points([width]), draw_order=20.0 - width
    )
    stream.log(path, strips, static=static)
