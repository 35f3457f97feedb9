"""MMPBoost: maximum margin planning that learns its features (N. Ratliff et al., NIPS 2007).

Features begin as the constant alone. Each round refits MMP, takes the visits x* of its
loss-augmented planner and fits a regression tree on raw features of the state to sign(x_E - x*)
with weights |x_E - x*|: a feature that rewards where the expert goes and the planner does not.
(The paper's labels are for costs; for rewards the sign is reversed.) Old policies stay as cuts.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.mmp import RIDGE, Minimum, augmented, by_cuts, margins
from walking_irl.baselines.recovered import (
    Recovered,
    from_reward,
    from_start,
    positive,
    with_features,
)
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.types import Status

SMALL = 1e-6
"""Differences of visits below this, relative to the largest, teach the tree nothing."""


@dataclass(frozen=True)
class Boosted:
    """A reward as a constant and a weighted sum of trees; it transfers to other worlds.

    Attributes:
        w: Weight of the constant and of each tree, shape (n + 1,).
        trees: Fitted regression trees.
    """

    w: Array
    trees: tuple[Any, ...]

    def predict(self, X: Array) -> Array:
        """Rewards of states with raw features X, shape (n, d): shape (n,)."""
        columns = [np.ones(len(X)), *(tree.predict(X) for tree in self.trees)]
        r: Array = np.column_stack(columns) @ self.w
        return r


def tree_library() -> Any:
    """scikit-learn's trees.

    Raises:
        InvalidInputError: If scikit-learn is not installed; the message names the command.
    """
    try:
        return importlib.import_module("sklearn.tree")
    except ImportError as error:
        raise InvalidInputError(
            "MMPBoost needs scikit-learn for its trees: pip install 'walking-irl[methods]'"
        ) from error


def mmp_boost(
    mdp: FiniteMDP,
    demonstrations: Demonstrations,
    *,
    features: Array | None = None,
    n_rounds: int = 8,
    depth: int = 3,
    ridge: float = RIDGE,
    has_own_start: bool = True,
) -> Recovered:
    """A non-linear reward from trees on the states' raw features.

    Args:
        mdp: The world.
        demonstrations: States and actions.
        features: Raw features, shape (S, d); the world's own by default.
        n_rounds: Number of trees.
        depth: Depth of each.
        ridge: Weight of |w|^2 / 2.
        has_own_start: Whether policies start where the demonstrations do; with few of them this
            halves the loss.

    Returns:
        A tabular reward; ``info["model"]`` is a :class:`Boosted`.
    """
    world = from_start(mdp, demonstrations) if has_own_start else mdp
    X = mdp.Phi if features is None else np.asarray(features, dtype=np.float64)
    if X.ndim != 2 or len(X) != mdp.n_states or not np.isfinite(X).all():
        raise InvalidInputError(
            f"MMPBoost needs finite features of shape ({mdp.n_states}, d), got {X.shape}"
        )
    x_E = demonstrations.visits(mdp.n_states, mdp.discount)
    loss = margins(demonstrations.counts(mdp.n_states, mdp.n_actions))
    model, log = boost(world, X, x_E, loss, n_rounds=n_rounds, depth=depth, ridge=ridge)
    notes = ("no policy has the demonstrations' visits (cost < 0): the last trees fit noise",)
    return from_reward(
        mdp,
        model.predict(X),
        objective=np.array([fit.c for fit in log]),
        status=Status.BUDGET if len(log) > n_rounds else Status.CONVERGED,
        info={"model": model, "solves": sum(len(fit.log) for fit in log)},
        notes=notes if log[-1].c < 0 else (),
    )


def boost(
    mdp: FiniteMDP, X: Array, x_E: Array, loss: Array, *, n_rounds: int, depth: int, ridge: float
) -> tuple[Boosted, tuple[Minimum, ...]]:
    """Model and the fit of each round; the fits' c never rise.

    c >= sum x_E l >= 0 wherever some policy has the visits x_E: below 0 trees fit the noise of a
    sample. They still help (measured: to stop there multiplies the loss by five).

    Args:
        mdp: The world.
        X: Raw features, shape (S, d).
        x_E: The expert's visits, shape (S,).
        loss: Margins, shape (S, A).
        n_rounds: Number of trees.
        depth: Depth of each.
        ridge: Weight of |w|^2 / 2.
    """
    positive(n_rounds=n_rounds, depth=depth)
    library, F, trees = tree_library(), np.ones((len(X), 1)), []
    world = with_features(mdp, F)
    fit = by_cuts(world, F.T @ x_E, loss, ridge=ridge, max_solves=150)
    log = [fit]
    for _ in range(n_rounds):
        there = augmented(world, fit.w, F.T @ x_E, loss, ridge)
        gap = x_E - there.visits
        is_used = np.abs(gap) > SMALL * np.abs(gap).max()
        if np.abs(gap).max() <= 1e-9:
            break
        tree = library.DecisionTreeRegressor(max_depth=depth, random_state=0)
        tree.fit(X[is_used], np.sign(gap[is_used]), sample_weight=np.abs(gap[is_used]))
        trees.append(tree)
        F = np.column_stack([F, tree.predict(X)])
        world = with_features(mdp, F)
        fit = by_cuts(world, F.T @ x_E, loss, ridge=ridge, max_solves=150, cuts=fit.cuts)
        log.append(fit)
    return Boosted(fit.w, tuple(trees)), tuple(log)
