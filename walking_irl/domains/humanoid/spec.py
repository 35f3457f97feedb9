"""Which walker, and what it may walk for: what every solve and every rollout must know."""

from __future__ import annotations

from dataclasses import dataclass

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.body.load import body_of, load_walker
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS, Costs
from walking_irl.domains.humanoid.costs.stack import CostStack, cost_stack


@dataclass(frozen=True)
class WalkerSpec:
    """A body and its costs, as plain data: hashable, and picklable to worker processes.

    Attributes:
        body: "humanoid", "humanoid-planar", or the path of an MJCF file.
        costs: Costs per metre, which are learnt, and the shared part.
    """

    body: str = "humanoid"
    costs: Costs = DEFAULT_COSTS

    def __post_init__(self) -> None:
        object.__setattr__(self, "body", body_of(self.body))
        object.__setattr__(self, "costs", tuple(self.costs))

    @property
    def walker(self) -> Walker:
        """The body."""
        return load_walker(self.body)

    @property
    def stack(self) -> CostStack:
        """The costs of that body."""
        return cost_stack(self.walker, self.costs)


HUMANOID, PLANAR = WalkerSpec("humanoid"), WalkerSpec("humanoid-planar")
