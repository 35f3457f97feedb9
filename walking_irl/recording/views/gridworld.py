"""Worlds on a grid: reward and policy of the learner and of the expert, and where they go."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from walking_irl.arrays import Array, Indices
from walking_irl.recording import style
from walking_irl.recording.drawing import outline, shade, text_2d
from walking_irl.recording.experiment import Clock

FRAMES, LAST_FRAMES = 48, 120
GAP = 1.5
"""Between two grids, in cells."""
MARGIN = (1.0, 2.6, 1.0, 1.0)
"""Left, above, right and below all grids, in cells."""
ARROW = 0.62
"""Length of an arrow, in cells."""
OUTER, INNER = 0.34, 0.17
"""Radius of an object's two colours, in cells."""
AGREEMENT = "curves/agreement"
REWARD, VISITS = {"learner": 0, "expert": 3}, {"learner": 1, "expert": 2}
"""Which grid is whose, from the left."""


class GridMotion(NamedTuple):
    """A policy, and the reward that it is the best for."""

    arrows: Array
    """Mean (row, column) step of the actions in each cell, shape (size, size, 2)."""
    visits: Array
    """Discounted expected visits of each cell, shape (size, size)."""
    reward: Array | None
    """Of each cell, shape (size, size), or None where the policy is not one of a reward."""


