"""The shrinking set of weights, drawn exactly for K = 3..7 objectives: ``/polyhedron``.

As soon as the set is small, a lens stands beside the true-scale picture: the same picture about the
set, magnified by a round factor that is written on it, so that it stays visible when it is tiny.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from walking_irl.arrays import Array
from walking_irl.errors import EmptyPolyhedronError
from walking_irl.recording import style
from walking_irl.recording.drawing import text_3d
from walking_irl.recording.experiment import Clock, Experiment, Other
from walking_irl.recording.hulls import CREASE, Hull, faces_lost, hull, polygon_lost
from walking_irl.recording.lens import LENS_RADIUS, Lens, lens_of, log_lens, pictures
from walking_irl.recording.panels import Panel, has_wide_view, panels
from walking_irl.types import Iteration

CLEAR_EDGES, MOST_EDGES = 40, 90
"""Edges from which lines become thinner, and the most that are drawn."""
SET_ALPHA, CUT_ALPHA, CUT_EDGE = 0.2, 0.42, 2.6
"""Opacity of the set and of what the newest cut took away, and width of its edges, at first."""
THIN = 0.4
"""Share of these opacities where further points inside must keep their colours."""
ABOVE = 0.02
"""Height of points over a flat set, which would hide half of them."""
KEY_FLAT = ((0.0, 0.87, 0.0), (0.0, -0.13, 0.0))
KEY_SOLID = ((0.95, -0.18, 0.95), (0.0, 0.0, -0.14))
"""Where the first name of further points stands, and from there the next one."""


class Point(NamedTuple):
    """A point among the weights: a dot, or lines about it, which hide nothing behind them."""

    name: str
    w: Array
    colour: style.Colour
    size: float = 6.0
    """Radius of a dot [points of the screen]."""
    lines: Array | None = None
    """Ends of lines about it, shape (n, 2, 3)."""


CROSS = 0.075 * np.stack([np.eye(3), -np.eye(3)], axis=1)
"""Three lines along the axes: the ground truth."""
DIAMOND = 0.042 * np.array(
    [[a * u, b * v] for u, v in combinations(np.eye(3), 2) for a in (1, -1) for b in (1, -1)]
)
"""Edges of an octahedron: the estimate."""
LINE = 1.5
"""Width of these lines [points of the screen]."""


class PolyhedronView:
    """Logs the polyhedron of each iteration in every panel.

    Args:
        experiment: What is known before the run.
        is_alone: Whether no world stands beside it.
    """

    def __init__(self, experiment: Experiment, *, is_alone: bool = False) -> None:
        self.panels = panels(experiment.names)
        self._is_wide = has_wide_view(experiment, is_alone)
        self._w_expert = experiment.w_expert
        self._others = experiment.others
        self._density = THIN if experiment.others else 1.0
        self._before: dict[str, Hull] = {}

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log frames, names and styles."""
        for panel in self.panels:
            log_frame(stream, panel)
            if self._others and len(self.panels) == 1:
                _log_key(stream, panel, self._others)

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, it: Iteration, others: Sequence[Other] = ()
    ) -> None:
        """Show the polyhedron in which the query was chosen, and fade what the last cut took away.

        A set without interior has no vertices to draw: the picture before it stays.
        """
        if not self.panels:
            return
        try:
            vertices = it.polyhedron.vertices()
        except EmptyPolyhedronError:
            return
        for panel in self.panels:
            after = hull(panel.project(vertices), CREASE)
            before = self._before.get(panel.path, after)
            self._log_panel(stream, clock, panel, self._points(it, others), before, after)
            self._before[panel.path] = after

    def log_answer(self, stream: rr.RecordingStream, clock: Clock) -> None:
        """The last query leaves; the estimate, which is the answer, stays."""
        clock.set(stream)
        for panel in self.panels:
            for root in (panel.path, f"{panel.path}/lens"):
                stream.log(f"{root}/query", rr.Clear(recursive=False))

    def _points(self, it: Iteration, others: Sequence[Other]) -> list[Point]:
        points = [
            Point("query", it.w, style.LEARNER, 4.0),
            Point("estimate", it.estimate, style.ESTIMATE, lines=DIAMOND),
        ]
        if self._others:
            shown = zip(self._others, others, style.OTHERS, strict=False)
            points = [Point(other_path(name), o.w, colour, 5.5) for name, o, colour in shown]
        if self._w_expert is not None:
            points.append(Point("truth", self._w_expert, style.EXPERT, lines=CROSS))
        return points

    def _log_panel(
        self,
        stream: rr.RecordingStream,
        clock: Clock,
        panel: Panel,
        points: Sequence[Point],
        before: Hull,
        after: Hull,
    ) -> None:
        clock.set(stream)
        lens = lens_of(panel, before.points, self._is_wide)
        if lens is None:
            stream.log(f"{panel.path}/lens", rr.Clear(recursive=True))
        else:
            log_lens(stream, panel, lens)
        lifted = np.array([0.0, 0.0, ABOVE if panel.is_flat else 0.0])
        for root, see in pictures(panel, lens):
            _log_set(stream, root, after, see, self._density)
            for point in points:
                x = panel.project(point.w)
                is_seen = see is None or bool(
                    np.abs(see(x) - see.place).max() <= LENS_RADIUS * 1.001
                )
                at = x if see is None else see(x)
                log_point(stream, root, point, at + lifted, is_seen)
        self._fade(stream, clock, panel, before, after, lens)

    def _fade(
        self,
        stream: rr.RecordingStream,
        clock: Clock,
        panel: Panel,
        before: Hull,
        after: Hull,
        lens: Lens | None,
    ) -> None:
        points, faces = before.points, faces_lost(before, after)
        if panel.is_flat:
            points, faces = polygon_lost(before, after)
        if len(faces) == 0:
            return
        edges = _edges_lost(before, after)
        for root, see in pictures(panel, lens):
            at, strips = points, edges
            if see is not None:
                at, strips = see(at), see(strips)
            stream.log(f"{root}/cut", _mesh(at, faces, style.CUT, self._density * CUT_ALPHA))
            glow = rr.LineStrips3D(
                strips, colors=[style.CUT], radii=rr.Radius.ui_points([CUT_EDGE])
            )
            stream.log(f"{root}/cut/edges", glow)
            for step in range(1, style.FADE_STEPS):  # only what changes, for a small file
                clock.set(stream, step * style.FADE_FRAMES // style.FADE_STEPS)
                left = 1.0 - step / style.FADE_STEPS
                faded = style.with_alpha(style.CUT, self._density * CUT_ALPHA * left)
                stream.log(f"{root}/cut", rr.Mesh3D.from_fields(albedo_factor=faded))
                # lines are always opaque: they shrink, then vanish
                thinner = rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points([CUT_EDGE * left]))
                is_seen = left > 0.5
                stream.log(f"{root}/cut/edges", thinner if is_seen else rr.Clear(recursive=False))
            clock.set(stream, style.FADE_FRAMES)
            stream.log(f"{root}/cut", rr.Clear(recursive=True))
            clock.set(stream)


