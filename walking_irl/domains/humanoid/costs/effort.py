r"""Effort: squared torque of muscles and tendons relative to the strength of its direction.

A tendon is the cubic part of a joint's stiffness (MJCF ``stiffness="k1 k2 k3"``): its muscle holds
what it bears, so the effort of such a joint is that of the sum

.. math:: \tau - k_3 (q - q_\text{ref})^3

of motor and tendon. Otherwise the calf's tendon would be a free source of push-off. Springs of the
linear part stand for ligaments and passive tissue, which nothing has to hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, Term, read_joints


@dataclass(frozen=True)
class Effort(Cost):
    """Squared torque of muscle and tendon [Nm] relative to the strength of its direction [Nm].

    Attributes:
        switch: Width of the change between the strengths of both directions [Nm].
    """

    name: str = "effort"
    unit: str = "1"
    scale: float = 0.145
    meaning: str = "Squared torque of muscle and tendon relative to the strength of its direction."
    formula: str = "|(tau - k3 (q - ref)^3) / strength|^2"
    reference: float | None = 4.898
    planar_reference: float | None = 1.094
    switch: float = 10.0

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One residual a motor; those without a tendon first."""
        tendon = walker.tendon_stiffness
        kinds = (np.flatnonzero(tendon == 0), np.flatnonzero(tendon))
        bare, strung = (self._term(walker, kind) if len(kind) else None for kind in kinds)
        return [term for term in (bare, strung) if term is not None]

    def _term(self, walker: Walker, motors: Indices) -> Term:
        law = _Law(walker, motors, self.switch)
        names = [walker.joints[walker.n_root + m] for m in motors]
        tau = read_joints(walker, "tau", names)
        if not law.k3.any():
            return Term(
                (tau,),
                law.of_torque,
                first=lambda t: law.slopes(t)[:1],
                second=lambda t: {(0, 0): law.slopes(t)[1]},
            )
        reads = (tau, read_joints(walker, "q", names))
        return Term(reads, law.of_both, first=law.first, second=law.second)


class _Law:
    """Residual of some motors: a torque over the strength of its direction, and its slopes."""

    def __init__(self, walker: Walker, motors: Indices, switch: float) -> None:
        plus, minus = 1 / walker.strength_plus[motors], 1 / walker.strength_minus[motors]
        self.mean, self.half, self.switch = (plus + minus) / 2, (plus - minus) / 2, switch
        self.k3: Array = walker.tendon_stiffness[motors]
        self.rest: Array = walker.model.qpos_spring[walker.n_root + motors]

    def of_torque(self, tau: Any) -> Any:
        return tau * (self.mean + self.half * np.tanh(tau / self.switch))

    def of_both(self, tau: Any, q: Any) -> Any:
        return self.of_torque(tau - self.k3 * (q - self.rest) ** 3)

    def slopes(self, tau: Any) -> tuple[Any, Any]:
        """First and second derivative of :meth:`of_torque`."""
        th = np.tanh(tau / self.switch)
        bend = self.half * (1 - th * th) / self.switch
        return self.mean + self.half * th + tau * bend, 2 * bend * (1 - tau * th / self.switch)

    def first(self, tau: Any, q: Any) -> tuple[Any, Any]:
        """First partial derivatives of :meth:`of_both`."""
        y = q - self.rest
        slope, _ = self.slopes(tau - self.k3 * y**3)
        return slope, slope * (-3 * self.k3 * y * y)

    def second(self, tau: Any, q: Any) -> dict[tuple[int, int], Any]:
        """Second partial derivatives of :meth:`of_both`."""
        y = q - self.rest
        first, bend = self.slopes(tau - self.k3 * y**3)
        pull = -3 * self.k3 * y * y
        return {
            (0, 0): bend,
            (0, 1): bend * pull,
            (1, 1): bend * pull * pull - first * 6 * self.k3 * y,
        }
