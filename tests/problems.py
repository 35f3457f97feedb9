"""Small problems with known answers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.lqr import LQR
from walking_irl.geometry.plane import plane_basis
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Expert, Response


@dataclass(frozen=True)
class Menu:
    """Finitely many policies with known features, shape (n, K): the best one by enumeration."""

    M: Array

    def forward(self, w: Array) -> Response:
        i = int(np.argmax(self.M @ w))
        return Response(i, self.M[i])

    def expert(self, w_E: Array) -> Expert:
        mu = self.forward(w_E).mu
        return Expert(mu, np.zeros(len(mu)))


def random_menu(rng: np.random.Generator, K: int, n: int = 200) -> Menu:
    """Policies on a smooth, concave front: points of a sphere's positive part."""
    M = np.abs(rng.standard_normal((n, K)))
    return Menu(M / np.linalg.norm(M, axis=1)[:, None] * 10.0)


TWO_POLICIES = Menu(np.eye(2))


def without_sensitivity(problem: LQR):
    return lambda w: replace(problem.forward(w), sensitivity=None)


def polyhedron_around(
    rng: np.random.Generator, K: int, n_cuts: int, width: float, stretch: float = 1.0
) -> tuple[WeightPolyhedron, Array]:
    """Polyhedron that holds a ball of radius 0.4 width around the weights returned."""
    w = 0.5 / K + 0.5 * rng.dirichlet(np.full(K, 5.0))
    normals = rng.standard_normal((n_cuts, K - 1))
    normals[:, 0] *= stretch
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    A = normals @ plane_basis(K).T
    offset = A @ w + width * rng.uniform(0.5, 1.0, n_cuts)
    return WeightPolyhedron.simplex(K).cut_all(A - offset[:, None]), w
