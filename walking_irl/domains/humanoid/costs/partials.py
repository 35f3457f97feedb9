r"""First and second partial derivatives of elementwise residuals, by complex steps.

For an analytic :math:`\rho` that is real on real numbers,

.. math:: \rho'(x) = \operatorname{Im} \rho(x + i\epsilon) / \epsilon + O(\epsilon^2)

has no cancellation, so that :math:`\epsilon = 10^{-30}` gives all digits (W. Squire, G. Trapp 1998,
Using complex variables to estimate derivatives of real functions, SIAM Review 40). Second partials
are central differences of these, of fourth order; with exact first derivatives the steps' size
hardly matters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from walking_irl.arrays import Array

EPSILON = 1e-30
STEP = 1e-3
"""Steps of the differences, relative to the size at which a read changes its residual."""
STENCIL = ((1.0, 8 / 12), (-1.0, -8 / 12), (2.0, -1 / 12), (-2.0, 1 / 12))
"""Central difference of fourth order: steps and coefficients."""


SIZES = {
    "q": 0.02,
    "v": 0.1,
    "v_next": 0.1,
    "a": 5.0,
    "tau": 1.0,
    "tau_next": 1.0,
    "s": 1.0,
    "s_next": 1.0,
    "h": 5e-3,
}
"""How far a number must move to change a residual a lot, within three decades [SI units]."""
POSITION_SIZE = 2e-3  # the same of a sensor that reads a point of the body [m]


def first_partials(
    residual: Callable[..., Any], reads: Sequence[Array], shape: tuple[int, int]
) -> Array:
    """Partial derivatives with respect to each read, shape (P, N, M).

    Args:
        residual: Elementwise function of P arrays.
        reads: Its arguments, each of shape (N, M), or (1, 1) for a number that all share.
        shape: (N, M).
    """
    count = len(reads)
    moved = [np.repeat(x[None].astype(complex), count, axis=0) for x in reads]
    for p, x in enumerate(moved):
        x[p] += 1j * EPSILON
    return _imaginary(residual(*moved), (count, *shape))


def second_partials(
    residual: Callable[..., Any],
    reads: Sequence[Array],
    sizes: Sequence[Array],
    shape: tuple[int, int],
) -> Array:
    """Second partial derivatives with respect to each pair of reads, shape (P, P, N, M).

    Args:
        residual: Elementwise function of P arrays.
        reads: Its arguments.
        sizes: How far each argument must move to change the residual a lot; shapes (M,) or (1,).
        shape: (N, M).
    """
    count = len(reads)
    pairs = [(p, o) for p in range(count) for o in range(p, count)]
    batch = len(pairs) * len(STENCIL)
    moved = [np.repeat(x[None].astype(complex), batch, axis=0) for x in reads]
    for k, (p, o) in enumerate(pairs):
        for m, (step, _) in enumerate(STENCIL):
            moved[p][k * len(STENCIL) + m] += step * STEP * sizes[p]
            moved[o][k * len(STENCIL) + m] += 1j * EPSILON
    slopes = _imaginary(residual(*moved), (batch, *shape)).reshape(len(pairs), -1, *shape)
    out = np.empty((count, count, *shape))
    for (p, o), slope in zip(pairs, slopes, strict=True):
        difference = sum(c * s for (_, c), s in zip(STENCIL, slope, strict=True))
        out[p, o] = out[o, p] = difference / (STEP * sizes[p])
    return out


def _imaginary(value: Any, shape: tuple[int, ...]) -> Array:
    return np.broadcast_to(np.imag(value) / EPSILON, shape)
