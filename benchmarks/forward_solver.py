"""Time of one iteration of the gait solver, against MuJoCo's own calls and a dense solver.

The same query is answered again and again: another weight vector, from the reference gait. At the
states at which the solver linearised, its closed-form derivatives are timed against
``mjd_inverseFD``; the floor of an evaluation is one ``mj_inverse`` a knot. The dense solver is
``mujoco.minimize.least_squares`` on the same weighted residuals; putting their Jacobian into a
dense matrix is not counted.
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
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.optimiser.dynamics.inverse import FD_STEP
from walking_irl.domains.humanoid.optimiser.linearisation import weighted
from walking_irl.domains.humanoid.optimiser.solver import GaitSolver
from walking_irl.domains.humanoid.optimiser.stages import Stage, stage
from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR

MAX_OF_FLOOR, MIN_OF_DIFFERENCES, MIN_OF_DENSE = 33.0, 4.0, 15.0


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

        def seen(ev: Any) -> Any:
            self.visited.append(ev.x.copy())
            return differentiate(ev)

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
        root = self.solver.dual(self.x)
        return self.solver.solve(self.w, self.x, self.stages, root=root).iterations

    def derivatives(self) -> None:
        """Closed-form derivatives at the linearised states."""
        problem = self.solver.problem
        for x in self.visited:
            q, v, a, _ = problem.motion(x)
            problem.dynamics.at(q, v[:-1], a)

    def mujoco_calls(self, derivatives: bool) -> Callable[[], None]:
        """MuJoCo's differences at the linearised states, or its part of all evaluations."""
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
                    if derivatives:
                        mujoco.mjd_inverseFD(model, data, FD_STEP, False, *out, None)
                    else:
                        mujoco.mj_inverse(model, data)

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
    x = start
    query = Query(solver, library[args.gait].w, x, (stage(1e6, 3 if args.quick else 30, 1e-7),))
    calls = (query.derivatives, query.mujoco_calls(True), query.mujoco_calls(False))
    times_of = [t / query.iterations for t in medians((query.solve, *calls), repeats)]
    whole, derivatives, differences, inverse = times_of
    floor = inverse / query.evaluations * query.iterations
    dense = float(np.median([dense_iteration(query, 2) for _ in range(1 if args.quick else 3)]))
    times = {
        "gait solver, one iteration": whole,
        "its derivatives, closed form": derivatives,
        "the same by mjd_inverseFD": differences,
        "its evaluations by mj_inverse": inverse,
        "one evaluation by mj_inverse": floor,
        "mujoco.minimize.least_squares, one iteration": dense,
    }
    rows = [[n, f"{1e3 * t:.1f}", f"{t / floor:.1f}"] for n, t in times.items()]
    print(
        f"{spec.walker.name}: {query.iterations} iterations, {query.evaluations} "
        f"evaluations, {len(x)} unknowns\n"
    )
    print(table(["part", "ms", "of one evaluation"], rows) + "\n")
    ratio, faster, gain = whole / floor, differences / derivatives, dense / whole
    text = f"one iteration takes {ratio:.0f} x one evaluation by mj_inverse (target <= 33)"
    print(verdict(text, ratio <= MAX_OF_FLOOR))
    text = f"derivatives are {faster:.1f} x faster than mjd_inverseFD (target >= 4)"
    print(verdict(text, faster >= MIN_OF_DIFFERENCES))
    text = f"an iteration is {gain:.0f} x faster than the dense solver's (target >= 15)"
    print(verdict(text, gain >= MIN_OF_DENSE))


if __name__ == "__main__":
    main()
