r"""All costs of a walker as one matrix of residuals, with its first and second partials.

Column m of the matrix belongs to one term of one cost; a residual depends on the few channels that
its term reads, so derivatives are kept as elementwise blocks (N, M of the term), one for each read.
The fixed part :math:`C` (feet do not skid, legs do not pass through each other, joints stay in
range) has a known weight and is added to *every* objective,
:math:`G_j = F_j / \text{scale}_j + C`: since the weights sum to one, the walker minimises
:math:`w \cdot G` exactly and every cut of CPIRL stays homogeneous.

The same stack serves the optimiser, where the steps are those of a gait, and a simulation, where
they are those of a :class:`~walking_irl.types.Rollout`.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import (
    CHANNELS,
    Channels,
    Cost,
    SharedCost,
    Squares,
    Term,
)
from walking_irl.domains.humanoid.costs.checks import check_costs, check_term
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS, UNIT, Costs
from walking_irl.domains.humanoid.costs.partials import (
    POSITION_SIZE,
    SIZES,
    first_partials,
    second_partials,
)
from walking_irl.types import Objective, Rollout

REFERENCE_SHARE = 0.1
"""Of a cost that does not know its coefficient in the most human gait."""


class Place(NamedTuple):
    """Where a term lies in the matrix of residuals."""

    term: Term
    columns: slice
    reads: tuple[Any, ...]
    """Columns of each read's channel, as slices where they can be; None for ``h``."""
    is_unique: tuple[bool, ...]
    """Whether no column is read twice, for each read."""
    cost: Squares
    """Which it belongs to."""
    joints: Indices | None
    """Motor of each residual that reads nothing but one motor's joint; else None."""


