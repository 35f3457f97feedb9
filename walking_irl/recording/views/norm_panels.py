"""Curves of walks over the gait cycle on the band of a norm, a panel a variable: ``/norms``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.curve_picture import PANELS, limits, ticks
from walking_irl.domains.humanoid.gait.curves import beside
from walking_irl.domains.humanoid.gait.norm_curves import PHASES, NormSet
from walking_irl.recording import style
from walking_irl.recording.drawing import outline, text_2d

ROOT = "norms"
VARIABLES = tuple(PANELS)[:9]
"""Angles and the vertical force: what recordings of people have."""
COLUMNS = 5
WIDTH, HEIGHT = 1.0, 0.62  # of a panel
ACROSS, DOWN = 1.18, 0.86  # from one panel to the next
RAISED = 0.10
"""The viewer writes below a point; so much higher, titles stand above their panel."""
BAND = (206, 208, 212)
NORM = (150, 152, 158)


class Curves(NamedTuple):
    """A walk's curves, and how they are drawn."""

    name: str
    colour: style.Colour
    by_variable: Mapping[str, Array]
    """At PHASES, in the clinic's signs."""


class NormPanels:
    """Draws the curves of some walks, which do not change, on a norm.

    Args:
        walks: In the order of drawing.
        norms: Mean and one standard deviation of a population.
    """

    def __init__(self, walks: Sequence[Curves], norms: NormSet) -> None:
        self.walks = [w._replace(by_variable=beside(w.by_variable, norms)) for w in walks]
        self.norms = norms

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log frames, bands, curves, titles and the legend."""
        shown = [v for v in VARIABLES if any(v in w.by_variable for w in self.walks)]
        for k, variable in enumerate(shown):
            self._log_panel(stream, variable, _corner(k))
        self._log_legend(stream, _corner(len(shown)))

    def view(self) -> rrb.View:
        """All panels as one picture."""
        rows = -(-(len(VARIABLES) + 1) // COLUMNS)
        return rrb.Spatial2DView(
            origin=f"/{ROOT}",
            name="Over the gait cycle, on adults' mean and 1 s.d. [deg, body weights]",
            background=style.PAPER,
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-0.12, (COLUMNS - 1) * ACROSS + WIDTH + 0.05),
                y_range=(-0.16, (rows - 1) * DOWN + HEIGHT + 0.04),
            ),
        )

    def _log_panel(self, stream: rr.RecordingStream, variable: str, corner: Array) -> None:
        norm = self.norms.curves.get(variable)
        known = [(w, w.by_variable[variable]) for w in self.walks if variable in w.by_variable]
        band = [] if norm is None else [norm.mean - norm.sd, norm.mean + norm.sd]
        low, high = limits([*(c for _, c in known), *band])

        def at(values: Array) -> Array:
            height = HEIGHT * (high - values) / (high - low)
            return np.column_stack([corner[0] + WIDTH * PHASES / 100, corner[1] + height])

        path = f"{ROOT}/{variable}"
        frame = outline(corner[None], corner[None] + [WIDTH, HEIGHT])
        lines = [[[corner[0], y], [corner[0] + WIDTH, y]] for y in _heights(low, high, corner)]
        _log_lines(stream, f"{path}/frame", [*frame, *lines], style.FRAME, 0.6, 5.0)
        if norm is not None:
            sides = np.stack([at(band[0]), at(band[1])], axis=1)
            strip = rr.LineStrips2D(
                sides, colors=[BAND], radii=[0.55 * WIDTH / len(PHASES)], draw_order=1.0
            )
            stream.log(f"{path}/band", strip, static=True)
            _log_lines(stream, f"{path}/mean", [at(norm.mean)], NORM, 1.0, 10.0)
        for order, (walk, curve) in enumerate(known):
            place = f"{path}/{rr.escape_entity_path_part(walk.name)}"
            _log_lines(stream, place, [at(curve)], walk.colour, 2.0, 20.0 + order)
        where, digits = corner + [WIDTH / 2, -RAISED], int(high - low < 5)
        label = f"{PANELS[variable][0]} {low:.{digits}f} .. {high:.{digits}f}"
        stream.log(f"{path}/title", text_2d(where[None], [label]), static=True)

    def _log_legend(self, stream: rr.RecordingStream, corner: Array) -> None:
        y = corner[1] + HEIGHT * (np.arange(len(self.walks)) + 0.5) / len(self.walks)
        for walk, height in zip(self.walks, y, strict=True):
            place = f"{ROOT}/legend/{rr.escape_entity_path_part(walk.name)}"
            line = [[[corner[0], height], [corner[0] + 0.25, height]]]
            _log_lines(stream, place, line, walk.colour, 3.0, 20.0)
        at = np.c_[np.full(len(y), corner[0] + 0.65), y - RAISED / 2]
        stream.log(f"{ROOT}/legend", text_2d(at, [w.name for w in self.walks]), static=True)


def _corner(k: int) -> Array:
    """Upper left corner of a panel."""
    return np.array([(k % COLUMNS) * ACROSS, (k // COLUMNS) * DOWN])


def _heights(low: float, high: float, corner: Array) -> list[float]:
    """Where zero lies, if it is in the panel."""
    return [float(corner[1] + HEIGHT * high / (high - low))] if 0.0 in ticks(low, high) else []


def _log_lines(
    stream: rr.RecordingStream,
    path: str,
    lines: Sequence[Array | list[list[float]]],
    colour: style.Colour,
    width: float,
    order: float,
) -> None:
    strips = rr.LineStrips2D(
        [np.asarray(line) for line in lines],
        colors=[colour],
        radii=rr.Radius.ui_points([width / 2]),
        draw_order=order,
    )
    stream.log(path, strips, static=True)
