"""PolicyWalk (D. Ramachandran & E. Amir, Bayesian inverse reinforcement learning, IJCAI 2007).

A Metropolis walk over the weights of linear rewards, on a grid, with posterior
prod_i exp(alpha Q*(s_i, a_i; w)) / Z_i(w) times a uniform prior. The normaliser
Z_i = sum_b exp(alpha Q*(s_i, b; w)) depends on the weights and must not be dropped. Q* of a
neighbour follows from the successor features of the present policy as long as that policy stays
greedy; only else is a forward problem solved, warm.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from scipy.special import logsumexp

from walking_irl.arrays import Array, Indices
from walking_irl.baselines.recovered import Recovered, from_weights, positive
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.successor import successor
from walking_irl.rl.tabular import MAX_IMPROVEMENTS, best_policy
from walking_irl.types import Status

KEPT_POINTS, KEPT_POLICIES = 50_000, 500
"""Grid points whose posterior is remembered, and policies whose successor features are."""
FEW = 100.0
"""Independent samples below which a chain's intervals are rough."""
TIE = 1e-9
"""Relative gain of an action over the policy's below which the policy still counts as greedy."""


class Place(NamedTuple):
    """A point of the walk."""

    pi: Actions
    """Its optimal policy, shape (S,)."""
    Psi: Array
    """Successor features of that policy, shape (S, A, K)."""
    log_posterior: float


class Posterior:
    """Unnormalised log posterior of weights, with what one solve teaches about its neighbours.

    Args:
        mdp: The world.
        counts: c[s, a], shape (S, A).
        alpha: Inverse temperature of the expert.
    """

    def __init__(self, mdp: FiniteMDP, counts: Array, alpha: float) -> None:
        self.mdp, self.alpha = mdp, alpha
        self.seen = np.flatnonzero(counts.sum(axis=1))
        self.counts = counts[self.seen]
        self.n_solves = 0
        self._successors: dict[bytes, Array] = {}

    def at(self, w: Array, near: Place | None = None) -> Place:
        """The posterior of weights w, shape (K,), starting from the policy of a near place."""
        if near is None:
            pi = best_policy(self.mdp, self.mdp.Phi @ w).pi
            Psi, self.n_solves = self._successor(pi), self.n_solves + 1
            return Place(pi, Psi, self._log_likelihood(Psi @ w))
        pi, Psi, n_improved = near.pi, near.Psi, 0
        while True:  # policy iteration: successor features evaluate a policy for any weights
            Q = Psi @ w
            own = np.take_along_axis(Q, pi[:, None], axis=1)[:, 0]
            is_better = Q.max(axis=1) > own + TIE * max(1.0, float(np.abs(own).max()))
            if not is_better.any():
                self.n_solves += n_improved > 0
                return Place(pi, Psi, self._log_likelihood(Q))
            if n_improved == MAX_IMPROVEMENTS:
                raise SolverError(f"the policy still changes after {n_improved} improvements")
            pi = np.where(is_better, Q.argmax(axis=1), pi)
            Psi, n_improved = self._successor(pi), n_improved + 1

    def _successor(self, pi: Actions) -> Array:
        """Successor features of a policy, remembered."""
        key = pi.tobytes()
        if key not in self._successors:
            if len(self._successors) >= KEPT_POLICIES:
                self._successors.clear()
            self._successors[key] = successor(self.mdp, pi)
        return self._successors[key]

    def _log_likelihood(self, Q: Array) -> float:
        """Sum of c(s, a) [alpha Q(s, a) - log sum_b exp alpha Q(s, b)]."""
        q = self.alpha * Q[self.seen]
        return float((self.counts * (q - logsumexp(q, axis=1, keepdims=True))).sum())


def policywalk(
    mdp: FiniteMDP,
    demonstrations: Demonstrations,
    *,
    rng: np.random.Generator,
    space: Literal["box", "simplex"] = "box",
    alpha: float | None = None,
    delta: float | None = None,
    bound: float = 10.0,
    n_samples: int = 5000,
    burn_in: int | None = None,
    w: Array | None = None,
) -> Recovered:
    """Samples of the posterior of the weights; the answer is optimal for their mean.

    Args:
        mdp: The world.
        demonstrations: States and actions.
        rng: Draws proposals.
        space: "box", one weight moves by +-delta within +-bound; "simplex", delta moves from one
            weight to another. Proposals that leave are rejected, never clipped: the walk stays
            symmetric.
        alpha: Inverse temperature of the expert; 1 in the box, whose weights have a scale of
            their own, and 10 on the simplex.
        delta: Step of the grid; 0.5 in the box, 0.05 on the simplex.
        bound: Largest weight of the box.
        n_samples: Samples that are kept.
        burn_in: Samples thrown away before; a fifth of ``n_samples`` by default.
        w: Where the walk begins, a point of the grid; 0 or as even as it allows by default.

    Returns:
        Mean weights and all samples; ``info`` holds 95 % intervals (K, 2), the share of accepted
        proposals, forward solves and effective sample sizes (K,).

    Raises:
        InvalidInputError: If a setting is out of range or the start is not on the grid.
    """
    K, is_box = mdp.n_objectives, space == "box"
    if space not in ("box", "simplex"):
        raise InvalidInputError(f"unknown space {space!r}; choose from box, simplex")
    alpha = (1.0 if is_box else 10.0) if alpha is None else alpha
    delta = (0.5 if is_box else 0.05) if delta is None else delta
    burn_in = n_samples // 5 if burn_in is None else burn_in
    positive(alpha=alpha, delta=delta, bound=bound, n_samples=n_samples)
    if K < 2 and not is_box:
        raise InvalidInputError("a walk on the simplex needs at least 2 features")
    top = int(np.floor((bound if is_box else 1.0) / delta + 1e-9))
    posterior = Posterior(mdp, demonstrations.counts(mdp.n_states, mdp.n_actions), alpha)
    point = _middle(K, top, is_box) if w is None else _on_grid(w, delta, top, is_box)
    points, log, accepted = _walk(posterior, point, delta, top, is_box, burn_in + n_samples, rng)
    samples: Array = np.asarray(points[burn_in:] * delta, dtype=np.float64)
    info = {
        "intervals": np.quantile(samples, [0.025, 0.975], axis=0).T,
        "acceptance": accepted / len(points),
        "solves": posterior.n_solves,
        "effective_sample_size": effective_sample_sizes(samples),
    }
    return from_weights(
        mdp,
        samples.mean(axis=0),
        space,
        samples=samples,
        objective=log[burn_in:],
        iterates=samples,
        status=Status.SAMPLED,
        info=info,
        notes=_notes(samples, delta * top if is_box else None),
    )