class CostStack:
    """The costs of one walker.

    Args:
        walker: Whose.
        costs: Costs per metre, which are learnt, and shared costs; in any order.

    Attributes:
        per_metre: The costs per metre, in the order of the weights.
        shared: The shared costs.
        objectives: Of the costs per metre.
        places: Where each term lies; those of costs per metre come first.
        size: Number M of residuals of a step.
        n_per_metre: How many of them, the first ones, belong to costs per metre.
        sensors: Columns of the sensor readings that are read, and of their mirror images.

    Raises:
        InvalidInputError: If names repeat, a scale is not positive, no cost is per metre, or a
            residual is not an elementwise function that takes complex numbers.
    """

    def __init__(self, walker: Walker, costs: Costs = DEFAULT_COSTS) -> None:
        self.walker, self.costs = walker, tuple(costs)
        self.per_metre = tuple(c for c in costs if isinstance(c, Cost))
        self.shared = tuple(c for c in costs if isinstance(c, SharedCost))
        check_costs(self.costs, self.per_metre)
        self.objectives: tuple[Objective, ...] = tuple(c.objective for c in self.per_metre)
        self.places: list[Place] = []
        edge, self.n_per_metre = 0, 0
        self._starts: list[int] = []
        for k, cost in enumerate((*self.per_metre, *self.shared)):
            self._starts.append(edge)
            for term in cost.terms(walker):
                width = max([len(r.columns) for r in term.reads], default=1)
                reads = tuple(_index(r.columns) if r.channel != "h" else None for r in term.reads)
                joints = _motors(walker, term)
                unique = tuple(len(np.unique(r.columns)) == len(r.columns) for r in term.reads)
                columns = slice(edge, edge + width)
                self.places.append(Place(term, columns, reads, unique, cost, joints))
                check_term(cost, term, width)
                edge += width
            if k < len(self.per_metre):
                self.n_per_metre = edge
        self.size = edge
        self._starts.append(edge)
        read = [r.columns for p in self.places for r in p.term.reads if r.channel[0] == "s"]
        needed = np.unique(np.concatenate([np.zeros(0, dtype=int), *read]))
        is_mirrored = (walker.sensor_mirror[needed] != 0).any(0)
        self.sensors: Indices = np.union1d(needed, np.flatnonzero(is_mirrored))
        self._scales = np.array([c.scale for c in self.per_metre])
        self._coefficients = np.array([c.coefficient for c in self.shared]) / UNIT

    def __reduce__(self) -> tuple[Any, ...]:
        """Terms hold functions of this process; they are made again elsewhere."""
        return CostStack, (self.walker, self.costs)

    @cached_property
    def reference_weights(self) -> Array:
        """Weights of the most human gait known, as far as the costs know them; shape (K,)."""
        shares = {c.name: self._share(c) for c in self.per_metre}
        whole = sum(share for share in shares.values() if share is not None) or UNIT
        w = [REFERENCE_SHARE * whole if s is None else s for s in shares.values()]
        return np.asarray(w) / sum(w)

    def _share(self, cost: Cost) -> float | None:
        """Scaled coefficient of a cost in the most human gait of this walker; None: unknown."""
        is_planar = not self.walker.is_lateral and cost.planar_reference is not None
        known = cost.planar_reference if is_planar else cost.reference
        return None if known is None else known * cost.scale

    def residuals(self, c: Channels) -> Array:
        """Residuals of all terms, shape (N, M)."""
        out = np.empty((len(c.q), self.size))
        for place in self.places:
            out[:, place.columns] = place.term.residual(*_reads(place, c))
        return out

    def first(self, c: Channels) -> Partials:
        """First partial derivatives of all residuals."""
        blocks = []
        for place in self.places:
            shape = (len(c.q), place.columns.stop - place.columns.start)
            reads = _reads(place, c)
            if not reads:
                blocks.append(np.zeros((0, *shape)))
            elif place.term.first is not None:
                block = np.empty((len(reads), *shape))
                for p, value in enumerate(place.term.first(*reads)):
                    block[p] = value
                blocks.append(block)
            else:
                blocks.append(first_partials(place.term.residual, reads, shape))
        return Partials(self, tuple(blocks))

    def second(self, c: Channels) -> tuple[Array, ...]:
        """Second partial derivatives of all residuals by term, each of shape (P, P, N, M)."""
        blocks = []
        for place in self.places:
            shape = (len(c.q), place.columns.stop - place.columns.start)
            reads = _reads(place, c)
            if place.term.is_linear or not reads or place.term.second is not None:
                block = np.zeros((len(reads), len(reads), *shape))
                found = place.term.second(*reads) if place.term.second is not None else {}
                for (p, o), value in found.items():
                    block[p, o] = block[o, p] = value
                blocks.append(block)
                continue
            sizes = [self._size(*r) for r in place.term.reads]
            blocks.append(second_partials(place.term.residual, reads, sizes, shape))
        return tuple(blocks)

    def _size(self, channel: str, columns: Indices) -> Array:
        if channel == "h":
            return np.array([SIZES["h"]])
        size = np.full(len(columns), SIZES[channel])
        if channel[0] == "s":
            size[self.walker.reads_position[columns]] = POSITION_SIZE
        return size

    def squares(self, w: Array, pace: float) -> Array:
        """Coefficients of the mean squares of all residuals in w.G without the root, shape (M,).

        Args:
            w: Weights, shape (K,).
            pace: Of the steps (see :class:`~.costs.base.Channels`).
        """
        each = np.concatenate([w / self._scales * pace, self._coefficients])
        return np.repeat(each, np.diff(self._starts))

    def costs_of(self, r: Array, pace: float) -> tuple[Array, float]:
        """Scaled costs per metre F_j / scale_j, shape (K,), and the fixed part C."""
        by_column = np.concatenate([np.sum(r * r, axis=0) / len(r), [0.0]])
        raw = np.add.reduceat(by_column, self._starts[:-1])
        raw[np.diff(self._starts) == 0] = 0.0
        k = len(self.per_metre)
        return raw[:k] * pace / self._scales, float(self._coefficients @ raw[k:])

    def total_costs(self, c: Channels) -> Array:
        """Total costs G of steps whose root is unactuated, shape (K,); mu is -G."""
        per_metre, fixed = self.costs_of(self.residuals(c), c.pace)
        return per_metre + fixed

    def rollout_costs(self, rollout: Rollout, timestep: float) -> Array:
        """Total costs G of a rollout over whole gait cycles, shape (K,).

        Args:
            rollout: n + 1 samples that span whole cycles; the last one only closes the last step.
            timestep: Time between samples [s].
        """
        return self.total_costs(rollout_channels(rollout, timestep))


