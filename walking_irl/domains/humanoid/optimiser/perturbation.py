"""Random changes of a gait: starts for a search, and a way out of a contact jump."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker, other_side


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


def _harmonics(c: Array, phase: Array) -> Array:
    angle = 2 * np.pi * np.outer(phase, np.arange(1, c.shape[1] + 1))
    return np.asarray(np.cos(angle) @ c[0] + np.sin(angle) @ c[1])
