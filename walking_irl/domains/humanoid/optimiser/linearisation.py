r"""First derivatives of all residuals of a gait, and their products at given weights.

Residuals of step i depend on the knots i - 1 ... i + 2, the step length L and the half period T.
A linearisation knows no weights, so that one serves every weight vector; :meth:`Linearisation.at`
gives the weighted residuals and their Jacobian.

Costs per metre carry the factor s = sqrt(v0 T / L), so their rows are :math:`s J + r u^T` with
:math:`u = (-1/2L, 1/2T)` on (L, T): a rank-one term that is added once, not row by row.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.costs.base import Channels
from walking_irl.domains.humanoid.costs.stack import CostStack
from walking_irl.domains.humanoid.optimiser.chain import Chain, Outputs
from walking_irl.domains.humanoid.optimiser.transcription import (
    ANCHOR_WEIGHTS,
    Evaluation,
    Transcription,
)


class Terms(NamedTuple):
    """Residuals of all costs (N, M), of the root (N, n_root) and of the anchors (3,).

    Also anything else of that layout: factors, or a product with the Jacobian.
    """

    costs: Array
    root: Array
    anchors: Array

    def flat(self) -> Array:
        """All entries in one vector."""
        return np.concatenate([t.ravel() for t in self])

    def like(self, flat: Array) -> Terms:
        """The inverse of :meth:`flat` for the shapes of this object."""
        edges = np.cumsum([t.size for t in self])[:-1]
        parts = np.split(flat, edges)
        return Terms(*(p.reshape(t.shape) for p, t in zip(parts, self, strict=True)))

    def times(self, other: Terms) -> Terms:
        """Elementwise product."""
        return Terms(*(a * b for a, b in zip(self, other, strict=True)))


def factors(stack: CostStack, ev: Evaluation, w: Array, penalty: float) -> Terms:
    """Square roots of the coefficients of all squared residuals: shapes (M,), (1,) and (3,)."""
    n = len(ev.motion.q)
    return Terms(
        np.sqrt(stack.squares(w, ev.motion.pace) / n),
        np.sqrt([penalty / n]),
        np.sqrt(ANCHOR_WEIGHTS),
    )


def weighted(stack: CostStack, ev: Evaluation, w: Array, penalty: float) -> Terms:
    """Weighted residuals of a gait; their squares sum to ``ev.total(w, penalty)``."""
    return factors(stack, ev, w, penalty).times(Terms(ev.residuals, ev.root, ev.anchors))


class Linearisation:
    """First derivatives of the residuals at one gait.

    Attributes:
        problem: The transcription.
        evaluation: The gait.
        stack: Its costs.
        derivatives: Of inverse dynamics at its knots.
        chain: Derivatives of the channels with respect to the unknowns.
        partials: Derivatives of the residuals with respect to the channels.
        log_scale: u, the gradient of log s with respect to (L, T).
    """

    def __init__(self, problem: Transcription, ev: Evaluation) -> None:
        self.problem, self.evaluation, self.stack = problem, ev, problem.stack
        self.derivatives = problem.differentiate(ev)
        self.chain = Chain(problem, ev, self.derivatives)
        self.partials = problem.stack.first(ev.motion)
        self.log_scale = np.array([-0.5 / ev.x[-2], 0.5 / ev.x[-1]])
        self.is_period_out = float(ev.anchors[2] != 0)

    @cached_property
    def second(self) -> tuple[Array, ...]:
        """Second partial derivatives of all residuals by term; see :meth:`.CostStack.second`."""
        return self.stack.second(self.evaluation.motion)

    def at(self, w: Array, penalty: float) -> Weighted:
        """The residuals and their Jacobian at weights ``w``, shape (K,), and a root penalty."""
        return Weighted(self, w, penalty)


class Weighted:
    """Weighted residuals r of a gait and their Jacobian J: r.r is ``total(w, penalty)``.

    Attributes:
        lin: The linearisation.
        factors: Square roots of the coefficients of the squared residuals.
        residuals: r.
    """

    def __init__(self, lin: Linearisation, w: Array, penalty: float) -> None:
        self.lin = lin
        ev = lin.evaluation
        self.factors = factors(lin.stack, ev, w, penalty)
        self.residuals = self.factors.times(Terms(ev.residuals, ev.root, ev.anchors))

    def times(self, dx: Array) -> Terms:
        """J times a direction ``dx``, shape (N nv + 2,)."""
        lin = self.lin
        out = lin.chain.forward(dx)
        anchors = np.array([dx[0], out.align, dx[-1] * lin.is_period_out])
        raw = Terms(lin.partials.times(out.channels), out.root, anchors)
        y = self.factors.times(raw)
        k = lin.stack.n_per_metre
        y.costs[:, :k] += float(lin.log_scale @ dx[-2:]) * self.residuals.costs[:, :k]
        return y

    def transpose_times(self, y: Terms) -> Array:
        """J transposed times ``y``, shape (N nv + 2,)."""
        out = self._pull_back(y)
        k = self.lin.stack.n_per_metre
        dot = float(np.vdot(self.residuals.costs[:, :k], y.costs[:, :k]))
        out[-2:] += dot * self.lin.log_scale
        return out

    def _pull_back(self, y: Terms) -> Array:
        """:meth:`transpose_times` without the derivative of the per-metre factor."""
        z = self.factors.times(y)
        return self._back(self.lin.partials.transpose_times(z.costs), z.root, z.anchors)

    def _back(self, channels: Channels, root: Array, anchors: Array) -> Array:
        out = self.lin.chain.backward(Outputs(channels, root, float(anchors[1])))
        out[0] += anchors[0]
        out[-1] += anchors[2] * self.lin.is_period_out
        return out

    @cached_property
    def _by_channels(self) -> tuple[Channels, Channels]:
        """Half the gradients of the costs per metre, and of the shared ones, by channels."""
        k, y = self.lin.stack.n_per_metre, self.factors.costs * self.residuals.costs
        learnt, shared = y.copy(), y
        learnt[:, k:], shared[:, :k] = 0.0, 0.0
        back = self.lin.partials.transpose_times
        return back(learnt), back(shared)

    @property
    def by_channels(self) -> Channels:
        """Half the gradient of all costs by channels, at a fixed per-metre factor."""
        learnt, shared = self._by_channels
        both: Any = zip(learnt, shared, strict=True)
        return Channels(*(a + b for a, b in both))

    @cached_property
    def _halves(self) -> tuple[Array, Array]:
        """Gradients at a fixed per-metre factor: of the costs per metre, and of all the rest."""
        learnt, shared = self._by_channels
        y = self.factors.times(self.residuals)
        nothing = np.zeros_like(y.root), np.zeros_like(y.anchors)
        return self._back(learnt, *nothing), self._back(shared, y.root, y.anchors)

    @property
    def per_metre_gradient(self) -> Array:
        """Half the gradient of the costs per metre at a fixed per-metre factor, (N nv + 2,)."""
        return self._halves[0]

    @property
    def per_metre_cost(self) -> float:
        """The weighted costs per metre."""
        k = self.lin.stack.n_per_metre
        return float(np.sum(self.residuals.costs[:, :k] ** 2))

    @cached_property
    def gradient(self) -> Array:
        """Half the gradient of ``evaluation.total(w, penalty)``, shape (N nv + 2,)."""
        learnt, rest = self._halves
        out = learnt + rest
        out[-2:] += self.per_metre_cost * self.lin.log_scale
        return out