class Partials(NamedTuple):
    """First partial derivatives of a stack's residuals: a Jacobian of elementwise blocks.

    ``blocks`` holds one array (P, N, M of the term) for each of ``stack.places``.
    """

    stack: CostStack
    blocks: tuple[Array, ...]

    def times(self, d: Channels) -> Array:
        """Change of the residuals for a change of the channels, shape (N, M)."""
        out = np.zeros((len(d.q), self.stack.size))
        for place, block in zip(self.stack.places, self.blocks, strict=True):
            for slope, x in zip(block, _reads(place, d), strict=True):
                out[:, place.columns] += slope * x
        return out

    def transpose_times(self, y: Array) -> Channels:
        """Transposed product with ``y``, shape (N, M): a gradient for each channel."""
        walker, n = self.stack.walker, len(y)
        nv, nu, ns = len(walker.joints), walker.model.nu, walker.model.nsensordata
        widths = (nv, nv, nv, nv, nu, nu, ns, ns)
        out: dict[str, Any] = {c: np.zeros((n, k)) for c, k in zip(CHANNELS, widths, strict=False)}
        h = 0.0
        for place, block in zip(self.stack.places, self.blocks, strict=True):
            if not y[:, place.columns].any():
                continue
            for k, (read, index) in enumerate(zip(place.term.reads, place.reads, strict=True)):
                z = block[k] * y[:, place.columns]
                if index is None:
                    h += float(z.sum())
                elif place.is_unique[k]:
                    out[read.channel][:, index] += z
                else:
                    np.add.at(out[read.channel].T, index, z.T)
        return Channels(**out, h=h, distance=0.0)


@lru_cache(maxsize=32)
def cost_stack(walker: Walker, costs: Costs = DEFAULT_COSTS) -> CostStack:
    """The stack of a walker's costs; one per process."""
    return CostStack(walker, costs)


def rollout_channels(rollout: Rollout, timestep: float) -> Channels:
    """Steps of a rollout; its last sample only closes the last step."""
    return Channels(
        q=rollout.q[:-1],
        v=rollout.v[:-1],
        v_next=rollout.v[1:],
        a=rollout.a[:-1],
        tau=rollout.u[:-1],
        tau_next=rollout.u[1:],
        s=rollout.sensors[:-1],
        s_next=rollout.sensors[1:],
        h=timestep,
        distance=float(rollout.q[-1, 0] - rollout.q[0, 0]),
    )


def _reads(place: Place, c: Channels) -> list[Any]:
    values = []
    for read, index in zip(place.term.reads, place.reads, strict=True):
        x = getattr(c, read.channel)
        values.append(np.full((1, 1), x) if index is None else x[:, index])
    return values


def _index(columns: Indices) -> Any:
    first = int(columns[0])
    if np.array_equal(columns, np.arange(first, first + len(columns))):
        return slice(first, first + len(columns))
    return columns


def _motors(walker: Walker, term: Term) -> Indices | None:
    motors = []
    for read in term.reads:
        if read.channel[0] == "s":
            return None
        if read.channel != "h":
            motors.append(read.columns - (0 if read.channel[:3] == "tau" else walker.n_root))
    if not motors or any(m.min() < 0 or not np.array_equal(m, motors[0]) for m in motors):
        return None
    return motors[0]
