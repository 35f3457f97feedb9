r"""What ground gained is worth, so that walking pays.

Costs per metre are a ratio, :math:`\min_\pi E \int c\,dt / E\,\text{distance}`. As a sum over time
it becomes (W. Dinkelbach 1967, On nonlinear fractional programming)

.. math:: \max_\pi E \sum_t (\lambda\, \Delta x_t - w \cdot c_t)

whose best policy is the ratio's where :math:`\lambda` is the least cost per metre
:math:`\lambda^* = \min w \cdot G`. There walking earns nothing, and lying down for free would be as
good. A little above :math:`\lambda^*` every metre earns :math:`\lambda - \lambda^*`, and the best
gait is still (to first order) the same one: it only walks a little faster.
"""

from __future__ import annotations

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.library import KnownGait, load_library

MARGIN = 0.05
"""By how much a metre's price exceeds the least cost per metre known, relative. From about .1 on, a
shipped gait earns more by the faster gait of other weights."""
FALL_METRES = 1.0
"""A fall takes back the price of so many metres: what is gained by pitching forward [m]."""


def best_known(w: Array, body: str) -> KnownGait:
    """The body's known gait that costs least under weights ``w``, shape (6,)."""
    return min(load_library(body).values(), key=lambda s: float(w @ s.total_costs))


def price_of_progress(w: Array, body: str) -> float:
    """Price of a metre: MARGIN above the least cost per metre known for weights ``w`` (6,).

    For weights that no gait is shipped for, the shipped gaits bound their optimum from above.
    """
    return (1.0 + MARGIN) * float(w @ best_known(w, body).total_costs)
