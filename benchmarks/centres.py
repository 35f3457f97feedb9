"""The four centres against cvxpy's formulation of the same problem, and how far they are apart.

Random polyhedra: a simplex of weights in dimension n = K - 1, cut by m half-spaces through points
near one interior weight vector. The analytic, Chebyshev and inscribed-ellipsoid centres are conic
programs, solved by cvxpy with Clarabel; the centre of gravity is none, so its accuracy is measured
against a long walk instead. The box is that of every weight's least and largest value, 2 K linear
programs, against SciPy's HiGHS.

Accuracy, relative to the reference: analytic, largest difference of the centres in units of the
Dikin ellipsoid; Chebyshev, of the radii; ellipsoid, of the volumes per dimension; gravity, of the
centres in covariance lengths; box, largest difference of a bound. Everything begins with the proof
that the set has an interior.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable
from typing import Any

import cvxpy as cp
import numpy as np
from bench import medians, seconds, table, verdict
from scipy.optimize import linprog

from walking_irl.arrays import Array
from walking_irl.geometry.centres import CENTRES, Centre
from walking_irl.geometry.centres.ellipsoid import cvxpy_ellipsoid
from walking_irl.geometry.centres.gravity import gravity
from walking_irl.geometry.plane import plane_basis
from walking_irl.geometry.polyhedron import WeightPolyhedron

DIMENSIONS, FACETS = (3, 5, 10, 20), (50, 200)
TARGET = 5.0
TARGET_DIMENSIONS = (5, 10)
LONG_WALK = 10  # times the samples of the sampled centre


def polyhedron(n: int, m: int, rng: np.random.Generator) -> WeightPolyhedron:
    """A simplex of dimension ``n`` with ``m`` cuts in random directions around a weight vector."""
    K = n + 1
    inside = 0.5 / K + 0.5 * rng.dirichlet(np.ones(K))
    normals = rng.normal(size=(m, K))
    normals -= normals.mean(axis=1, keepdims=True)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    away = rng.uniform(0.05, 0.5, size=m) / K
    return WeightPolyhedron.simplex(K).cut_all(normals - (normals @ inside + away)[:, None])


def solved(objective: Any, constraints: list[Any]) -> Any:
    """Value of a convex program."""
    problem = cp.Problem(objective, constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem.solve(solver=cp.CLARABEL)
    return problem.value


def cvxpy_analytic(P: WeightPolyhedron) -> Array:
    z = cp.Variable(P.A.shape[1])
    solved(cp.Maximize(cp.sum(cp.log(P.b - P.A @ z))), [])
    return np.asarray(z.value)


def cvxpy_chebyshev(P: WeightPolyhedron) -> float:
    z, radius = cp.Variable(P.A.shape[1]), cp.Variable()
    return float(solved(cp.Maximize(radius), [P.A @ z + radius <= P.b]))


def cvxpy_volume(P: WeightPolyhedron) -> float:
    """Logarithm of det B of the largest ellipsoid, in the coordinates our own method solves in."""
    found = cvxpy_ellipsoid(P.whitened.rows)
    scale = np.log(np.abs(np.diagonal(P.barrier.R))).sum()
    return float(0.5 * np.linalg.slogdet(found.square)[1] - scale)


def highs_box(P: WeightPolyhedron) -> Array:
    """Least and largest value of each weight, shape (K, 2)."""
    U = plane_basis(P.n_objectives)
    ends = [[s * linprog(s * u, P.A, P.b, bounds=(None, None)).fun for s in (1, -1)] for u in U]
    return 1.0 / P.n_objectives + np.array(ends)


def fresh(P: WeightPolyhedron) -> WeightPolyhedron:
    """The same set without anything computed before."""
    return WeightPolyhedron(P.n_objectives, P.min_weight, P.cuts, P.is_lazy)


def centre(key: str, P: WeightPolyhedron) -> Centre:
    return CENTRES[key](fresh(P), rng=np.random.default_rng(0))


def ours(key: str, P: WeightPolyhedron) -> Any:
    return fresh(P).intervals() if key == "box" else centre(key, P)


def difference(key: str, P: WeightPolyhedron) -> float:
    """Difference between our answer and the reference, as the module says."""
    if key == "box":
        return float(np.abs(P.intervals() - highs_box(P)).max())
    found = centre(key, P)
    if key == "ac":
        return float(np.linalg.norm(P.barrier.R @ (found.z - cvxpy_analytic(P))))
    if key == "cc":
        radius = float(np.sqrt(found.shape[0, 0]))
        return abs(radius / cvxpy_chebyshev(P) - 1)
    n = len(found.z)
    if key == "mvie":
        ours = 0.5 * np.linalg.slogdet(found.shape)[1]
        return float(abs(np.expm1((ours - cvxpy_volume(P)) / n)))
    long = gravity(fresh(P), rng=np.random.default_rng(1), n_samples=LONG_WALK * 4000)
    off = found.z - long.z
    return float(np.sqrt(off @ np.linalg.solve(found.shape, off)))


def row(key: str, P: WeightPolyhedron, repeats: int) -> tuple[list[str], float]:
    """Cells of one centre and polyhedron, and how much faster it is (nan: no oracle)."""
    oracles: dict[str, Callable[[WeightPolyhedron], Any]] = {
        "ac": cvxpy_analytic,
        "cc": cvxpy_chebyshev,
        "mvie": cvxpy_volume,
        "box": highs_box,
    }
    calls: list[Callable[[], Any]] = [lambda: ours(key, P)]
    if key in oracles:
        calls.append(lambda: oracles[key](fresh(P)))
    seconds(calls[0])  # first calls import and cache
    times = medians(calls, repeats)
    gain = times[1] / times[0] if len(times) > 1 else float("nan")
    size = f"{P.n_objectives - 1} / {len(P.cuts)}"
    other = [f"{1e3 * times[1]:.1f}", f"{gain:.1f} x"] if len(times) > 1 else ["-", "-"]
    return [f"{key:5} {size}", f"{1e3 * times[0]:.2f}", *other, f"{difference(key, P):.0e}"], gain


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="dimension 3 only, once")
    args = parser.parse_args()
    dimensions, facets = ((3,), (20,)) if args.quick else (DIMENSIONS, FACETS)
    rng = np.random.default_rng(args.seed)
    sets = [polyhedron(n, m, rng) for n in dimensions for m in facets]
    rows: list[list[str]] = []
    gains: dict[str, list[float]] = {"ac": [], "cc": [], "mvie": [], "box": []}
    for key in (*gains, "cg"):
        for P in sets:
            cells, gain = row(key, P, 1 if args.quick else args.repeats)
            rows.append(cells)
            if key in gains and (args.quick or P.n_objectives - 1 in TARGET_DIMENSIONS):
                gains[key].append(gain)
    header = ["centre, n / cuts", "ms", "oracle ms", "faster", "difference"]
    print(table(header, rows) + "\n")
    for key, found in gains.items():
        oracle = "HiGHS" if key == "box" else "cvxpy"
        text = f"{key}: {min(found):.1f} to {max(found):.1f} x faster than {oracle} (target >= 5)"
        print(verdict(text, min(found) >= TARGET))


if __name__ == "__main__":
    main()
