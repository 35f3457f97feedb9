"""What all baselines share: a budget, the policies found, and a lottery over them.

A baseline is its rule alone: what it makes of the policies found so far (a mixture), what it asks
for next, and when it is content. Adding one is a file with a function of :class:`Baseline`'s
signature, and a line in :data:`walking_irl.baselines.BASELINES`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple, Protocol

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice
from walking_irl.errors import InvalidInputError
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.types import Expert, Forward, Response, Status


class Setting(NamedTuple):
    """What a baseline may know of the domain beside its solver."""

    is_signed: bool = True
    """Whether the solver takes negative weights, as Abbeel & Ng's algorithms ask for."""
    span: float | None = None
    """Bound on |mu_i - mu_E_i| of every policy and feature, for MWAL."""
    mdp: FiniteMDP | None = None
    """The model where there are finitely many states and actions, for LPAL."""


USUAL = Setting()


class Baseline(Protocol):
    """Signature of every baseline."""

    def __call__(
        self,
        forward: Forward,
        expert: Expert,
        *,
        rng: np.random.Generator,
        setting: Setting = ...,
        tol: float = ...,
        max_solves: int = ...,
    ) -> Iterator[Apprentice]:
        """One apprentice per forward solve; the last has a status other than CUT.

        Args:
            forward: Best policy for given weights.
            expert: The expert; only ``mu`` is used.
            rng: Draws the first weights, where they are drawn.
            setting: What is known of the domain.
            tol: What counts as reached, relative to the size of ``mu``.
            max_solves: Budget of forward solves.
        """
        ...


class Move(NamedTuple):
    """What a rule makes of the policies found."""

    mixture: Array
    """Probability of each, shape (n,)."""
    w: Array
    """What it asks for next, shape (K,)."""
    status: Status = Status.CUT
    """CUT to go on."""


Rule = Callable[[Array, Array], Move]
"""Maps the queries W and their policies' features M, both of shape (n, K), to the next move."""


def apprentices(
    forward: Forward, expert: Expert, first: Array, rule: Rule, *, tol: float, max_solves: int
) -> Iterator[Apprentice]:
    """Ask, let the rule decide, and go on until it is content or the budget is spent.

    Args:
        forward: Best policy for given weights.
        expert: The expert.
        first: First query, shape (K,).
        rule: The algorithm.
        tol: Its tolerance, to be checked.
        max_solves: Budget of forward solves.

    Raises:
        InvalidInputError: If the budget is below 1 or the tolerance is negative.
    """
    if max_solves < 1 or not tol >= 0:
        raise InvalidInputError(
            f"max_solves must be at least 1 and tol >= 0, got {max_solves} and {tol}"
        )
    W: list[Array] = []
    responses: list[Response] = []
    w = first
    for k in range(max_solves):
        W.append(w)
        responses.append(forward(w))
        move = rule(np.array(W), np.array([r.mu for r in responses]))
        is_last = k == max_solves - 1 and move.status is Status.CUT
        status = Status.BUDGET if is_last else move.status
        yield Apprentice(np.array(W), tuple(responses), move.mixture, expert.mu, status)
        if status is not Status.CUT:
            return
        w = move.w