class GridworldView:
    """Shows grids side by side: the learner's left, the expert's right.

    The outer grids are coloured by reward and carry the policy's arrows, the inner ones by visits.

    Args:
        size: Cells along a side.
        expert: The expert's policy and reward, or None where they are not known.
        regions: Region of each cell, -1 for none, shape (size, size); their outlines are drawn.
        objects: Objects in cells, with ``cells``, ``inner`` and ``outer`` colours, (n,) each.
    """

    curves_name = "Agreement"

    def __init__(
        self,
        size: int,
        expert: GridMotion | None = None,
        *,
        regions: Indices | None = None,
        objects: Any = None,
    ) -> None:
        self.size, self.expert = size, expert
        self.regions, self.objects = regions, objects

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log what lies in the world, the expert's grids, and the names of all."""
        names = ["learner: reward, policy", "learner: visits"]
        names += ["expert: visits", "expert: true reward, policy"][: 2 * self._has_expert]
        at = np.array([[self._left(i) + self.size / 2, -2.1] for i in range(len(names))])
        stream.log("world/names", text_2d(at, names), static=True)
        for who in ("learner", "expert")[: 1 + self._has_expert]:
            self._log_marks(stream, who)
        if self.expert is not None:
            self._log_reward(stream, "expert", self.expert, static=True)
            self._log_visits(stream, "expert", self.expert, style.EXPERT, static=True)
            self._log_arrows(stream, "expert", self.expert, np.zeros(self.size**2), static=True)
            name = rr.SeriesLines(
                names=["cells where both go the same way [%]"],
                colors=[style.LEARNER],
                interpolation_mode="StepAfter",
            )
            stream.log(AGREEMENT, name, static=True)

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, motion: GridMotion, is_last: bool
    ) -> int:
        """Show one policy."""
        clock.set(stream)
        differs = np.zeros(self.size**2)
        if self.expert is not None:
            other = self.expert.arrows != motion.arrows
            differs = other.any(axis=-1).ravel().astype(float)
            stream.log(AGREEMENT, rr.Scalars(100 * (1 - differs.mean())))
        self._log_reward(stream, "learner", motion)
        self._log_visits(stream, "learner", motion, style.LEARNER)
        self._log_arrows(stream, "learner", motion, differs)
        return LAST_FRAMES if is_last else FRAMES

    def view(self) -> rrb.View:
        """All grids in one plane."""
        left, above, right, below = MARGIN
        n = 4 if self._has_expert else 2
        return rrb.Spatial2DView(
            origin="/world",
            name="Gridworld" if self.objects is None else "Objectworld",
            background=style.PAPER,
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-left, self._left(n) - GAP + right), y_range=(-above, self.size + below)
            ),
        )

    def curves(self) -> list[str]:
        """How many cells' actions are the expert's."""
        return [f"/{AGREEMENT}"] if self._has_expert else []

    def describe(self) -> str:
        """One sentence for the summary."""
        things = "" if self.objects is None else ", objects as dots in their two colours"
        learner = (
            f"the grid as the learner sees it: its reward in amber{things}, its policy as arrows, "
            "and in blue how often each cell is visited (discounted)"
        )
        if not self._has_expert:
            return learner
        return (
            f"{learner}; in red the expert's visits and beside them its true reward and policy. "
            "Blue arrows go where the expert's do not"
        )

    @property
    def _has_expert(self) -> bool:
        return self.expert is not None

    def _left(self, i: int) -> float:
        """Left edge of grid ``i``."""
        return i * (self.size + GAP)

    def _log_marks(self, stream: rr.RecordingStream, who: str) -> None:
        """Outlines of the regions, and the objects, in the grid of rewards."""
        shift = [self._left(REWARD[who]), 0.0]
        if self.regions is not None:
            places = [np.argwhere(self.regions == j) for j in range(self.regions.max() + 1)]
            lows = np.array([place.min(axis=0) for place in places])
            highs = np.array([place.max(axis=0) for place in places])
            frames = outline(lows[:, ::-1] + shift, highs[:, ::-1] + 1.0 + shift)
            lines = rr.LineStrips2D(
                frames, colors=[style.POLYHEDRON_EDGE], radii=rr.Radius.ui_points([0.8])
            )
            stream.log(f"world/{who}/regions", lines, static=True)
        if self.objects is not None:
            rows, columns = np.divmod(self.objects.cells, self.size)
            colours = np.array(style.OTHERS, dtype=np.uint8)
            dots = rr.Points2D(
                np.tile(np.c_[columns, rows] + 0.5 + shift, (2, 1)),
                colors=colours[np.r_[self.objects.outer, self.objects.inner] % len(colours)],
                radii=np.repeat([OUTER, INNER], len(rows)),
                draw_order=15.0,
            )
            stream.log(f"world/{who}/objects", dots, static=True)

    def _log_reward(
        self, stream: rr.RecordingStream, who: str, motion: GridMotion, static: bool = False
    ) -> None:
        known = self.expert or motion
        low, span = 0.0, 1.0
        if known.reward is not None:
            low, span = float(known.reward.min()), float(np.ptp(known.reward)) or 1.0
        reward = np.full((self.size, self.size), low) if motion.reward is None else motion.reward
        cells = shade((reward - low) / span, style.POLYHEDRON)
        self._log_cells(stream, f"{who}/reward", REWARD[who], cells, static)

    def _log_visits(
        self, stream: rr.RecordingStream, who: str, motion: GridMotion, colour: style.Colour,
        static: bool = False,
    ) -> None:  # fmt: skip
        known = motion if self.expert is None else self.expert
        share = np.sqrt(motion.visits / known.visits.max())  # most cells are visited rarely
        self._log_cells(stream, f"{who}/visits", VISITS[who], shade(share, colour), static)

    def _log_cells(
        self, stream: rr.RecordingStream, path: str, i: int, cells: NDArray[np.uint8], static: bool
    ) -> None:
        at = rr.Transform3D(translation=[self._left(i), 0.0, 0.0])
        stream.log(f"world/{path}", at, static=True)
        stream.log(f"world/{path}", rr.Image(cells, magnification_filter="nearest"), static=static)
        frame = outline(np.zeros((1, 2)), np.full((1, 2), float(self.size)))
        lines = rr.LineStrips2D(frame, colors=[style.FRAME], radii=rr.Radius.ui_points([0.8]))
        stream.log(f"world/{path}/frame", lines, static=True)

    def _log_arrows(
        self, stream: rr.RecordingStream, who: str, motion: GridMotion, differs: Array,
        static: bool = False,
    ) -> None:  # fmt: skip
        rows, columns = np.divmod(np.arange(self.size**2), self.size)
        centre = np.c_[self._left(REWARD[who]) + columns + 0.5, rows + 0.5]
        vector = ARROW * motion.arrows.reshape(-1, 2)[:, ::-1]
        colours = np.where(differs[:, None] > 0, style.LEARNER, style.INK)
        arrows = rr.Arrows2D(
            origins=centre - vector / 2, vectors=vector, colors=colours.astype(np.uint8),
            radii=np.where(differs > 0, 0.075, 0.045), draw_order=20.0,
        )  # fmt: skip
        stream.log(f"world/{who}/policy", arrows, static=static)
