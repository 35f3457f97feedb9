"""Features of states and actions for Q(s, a) = features(s, a).theta, and their greedy policies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.errors import SolverError
from walking_irl.rl.finite_mdp import Actions


@dataclass(frozen=True, eq=False)
class BlockFeatures:
    """State features, once per action: psi(s) stands in block a, zeros elsewhere; p = A d."""

    psi: Array
    """Features of each state, shape (S, d)."""
    n_actions: int

    def __call__(self, states: Indices, actions: Indices) -> Array:
        """Features of n pairs, shape (n, A d)."""
        n, d = len(states), self.psi.shape[1]
        phi = np.zeros((n, self.n_actions, d))
        phi[np.arange(n), actions] = self.psi[states]
        return phi.reshape(n, -1)

    def greedy(self, theta: Array) -> Actions:
        """Best action of every state, shape (S,)."""
        Q = self.psi @ theta.reshape(self.n_actions, -1).T
        return np.asarray(Q.argmax(axis=1), dtype=np.intp)


@dataclass(frozen=True)
class QuadraticFeatures:
    """All products of two coordinates of (x, u), and optionally a constant.

    Q(x, u) = (x, u)' H (x, u) + c is exact for linear-quadratic worlds; c is needed where the
    controls or the states are noisy.
    """

    n_states: int
    """n, length of x."""
    n_controls: int
    """m, length of u."""
    has_constant: bool = False

    def __call__(self, x: Array, u: Array) -> Array:
        """Features of N pairs (N, n), (N, m): shape (N, p), p = (n + m) (n + m + 1) / 2 (+ 1)."""
        z = np.c_[x, u]
        i, j = np.triu_indices(z.shape[1])
        phi = z[:, i] * z[:, j]
        return np.asarray(np.c_[phi, np.ones(len(z))] if self.has_constant else phi)

    def matrix(self, theta: Array) -> Array:
        """H, symmetric, shape (n + m, n + m)."""
        size = self.n_states + self.n_controls
        H = np.zeros((size, size))
        i, j = np.triu_indices(size)
        H[i, j] = theta[: len(i)]
        return (H + H.T) / 2

    def greedy(self, theta: Array) -> Array:
        """Gain k of the best controls u = k x = -H_uu^-1 H_ux x, shape (m, n).

        Raises:
            SolverError: If Q has no maximum in u: the samples do not determine it.
        """
        n = self.n_states
        H = self.matrix(theta)
        if np.linalg.eigvalsh(H[n:, n:]).max() >= 0:
            raise SolverError(
                "the estimated action values have no maximum over the controls; take more samples, "
                "with more varied controls"
            )
        return np.asarray(-np.linalg.solve(H[n:, n:], H[n:, :n]))