def _notes(samples: Array, bound: float | None) -> tuple[str, ...]:
    """What a reader of the posterior should know of its chain."""
    notes = list(mixing(samples))
    if bound is not None:
        share = float((np.abs(samples).max(axis=1) > bound - 1e-9).mean())
        if share > 0.5:
            notes.append(
                f"a weight lies at the bound of the box in {100 * share:.0f} % of the samples: the "
                "expert acts with more certainty than the box allows, and the intervals are too "
                "narrow; the ratios of weights still say what it prefers"
            )
    return tuple(notes)


def mixing(samples: Array) -> tuple[str, ...]:
    """A warning where a chain is worth few independent samples."""
    least = float(effective_sample_sizes(samples).min())
    if least >= FEW:
        return ()
    return (
        f"the chain is worth {least:.0f} independent samples of its weakest weight: draw more "
        "before you trust its intervals",
    )


def _middle(K: int, top: int, is_box: bool) -> Indices:
    """The middle of the grid, in steps, shape (K,)."""
    point = np.zeros(K, dtype=np.intp)
    if not is_box:
        point += top // K
        point[: top - K * (top // K)] += 1
    return point


def _on_grid(w: Array, delta: float, top: int, is_box: bool) -> Indices:
    point: Indices = np.round(np.asarray(w) / delta).astype(np.intp)
    is_inside = np.abs(point).max() <= top if is_box else point.min() >= 0 and point.sum() == top
    if not is_inside or np.abs(point * delta - w).max() > 1e-9:
        raise InvalidInputError(f"the walk must begin on its grid of step {delta}, got {w}")
    return point


def _walk(
    posterior: Posterior,
    point: Indices,
    delta: float,
    top: int,
    is_box: bool,
    n: int,
    rng: np.random.Generator,
) -> tuple[Indices, Array, int]:
    """Points (n, K) of the chain in steps of the grid, their log posteriors, accepted proposals."""
    K, accepted = len(point), 0
    place = posterior.at(np.asarray(point * delta, dtype=np.float64))
    known: dict[bytes, Place] = {point.tobytes(): place}
    points, log = np.empty((n, K), dtype=np.intp), np.empty(n)
    first, other = rng.integers(K, size=n), rng.integers(max(K - 1, 1), size=n)
    sign, dice = 2 * rng.integers(2, size=n) - 1, np.log(rng.random(n))
    for t in range(n):
        new, i = point.copy(), first[t]
        if is_box:
            new[i] += sign[t]
            is_inside = abs(new[i]) <= top
        else:
            j = (i + 1 + other[t]) % K
            new[i] += 1
            new[j] -= 1
            is_inside = new[j] >= 0
        if is_inside:
            there = known.get(new.tobytes())
            if there is None:
                there = posterior.at(np.asarray(new * delta, dtype=np.float64), place)
                if len(known) < KEPT_POINTS:
                    known[new.tobytes()] = there
            if dice[t] < there.log_posterior - place.log_posterior:
                point, place, accepted = new, there, accepted + 1
        points[t], log[t] = point, place.log_posterior
    return points, log, accepted


def effective_sample_sizes(samples: Array) -> Array:
    """Independent samples that a chain is worth, by Geyer's initial positive sequence, (K,).

    n / (1 + 2 sum of autocorrelations), summed in pairs while a pair is positive (C. Geyer, 1992);
    n for a coordinate that never moves.
    """
    n, K = samples.shape
    centred = samples - samples.mean(axis=0)
    F = np.fft.rfft(centred, 2 * n, axis=0)
    correlation = np.fft.irfft(np.abs(F) ** 2, axis=0)[:n]
    sizes = np.full(K, float(n))
    for k in range(K):
        if correlation[0, k] <= 1e-12 * n:
            continue
        rho = correlation[:, k] / correlation[0, k]
        pairs = rho[: n - n % 2].reshape(-1, 2).sum(axis=1)
        last = int(np.argmax(pairs <= 0)) if (pairs <= 0).any() else len(pairs)
        sizes[k] = n / max(2 * pairs[:last].sum() - 1, 1.0)
    return sizes
