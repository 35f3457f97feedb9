r"""The gait that the same weights give elsewhere: at another speed, on a slope, with a load.

The time that a metre takes is one over the speed, and a cost of its own. So the best gait of a
given speed is the best one for another price :math:`\lambda` of time, all other prices as they are:
its Lagrange multiplier. Slopes and loads are reached in steps from level ground.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.variants import Surroundings, parted, variant
from walking_irl.domains.humanoid.costs.base import Cost
from walking_irl.domains.humanoid.costs.time import Time
from walking_irl.domains.humanoid.expert_search import best_gait
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.learner import check_weights, search, solver_for
from walking_irl.domains.humanoid.optimiser.stages import DIRECT, LADDER
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import InvalidInputError, SolverError

STEP = Surroundings(slope=2.0, load=10.0)
"""Largest step on the way to a slope [deg] and a load [kg]."""
SPEED_ERROR, WORST_SPEED_ERROR = 1e-3, 0.02
"""Of a gait of a given speed, relative: what is sought, and what is granted where the best gait
jumps from one kind of walk to another."""
STEEP_PRICE = 0.35
"""Step of the logarithm of time's price while a speed is bracketed."""
MAX_STEPS = 12


@dataclass(frozen=True)
class Prediction:
    """A gait for the same weights in other circumstances.

    Attributes:
        spec: The body there.
        gait: The gait.
        total_costs: Its total costs G there, shape (K,).
        price: Weight of time at which it is the best one, the other weights as they are.
    """

    spec: WalkerSpec
    gait: Gait
    total_costs: Array
    price: float


def predict(
    spec: WalkerSpec,
    w: Array,
    around: Surroundings,
    speed: float | None = None,
    executor: Executor | None = None,
    *,
    level: Prediction | None = None,
) -> Prediction:
    """The best gait for weights in other circumstances.

    Args:
        spec: Body on level ground and its costs.
        w: Weights, shape (K,).
        around: Where it walks.
        speed: Of the walk [m/s], or None: the one that the weights choose.
        executor: Solves side by side.
        level: The prediction for level ground, where it is known already.

    Raises:
        InvalidInputError: If the weights are wrong, the body is somewhere else already, or there is
            no gait of that speed.
        SolverError: If no gait is found that can be walked.
    """
    w = check_weights(w, spec)
    if parted(spec.body)[1] != Surroundings():
        raise InvalidInputError(f"predictions start from level ground, {spec.body} is elsewhere")
    gait = search(spec, w, executor).policy if level is None else level.gait
    x = gait.to_vector()
    n = int(np.ceil(max(abs(around.slope) / STEP.slope, around.load / STEP.load)))
    there = spec
    for k in range(1, n + 1):
        there = replace(spec, body=variant(spec.body, around.share(k / n)))
        x = solver_for(there).solve(w, x, LADDER).x
    if n:
        x = _cheaper(there, w, x, executor)
    price = float(w[_time(spec)])
    if speed is not None:
        x, price = _at_speed(there, w, x, speed)
    if solver_for(there).dual(x) is None:
        raise SolverError("no gait found there that the body can walk")
    costs = solver_for(there).problem.evaluate(x).total_costs()
    return Prediction(there, Gait.from_vector(x, len(there.walker.joints)), costs, price)


def _cheaper(spec: WalkerSpec, w: Array, x: Array, executor: Executor | None) -> Array:
    """The cheapest gait found by a search as hard as an expert's, from this one among others."""
    found = best_gait(spec, w, np.random.default_rng(0), executor, also=[x])
    costs = solver_for(spec).problem.evaluate(x).total_costs()
    return found.x if float(found.total_costs @ w) < float(costs @ w) else x


def _time(spec: WalkerSpec) -> int:
    """Index of the time among the objectives."""
    costs = [c for c in spec.costs if isinstance(c, Cost)]
    found = [i for i, c in enumerate(costs) if isinstance(c, Time)]
    if not found:
        raise InvalidInputError("without the time among the costs no speed can be asked for")
    return found[0]


def _at_speed(spec: WalkerSpec, w: Array, x: Array, speed: float) -> tuple[Array, float]:
    """The best gait of a given speed from the best one of any, and the price of its time."""
    if not (np.isfinite(speed) and speed > 0):
        raise InvalidInputError(f"speed must be a positive number, got {speed}")
    solver, j = solver_for(spec), _time(spec)
    found = {float(np.log(w[j])): x}

    def excess(price: float) -> float:
        """Relative speed beyond what is asked for, at the logarithm of a price."""
        near = min(found, key=lambda p: abs(p - price))
        if near != price:
            priced = w.copy()
            priced[j] = np.exp(price)
            found[price] = solver.solve(priced, found[near], DIRECT).x
        return float(found[price][-2] / found[price][-1]) / speed - 1

    def reached(price: float) -> bool:
        return abs(excess(price)) < SPEED_ERROR

    low = high = next(iter(found))
    for _ in range(MAX_STEPS):
        if excess(low) > 0:
            low -= STEEP_PRICE
        elif excess(high) < 0:
            high += STEEP_PRICE
    if not excess(low) <= 0 <= excess(high):
        ends = sorted(float(y[-2] / y[-1]) for y in found.values())
        raise InvalidInputError(
            f"no gait of {speed:g} m/s is the best one at any price of time: speeds from "
            f"{ends[0]:.2f} to {ends[-1]:.2f} m/s were found"
        )
    for _ in range(MAX_STEPS):
        if any(map(reached, tuple(found))):
            break
        a, b = excess(low), excess(high)
        share = float(np.clip(a / (a - b), 0.1, 0.9))  # the line through both, but never a crawl
        middle = low + share * (high - low)
        low, high = (middle, high) if excess(middle) < 0 else (low, middle)
    best = min(found, key=lambda price: abs(excess(price)))
    if abs(excess(best)) > WORST_SPEED_ERROR:
        raise InvalidInputError(
            f"around {speed:g} m/s the best gait jumps from one kind of walk to another; the "
            f"nearest speed found is {found[best][-2] / found[best][-1]:.2f} m/s"
        )
    return found[best], float(np.exp(best))
