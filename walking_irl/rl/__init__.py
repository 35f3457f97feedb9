"""Forward solvers: the best policy for given weights in finite and linear-quadratic worlds."""

from __future__ import annotations

from walking_irl.rl.finite_mdp import FiniteMDP, Solution
from walking_irl.rl.linear_program import linear_program
from walking_irl.rl.policy_iteration import policy_iteration
from walking_irl.rl.value_iteration import value_iteration

__all__ = ["FiniteMDP", "Solution", "linear_program", "policy_iteration", "value_iteration"]
