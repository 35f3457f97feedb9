"""The best gait for a weight vector, how smooth an optimum it is, and its sensitivities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.optimiser.descent import FD_STEPS, Descent, OnStep, linearise
from walking_irl.domains.humanoid.optimiser.linearisation import Linearisation
from walking_irl.domains.humanoid.optimiser.normal_equations import Factor, normal_matrix
from walking_irl.domains.humanoid.optimiser.perturbation import perturb
from walking_irl.domains.humanoid.optimiser.ring import KnotOrder
from walking_irl.domains.humanoid.optimiser.stages import DIRECT, Stage
from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY, Transcription

SMOOTH_DECREMENT = 1e-6
"""Undamped Newton decrement below which a gait counts as a smooth minimum."""


@dataclass
class Solution:
    """A gait found, with the gaits passed on the way.

    Attributes:
        x: Best gait vector.
        total_costs: Its total costs G, shape (K,).
        passed: Total costs of all gaits accepted on the way, shape (n, K).
        iterations: Iterations of all stages.
        is_stalled: Whether the last stage ended because no step helped.
    """

    x: Array
    total_costs: Array
    passed: Array
    iterations: int
    is_stalled: bool


class GaitSolver:
    """Minimises w.G over the gaits of a transcription.

    Attributes:
        problem: The transcription.
        order: Order of its knots.
    """

    def __init__(self, problem: Transcription) -> None:
        self.problem = problem
        self.order = KnotOrder(problem.n_knots, problem.nv)

    def solve(
        self,
        w: Array,
        x: Array,
        stages: Sequence[Stage] = DIRECT,
        on_step: OnStep | None = None,
    ) -> Solution:
        """Best gait for weights ``w`` near the gait ``x``.

        Args:
            w: Weights, shape (K,).
            x: Start, shape (N nv + 2,).
            stages: Homotopy in the root penalty, easiest first.
            on_step: Told of every iteration.

        Raises:
            SolverError: If the cost of the start is not finite.
        """
        passed: list[Array] = []
        anchor = x
        iterations = 0
        stalled = False
        for s in stages:
            run = Descent(self.problem, self.order, w, s, anchor, on_step)
            x, n, stalled = run.minimise(x, passed)
            iterations += n
        ev = self.problem.evaluate(x)
        k = len(self.problem.stack.objectives)
        visited = np.array(passed).reshape(-1, k)
        return Solution(x, ev.total_costs(), visited, iterations, stalled)

    def linearise(self, x: Array, eps: float = FD_STEPS[0]) -> Linearisation:
        """Derivatives at the gait ``x``."""
        return linearise(self.problem, x, eps)

    def decrement(self, w: Array, lin: Linearisation) -> float:
        r"""Undamped relative Newton decrement :math:`g^T H^{-1} g / 2J` of a gait.

        Below 1e-8 the gait is a smooth minimum; above 1e-5 it sits on a contact jump, where
        derivatives and sensitivities mean nothing.
        """
        g = lin.at(w, ROOT_PENALTY).gradient
        step = self._undamped(w, lin).solve(g)
        return float(g @ step / lin.evaluation.total(w, ROOT_PENALTY))

    def sensitivity(self, w: Array, lin: Linearisation) -> tuple[Array, Array]:
        r"""Gauss-Newton sensitivities of an optimal gait to its weights.

        Returns:
            d mu / d w = :math:`g^T (2 J^T J)^{-1} g`, symmetric positive semi-definite, shape
            (K, K), with g the gradients of the K total costs; and dx / dw, (N nv + 2, K).
        """
        unit = np.eye(len(self.problem.stack.objectives))
        g = np.column_stack([2 * lin.at(e, ROOT_PENALTY).gradient for e in unit])
        y = self._undamped(w, lin).solve(g) / 2
        m = g.T @ y
        return (m + m.T) / 2, -y

    def _undamped(self, w: Array, lin: Linearisation) -> Factor:
        return normal_matrix(lin.at(w, ROOT_PENALTY), self.order).factor(1e-9)

    def perturb(self, x: Array, amplitude: float, rng: np.random.Generator) -> Array:
        """See :func:`~.perturbation.perturb`."""
        return perturb(self.problem.walker, x, amplitude, rng)
