"""Maps from weights to pictures: which three weights each panel of the polyhedron shows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.recording.experiment import Experiment

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, math.sqrt(0.75), 0.0]])
TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / math.sqrt(8) + 0.5
GROUPS = {
    5: [(0, 1, 2), (2, 3, 4)],
    6: [(0, 1, 2), (3, 4, 5)],
    7: [(0, 1, 2), (3, 4, 5), (4, 5, 6)],
}
"""Which weights are drawn together; every weight is in at least one panel."""


@dataclass(frozen=True, eq=False)
class Panel:
    """A linear picture of the simplex.

    Attributes:
        path: Entity path.
        title: Name of the view.
        chart: Where each weight's vertex of the simplex goes, shape (K, 3).
        corners: Corners of the frame, shape (n, 3).
        tips: Corners that carry names, shape (m, 3).
        labels: Their names.
    """

    path: str
    title: str
    chart: Array
    corners: Array
    tips: Array
    labels: tuple[str, ...]

    def project(self, w: Array) -> Array:
        """Points of weights, (..., K) -> (..., 3)."""
        points: Array = np.asarray(w @ self.chart)
        return points

    @property
    def is_flat(self) -> bool:
        """Whether the picture lies in the plane z = 0."""
        return bool(np.all(self.chart[:, 2] == 0.0))


def panels(names: Sequence[str]) -> list[Panel]:
    """Panels that together show K = 3..7 weights exactly; none for any other K.

    >>> [p.title for p in panels("abcdef")]
    ['a, b, c', 'd, e, f']
    """
    K = len(names)
    if K in (3, 4):
        chart = TRIANGLE if K == 3 else TETRAHEDRON
        return [Panel("polyhedron/all", ", ".join(names), chart, chart, chart, tuple(names))]
    return [_corner(names, group) for group in GROUPS.get(K, [])]


def has_wide_view(experiment: Experiment, is_alone: bool) -> bool:
    """Whether a single panel has most of the window's width, and so room for a lens beside it."""
    return len(panels(experiment.names)) == 1 and (is_alone or bool(experiment.others))


def _corner(names: Sequence[str], group: tuple[int, ...]) -> Panel:
    """Corner tetrahedron {a, b, c >= 0, a + b + c <= 1} of three weights."""
    chart = np.zeros((len(names), 3))
    chart[list(group), range(3)] = 1.0
    labels = tuple(names[i] for i in group)
    path = "polyhedron/shadow_" + "".join(str(i + 1) for i in group)
    return Panel(
        path, ", ".join(labels), chart, np.vstack([np.zeros(3), np.eye(3)]), np.eye(3), labels
    )
