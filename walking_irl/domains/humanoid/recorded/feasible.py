r"""The walk of the model that is nearest to a recorded one: exactly physical, and cheap.

A recorded cycle asks for forces of a body weight at the root, so its costs mean nothing. Sought is

.. math:: \min_x \; w \cdot G(x) + \tau \, d(x, x_\text{rec})^2

with full root penalty; a measured vertical force joins the distance. It has many minima (feet that
chatter, other rhythms), so it is sought along two ways and the cheaper end counts: *down* from the
recording, held strongly at first and ever more loosely, and *up* from the known gaits that are
nearest, pulled ever more strongly, once beyond what is asked and back.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.learner import check_weights, known_gaits, solver_for
from walking_irl.domains.humanoid.optimiser.stages import Stage, stage
from walking_irl.domains.humanoid.optimiser.transcription import Evaluation
from walking_irl.domains.humanoid.recorded.closeness import (
    Closeness,
    Walk,
    closeness,
    degrees_apart,
    sagittal_apart,
)
from walking_irl.domains.humanoid.recorded.force_cost import force_apart_from
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import InvalidInputError
from walking_irl.workers import run_tasks

STRENGTH = 0.1
"""tau, relative to the costs: the pull at which gaits come as near to healthy adults' recordings as
laboratories come to each other; stronger ones buy closeness with the noise of the recording."""
LOOSENED = (10.0, 3.0, 1.0, 0.3)
"""Pulls on the way down, as far as they exceed the last one."""
TIGHTENED = 0.1
"""First pull on the way up, relative to the last one."""
BEYOND = 10.0
"""Pull by which a way up goes beyond the last one, and comes back."""
NEIGHBOURS = 2
"""Known gaits from which ways lead up."""
FOREIGN = 7.0
"""Sagittal distance from which on a walk is no habit of this body [deg]."""


@dataclass(frozen=True)
class Feasible:
    """The nearest gait that the body can walk.

    Attributes:
        gait: The gait.
        total_costs: Its total costs G, shape (K,).
        pull: tau times the squared distance from the recording, its force included.
        root: Its largest root force or moment [body weights; half a body weight times a metre].
        degrees: Distance of each joint from the recording [deg], sides as one.
        way: "down" from the recording or "up" from a known gait.
        iterations: Of the solver, on all ways.
    """

    gait: Gait
    total_costs: Array
    pull: float
    root: float
    degrees: dict[str, float]
    way: str
    iterations: int

    @property
    def sagittal(self) -> float:
        """Distance of hips, knees and ankles from the recording, root mean square [deg]."""
        return sagittal_apart(self.degrees)


def feasible_gait(
    spec: WalkerSpec,
    walk: Walk,
    w: Array,
    *,
    strength: float = STRENGTH,
    near: Sequence[Gait] = (),
    executor: Executor | None = None,
) -> Feasible:
    """The nearest gait to a recorded one.

    Args:
        spec: Which body, and its costs.
        walk: The recorded walk.
        w: Weights of the costs, shape (K,); of all gaits that are about as near, the cheapest under
            them is found.
        strength: tau.
        near: Gaits that solved the like before; then ways lead from them alone.
        executor: Goes the ways side by side.
    """
    w = check_weights(w, spec)
    to = closeness(spec.walker, walk)
    held, prices = _held(spec, walk, w, strength)
    legs = (
        _ways(spec, to, strength)
        if not near
        else [("near", g.to_vector(), [_settle(strength, to)]) for g in near]
    )
    tasks = [(held, prices, x, to, stages) for _, x, stages in legs]
    found = run_tasks(_follow, tasks, executor)
    ends = [(name, x) for (name, *_), (xs, _) in zip(legs, found, strict=True) for x in xs]
    evaluated = [(way, *_evaluated(held, x, to, len(w), strength)) for way, x in ends]
    way, ev, pull = min(evaluated, key=lambda e: float(w @ e[1].total_costs()[: len(w)]) + e[2])
    gait = Gait.from_vector(ev.x, len(spec.walker.joints))
    return Feasible(
        gait=gait,
        total_costs=ev.total_costs()[: len(w)],
        pull=pull,
        root=float(np.abs(ev.root).max()),
        degrees=degrees_apart(spec.walker, gait, walk.shown),
        way=way,
        iterations=sum(n for _, n in found),
    )


def sensitivity(
    spec: WalkerSpec, found: Feasible, walk: Walk, w: Array, *, strength: float = STRENGTH
) -> Array | None:
    """D mu / d w of the nearest gait, shape (K, K); None if it is no smooth minimum.

    Args:
        spec: Which body, and its costs.
        found: What :func:`feasible_gait` found, with these arguments.
        walk: The recorded walk.
        w: Weights, shape (K,).
        strength: tau.
    """
    held, prices = _held(spec, walk, w, strength)
    solver, to = solver_for(held), closeness(spec.walker, walk)
    lin = solver.linearise(found.gait.to_vector())
    known = solver.sensitivity(prices, lin, tether=strength * to.weight)
    return None if known is None else known[0][: len(w), : len(w)]


def _held(spec: WalkerSpec, walk: Walk, w: Array, strength: float) -> tuple[WalkerSpec, Array]:
    """The costs, with that of the force where one was measured, and the price of each."""
    if walk.force is None:
        return spec, w
    return replace(spec, costs=(*spec.costs, force_apart_from(walk.force))), np.r_[w, strength]


def _evaluated(
    held: WalkerSpec, x: Array, to: Closeness, K: int, strength: float
) -> tuple[Evaluation, float]:
    """A gait, and the pull towards the recording: of its K costs' successor, if there is one."""
    ev = solver_for(held).problem.evaluate(x)
    return ev, strength * (to.squared(x) + float(ev.objective_costs[K:].sum()))


