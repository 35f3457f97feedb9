"""Least-squares policy iteration (M. Lagoudakis & R. Parr 2003, figures 5 and 8)."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError

Policy = Callable[[Any], Any]
"""Actions of N states."""


class Transitions(NamedTuple):
    """n observed transitions; the policy that chose the actions does not matter."""

    states: Any
    """First axis n."""
    actions: Any
    """First axis n."""
    rewards: Array
    """Shape (n,)."""
    next_states: Any
    """First axis n."""
    weights: Array | None = None
    """How much each counts, shape (n,): the probabilities where every outcome is listed."""


class Ending(enum.Enum):
    """Why policy iteration ended."""

    CONVERGED = "the parameters no longer change"
    CYCLES = "a policy has come back: the approximation makes policies cycle"
    BUDGET = "the budget of iterations is spent"


class LSPISolution(NamedTuple):
    """What least-squares policy iteration found."""

    theta: Array
    """Parameters of Q(s, a) = features(s, a).theta, shape (p,)."""
    policy: Policy
    """Greedy in that Q."""
    change: Array
    """Relative change of theta in each iteration."""
    ending: Ending


def lstdq(
    phi: Array, r: Array, phi_next: Array, discount: float, *, ridge: float = 1e-6,
    weights: Array | None = None,
) -> Array:  # fmt: skip
    """Theta of A theta = b: A = sum phi (phi - gamma phi')', b = sum phi r (equation 5.2).

    Args:
        phi: Features of the pairs seen, shape (n, p).
        r: Rewards, shape (n,).
        phi_next: Features of the next states with the policy's actions, shape (n, p).
        discount: gamma in [0, 1).
        ridge: Added to A's diagonal, per unit of weight.
        weights: Shape (n,), or None for ones.
    """
    weighted = phi if weights is None else weights[:, None] * phi
    total = len(phi) if weights is None else float(weights.sum())
    A = weighted.T @ (phi - discount * phi_next) + ridge * total * np.eye(phi.shape[1])
    b = weighted.T @ r
    return np.asarray(np.linalg.solve(A, b) if ridge > 0 else np.linalg.lstsq(A, b)[0])


def lspi(
    features: Callable[[Any, Any], Array],
    samples: Transitions,
    improve: Callable[[Array], Policy],
    policy: Policy,
    *,
    discount: float,
    ridge: float = 1e-6,
    tol: float = 1e-9,
    max_iter: int = 50,
) -> LSPISolution:
    """Evaluate a policy on all samples, improve it greedily, again until nothing changes.

    Args:
        features: features(states, actions), shape (n, p); see :mod:`walking_irl.rl.q_features`.
        samples: Transitions; the same serve every policy.
        improve: Greedy policy for parameters theta.
        policy: The first policy.
        discount: gamma in [0, 1).
        ridge: See :func:`lstdq`.
        tol: Relative change of theta at which it has converged.
        max_iter: Iterations after which it ends.

    Raises:
        InvalidInputError: If there are no samples or they differ in number.
    """
    n = len(samples.rewards)
    parts = (samples.states, samples.actions, samples.next_states)
    if n == 0 or any(len(part) != n for part in parts):
        lengths = ", ".join(str(len(part)) for part in parts)
        raise InvalidInputError(f"expected {n} > 0 states, actions and next states, got {lengths}")
    phi = features(samples.states, samples.actions)
    theta, change, seen, ending = np.zeros(phi.shape[1]), [], set(), Ending.BUDGET
    last = b""
    for _ in range(max_iter):
        actions = np.asarray(policy(samples.next_states))
        choice = actions.tobytes()
        if choice != last and choice in seen:
            ending = Ending.CYCLES
            break
        seen.add(choice)
        phi_next = features(samples.next_states, actions)
        new = lstdq(phi, samples.rewards, phi_next, discount, ridge=ridge, weights=samples.weights)
        change.append(float(np.abs(new - theta).max() / max(1e-12, np.abs(new).max())))
        theta, policy, last = new, improve(new), choice
        if change[-1] <= tol:
            ending = Ending.CONVERGED
            break
    return LSPISolution(theta, policy, np.array(change), ending)
