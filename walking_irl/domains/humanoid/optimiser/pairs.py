"""Where second derivatives of residuals by what they read go, among the outputs of every knot.

A residual of step i reads numbers of knot i, of the step after it (knot i + 1, or mirrored knot 0),
or the duration of a step. Its second derivatives by two reads couple two *slots*: an output of a
knot (a root force, torque or sensor), one of its coordinates q, v, a, or one of the globals h and
L. All of that is known beforehand; :class:`Pairs` sums a list of numbers into few dense arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Flags, Indices
from walking_irl.domains.humanoid.costs.base import Read
from walking_irl.domains.humanoid.costs.stack import CostStack

GLOBALS = ("h", "L")
_MOVING, _STILL, _OWN, _GLOBAL = range(4)


class Knots(NamedTuple):
    """The slots of every knot: R outputs, then 3 nv coordinates q, v, a; then the globals.

    ``sensors``: the sensors among the outputs; ``is_static``, shape (R,): whether an output depends
    on q alone.
    """

    n: int
    nv: int
    n_root: int
    sensors: Indices
    is_static: Flags

    @property
    def outputs(self) -> int:
        """R."""
        return self.nv + len(self.sensors)

    @property
    def size(self) -> int:
        """Slots of one knot."""
        return self.outputs + 3 * self.nv


class _Atom(NamedTuple):
    """A slot that a read depends on, for all residuals of a term, shape (N, M); see Pairs."""

    knot: Indices
    slot: Indices
    factor: Indices
    sign: Array


class Scatter(NamedTuple):
    """Sums a slice of numbers into an array of some shape; most of its entries stay untouched."""

    numbers: slice
    inverse: Indices
    target: Indices
    shape: tuple[int, ...]

    def add(self, numbers: Array, out: Array) -> None:
        """Add to a contiguous array of ``shape``."""
        if len(self.target):
            sums = np.bincount(self.inverse, numbers[self.numbers], len(self.target))
            out.reshape(-1)[self.target] += sums

    def dense(self, numbers: Array) -> Array:
        """The array."""
        out = np.zeros(self.shape)
        self.add(numbers, out)
        return out


class Pairs:
    """Second derivatives of the residuals' half squares by pairs of slots.

    Outputs are sorted into still ones (s), which depend on q alone and go together with such
    outputs only, and moving ones (m); u are the coordinates of the knot.

    Attributes:
        moving: Slots of the moving outputs, then of coordinates that go with a knot ahead.
        still: Slots of the still outputs.
        mm, ss: Same knot, shapes (N, n, n).
        is_diagonal: Whether no moving output goes with another one at the same knot.
        mu: Moving outputs with coordinates, shape (3, N, n, nv).
        uu: Coordinates of the pairs ``joints`` of joints, shape (N, n, 3, 3).
        global_local: Shape (2, N, size), globals in the order of GLOBALS.
        global_global: Shape (2, 2).
        m_ahead: Of knot i with knot i + 1, both among ``moving``, shape (N, n, n).
        s_ahead: The same among ``still``.
    """

    def __init__(self, stack: CostStack, knots: Knots) -> None:
        self.stack, self.knots = stack, knots
        found = [self._of_place(*t) for t in self._terms()]
        none = [np.zeros(0, int)] * 7 + [np.zeros(0)]
        self._layout(*(np.concatenate(x) for x in zip(none, *found, strict=True)))

    def _terms(self) -> list[tuple[int, tuple[Read, ...], int]]:
        """Of each term with reads: the offset of its numbers, its reads, its number of residuals.

        The numbers of a term are a flattened array (P, P, N, M).
        """
        out, offset = [], 0
        for place in self.stack.places:
            reads, width = place.term.reads, place.columns.stop - place.columns.start
            if reads:
                out.append((offset, reads, width))
            offset += len(reads) ** 2 * self.knots.n * width
        self.count = offset
        return out

    def _of_place(self, offset: int, reads: tuple[Read, ...], width: int) -> list[Array]:
        n = self.knots.n
        each = np.arange(n * width).reshape(n, width)
        atoms = [self._atoms(r, width) for r in reads]
        columns: list[list[Array]] = [[] for _ in range(8)]
        for p, left in enumerate(atoms):
            for o, right in enumerate(atoms):
                source = offset + (p * len(reads) + o) * n * width + each
                for a in left:
                    for b in right:
                        row = (source, a.knot, a.slot, b.knot, b.slot, a.factor, b.factor)
                        for to, x in zip(columns, (*row, a.sign * b.sign), strict=True):
                            to.append(np.broadcast_to(x, (n, width)).ravel())
        return [np.concatenate(c) for c in columns]

    def _atoms(self, read: Read, width: int) -> list[_Atom]:
        k, walker = self.knots, self.stack.walker
        n, nv = k.n, k.nv
        knot = np.broadcast_to(np.arange(n)[:, None], (n, width))
        one, zero = np.ones((n, width)), np.zeros((n, width), int)
        if read.channel == "h":
            return [_Atom(knot, zero + k.size, zero, one)]
        columns = np.broadcast_to(read.columns, (n, width))
        if read.channel in ("q", "v", "a"):
            slot = k.outputs + "qva".index(read.channel) * nv + columns
            return [_Atom(knot, slot, zero, one)]
        if read.channel == "v_next":  # v + h a, with factors h of a, and a of h
            slot = k.outputs + nv + columns
            by_h = 2 + knot * nv + columns
            return [
                _Atom(knot, slot, zero, one),
                _Atom(knot, slot + nv, zero + 1, one),
                _Atom(knot, zero + k.size, by_h, one),
            ]
        is_torque = read.channel.startswith("tau")
        columns, sign, more = columns.copy(), one.copy(), []
        if read.channel.endswith("_next"):
            knot = (knot + 1) % n
            mirror = walker.torque_mirror if is_torque else walker.sensor_mirror
            rows = mirror[read.columns]  # signed permutations
            columns[-1], sign[-1] = np.abs(rows).argmax(1), rows.sum(1)
            advance = 0.0 if is_torque else walker.sensor_advance[read.columns]
            last = np.zeros((n, width))
            last[-1] = advance
            if last.any():
                more = [_Atom(knot, zero + k.size + 1, zero, last)]
        slot = k.n_root + columns if is_torque else nv + np.searchsorted(k.sensors, columns)
        return [_Atom(knot, slot, zero, sign), *more]

    def _layout(
        self,
        source: Indices,
        knot: Indices,
        slot: Indices,
        knot2: Indices,
        slot2: Indices,
        factor: Indices,
        factor2: Indices,
        sign: Array,
    ) -> None:
        """Sort the pairs into scatters; a pair of two kinds is kept in one order only."""
        k = self.knots
        is_still = self._still(slot[sign != 0], slot2[sign != 0])
        kind, place = _kinds(is_still, 3 * k.nv)
        left, right = kind[slot], kind[slot2]
        chosen, edge = [], 0

        def sort(mask: Flags, flat: Indices, shape: tuple[int, ...]) -> Scatter:
            nonlocal edge
            index = np.flatnonzero(mask & (sign != 0))
            target, inverse = np.unique(flat[index], return_inverse=True)
            chosen.append(index)
            start, edge = edge, edge + len(index)
            return Scatter(slice(start, edge), inverse, target, shape)

        is_global, is_global2 = left == _GLOBAL, right == _GLOBAL
        flat = (place[slot] * k.n + knot2) * k.size + slot2
        self.global_local = sort(is_global & ~is_global2, flat, (2, k.n, k.size))
        flat = place[slot] * 2 + place[slot2]
        self.global_global = sort(is_global & is_global2, flat, (2, 2))
        same, is_local = knot == knot2, ~is_global & ~is_global2
        is_ahead = is_local & (knot2 == (knot + 1) % k.n) & ~same
        is_moving = is_ahead & ~((left == _STILL) & (right == _STILL))
        moving = np.flatnonzero(~is_still)
        extra = np.concatenate([slot[is_moving], slot2[is_moving]])
        self.moving, self.still = np.union1d(moving, extra), np.flatnonzero(is_still)
        m, s, nv = len(self.moving), len(self.still), k.nv
        at, at2 = place[slot], place[slot2]
        both = (same, left, right)
        self.mm = sort(_are(both, _MOVING, _MOVING), (knot * m + at) * m + at2, (k.n, m, m))
        self.ss = sort(_are(both, _STILL, _STILL), (knot * s + at) * s + at2, (k.n, s, s))
        self.is_diagonal = bool((self.mm.target % (m * m) % (m + 1) == 0).all())
        (kind2, joint2), (kind1, joint1) = np.divmod(at2, nv), np.divmod(at, nv)
        flat = ((kind2 * k.n + knot) * m + at) * nv + joint2
        self.mu = sort(_are(both, _MOVING, _OWN), flat, (3, k.n, m, nv))
        is_own = _are(both, _OWN, _OWN)
        pairs, pair = np.unique((joint1 * nv + joint2)[is_own], return_inverse=True)
        self.joints = np.divmod(pairs, nv)
        flat = np.zeros(len(slot), int)
        flat[is_own] = ((knot * len(pairs))[is_own] + pair) * 9 + (3 * kind1 + kind2)[is_own]
        self.uu = sort(is_own, flat, (k.n, len(pairs), 3, 3))
        row, row2 = (np.searchsorted(self.moving, x) for x in (slot, slot2))
        self.m_ahead = sort(is_moving, (knot * m + row) * m + row2, (k.n, m, m))
        self.s_ahead = sort(is_ahead & ~is_moving, (knot * s + at) * s + at2, (k.n, s, s))
        order = np.concatenate(chosen)
        self._source, self._sign = source[order], sign[order]
        self._factors = factor[order], factor2[order]

    def _still(self, slot: Indices, slot2: Indices) -> Flags:
        """Which outputs depend on q alone and go together with no other outputs, shape (R,)."""
        k = self.knots
        is_still = np.concatenate([k.is_static, np.zeros(3 * k.nv + len(GLOBALS), bool)])
        is_free = np.arange(len(is_still)) >= k.size  # globals go with everything
        while True:
            mixed = is_still[slot] & ~is_still[slot2] & ~is_free[slot2]
            if not mixed.any():
                return is_still[: k.outputs]
            is_still[slot[mixed]] = False

    def numbers(self, values: Array, h: float, a: Array) -> Array:
        """What the scatters sum.

        Args:
            values: Second derivatives by reads, all terms' (P, P, N, M) in a row.
            h: Duration of a step [s].
            a: Accelerations, shape (N, nv).
        """
        factors = np.concatenate([[1.0, h], a.ravel()])
        left, right = self._factors
        return np.asarray(values[self._source] * self._sign * factors[left] * factors[right])


def _are(both: tuple[Flags, Indices, Indices], kind: int, kind2: int) -> Flags:
    """Which pairs of slots of the same knot are of two kinds."""
    same, left, right = both
    return np.asarray(same & (left == kind) & (right == kind2))


def _kinds(is_still: Flags, coordinates: int) -> tuple[Indices, Indices]:
    """Kind of every slot, and its place among them; ``is_still`` of the outputs."""
    outputs = np.where(is_still, _STILL, _MOVING)
    kind = np.concatenate([outputs, np.full(coordinates, _OWN), np.full(len(GLOBALS), _GLOBAL)])
    place = np.empty(len(kind), int)
    for value in (_MOVING, _STILL, _OWN, _GLOBAL):
        mine = kind == value
        place[mine] = np.arange(mine.sum())
    return kind, place
