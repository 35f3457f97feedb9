"""The forward methods by name: where each comes from, where it runs, what it guarantees."""

from __future__ import annotations

from typing import NamedTuple

FINITE, LINEAR_QUADRATIC = "finite", "lqr"
"""Worlds: finitely many states and actions; linear dynamics with quadratic costs."""


class ForwardMethod(NamedTuple):
    """One way of solving "best policy for these weights"."""

    name: str
    module: str
    """Module of walking_irl.rl that holds it."""
    source: str
    needs: str
    """What it asks of the world."""
    worlds: tuple[str, ...]
    guarantee: str
    """What holds of its answer, in one clause."""
    extra: str = ""
    """Package that it needs beside the project's own, or none."""


BOTH = (FINITE, LINEAR_QUADRATIC)
METHODS: dict[str, ForwardMethod] = {
    method.name: method
    for method in (
        ForwardMethod(
            "policy iteration", "policy_iteration", "Howard 1960", "model", (FINITE,),
            "exact to rounding",
        ),
        ForwardMethod(
            "value iteration", "value_iteration", "Bellman 1957", "model", (FINITE,),
            "within a stated tolerance",
        ),
        ForwardMethod(
            "linear program", "linear_program", "Puterman 1994", "model", (FINITE,),
            "exact to the solver's 1e-7",
        ),
        ForwardMethod(
            "Riccati equation", "riccati", "Bertsekas", "model", (LINEAR_QUADRATIC,),
            "exact to rounding",
        ),
        ForwardMethod(
            "approximate value iteration, linear", "approximate_value_iteration",
            "Munos & Szepesvari 2008", "generative model", BOTH,
            "none: sweeps may diverge, which is reported",
        ),
        ForwardMethod(
            "approximate value iteration, neighbours", "approximate_value_iteration",
            "Gordon 1995", "generative model", (FINITE,),
            "converges; as good as its samples and neighbours",
        ),
        ForwardMethod(
            "LSPI", "lspi", "Lagoudakis & Parr 2003", "transitions", BOTH,
            "exact where Q lies in the span of the features; may cycle, which is reported",
        ),
        ForwardMethod(
            "REINFORCE", "reinforce", "Williams 1992", "episodes", BOTH,
            "unbiased gradient up to the baseline's 1/n; a local maximum",
        ),
        ForwardMethod(
            "GPOMDP", "gpomdp", "Baxter & Bartlett 2001", "episodes", BOTH,
            "the same with less variance",
        ),
        ForwardMethod(
            "natural gradient", "natural_gradient", "Kakade 2002", "episodes", BOTH,
            "the same step in any coordinates of the parameters",
        ),
        ForwardMethod(
            "cross-entropy", "cross_entropy", "Rubinstein 1999", "evaluations", BOTH, "none",
        ),
        ForwardMethod(
            "CMA-ES", "cma_es", "Hansen & Ostermeier 2001", "evaluations", BOTH,
            "none; invariant to monotone costs and linear coordinates", "cmaes",
        ),
        ForwardMethod(
            "simulated annealing", "simulated_annealing", "Xiang et al. 1997", "evaluations", BOTH,
            "the best of all in infinite time",
        ),
    )
}  # fmt: skip
"""Forward methods of finite and linear-quadratic worlds; the walking path and the humanoid have
optimal control of their own: no planner for samples comes near it there."""
