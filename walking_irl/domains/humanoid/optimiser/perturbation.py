"""Changes of a gait: starts for a search, and a way out of a contact jump."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker, other_side
from walking_irl.domains.humanoid.gait.gait import Gait, whole_cycle


def perturb(walker: Walker, x: Array, amplitude: float, rng: np.random.Generator) -> Array:
    """Smooth random change of the joint angles that keeps the mirror symmetry.

    Args:
        walker: Whose gait.
        x: Gait vector.
        amplitude: Standard deviation of the first harmonic [rad].
        rng: Source of randomness.
    """
    nv = len(walker.joints)
    q = x[:-2].reshape(-1, nv).copy()
    phase = np.arange(len(q)) / (2 * len(q))
    for j, name in enumerate(walker.joints):
        if j < walker.n_root or not name.endswith("_r"):
            continue
        c = rng.normal(size=(2, 3)) * amplitude / np.arange(1, 4)
        q[:, j] += _harmonics(c, phase)
        q[:, walker.joints.index(other_side(name))] += _harmonics(c, phase + 0.5)
    return np.concatenate([q.ravel(), x[-2:]])


def shifted(walker: Walker, x: Array, knots: float) -> Array:
    """The same walk with its knots later by a share of their distance, shape (N nv + 2,).

    Between the knots it is the trigonometric polynomial through those of the whole cycle.

    Args:
        walker: Who walks.
        x: Gait vector.
        knots: How much later.
    """
    gait = Gait.from_vector(x, len(walker.joints))
    n = gait.n_knots
    q = whole_cycle(gait, walker.mirror)
    drift = np.arange(2 * n) * gait.step_length / n
    q[:, 0] -= drift
    waves = np.fft.rfft(q, axis=0)
    turned = waves * np.exp(1j * np.pi * knots / n * np.arange(n + 1))[:, None]
    later = np.fft.irfft(turned, 2 * n, axis=0)[:n]
    later[:, 0] += drift[:n]  # the walk starts where it did
    return np.concatenate([later.ravel(), x[-2:]])


def _harmonics(c: Array, phase: Array) -> Array:
    angle = 2 * np.pi * np.outer(phase, np.arange(1, c.shape[1] + 1))
    return np.asarray(np.cos(angle) @ c[0] + np.sin(angle) @ c[1])