def log_frame(stream: rr.RecordingStream, panel: Panel) -> None:
    """Log the corners of a panel and their names."""
    stream.log(panel.path, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    sides = np.array(list(combinations(panel.corners, 2)))
    lines = rr.LineStrips3D(sides, colors=[style.FRAME], radii=rr.Radius.ui_points([1.0]))
    stream.log(f"{panel.path}/frame", lines, static=True)
    tips = text_3d(panel.tips, list(panel.labels))
    stream.log(f"{panel.path}/names", tips, static=True)


def other_path(name: str) -> str:
    """Entity of a further point, below a picture of the polyhedron."""
    return f"other/{rr.escape_entity_path_part(name)}"


def _log_key(stream: rr.RecordingStream, panel: Panel, names: Sequence[str]) -> None:
    """Names of the further points beside the frame, left of it as the view opens."""
    first, step = KEY_FLAT if panel.is_flat else KEY_SOLID
    at = np.array(first) + np.outer(np.arange(len(names)), step)
    radii = rr.Radius.ui_points([6.5])
    dots = rr.Points3D(at, colors=style.OTHERS[: len(names)], radii=radii)
    stream.log(f"{panel.path}/key", dots, static=True)
    stream.log(f"{panel.path}/key/names", text_3d(at, list(names)), static=True)


def _log_set(
    stream: rr.RecordingStream, root: str, body: Hull, see: Lens | None, density: float
) -> None:
    points, edges = body.points, body.edges
    if see is not None:
        points, edges = see(points), see(edges)
    if len(body.triangles):
        stream.log(
            f"{root}/set", _mesh(points, body.triangles, style.POLYHEDRON, density * SET_ALPHA)
        )
    else:
        stream.log(f"{root}/set", rr.Clear(recursive=False))
    edges = _longest(edges)
    width = max(0.5, 1.2 * min(1.0, CLEAR_EDGES / max(len(edges), 1)))
    lines = rr.LineStrips3D(
        edges, colors=[style.POLYHEDRON_EDGE], radii=rr.Radius.ui_points([width])
    )
    stream.log(f"{root}/edges", lines)


def _longest(edges: Array) -> Array:
    """The longest edges: a round set has hundreds, which would hide the points inside."""
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    chosen: Array = edges[np.sort(np.argsort(-length)[:MOST_EDGES])]
    return chosen


def log_point(stream: rr.RecordingStream, root: str, point: Point, x: Array, is_seen: bool) -> None:
    """Log a point at ``x`` of a picture, or nothing where it lies outside of a lens."""
    shape: rr.Points3D | rr.LineStrips3D
    if point.lines is None:
        radii = rr.Radius.ui_points([point.size])
        shape = rr.Points3D([x] if is_seen else [], colors=[point.colour], radii=radii)
    else:
        strips = x + point.lines if is_seen else np.empty((0, 2, 3))
        radii = rr.Radius.ui_points([LINE / 2])
        shape = rr.LineStrips3D(strips, colors=[point.colour], radii=radii)
    stream.log(f"{root}/{point.name}", shape)


def _mesh(
    points: Array, triangles: NDArray[np.uint32], colour: style.Colour, alpha: float
) -> rr.Mesh3D:
    return rr.Mesh3D(
        vertex_positions=points,
        triangle_indices=triangles,
        albedo_factor=style.with_alpha(colour, alpha),
    )


def _edges_lost(before: Hull, after: Hull) -> Array:
    """Edges of ``before`` that are not edges of ``after``."""
    size = float(np.ptp(before.points, axis=0).max())
    before_keys, after_keys = (
        np.sort(np.asarray(h.edges), axis=1).reshape(-1, 6) / (1e-6 * size) for h in (before, after)
    )
    distance, _ = cKDTree(after_keys).query(before_keys, distance_upper_bound=1.0, p=np.inf)
    lost: Array = before.edges[~np.isfinite(distance)]
    return lost
