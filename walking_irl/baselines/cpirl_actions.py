"""CPIRL that reads actions: the demonstration is completed by planning (ours).

With a known model the expert's features need not be a noisy mean of returns. Act as demonstrated
in visited states and plan freely elsewhere: V^c_w is the best value under that constraint. Every w
for which the demonstrated actions are optimal has g(w) = x.V*_w - x.V^c_w = 0, and g >= 0, with x
the distribution of visited states. Both terms are convex in w, so that g is a difference of convex
functions: a convex-concave round takes mu_ref = mu^c(w_j) and lets CPIRL minimise the regret
x.V*_w - w.mu_ref against that exact expert. It majorises g and touches it at w_j: g never rises.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.mce import mce_likelihood
from walking_irl.baselines.recovered import Recovered, from_weights, positive
from walking_irl.cpirl import cpirl
from walking_irl.errors import EmptyPolyhedronError, SolverError
from walking_irl.rl.chain import Chain
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.policy_iteration import TIE
from walking_irl.rl.tabular import best_policy
from walking_irl.types import Expert, Iteration, Response, Status

EXPLAINED = 1e-9
"""g relative to max |x.V*| at which all demonstrated actions count as optimal."""
MAX_IMPROVEMENTS = 500
UNEXPLAINED = (
    "no weights found make all demonstrated actions optimal: for an expert that errs or is soft "
    "prefer a likelihood method (mce-likelihood)"
)


class Completed(NamedTuple):
    """Demonstrated actions where there are some, the best ones elsewhere."""

    policy: Array
    """Shape (S, A)."""
    V: Array
    """Its value, shape (S,)."""
    mu: Array
    """Its feature expectations from the distribution of visited states, shape (K,)."""


def complete(mdp: FiniteMDP, w: Array, counts: Array) -> Completed:
    """The best policy for w of all that act as demonstrated, by policy iteration.

    Args:
        mdp: The world, entered as the visited states are distributed.
        w: Weights, shape (K,).
        counts: c[s, a], shape (S, A).

    Raises:
        SolverError: If the policy still changes after 500 improvements.
    """
    r, n, states = mdp.reward(w), counts.sum(axis=1), np.arange(mdp.n_states)
    is_seen = n > 0
    pi = best_policy(mdp, r).pi
    shares = counts / np.maximum(n, 1)[:, None]
    for _ in range(MAX_IMPROVEMENTS):
        P = np.where(is_seen[:, None], shares, mdp.probabilities(pi))
        chain = Chain(mdp, P)
        V = chain.solve(r)
        Q = mdp.action_values(r, V)
        margin = TIE * max(1.0, float(np.abs(V).max()))
        is_better = (Q.max(axis=0) > Q[pi, states] + margin) & ~is_seen
        if not is_better.any():
            return Completed(P, V, mdp.Phi.T @ chain.solve_transposed(mdp.start))
        pi = np.where(is_better, Q.argmax(axis=0), pi)
    raise SolverError(f"the completion still changes after {MAX_IMPROVEMENTS} improvements")


class Estimate(NamedTuple):
    """Weights and how far the demonstrated actions are from optimal for them."""

    w: Array
    """Shape (K,)."""
    g: float
    """Shortfall x.V*_w - x.V^c_w >= 0."""
    completed: Completed
    answer: Response
    """Optimal policy for the weights."""

    @property
    def is_explained(self) -> bool:
        """Whether all demonstrated actions are optimal, to rounding."""
        return self.g <= EXPLAINED * max(abs(float(self.w @ self.answer.mu)), 1e-300)


def estimate(mdp: FiniteMDP, w: Array, counts: Array) -> Estimate:
    """g(w) with the completion and the optimal policy that it compares."""
    completed = complete(mdp, w, counts)
    best = best_policy(mdp, mdp.reward(w))
    mu = mdp.Phi.T @ best.chain.solve_transposed(mdp.start)
    g = max(0.0, float(w @ (mu - completed.mu)))
    return Estimate(w, g, completed, Response(best.pi, mu))


def cpirl_actions(
    mdp: FiniteMDP,
    demonstrations: Demonstrations,
    *,
    rng: np.random.Generator,
    centre: str = "ac",
    n_rounds: int = 10,
    max_solves: int = 25,
    w: Array | None = None,
) -> Recovered:
    """Weights of the simplex for which the demonstrated actions are optimal, or nearly so.

    Limits: for soft experts the shares of actions are optimal for no weights and nothing is
    gained; where few states are seen the others complete themselves, and many weights explain
    everything: read the intervals, not the point. They bound the weights that explain the
    completion found; with other completions the set is wider still.

    Args:
        mdp: The world.
        demonstrations: States and actions.
        rng: For CPIRL.
        centre: CPIRL's centre: ac, cg, mvie or cc.
        n_rounds: Budget of convex-concave rounds.
        max_solves: Budget of forward solves of each.
        w: Where the first completion plans for, shape (K,); by default the better of even weights
            and the non-negative part of MCE's estimate.

    Returns:
        Weights; ``objective`` is g at the start and after each round, ``info`` holds the intervals
        (K, 2) that the last round leaves and the shortfall, g relative to w.mu.
    """
    positive(n_rounds=n_rounds, max_solves=max_solves)
    counts = demonstrations.counts(mdp.n_states, mdp.n_actions)
    visits = counts.sum(axis=1)
    world = replace(mdp, start=visits / visits.sum())
    starts = _starts(world, demonstrations) if w is None else [np.asarray(w, dtype=np.float64)]
    here = _least(world, starts, counts)
    log, known, solves = [here], [here.answer.mu], len(starts)
    intervals, status = np.tile([0.0, 1.0], (len(here.w), 1)), Status.BUDGET
    for _ in range(n_rounds):
        try:
            run = _round(world, here.completed.mu, known, centre, max_solves, rng)
        except (EmptyPolyhedronError, SolverError):
            status = Status.STALLED
            break
        intervals = run[-1].intervals
        known.extend(it.response.mu for it in run)
        least = min(run, key=lambda it: it.regret)
        there = _least(world, [run[-1].estimate, least.w], counts)
        solves += len(run) + 2
        if there.g > here.g and not there.is_explained:  # the round's budget was too small
            status = Status.STALLED
            break
        is_same = np.abs(there.completed.mu - here.completed.mu).max() <= 1e-12 * max(
            1.0, float(np.abs(here.completed.mu).max())
        )
        here = there
        log.append(here)
        if here.is_explained or is_same:
            status = Status.MATCHED if here.is_explained else Status.CONVERGED
            break
    info = {
        "solves": solves,
        "shortfall": here.g / max(abs(float(here.w @ here.answer.mu)), 1e-300),
        "intervals": intervals,
    }
    notes = () if here.is_explained else (UNEXPLAINED,)
    return from_weights(
        mdp,
        here.w,
        "simplex",
        objective=np.array([e.g for e in log]),
        iterates=np.array([e.w for e in log]),
        status=status,
        info=info,
        notes=notes,
    )


def _starts(mdp: FiniteMDP, demonstrations: Demonstrations) -> list[Array]:
    """Even weights, and MCE's estimate without its negative part."""
    K = mdp.n_objectives
    w = mce_likelihood(mdp, demonstrations).w
    assert w is not None
    w = np.maximum(w, 0.0)
    even = np.full(K, 1 / K)
    return [even, w / w.sum()] if w.sum() > 0 else [even]


def _least(mdp: FiniteMDP, tried: list[Array], counts: Array) -> Estimate:
    """The weights of least shortfall; of those that explain everything the first."""
    found = [estimate(mdp, w, counts) for w in tried]
    return min(found, key=lambda e: 0.0 if e.is_explained else e.g)


def _round(
    mdp: FiniteMDP,
    mu_ref: Array,
    known: list[Array],
    centre: str,
    max_solves: int,
    rng: np.random.Generator,
) -> list[Iteration]:
    """CPIRL against the completed demonstration; policies of earlier rounds are free cuts."""
    is_first = True
    pi = None

    def forward(w: Array) -> Response:
        nonlocal is_first, pi
        best = best_policy(mdp, mdp.reward(w), pi=pi)
        pi, mu = best.pi, mdp.Phi.T @ best.chain.solve_transposed(mdp.start)
        evaluated = np.array(known) if is_first else np.empty((0, len(mu)))
        is_first = False
        return Response(pi, mu, evaluated=evaluated)

    expert = Expert(mu_ref, np.zeros_like(mu_ref))
    return list(
        cpirl(forward, expert, centre=centre, mode="minimise", max_solves=max_solves, rng=rng)
    )
