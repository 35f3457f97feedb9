"""Active contacts packed one after the other, and sums over those of a knot and foot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Flags, Indices


class Packed(NamedTuple):
    """Active contacts: their knot, foot and sphere.

    Those of a knot and foot form a group: ``groups`` are the ones that are not empty, ``starts``
    where they start, ``group`` and ``rank`` which one each contact belongs to, and as which.
    """

    knot: Indices
    foot: Indices
    sphere: Indices
    starts: Indices
    groups: Indices
    group: Indices
    rank: Indices
    shape: tuple[int, int]

    @classmethod
    def of(cls, active: Flags, foot: Indices, n_feet: int) -> Packed:
        """Pack what is active, shape (N, n)."""
        knot, sphere = np.nonzero(active)
        key = knot * n_feet + foot[sphere]  # ascending: spheres are sorted by foot
        is_first = np.diff(key, prepend=-1) > 0
        starts, group = np.flatnonzero(is_first), np.cumsum(is_first) - 1
        rank = np.arange(len(key)) - starts[group]
        shape = (len(active), n_feet)
        return cls(knot, foot[sphere], sphere, starts, key[starts], group, rank, shape)

    def sum(self, x: Array) -> Array:
        """Sums over the contacts of each knot and foot, shape (N, feet, ...)."""
        if not len(self.starts):
            return np.zeros((*self.shape, *x.shape[1:]))
        return self._spread(np.add.reduceat(x, self.starts, axis=0))

    def pad(self, x: Array) -> Array:
        """Matrices (n, r, m) below one another by group, zeros below the last; (groups, r', m)."""
        most = int(self.rank.max(initial=-1)) + 1
        out = np.zeros((len(self.groups), most, *x.shape[1:]))
        out[self.group, self.rank] = x
        return out.reshape(len(out), most * x.shape[1], x.shape[2])

    def products(self, left: Array, right: Array) -> Array:
        """Sums of left' right over the contacts of each knot and foot, of padded matrices."""
        return self._spread(left.mT @ right)

    def _spread(self, x: Array) -> Array:
        out = np.zeros((self.shape[0] * self.shape[1], *x.shape[1:]))
        out[self.groups] = x
        return out.reshape(*self.shape, *x.shape[1:])