def check_habit(found: Feasible, accepted: bool = False) -> None:
    """Refuse a walk that the body cannot follow.

    Raises:
        InvalidInputError: If it is farther from the recording than FOREIGN, unless accepted; the
            message says where.
    """
    if accepted or found.sagittal <= FOREIGN:
        return
    worst = sorted(found.degrees, key=lambda n: -found.degrees[n])[:3]
    places = ", ".join(f"{n} {found.degrees[n]:.0f}" for n in worst)
    raise InvalidInputError(
        f"this walk is not a habit of the body: its nearest gait is {found.sagittal:.1f} degrees "
        f"off at hips, knees and ankles, more than {FOREIGN:.0f} (farthest: {places}); its weights "
        "would explain the difference, not the person (--accept-habit goes on all the same)"
    )


Way = tuple[str, Array, list[tuple[Stage, ...]]]
"""Its name, where it starts, and its legs: the end of each is a gait to choose from."""


def _ways(spec: WalkerSpec, to: Closeness, strength: float) -> list[Way]:
    """The longest first, for a pool."""
    up = (_pulled(TIGHTENED * strength, to), _pulled(strength, to), *_settle(strength, to))
    beyond = (_pulled(BEYOND * strength, to), _pulled(strength, to), *_settle(strength, to))
    first, *others = _neighbours(spec, to)
    ways: list[Way] = [("down", to.target, [_down(strength, to)]), ("up", first, [up, beyond])]
    return [*ways, *(("up", x, [up]) for x in others)]


def _down(strength: float, to: Closeness) -> tuple[Stage, ...]:
    """Stages from the recording itself, whose root forces are of the order of a body weight."""
    first, *others = [s for s in LOOSENED if s > strength] + [strength]
    soft = (stage(p, 15, 1e-3, first * to.weight) for p in (1e2, 1e3, 1e4))
    loose = (stage(1e4, 15, 1e-3, s * to.weight) for s in others)
    return (*soft, *loose, *_settle(strength, to))


def _pulled(strength: float, to: Closeness) -> Stage:
    return stage(1e4, 20, 1e-3, strength * to.weight)


def _settle(strength: float, to: Closeness) -> tuple[Stage, ...]:
    """To full root penalty."""
    pull = strength * to.weight
    return stage(1e5, 20, 1e-4, pull), stage(1e6, 40, 1e-8, pull)


def _neighbours(spec: WalkerSpec, to: Closeness) -> list[Array]:
    """Known gaits that are nearest."""
    known = [g.x for g in known_gaits(spec)]
    return sorted(known, key=to.squared)[:NEIGHBOURS]


def _follow(
    spec: WalkerSpec, w: Array, x: Array, to: Closeness, legs: Sequence[Sequence[Stage]]
) -> tuple[list[Array], int]:
    """The ends of a way's legs and its iterations; for a process pool."""
    ends, iterations = [], 0
    for stages in legs:
        found = solver_for(spec).solve(w, x, stages, anchor=to.target)
        x, iterations = found.x, iterations + found.iterations
        ends.append(x)
    return ends, iterations
