"""Apprenticeship learning by policy matching (G. Neu & C. Szepesvari, UAI 2007).

J(w) = sum_s x_E(s) sum_a (pi_w(a|s) - pi_E(a|s))^2 with pi_w = softmax(beta Q*_w). By the envelope
theorem dQ*/dw is the successor feature of the greedy policy. The natural gradient, with the metric
G = sum_s x_E(s) sum_a dpi dpi' that the distance of policies induces, is the Gauss-Newton step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple, get_args

import numpy as np
from scipy.optimize import least_squares

from walking_irl.arrays import Array
from walking_irl.baselines.recovered import Recovered, from_weights, positive
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.successor import successor
from walking_irl.rl.tabular import best_policy
from walking_irl.types import Status

Step = Literal["trust-region", "natural", "gradient"]
SMALLEST_STEP, LARGEST_STEP = 1e-12, 1e6
GAIN = 1e-12
"""Fall of J that counts as none."""
FLAT = 1e-10
"""Relative tolerances of the trust-region search."""


class Matched(NamedTuple):
    """Policies of weights beside the expert's."""

    residual: Array
    """sqrt(x_E(s)) (pi_w - pi_E), shape (S A,): J is its square."""
    jacobian: Array
    """Its derivative in w, shape (S A, K)."""
    greedy: Actions
    """Optimal policy, to start the next solve from, shape (S,)."""


def boltzmann_policy(
    mdp: FiniteMDP, w: Array, beta: float, *, pi: Actions | None = None
) -> tuple[Array, Array, Actions]:
    """pi_w = softmax(beta Q*_w), shape (S, A); d pi / d w, shape (S, A, K); the greedy policy.

    d pi = beta pi (dQ - sum_b pi dQ). Q* has kinks where actions tie: one of its slopes is taken.
    """
    best = best_policy(mdp, mdp.reward(w), pi=pi)
    greedy = best.pi
    dQ = successor(mdp, greedy, chain=best.chain)
    q = beta * (dQ @ w)
    P = np.exp(q - q.max(axis=1, keepdims=True))
    P /= P.sum(axis=1, keepdims=True)
    dP: Array = beta * P[:, :, None] * (dQ - np.einsum("sa,sak->sk", P, dQ)[:, None])
    return P, dP, greedy


def policy_matching(
    mdp: FiniteMDP,
    demonstrations: Demonstrations,
    *,
    beta: float = 1.0,
    step: Step = "trust-region",
    w: Array | None = None,
    max_solves: int = 60,
) -> Recovered:
    """Weights whose Boltzmann policy is closest to the demonstrated shares of actions.

    Args:
        mdp: The world.
        demonstrations: States and actions; states that were not visited do not count.
        beta: Inverse temperature; it and the scale of w are one parameter, so it stays fixed.
        step: "trust-region" (Gauss-Newton by scipy), "natural" (the paper's natural gradient,
            halved until J falls) or "gradient" (the plain one, halved likewise).
        w: Where the search begins; 0, where all actions are equal, by default: J is not convex.
        max_solves: Budget of forward solves.
    """
    counts = demonstrations.counts(mdp.n_states, mdp.n_actions)
    visits = counts.sum(axis=1)
    shares = counts / np.maximum(visits, 1.0)[:, None]
    return match_policy(
        mdp, shares, visits / visits.sum(), beta=beta, step=step, w=w, max_solves=max_solves
    )


def match_policy(
    mdp: FiniteMDP,
    policy: Array,
    visits: Array,
    *,
    beta: float = 1.0,
    step: Step = "trust-region",
    w: Array | None = None,
    max_solves: int = 60,
) -> Recovered:
    """The same for a policy (S, A) and weights of its states (S,); see :func:`policy_matching`.

    Raises:
        InvalidInputError: If the step is unknown or a setting is out of range.
    """
    positive(beta=beta, max_solves=max_solves)
    if step not in get_args(Step):
        raise InvalidInputError(f"unknown step {step!r}; choose from {', '.join(get_args(Step))}")
    w = np.zeros(mdp.n_objectives) if w is None else np.asarray(w, dtype=np.float64)
    root = np.sqrt(visits)[:, None]
    last: Matched | None = None
    log: list[float] = []
    tried: list[Array] = []

    def at(v: Array) -> Matched:
        nonlocal last
        P, dP, greedy = boltzmann_policy(mdp, v, beta, pi=None if last is None else last.greedy)
        residual = (root * (P - policy)).ravel()
        last = Matched(residual, (root[:, :, None] * dP).reshape(-1, v.size), greedy)
        log.append(float(residual @ residual))
        tried.append(np.array(v))
        return last

    if step == "trust-region":
        kept: dict[bytes, Matched] = {}

        def once(v: Array) -> Matched:
            if v.tobytes() not in kept:
                kept.clear()
                kept[v.tobytes()] = at(v)
            return kept[v.tobytes()]

        result = least_squares(
            lambda v: once(v).residual,
            w,
            lambda v: once(v).jacobian,
            ftol=FLAT,
            xtol=FLAT,
            gtol=FLAT,
            max_nfev=max_solves,
        )
        w, is_done = np.asarray(result.x), result.status > 0
    else:
        w, is_done = _descend(at, w, step, max_solves, log)
    status = Status.CONVERGED if is_done else Status.BUDGET
    info = {"solves": len(log), "J": min(log)}
    kept_log = {"objective": np.array(log), "iterates": np.array(tried)}
    return from_weights(mdp, w, "free", **kept_log, status=status, info=info)


def natural_step(residual: Array, jacobian: Array) -> Array:
    """-G^+ grad(J) / 2 with G = J'J: the least-squares solution of jacobian d = -residual."""
    return np.asarray(np.linalg.lstsq(jacobian, -residual, rcond=1e-10)[0])


def _descend(
    at: Callable[[Array], Matched], w: Array, step: Step, max_solves: int, log: list[float]
) -> tuple[Array, bool]:
    """Steps that lower J, halved until they do; weights, and whether no step lowers it further."""
    rate, here = 1.0, at(w)
    while len(log) < max_solves:
        J = float(here.residual @ here.residual)
        d = natural_step(here.residual, here.jacobian)
        if step == "gradient":
            d = -here.jacobian.T @ here.residual
        there = here
        while rate > SMALLEST_STEP and len(log) < max_solves:
            there = at(w + rate * d)
            if there.residual @ there.residual < J:
                break
            rate /= 2
        fall = J - float(there.residual @ there.residual)
        if fall <= 0:
            return w, rate <= SMALLEST_STEP
        w, here = w + rate * d, there
        if fall < GAIN:
            return w, True
        rate = min(2 * rate, 1.0 if step == "natural" else LARGEST_STEP)
    return w, False
