"""A forward solver for one recorded walk, which forgets no answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.learner import Start, WarmStartSolver, known_gaits
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.types import Response


class Remembered:
    """A forward solver that remembers: weights asked twice cost nothing, and every answer cuts.

    A person's gait is no optimum, so each solve goes to its end, from that gait or from a known
    one that is cheaper.

    Args:
        start: Gait from which solves start.
        spec: Which body, and its costs.
        answers: Weights and responses that are known already.

    Attributes:
        solves: Forward solves so far.
        answers: Weights and responses so far.
    """

    def __init__(
        self, start: Gait, spec: WalkerSpec, answers: Sequence[tuple[Array, Response]] = ()
    ) -> None:
        K = len(spec.stack.objectives)
        self.forward = WarmStartSolver(start, spec, mu=np.zeros(K))  # 0: beaten by nobody
        self.forward.found += known_gaits(spec)
        self.solves = 0
        self.met: list[Array] = []
        self.answers = list(answers)
        for _, response in answers:
            self.forward.recall(response)

    def __call__(self, w: Array) -> Response:
        """The response, with the features of all policies found before."""
        known = next((r for v, r in self.answers if np.array_equal(v, w)), None)
        if known is None:
            known = self.forward(w)
            self.solves += 1
            self.answers.append((w, known))
        return replace(known, evaluated=self.policies())

    def meet(self, gait: Gait, total_costs: Array) -> None:
        """Learn of a gait that is no answer: it may be a start, and it bounds every answer."""
        self.forward.found.append(Start(gait.to_vector(), total_costs))
        self.met.append(-total_costs)

    def value(self, w: Array) -> float:
        """V(w), the most that any policy known is worth."""
        return float((self.policies() @ w).max())

    def policies(self) -> Array:
        """Features of all policies known, shape (n, K)."""
        rows = [m for _, r in self.answers for m in (r.mu, *r.evaluated)] + self.met
        return np.asarray(np.unique(np.array(rows), axis=0))

    def sensitivity(self, w: Array) -> Array:
        """Of the answer nearest to weights that has one, else the identity: (K, K).

        Its steps are short ones down the gradient, and its half widths are wide.
        """
        known = [(v, r.sensitivity) for v, r in self.answers if r.sensitivity is not None]
        if not known:
            return np.eye(len(w))
        return min(known, key=lambda a: float(np.abs(a[0] - w).sum()))[1]
