"""Time of one iteration of the gait solver, against its MuJoCo calls and a dense solver.

The same query is answered again and again: another weight vector, from the reference gait. The
derivative calls alone are ``mj_inverse`` and ``mjd_inverseFD`` at the states at which the solver
linearised. The dense solver is ``mujoco.minimize.least_squares`` on the same weighted residuals;
putting their Jacobian into a dense matrix is not counted.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from bench import medians, table, verdict
from mujoco import minimize

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import NUDGE, solver_for
from walking_irl.domains.humanoid.optimiser.descent import FD_STEPS
from walking_irl.domains.humanoid.optimiser.linearisation import weighted
from walking_irl.domains.humanoid.optimiser.solver import GaitSolver
from walking_irl.domains.humanoid.optimiser.stages import Stage, stage
from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR

MAX_OF_DERIVATIVES, MIN_OF_DENSE = 2.0, 15.0


class Query:
    """One solve, and where it linearised.

    Args:
        solver: The solver.
        w: Weights, shape (6,).
        x: Start.
        stages: Of the solve.
    """

    def __init__(self, solver: GaitSolver, w: Array, x: Array, stages: tuple[Stage, ...]) -> None:
        self.solver, self.w, self.x, self.stages = solver, w, x, stages
        problem = solver.problem
        self.visited: list[Array] = []
        self.evaluations = 0
        differentiate, evaluate = problem.differentiate, problem.evaluate

        def seen(x: Array, eps: float) -> Any:
            self.visited.append(x.copy())
            return differentiate(x, eps)

        def counted(x: Array) -> Any:
            self.evaluations += 1
            return evaluate(x)

        problem.differentiate, problem.evaluate = seen, counted  # type: ignore[method-assign]
        try:
            self.iterations = self.solve()
        finally:
            del problem.differentiate, problem.evaluate

    def solve(self) -> int:
        """Solve, and return the number of iterations."""
        return self.solver.solve(self.w, self.x, self.stages).iterations

    def mujoco_calls(self, derivatives: bool) -> Callable[[], None]:
        """MuJoCo's part of the solve: at the linearised states, or of all evaluations."""
        problem = self.solver.problem
        model, n = problem.walker.model, problem.n_knots
        data = mujoco.MjData(model)
        nv, ns = model.nv, model.nsensordata
        out = [np.empty((nv, nv)) for _ in range(3)] + [np.empty((nv, ns)) for _ in range(3)]
        states = [problem.motion(x)[:3] for x in self.visited]
        if not derivatives:
            states = [states[i % len(states)] for i in range(self.evaluations)]

        def run() -> None:
            for q, v, a in states:
                for i in range(n):
                    data.qpos[:], data.qvel[:], data.qacc[:] = q[i], v[i], a[i]
                    mujoco.mj_inverse(model, data)
                    if derivatives:
                        mujoco.mjd_inverseFD(model, data, FD_STEPS[0], False, *out, None)

        return run


def dense_iteration(query: Query, iterations: int) -> float:
    """Time of one iteration of MuJoCo's dense solver [s]."""
    solver, w = query.solver, query.w
    problem = solver.problem
    dense = 0.0

    def residual(x: Array) -> Array:
        ev = problem.evaluate(x.ravel())
        return weighted(problem.stack, ev, w, ROOT_PENALTY).flat()[:, None]

    def jacobian(x: Array, r: Array) -> Array:
        nonlocal dense
        at = solver.linearise(x.ravel()).at(w, ROOT_PENALTY)
        start = time.process_time()
        unit = np.eye(x.size)
        J = np.column_stack([at.times(e).flat() for e in unit])
        dense += time.process_time() - start
        return J

    start = time.process_time()
    _, trace = minimize.least_squares(
        query.x, residual, jacobian=jacobian, max_iter=iterations, verbose=0
    )
    return (time.process_time() - start - dense) / max(1, min(iterations, len(trace)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--planar", action="store_true")
    parser.add_argument("--gait", default="effort x3", help="shipped gait whose weights are asked")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--quick", action="store_true", help="planar, few iterations, once")
    args = parser.parse_args()
    spec = PLANAR if args.planar or args.quick else HUMANOID
    repeats = 1 if args.quick else args.repeats
    library = load_library(spec.body)
    solver = solver_for(spec)
    start = library["reference"].gait.to_vector()
    x = solver.perturb(start, NUDGE, np.random.default_rng(0))
    query = Query(solver, library[args.gait].w, x, (stage(1e6, 3 if args.quick else 30, 1e-7),))
    parts = (query.solve, query.mujoco_calls(True), query.mujoco_calls(False))
    whole, derivatives, inverse = (t / query.iterations for t in medians(parts, repeats))
    dense = float(np.median([dense_iteration(query, 2) for _ in range(1 if args.quick else 3)]))
    names = ["gait solver, one iteration", "MuJoCo's derivatives alone", "MuJoCo's evaluations"]
    times = dict(zip(names, (whole, derivatives, inverse), strict=True))
    times["linear algebra and the rest"] = whole - derivatives - inverse
    times["mujoco.minimize.least_squares, one iteration"] = dense
    rows = [[n, f"{1e3 * t:.1f}", f"{t / derivatives:.2f}"] for n, t in times.items()]
    print(
        f"{spec.walker.name}: {query.iterations} iterations, {query.evaluations} "
        f"evaluations, {len(x)} unknowns\n"
    )
    print(table(["part", "ms", "of derivatives"], rows) + "\n")
    ratio, gain = whole / derivatives, dense / whole
    text = f"one iteration takes {ratio:.2f} x its derivative calls (target <= 2)"
    print(verdict(text, ratio <= MAX_OF_DERIVATIVES))
    text = f"it is {gain:.0f} x faster than the dense solver's (target >= 15)"
    print(verdict(text, gain >= MIN_OF_DENSE))


if __name__ == "__main__":
    main()
