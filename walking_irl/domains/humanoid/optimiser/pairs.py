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
_LOCAL, _AHEAD = 0, 1


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

    Outputs are sorted into dynamic (d) and static ones (s); u are the coordinates of the knot.

    Attributes:
        dynamic, static: Outputs of each kind.
        dd, ds, ss, du, su, uu: Same knot, shapes (N, n, n'): both orders where the kinds agree.
        global_local: Shape (2, N, size), globals in the order of GLOBALS.
        global_global: Shape (2, 2).
        ahead: Slots ``ahead_rows`` of knot i with ``ahead_columns`` of knot i + 1, (N, n, n').
    """

    def __init__(self, stack: CostStack, knots: Knots) -> None:
        self.stack, self.knots = stack, knots
        self.dynamic = np.flatnonzero(~knots.is_static)
        self.static = np.flatnonzero(knots.is_static)
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
        kind, place = self._kinds()
        left, right = kind[slot], kind[slot2]
        same = knot == knot2
        chosen, scatters = [], {}
        count = [len(self.dynamic), len(self.static), 3 * k.nv]
        edge = 0

        def sort(name: str, mask: Flags, flat: Indices, shape: tuple[int, ...]) -> None:
            nonlocal edge
            mask = mask & (sign != 0)
            index = np.flatnonzero(mask)
            target, inverse = np.unique(flat[index], return_inverse=True)
            scatters[name] = Scatter(slice(edge, edge + len(index)), inverse, target, shape)
            chosen.append(index)
            edge += len(index)

        for name, (a, b) in zip(
            ("dd", "ds", "ss", "du", "su", "uu"),
            ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)),
            strict=True,
        ):
            flat = (knot * count[a] + place[slot]) * count[b] + place[slot2]
            shape = (k.n, count[a], count[b])
            sort(name, same & (left == a) & (right == b), flat, shape)
        is_global, is_global2 = left == 3, right == 3
        flat = (place[slot] * k.n + knot2) * k.size + slot2
        sort("global_local", is_global & ~is_global2, flat, (2, k.n, k.size))
        sort("global_global", is_global & is_global2, place[slot] * 2 + place[slot2], (2, 2))
        is_ahead = ~is_global & ~is_global2 & (knot2 == (knot + 1) % k.n) & ~same
        self.ahead_rows, rows = np.unique(slot[is_ahead], return_inverse=True)
        self.ahead_columns, columns = np.unique(slot2[is_ahead], return_inverse=True)
        shape = (k.n, len(self.ahead_rows), len(self.ahead_columns))
        flat = np.zeros(len(slot), int)
        flat[is_ahead] = (knot[is_ahead] * shape[1] + rows) * shape[2] + columns
        sort("ahead", is_ahead, flat, shape)
        self.dd, self.ds, self.ss = (scatters[name] for name in ("dd", "ds", "ss"))
        self.du, self.su, self.uu = (scatters[name] for name in ("du", "su", "uu"))
        self.global_local, self.global_global = scatters["global_local"], scatters["global_global"]
        self.ahead = scatters["ahead"]
        order = np.concatenate(chosen)
        self._source, self._sign = source[order], sign[order]
        self._factors = factor[order], factor2[order]

    def _kinds(self) -> tuple[Indices, Indices]:
        """Kind of every slot (dynamic, static, coordinate, global), and its place among them."""
        k = self.knots
        kind = np.concatenate([k.is_static.astype(int), np.full(3 * k.nv, 2), [3, 3]])
        place = np.empty(len(kind), int)
        for value in range(4):
            mine = kind == value
            place[mine] = np.arange(mine.sum())
        return kind, place

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
