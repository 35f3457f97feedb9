r"""Algebra of spatial vectors, vectorised over all leading axes.

Motions are (rotation; translation) and forces (moment; force), as MuJoCo's ``cdof`` and ``cinert``
have them: world axes, origin at the centre of mass of the whole body. R. Featherstone (2008),
Rigid Body Dynamics Algorithms, chapter 2.
"""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array


def _skew_map() -> Array:
    t = np.zeros((3, 3, 3))  # a x = sum_k a_k t[k]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        t[k, i, j], t[k, j, i] = -1, 1
    return t


def _six_maps() -> tuple[Array, Array, Array]:
    skew = _skew_map()
    motion, force, inertia = np.zeros((6, 6, 6)), np.zeros((6, 6, 6)), np.zeros((10, 6, 6))
    for k in range(3):
        motion[k, :3, :3] = motion[k, 3:, 3:] = motion[3 + k, 3:, :3] = skew[k]
        force[k, :3, :3] = force[3 + k, :3, 3:] = force[3 + k, 3:, :3] = -skew[k]
        inertia[6 + k, :3, 3:], inertia[6 + k, 3:, :3] = skew[k], -skew[k]
    for k, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]):
        inertia[k, i, j] = inertia[k, j, i] = 1
    inertia[9, 3:, 3:] = np.eye(3)
    return motion.reshape(6, 36), force.reshape(6, 36), inertia.reshape(10, 36)


def _product_terms(parts: list[tuple[int, int, int]]) -> tuple[Array, Array, Array]:
    """What picks the factors of 3-vector products (out, a, b offsets) and sums them with signs."""
    of_a, of_b, rows = [], [], []
    eye = np.eye(6)
    for out, a, b in parts:
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            of_a += [eye[a + i], eye[a + j]]
            of_b += [eye[b + j], eye[b + i]]
            rows += [eye[out + k], -eye[out + k]]
    return np.array(of_a).T, np.array(of_b).T, np.array(rows)


_SKEW = _skew_map().reshape(3, 9)
_MOTION, _FORCE, _INERTIA = _six_maps()
_BY_MOTION = _product_terms([(0, 0, 0), (3, 0, 3), (3, 3, 0)])
_BY_FORCE = _product_terms([(0, 0, 0), (0, 3, 3), (3, 0, 3)])


def cross(a: Array, b: Array) -> Array:
    """Cross product of 3-vectors along the last axis; faster than ``np.cross``."""
    return times(skew(a), b)


def skew(a: Array) -> Array:
    """Matrices a x, shape (..., 3, 3)."""
    return np.asarray((a @ _SKEW).reshape(*a.shape[:-1], 3, 3))


def motion_cross(a: Array, b: Array) -> Array:
    """Motion times motion, a x b."""
    return _products(_BY_MOTION, a, b)


def force_cross(a: Array, f: Array) -> Array:
    """Motion times force, a x* f."""
    return _products(_BY_FORCE, a, f)


def _products(terms: tuple[Array, Array, Array], a: Array, b: Array) -> Array:
    """Sums of products of components; two-dimensional matrix products are fastest."""
    of_a, of_b, signs = terms
    left, right = a.reshape(-1, 6) @ of_a, b.reshape(-1, 6) @ of_b
    if a.shape == b.shape:
        left *= right
        return np.asarray(left @ signs).reshape(b.shape)
    both = left.reshape(*a.shape[:-1], -1) * right.reshape(*b.shape[:-1], -1)
    return np.asarray(both @ signs)


def motion_matrix(a: Array) -> Array:
    """Matrices a x of motions, shape (..., 6, 6)."""
    return np.asarray((a @ _MOTION).reshape(*a.shape[:-1], 6, 6))


def force_matrix(f: Array) -> Array:
    """Matrices M(f) with a x* f = M(f) a, shape (..., 6, 6)."""
    return np.asarray((f @ _FORCE).reshape(*f.shape[:-1], 6, 6))


def inertia_matrix(numbers: Array) -> Array:
    """Spatial inertias of MuJoCo's ten numbers (``cinert``), shape (..., 6, 6)."""
    return np.asarray((numbers @ _INERTIA).reshape(*numbers.shape[:-1], 6, 6))


def point_rows(r: Array) -> Array:
    """Rows that read the velocity at a point r off a motion, shape (..., 3, 6).

    Transposed they give the wrench, at the origin, of a force at r.
    """
    eye = np.broadcast_to(np.eye(3), (*r.shape[:-1], 3, 3))
    return np.concatenate([-skew(r), eye], axis=-1)


def times(m: Array, v: Array) -> Array:
    """Matrices times vectors."""
    return np.asarray((m @ v[..., None])[..., 0])


def outer(a: Array, b: Array) -> Array:
    """Outer products of vectors."""
    return np.asarray(a[..., :, None] * b[..., None, :])
