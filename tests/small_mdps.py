"""Small finite MDPs, and independent measurements of the domains' policies."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from walking_irl.domains.humanoid.closed_loop.trials import Trials
from walking_irl.domains.humanoid.closed_loop.trials import measure as walk_and_measure
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.finite import FiniteDomain
from walking_irl.domains.path.walking_path import SCALES, WalkingPath
from walking_irl.rl import FiniteMDP


def random_mdp(
    rng: np.random.Generator, S: int = 25, A: int = 3, K: int = 4, discount: float = 0.9
) -> FiniteMDP:
    T = sparse.csr_array(rng.dirichlet(np.full(S, 0.3), size=A * S))
    return FiniteMDP(T, rng.random((S, K)), rng.dirichlet(np.ones(S)), discount)


def simulated_mu(
    mdp: FiniteMDP, pi: np.ndarray, rng: np.random.Generator, n: int = 4000, horizon: int = 150
) -> tuple[np.ndarray, np.ndarray]:
    """Mean discounted features of ``n`` simulated runs and their standard errors, (K,) each."""
    cumulative = np.cumsum(mdp.T.toarray(), axis=1)
    state = np.searchsorted(np.cumsum(mdp.start), rng.random(n)).clip(max=mdp.n_states - 1)
    total = np.zeros((n, mdp.n_objectives))
    for t in range(horizon):
        total += mdp.discount**t * mdp.Phi[state]
        rows = cumulative[pi[state] * mdp.n_states + state]
        state = (rows < rng.random(n)[:, None]).sum(axis=1).clip(max=mdp.n_states - 1)
    return total.mean(axis=0), total.std(axis=0) / np.sqrt(n)


def measure(domain, response, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """mu of a policy by simulation rather than by the solver, and how far it may be off, (K,)."""
    if isinstance(domain, FiniteDomain):
        mean, error = simulated_mu(domain.mdp, response.policy, rng)
        truncated = domain.mdp.discount**150 / (1 - domain.mdp.discount)
        return mean, 5 * error + truncated
    if isinstance(domain, LQR):
        return _simulated_lqr(domain, response.policy), np.full(domain.n_objectives, 1e-6)
    if isinstance(domain, Humanoid):  # closed loop in forward dynamics
        walked = walk_and_measure(domain.spec, response.policy, Trials(2, noise=0.0), rng)
        return -walked.mean, 1e-3 * np.abs(response.mu)
    assert isinstance(domain, WalkingPath)
    mu = -np.mean(
        [_walked(p.z, g) for p, g in zip(response.policy, domain.goals, strict=True)], axis=0
    )
    return mu / SCALES, np.array([1e-9, 1e-9, 1e-9, 1e-9, 0.01])


def _simulated_lqr(domain: LQR, k: np.ndarray) -> np.ndarray:
    """Discounted rewards of each objective along the noise-free closed loop."""
    n, e = domain.n_objectives, domain.mixing
    Q = e + (1 - 2 * e) * np.eye(n)
    R = 1 - Q
    x, total = np.full(n, domain.start), np.zeros(n)
    for t in range(600):
        u = k * x
        total -= domain.discount**t * (Q @ x**2 + R @ u**2)
        x = x + u
    return total


def _walked(z: np.ndarray, goal: np.ndarray, n_steps: int = 50) -> np.ndarray:
    """Raw costs of one walk by Euler steps 100 times finer than the solver's, shape (5,)."""
    u, T = z[:-1].reshape(-1, 3), z[-1]
    h = T / len(u) / n_steps
    x = np.zeros(6)
    F = np.array([T, 0.0, 0.0, 0.0, 0.0])
    for control in np.repeat(u, n_steps, axis=0):
        gap = goal[:2] - x[:2]
        r2 = gap @ gap
        psi = (np.arctan2(gap[1], gap[0]) - x[2] + np.pi) % (2 * np.pi) - np.pi
        F[1:4] += h * control**2
        F[4] += h * psi**2 * r2 / (r2 + 0.3**2)
        c, s = np.cos(x[2]), np.sin(x[2])
        rate = np.array([c * x[3] - s * x[5], s * x[3] + c * x[5], x[4], *control])
        x = x + h * rate
    return F
