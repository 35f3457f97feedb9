r"""What a cost is: a sum of squared residuals, stated elementwise on what a step offers.

A residual is a function of a few numbers of its step (its *reads*), the same function in every
step: :math:`r_{im} = \rho(c^1_{i m}, c^2_{i m}, \dots)`. It must be analytic in them wherever the
optimiser may come, for its partial derivatives are taken by complex steps
(:mod:`~.costs.partials`): no ``abs``, no branch on a value; ``np.minimum(0, x)`` is a hinge.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.errors import InvalidInputError
from walking_irl.types import Objective

REFERENCE_SPEED = 1.25
"""v0 [m/s]: costs are per metre, in units of the time that a metre takes at this speed."""


class Channels(NamedTuple):
    """What the steps of a walk offer to costs; row i is the step from sample i to i + 1.

    Also a change of these numbers, and what a gradient says of each of them.

    Attributes:
        q: Joint positions [m, rad], shape (N, nv).
        v: Joint velocities at the start of the step [m/s, rad/s], shape (N, nv).
        v_next: The same at its end.
        a: Joint accelerations during the step, shape (N, nv).
        tau: Joint torques during the step [Nm], shape (N, nu).
        tau_next: Those of the step after it.
        s: Sensor readings at the start of the step, shape (N, ns).
        s_next: Those at the start of the step after it.
        h: Duration of a step [s].
        distance: Way walked in all N steps [m]; enters costs by ``pace`` only.
    """

    q: Array
    v: Array
    v_next: Array
    a: Array
    tau: Array
    tau_next: Array
    s: Array
    s_next: Array
    h: float
    distance: float

    @property
    def pace(self) -> float:
        """Time per distance relative to the reference speed, v0 T / L [1]."""
        return REFERENCE_SPEED * self.h * len(self.q) / self.distance


CHANNELS = Channels._fields[:-1]
"""What a cost may read."""


class Read(NamedTuple):
    """Columns of a channel that a residual is a function of, one for each of its M components."""

    channel: str
    columns: Indices
    """Shape (M,); of ``h``, which is one number, (0,)."""


class Term(NamedTuple):
    """Residuals of one kind.

    ``residual`` takes the reads as arrays (..., N, M), complex ones too, and returns (..., N, M).
    """

    reads: tuple[Read, ...]
    residual: Callable[..., Any]
    is_linear: bool = False
    """Linear, or a hinge of something linear: second partials are zero, also across the kink."""
    first: Callable[..., tuple[Any, ...]] | None = None
    """First partials by each read in closed form, which is faster; None: by complex steps."""
    second: Callable[..., dict[tuple[int, int], Any]] | None = None
    """Second partials in closed form, which is faster: of the reads, those that are not zero by
    pairs (p, o), p <= o, of positions among the reads; None: by differences."""


@dataclass(frozen=True)
class Squares(ABC):
    """A sum of squared residuals; see :class:`Cost` and :class:`SharedCost`."""

    name: str
    unit: str

    @abstractmethod
    def terms(self, walker: Walker) -> Sequence[Term]:
        """The residuals whose mean square over the steps is the cost.

        Args:
            walker: Whose; names of its joints and sensors say which columns are read.
        """


@dataclass(frozen=True)
class Cost(Squares):
    r"""A cost per metre, whose weight is learnt: :math:`F = (v_0 T / L) \langle |r|^2 \rangle`.

    Attributes:
        name: One word.
        unit: Of the raw cost.
        scale: Raw value that counts as one.
        meaning: One sentence for a person.
        formula: The cost as text.
        reference: Coefficient of the raw cost in the most human gait known; None: a tenth of the
            whole.
        planar_reference: The same of a walker in the sagittal plane; None: as of any other.
    """

    scale: float
    meaning: str
    formula: str = ""
    reference: float | None = None
    planar_reference: float | None = None

    @property
    def objective(self) -> Objective:
        """The cost as the contract knows it."""
        return Objective(self.name, self.unit, self.scale, self.meaning, self.formula)


@dataclass(frozen=True)
class SharedCost(Squares):
    r"""A part of the cost that every walker shares, with a known weight; not per metre.

    Attributes:
        name: One word.
        unit: Of the raw cost.
        coefficient: Of the raw cost, as ``Cost.reference`` states it.
        meaning: One sentence for a person.
        formula: The cost as text.
    """

    coefficient: float
    meaning: str
    formula: str = ""


H = Read("h", np.zeros(0, dtype=int))
"""The duration of a step."""


def read_joints(walker: Walker, channel: str, names: Iterable[str] | None = None) -> Read:
    """Reads a channel of q, v, a or tau at all actuated joints, or at some by name.

    Raises:
        InvalidInputError: If the walker has no such joint, or it has no motor and tau is read.
    """
    first = walker.n_root if channel.startswith("tau") else 0
    known = walker.joints[first:]
    chosen = walker.joints[walker.n_root :] if names is None else tuple(names)
    missing = [n for n in chosen if n not in known]
    if missing:
        exist = ", ".join(known)
        raise InvalidInputError(
            f"{walker.name} has no joint {missing[0]!r} with {channel}; there are {exist}"
        )
    return Read(channel, np.array([known.index(n) for n in chosen], dtype=int))


def read_sensors(walker: Walker, channel: str, places: Iterable[tuple[str, int]]) -> Read:
    """Reads ``s`` or ``s_next`` at components (sensor, axis), the axis counted from 0.

    Raises:
        InvalidInputError: If the walker has no such sensor.
    """
    columns = []
    for name, axis in places:
        if name not in walker.sensor:
            known = ", ".join(walker.sensor)
            raise InvalidInputError(f"{walker.name} has no sensor {name!r}; there are {known}")
        columns.append(walker.sensor[name].start + axis)
    return Read(channel, np.array(columns, dtype=int))
