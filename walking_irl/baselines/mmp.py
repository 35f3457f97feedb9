"""Maximum margin planning (N. Ratliff, J. A. Bagnell & M. Zinkevich, ICML 2006).

c(w) = max_pi [w.mu(pi) + sum_{s,a} x_pi(s, a) l(s, a)] - w.mu_E + ridge/2 |w|^2: the regret of
CPIRL with a margin, by which the expert must beat policies the more the less they do as it does,
and a ridge. It is convex; a policy optimal for the reward w.phi + l gives a subgradient, and a cut
for any features.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy import sparse

from walking_irl.arrays import Array
from walking_irl.baselines.recovered import Recovered, from_start, from_weights, positive
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.tabular import best_policy
from walking_irl.types import Status

RIDGE = 1e-2
TOL = 1e-3
"""Gap between the best c found and its lower bound, relative to the larger of 1 and c."""


class Augmented(NamedTuple):
    """Answer of the loss-augmented planner."""

    c: float
    """The objective c(w)."""
    visits: Array
    """Discounted visits of the policy, shape (S,)."""
    margin: float
    """sum x_pi(s, a) l(s, a) of the policy."""
    pi: Actions
    """Shape (S,)."""


class Cut(NamedTuple):
    """A policy as a row of the quadratic program, whatever the features."""

    visits: Array
    """Shape (S,)."""
    margin: float


class Minimum(NamedTuple):
    """Least c(w) found."""

    w: Array
    """Shape (K,)."""
    c: float
    log: Array
    """Best c after each solve, shape (n,)."""
    iterates: Array
    """Weights of that c, shape (n, K)."""
    lower: float
    """Lower bound of c where cuts give one, else minus infinity."""
    cuts: tuple[Cut, ...]
    """All policies found, earlier ones included."""


def margins(counts: Array) -> Array:
    """l(s, a): share of the visits of s with another action, 0 where there was none, (S, A)."""
    n = counts.sum(axis=1, keepdims=True)
    return np.where(n > 0, 1 - counts / np.maximum(n, 1), 0.0)


def augmented(
    mdp: FiniteMDP, w: Array, mu_E: Array, loss: Array, ridge: float, pi: Actions | None = None
) -> Augmented:
    """c(w) and the policy that attains its maximum; a subgradient is mu(pi) - mu_E + ridge w.

    Args:
        mdp: The world.
        w: Weights, shape (K,).
        mu_E: The expert's features, shape (K,).
        loss: Margin of each state and action, shape (S, A).
        ridge: Weight of |w|^2 / 2.
        pi: Policy to start from, shape (S,).
    """
    best = best_policy(mdp, mdp.reward(w)[:, None] + loss, pi=pi)
    x = best.chain.solve_transposed(mdp.start)
    c = float(mdp.start @ best.V - w @ mu_E + 0.5 * ridge * w @ w)
    return Augmented(c, x, float(x @ loss[np.arange(x.size), best.pi]), best.pi)


def mmp(
    mdp: FiniteMDP,
    demonstrations: Demonstrations,
    *,
    method: Literal["cuts", "subgradient"] = "cuts",
    ridge: float = RIDGE,
    max_solves: int | None = None,
    is_nonnegative: bool = False,
    has_own_start: bool = True,
) -> Recovered:
    """Weights under which the demonstrations beat every policy by its margin.

    Args:
        mdp: The world.
        demonstrations: States and actions.
        method: "cuts" (quadratic programs, finished by a gap) or "subgradient" (the paper's).
        ridge: Weight of |w|^2 / 2; margins lie in [0, 1], which fixes the scale of w.
        max_solves: Budget of forward solves; 300 by cuts, 500 by subgradients. With many features
            an unfinished run may still be at w = 0.
        is_nonnegative: Whether w >= 0.
        has_own_start: Whether policies start where the demonstrations do.

    Returns:
        Free weights; ``info`` holds c and its lower bound. c < 0 says that no policy has the
        demonstrations' features: the sample is too small.

    Raises:
        InvalidInputError: If the method is unknown or a setting is out of range.
    """
    if method not in ("cuts", "subgradient"):
        raise InvalidInputError(f"unknown method {method!r}; choose from cuts, subgradient")
    world = from_start(mdp, demonstrations) if has_own_start else mdp
    mu_E = demonstrations.feature_expectations(mdp.Phi, mdp.discount)
    loss = margins(demonstrations.counts(mdp.n_states, mdp.n_actions))
    if method == "cuts":
        n = 300 if max_solves is None else max_solves
        found = by_cuts(world, mu_E, loss, ridge=ridge, max_solves=n, is_nonnegative=is_nonnegative)
    else:
        n = 500 if max_solves is None else max_solves
        found = by_subgradients(
            world, mu_E, loss, ridge=ridge, n_steps=n, is_nonnegative=is_nonnegative
        )
    is_closed = found.c - found.lower <= TOL * max(1.0, abs(found.c))
    status = Status.GAP_CLOSED if is_closed else Status.BUDGET
    notes = []
    if not found.w.any():
        notes.append("no weights are better than 0: give it more solves or a smaller ridge")
    if found.c < 0:
        notes.append("no policy has the demonstrations' features: too few trajectories")
    info = {"solves": len(found.log), "c": found.c, "lower": found.lower}
    return from_weights(
        mdp,
        found.w,
        "free",
        objective=found.log,
        iterates=found.iterates,
        status=status,
        info=info,
        notes=tuple(notes),
    )


def by_cuts(
    mdp: FiniteMDP,
    mu_E: Array,
    loss: Array,
    *,
    ridge: float = RIDGE,
    tol: float = TOL,
    max_solves: int = 300,
    is_nonnegative: bool = False,
    cuts: Sequence[Cut] = (),
) -> Minimum:
    """Minimise c by cutting planes, min ridge/2 |w|^2 + z, z >= w.(mu_i - mu_E) + l_i.

    Args:
        mdp: The world.
        mu_E: The expert's features, shape (K,).
        loss: Margins, shape (S, A).
        ridge: Weight of |w|^2 / 2.
        tol: Gap that counts as closed, relative to the larger of 1 and c.
        max_solves: Budget of forward solves.
        is_nonnegative: Whether w >= 0.
        cuts: Policies known from before; they hold for any features.
    """
    positive(ridge=ridge, tol=tol, max_solves=max_solves)
    known = list(cuts)
    D = [mdp.Phi.T @ cut.visits - mu_E for cut in known]
    w, pi = np.zeros(len(mu_E)), None
    best, lower, log = (np.inf, w), -np.inf, []
    at: list[Array] = []
    if known:
        w, lower = quadratic_program(np.array(D), _offsets(known), ridge, is_nonnegative)
    for _ in range(max_solves):
        found = augmented(mdp, w, mu_E, loss, ridge, pi)
        pi = found.pi
        best = min(best, (found.c, w), key=lambda pair: pair[0])
        known.append(Cut(found.visits, found.margin))
        D.append(mdp.Phi.T @ found.visits - mu_E)
        log.append(best[0])
        at.append(best[1])
        if best[0] - lower <= tol * max(1.0, abs(best[0])):
            break
        w, lower = quadratic_program(np.array(D), _offsets(known), ridge, is_nonnegative)
    return Minimum(best[1], best[0], np.array(log), np.array(at), lower, tuple(known))


def _offsets(cuts: Sequence[Cut]) -> Array:
    return np.array([cut.margin for cut in cuts])


def quadratic_program(
    D: Array, loss: Array, ridge: float, is_nonnegative: bool
) -> tuple[Array, float]:
    """Minimise ridge/2 |w|^2 + max_i (D_i.w + l_i): weights (K,) and the value.

    Clarabel gets the program as it is: hundreds are solved, and to compile one takes longer.

    Raises:
        SolverError: If Clarabel fails.
    """
    clarabel: Any = importlib.import_module("clarabel")
    n, K = D.shape
    rows, right = [np.c_[D, -np.ones(n)]], [-loss]  # of (w, z)
    if is_nonnegative:
        rows.append(np.c_[-np.eye(K), np.zeros(K)])
        right.append(np.zeros(K))
    b = np.concatenate(right)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    found = clarabel.DefaultSolver(
        sparse.csc_array(np.diag(np.r_[np.full(K, ridge), 0.0])),
        np.r_[np.zeros(K), 1.0],
        sparse.csc_array(np.concatenate(rows)),
        b,
        [clarabel.NonnegativeConeT(len(b))],
        settings,
    ).solve()
    if str(found.status) not in ("Solved", "AlmostSolved"):
        raise SolverError(f"the quadratic program of MMP has no solution: {found.status}")
    w = np.array(found.x[:K])
    return np.maximum(w, 0.0) if is_nonnegative else w, float(found.obj_val)


def by_subgradients(
    mdp: FiniteMDP,
    mu_E: Array,
    loss: Array,
    *,
    ridge: float = RIDGE,
    n_steps: int = 500,
    is_nonnegative: bool = False,
) -> Minimum:
    """The paper's w <- P[w - a_t g], a_t = 1 / (ridge (t + 1)): sublinear in c.

    Returns the best of all iterates and of their average with weights 2 (t + 1) / (T (T + 1)).
    """
    positive(ridge=ridge, n_steps=n_steps)
    w = average = np.zeros(len(mu_E))
    best, pi = (np.inf, w), None
    log, at, cuts = [], [], []
    for t in range(n_steps):
        found = augmented(mdp, w, mu_E, loss, ridge, pi)
        pi = found.pi
        cuts.append(Cut(found.visits, found.margin))
        best = min(best, (found.c, w), key=lambda pair: pair[0])
        log.append(best[0])
        at.append(best[1])
        subgradient = mdp.Phi.T @ found.visits - mu_E + ridge * w
        w = w - subgradient / (ridge * (t + 1))
        w = np.maximum(w, 0.0) if is_nonnegative else w
        average = average + 2 * (t + 1) / (n_steps * (n_steps + 1)) * w
    at_average = augmented(mdp, average, mu_E, loss, ridge, pi).c
    best = min(best, (at_average, average), key=lambda pair: pair[0])
    log, at = [*log, best[0]], [*at, best[1]]
    return Minimum(best[1], best[0], np.array(log), np.array(at), -np.inf, tuple(cuts))
