"""Worlds of cells: reward and policy of the learner and of the expert, and where they go."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from walking_irl.arrays import Array, Indices
from walking_irl.recording import style
from walking_irl.recording.drawing import outline, shade, text_2d
from walking_irl.recording.experiment import Clock

FRAMES, LAST_FRAMES = 48, 120
GAP = (1.5, 3.4)
"""Between two grids, in cells: beside and below each other."""
MARGIN = (1.0, 2.6, 1.0, 1.0)
"""Left, above, right and below all grids, in cells."""
ARROW = 0.62
"""Length of an arrow, in cells."""
TURNED = 0.5
"""Steps of two policies that differ by more in a direction go different ways."""
AGREEMENT = "curves/agreement"


class GridMotion(NamedTuple):
    """A policy and the reward that it is the best for, by cell; row 0 is at the top."""

    arrows: Array
    """Mean (row, column) step, shape (size, size, 2)."""
    visits: Array
    """Discounted expected visits, shape (size, size)."""
    reward: Array | None
    """Shape (size, size), or None where the policy is not one of a reward."""


class Landmarks(NamedTuple):
    """What lies in a grid."""

    regions: Array = np.empty((0, 2, 2))
    """Upper left and lower right corner (column, row) of each region, shape (n, 2, 2)."""
    objects: Array = np.empty((0, 2))
    """Middle (column, row) of each object, shape (m, 2)."""
    inner: Indices = np.empty(0, np.intp)
    """Index of the colour within each, shape (m,)."""
    outer: Indices = np.empty(0, np.intp)
    """Index of the colour around each, shape (m,)."""


class GridworldView:
    """Shows grids: the learner's left or above, the expert's right or below.

    Some are coloured by reward and carry the policy's arrows, others are coloured by visits.

    Args:
        title: Name of the view.
        size: Cells along a side.
        landmarks: What lies in the grid.
        expert: The expert's policy and reward, or None where they are not known.
        is_square: Whether the expert's grids stand below the learner's, else all in a row.
    """

    curves_name = "Agreement"

    def __init__(
        self,
        title: str,
        size: int,
        landmarks: Landmarks,
        expert: GridMotion | None = None,
        *,
        is_square: bool = False,
    ) -> None:
        self.title, self.size, self.landmarks, self.expert = title, size, landmarks, expert
        order = {"learner/reward": (0, 0), "learner/visits": (1, 0)}
        if expert is not None:
            below = {"expert/reward": (0, 1), "expert/visits": (1, 1)}
            beside = {"expert/reward": (3, 0), "expert/visits": (2, 0)}
            order |= below if is_square else beside
        self._corner = {name: (size + np.array(GAP)) * place for name, place in order.items()}

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log the expert's grids, and the names of all."""
        names = {"learner/reward": "learner: reward, policy",
                 "learner/visits": "learner: visits", "expert/visits": "expert: visits",
                 "expert/reward": "expert: true reward, policy"}  # fmt: skip
        at = np.array(list(self._corner.values())) + [self.size / 2, -2.1]
        stream.log("world/names", text_2d(at, [names[name] for name in self._corner]), static=True)
        for name, corner in self._corner.items():
            stream.log(f"world/{name}", rr.Transform3D(translation=[*corner, 0.0]), static=True)
            box = outline(np.zeros((1, 2)), np.full((1, 2), float(self.size)))
            lines = rr.LineStrips2D(box, colors=[style.FRAME], radii=rr.Radius.ui_points([0.8]))
            stream.log(f"world/{name}/frame", lines, static=True)
            if name.endswith("reward"):
                self._log_landmarks(stream, f"world/{name}")
        if self.expert is not None:
            self._log_policy(stream, "expert", self.expert, np.zeros(self.size**2), static=True)
            line = rr.SeriesLines(
                names=["cells where both go the same way [%]"],
                colors=[style.LEARNER],
                interpolation_mode="StepAfter",
            )
            stream.log(AGREEMENT, line, static=True)

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, motion: GridMotion, is_last: bool
    ) -> int:
        """Show one policy."""
        clock.set(stream)
        differs = np.zeros(self.size**2)
        if self.expert is not None:
            apart = np.abs(self.expert.arrows - motion.arrows).max(axis=-1)
            differs = (apart > TURNED).ravel().astype(float)
            stream.log(AGREEMENT, rr.Scalars(100 * (1 - differs.mean())))
        self._log_policy(stream, "learner", motion, differs)
        return LAST_FRAMES if is_last else FRAMES

    def view(self) -> rrb.View:
        """All grids in one plane."""
        left, above, right, below = MARGIN
        width, height = np.max(list(self._corner.values()), axis=0) + self.size
        return rrb.Spatial2DView(
            origin="/world",
            name=self.title,
            background=style.PAPER,
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-left, width + right), y_range=(-above, height + below)
            ),
        )

    def curves(self) -> list[str]:
        """How many cells' actions are the expert's."""
        return [] if self.expert is None else [f"/{AGREEMENT}"]

    def describe(self) -> str:
        """One sentence for the summary."""
        where = "of the regions " if len(self.landmarks.regions) else ""
        learner = (
            f"the grid as the learner sees it: its reward {where}in amber, its policy as arrows, "
            "and in blue how often each cell is visited (discounted)"
        )
        if len(self.landmarks.objects):
            learner += "; dots are objects with an inner and an outer colour"
        if self.expert is None:
            return learner
        return (
            f"{learner}; in red the expert's visits and beside them its true reward and policy. "
            "Blue arrows go where the expert's do not"
        )

    def _log_policy(
        self, stream: rr.RecordingStream, who: str, motion: GridMotion, differs: Array,
        static: bool = False,
    ) -> None:  # fmt: skip
        known = motion if self.expert is None else self.expert
        visits = np.sqrt(motion.visits / known.visits.max())  # most cells are visited rarely
        colour = style.LEARNER if who == "learner" else style.EXPERT
        cells = shade(_share(motion.reward, known.reward, visits.shape), style.POLYHEDRON)
        _log_cells(stream, f"{who}/reward", cells, static)
        _log_cells(stream, f"{who}/visits", shade(visits, colour), static)
        rows, columns = np.divmod(np.arange(self.size**2), self.size)
        centre = np.c_[columns + 0.5, rows + 0.5]
        vector = ARROW * motion.arrows.reshape(-1, 2)[:, ::-1]
        colours = np.where(differs[:, None] > 0, style.LEARNER, style.INK)
        arrows = rr.Arrows2D(
            origins=centre - vector / 2, vectors=vector, colors=colours.astype(np.uint8),
            radii=np.where(differs > 0, 0.075, 0.045), draw_order=20.0,
        )  # fmt: skip
        stream.log(f"world/{who}/reward/policy", arrows, static=static)

    def _log_landmarks(self, stream: rr.RecordingStream, root: str) -> None:
        there = self.landmarks
        if len(there.regions):
            lines = rr.LineStrips2D(
                outline(there.regions[:, 0], there.regions[:, 1]),
                colors=[style.POLYHEDRON_EDGE],
                radii=rr.Radius.ui_points([0.8]),
            )
            stream.log(f"{root}/regions", lines, static=True)
        palette = np.array(style.OTHERS, np.uint8)[[2, 1, 0, 3]]  # the first two far apart
        for name, kind, radius in (("outer", there.outer, 0.42), ("inner", there.inner, 0.22)):
            if len(there.objects):
                dots = rr.Points2D(
                    there.objects, colors=palette[kind % len(palette)], radii=[radius],
                    draw_order=11.0 - radius,
                )  # fmt: skip
                stream.log(f"{root}/objects/{name}", dots, static=True)


def _share(reward: Array | None, known: Array | None, shape: tuple[int, ...]) -> Array:
    """A reward between the least and the largest that is known."""
    if reward is None:
        return np.zeros(shape)
    scale = reward if known is None else known
    return np.asarray((reward - scale.min()) / (float(np.ptp(scale)) or 1.0))


def _log_cells(
    stream: rr.RecordingStream, path: str, cells: NDArray[np.uint8], static: bool
) -> None:
    image = rr.Image(cells, magnification_filter="nearest")
    stream.log(f"world/{path}/cells", image, static=static)
