"""Value iteration on samples with an approximated value function.

Source: R. Munos & C. Szepesvari, Finite-time bounds for fitted value iteration (2008), section 2.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.approximators import Approximator, ValueFunction
from walking_irl.rl.finite_mdp import Actions
from walking_irl.rl.generative import Draws

DIVERGED = 10.0
"""Multiple of the largest possible value, max |r| / (1 - gamma), at which sweeps have diverged."""


class FittedValues(NamedTuple):
    """A value function that has been fitted sweep after sweep."""

    value: ValueFunction
    """After the last sweep."""
    y: Array
    """Values that it was fitted to, shape (n,)."""
    change: Array
    """Largest change of these values in each sweep, shape (n_iter,)."""


def action_values(draws: Draws, value: ValueFunction, discount: float) -> Array:
    """Q = E[r + gamma V(s')] over the draws, shape (A, n); biased upward once maximised."""
    V = _values(draws.next_states, value, draws.rewards.shape)
    Q: Array = (draws.probabilities * (draws.rewards + discount * V)).sum(axis=-1)
    return Q


def greedy(draws: Draws, value: ValueFunction, discount: float) -> Actions:
    """Best action of each of the n states by one step of the draws, shape (n,)."""
    return np.asarray(action_values(draws, value, discount).argmax(axis=0), dtype=np.intp)


def approximate_value_iteration(
    states: Any,
    draws: Draws,
    fit: Approximator,
    *,
    discount: float,
    n_iter: int = 100,
    redraw: Callable[[], Draws] | None = None,
) -> FittedValues:
    """Sweep y_i = max_a E[r + gamma V(s')] at n states, then fit V to y, ``n_iter`` times.

    With nearest neighbours the sweeps contract by gamma; with a linear fit they may diverge.

    Args:
        states: The n states, first axis n.
        draws: Outcomes of every action in each of them; the same in every sweep.
        fit: How values become a value function.
        discount: gamma in [0, 1).
        n_iter: Sweeps.
        redraw: Makes new draws for every later sweep, or None.

    Raises:
        InvalidInputError: If there are as many draws as states no longer, or ``n_iter`` < 1.
        SolverError: If the values grow beyond ten times what any policy can collect.
    """
    n = draws.rewards.shape[1]
    if len(states) != n or n_iter < 1 or not 0 <= discount < 1:
        raise InvalidInputError(
            f"expected draws of {len(states)} states, n_iter >= 1 and discount in [0, 1), got "
            f"draws of {n}, {n_iter} and {discount}"
        )
    value: ValueFunction = lambda s: np.zeros(len(s))  # noqa: E731
    y, change = np.zeros(n), np.empty(n_iter)
    limit = DIVERGED * max(float(np.abs(draws.rewards).max()), 1e-300) / (1 - discount)
    for i in range(n_iter):
        if redraw is not None and i > 0:
            draws = redraw()
        y_next = action_values(draws, value, discount).max(axis=0)
        if not np.abs(y_next).max() <= limit:
            raise SolverError(
                f"approximate value iteration diverges: after {i + 1} sweeps a value is beyond "
                f"{limit:.3g}; take more states, more draws, a larger ridge or nearest neighbours"
            )
        change[i] = np.abs(y_next - y).max()
        y, value = y_next, fit(states, y_next)
    return FittedValues(value, y, change)


def _values(states: Any, value: ValueFunction, shape: tuple[int, ...]) -> Array:
    """V of every next state, shape (A, n, m); states that are indices are valued once each."""
    flat = np.asarray(states).reshape(-1, *np.shape(states)[3:])
    if flat.ndim == 1 and np.issubdtype(flat.dtype, np.integer):
        known, place = np.unique(flat, return_inverse=True)
        return value(known)[place].reshape(shape)
    return value(flat).reshape(shape)
