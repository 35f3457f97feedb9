"""The gridworld: rewards and policy of the learner and of the expert, and where they go."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.domains.mdp.gridworld import GridPicture
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
AGREEMENT = "curves/agreement"


class GridMotion(NamedTuple):
    """A policy, and the weights that it is the best for."""

    picture: GridPicture
    w: Array
    """Weights of the regions, shape (K,)."""


class GridworldView:
    """Shows grids side by side: the learner's left, the expert's right.

    The outer grids are coloured by reward and carry the policy's arrows, the inner ones by visits.

    Args:
        size: Cells along a side.
        expert: The expert's policy and weights, or None where they are not known.
    """

    curves_name = "Agreement"

    def __init__(self, size: int, expert: GridMotion | None = None) -> None:
        self.size = size
        self.expert = expert

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log the expert's grids, and the names of all."""
        names = ["learner: queried reward, policy", "learner: visits"]
        names += ["expert: visits", "expert: true reward, policy"][: 2 * self._has_expert]
        at = np.array([[self._left(i) + self.size / 2, -2.1] for i in range(len(names))])
        stream.log("world/names", text_2d(at, names), static=True)
        if self.expert is not None:
            picture, w = self.expert
            self._log_reward(stream, "expert", 3, picture, w, static=True)
            self._log_visits(stream, "expert", 2, picture, style.EXPERT, static=True)
            self._log_arrows(stream, "expert", 3, picture, np.zeros(self.size**2), static=True)
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
        picture, w = motion
        differs = np.zeros(self.size**2)
        if self.expert is not None:
            other = self.expert.picture.arrows != picture.arrows
            differs = other.any(axis=-1).ravel().astype(float)
            stream.log(AGREEMENT, rr.Scalars(100 * (1 - differs.mean())))
        self._log_reward(stream, "learner", 0, picture, w)
        self._log_visits(stream, "learner", 1, picture, style.LEARNER)
        self._log_arrows(stream, "learner", 0, picture, differs)
        return LAST_FRAMES if is_last else FRAMES

    def view(self) -> rrb.View:
        """All grids in one plane."""
        left, above, right, below = MARGIN
        n = 4 if self._has_expert else 2
        return rrb.Spatial2DView(
            origin="/world",
            name="Gridworld",
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
        learner = (
            "the grid under the weights queried: rewards of the regions in amber, the best policy "
            "as arrows, and in blue how often each cell is visited (discounted)"
        )
        if not self._has_expert:
            return learner
        return (
            f"{learner}; in red the expert's visits and beside them its true rewards and policy. "
            "Blue arrows go where the expert's do not"
        )

    @property
    def _has_expert(self) -> bool:
        return self.expert is not None

    def _left(self, i: int) -> float:
        """Left edge of grid ``i``."""
        return i * (self.size + GAP)

    def _log_reward(
        self, stream: rr.RecordingStream, who: str, i: int, picture: GridPicture, w: Array,
        static: bool = False,
    ) -> None:  # fmt: skip
        known = w if self.expert is None else self.expert.w
        reward = np.where(picture.regions < 0, 0.0, w[picture.regions]) / known.max()
        self._log_cells(stream, f"{who}/reward", i, shade(reward, style.POLYHEDRON), static)
        lows = np.array([np.argwhere(picture.regions == j).min(axis=0) for j in range(len(w))])
        highs = np.array([np.argwhere(picture.regions == j).max(axis=0) for j in range(len(w))])
        shift = [self._left(i), 0.0]
        frames = outline(lows[:, ::-1] + shift, highs[:, ::-1] + 1.0 + shift)
        lines = rr.LineStrips2D(
            frames, colors=[style.POLYHEDRON_EDGE], radii=rr.Radius.ui_points([0.8])
        )
        stream.log(f"world/{who}/regions", lines, static=static)

    def _log_visits(
        self, stream: rr.RecordingStream, who: str, i: int, picture: GridPicture,
        colour: style.Colour, static: bool = False,
    ) -> None:  # fmt: skip
        known = picture if self.expert is None else self.expert.picture
        share = np.sqrt(picture.visits / known.visits.max())  # most cells are visited rarely
        self._log_cells(stream, f"{who}/visits", i, shade(share, colour), static)

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
        self, stream: rr.RecordingStream, who: str, i: int, picture: GridPicture, differs: Array,
        static: bool = False,
    ) -> None:  # fmt: skip
        rows, columns = np.divmod(np.arange(self.size**2), self.size)
        centre = np.c_[self._left(i) + columns + 0.5, rows + 0.5]
        vector = ARROW * picture.arrows.reshape(-1, 2)[:, ::-1]
        colours = np.where(differs[:, None] > 0, style.LEARNER, style.INK)
        arrows = rr.Arrows2D(
            origins=centre - vector / 2, vectors=vector, colors=colours.astype(np.uint8),
            radii=np.where(differs > 0, 0.075, 0.045), draw_order=20.0,
        )  # fmt: skip
        stream.log(f"world/{who}/policy", arrows, static=static)
