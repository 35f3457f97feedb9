"""A cost of your own
==================

What a walker may walk for is a list of costs, each one small class. Here a seventh is added: knees
that do not like to be bent far. It is solved for, measured, learnt and recorded like the other six.
"""

# %%
# A cost is a sum of squared residuals, each a function of a few numbers of a step. Derivatives are
# taken for you; the residual need only be analytic, and ``np.maximum(0, ...)`` is allowed.

from dataclasses import dataclass

import numpy as np

from walking_irl.domains.humanoid.costs.base import Cost, Term, read_joints
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.learner import search

KNEES, MOST = ("knee_r", "knee_l"), np.deg2rad(50.0)


@dataclass(frozen=True)
class KneeFlexion(Cost):
    """Squared knee flexion beyond 50 degrees."""

    name: str = "knee"
    unit: str = "rad^2"
    scale: float = 0.01
    meaning: str = "Squared knee flexion beyond 50 degrees."

    def terms(self, walker):
        """One residual a knee."""

        def residual(q):
            return np.maximum(0, q - MOST)

        return [Term((read_joints(walker, "q", KNEES),), residual, is_linear=True)]


# %%
# The planar walker with seven objectives. Ten per cent of the weight go to the new one.

domain = Humanoid("humanoid-planar", costs=(*DEFAULT_COSTS, KneeFlexion()))
print([o.name for o in domain.objectives])
reference = domain.spec.stack.reference_weights
w = np.append(0.9 * reference[:-1] / reference[:-1].sum(), 0.1)
best = search(domain.spec, w, starts=1)

# %%
# What the best gait does about it:

columns = [domain.walker.joints.index(name) for name in KNEES]
for label, gait in (
    ("six objectives", load_gaits("humanoid-planar")["reference"]),
    ("and the seventh", best.policy),
):
    knee = np.degrees(gait.q[:, columns].max())
    print(f"{label:16s} knee bends to {knee:.0f} degrees at {gait.speed:.2f} m/s")
assert knee < 55

# %%
# To recover seven weights from a walk, hand the domain to the run of your choice: its ``learner`` is a
# forward function like any other, and ``walking_irl.domains.register`` gives it a name for the command
# line.
