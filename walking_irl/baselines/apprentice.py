"""What every baseline holds after a forward solve: policies, and a lottery over them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from walking_irl.arrays import Array
from walking_irl.geometry.game import game_lp
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.types import Response, Status


@dataclass(frozen=True)
class Apprentice:
    """Policies found so far and the mixture that the algorithm would return.

    Attributes:
        W: Queries, shape (n, K); their scale and sign are the algorithm's.
        responses: The forward solver's answers, n of them.
        mixture: Probability with which each policy is drawn before the start, shape (n,).
        mu_E: The expert's feature expectations, shape (K,).
        status: CUT while the algorithm goes on, else why it ended.
    """

    W: Array
    responses: tuple[Response, ...]
    mixture: Array
    mu_E: Array
    status: Status

    @property
    def M(self) -> Array:
        """Feature expectations of the policies, shape (n, K)."""
        return np.array([r.mu for r in self.responses])

    @property
    def mu(self) -> Array:
        """Feature expectations of the mixture, shape (K,)."""
        return self.mixture @ self.M

    @property
    def last(self) -> Response:
        """The newest policy by itself."""
        return self.responses[-1]

    @property
    def certificate(self) -> float:
        """Certificate t of Theorem 6.2.3: some mixture loses at most this to the expert."""
        return game_lp(self.M - self.mu_E).value

    def stationary_policy(self, mdp: FiniteMDP) -> tuple[Array, Array]:
        """The mixture as one stochastic policy, (S, A), and its feature expectations, (K,)."""
        return mdp.stationary_policy([r.policy for r in self.responses], self.mixture)


def closest_mixture(M: Array, mu_E: Array, *, is_signed: bool = True) -> Array:
    """Mixture of policies whose feature expectations are closest to the expert's, shape (n,).

    The quadratic program min ||mu_E - lambda M||_2 over the simplex (Abbeel & Ng 2004, section 3).
    With d = mu_E - mu it is solved exactly as non-negative least squares,
    min ||sum lambda_i d_i||^2 + (sum lambda_i - 1)^2, whose solution has the same direction
    (Lawson & Hanson 1974, chapter 23).

    Args:
        M: Feature expectations of the policies, shape (n, K).
        mu_E: The expert's, shape (K,).
        is_signed: Whether features above the expert's count as distance too. Without it the
            positive part of mu_E - lambda M is minimised: rewards then have weights >= 0.
    """
    d = mu_E - M
    scale = max(float(np.abs(d).max()), 1e-300)
    columns = d.T / scale
    if not is_signed:
        columns = np.column_stack([columns, np.eye(len(mu_E))])
    A = np.vstack([columns, np.r_[np.ones(len(M)), np.zeros(columns.shape[1] - len(M))]])
    share = nnls(A, np.r_[np.zeros(len(mu_E)), 1.0])[0][: len(M)]
    mixture: Array = share / share.sum()
    return mixture
