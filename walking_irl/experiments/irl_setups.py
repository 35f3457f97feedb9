"""How each IRL method is set up in table 3.1b: from a case to the policy that it recommends."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.cpirl_actions import cpirl_actions
from walking_irl.baselines.gpirl import gpirl
from walking_irl.baselines.loop import Baseline, Setting
from walking_irl.baselines.lpal import lpal
from walking_irl.baselines.max_margin import max_margin
from walking_irl.baselines.maxent import maxent
from walking_irl.baselines.mce import mce_likelihood, mce_matching
from walking_irl.baselines.mmp import mmp
from walking_irl.baselines.mmp_boost import mmp_boost
from walking_irl.baselines.mwal import mwal
from walking_irl.baselines.ng_russell_1 import ng_russell_1
from walking_irl.baselines.ng_russell_2 import ng_russell_2
from walking_irl.baselines.ng_russell_3 import ng_russell_3
from walking_irl.baselines.policy_matching import policy_matching
from walking_irl.baselines.policywalk import policywalk
from walking_irl.baselines.projection import projection
from walking_irl.baselines.recovered import Recovered
from walking_irl.baselines.relative_entropy import relative_entropy
from walking_irl.cpirl.loop import cpirl
from walking_irl.experiments.irl_cases import Case, doubled, forward
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.tabular import best_policy


class Answer(NamedTuple):
    """What is scored of a method."""

    policy: Array | Actions
    """Deterministic (S,) or stochastic (S, A)."""
    reward: Array | None = None
    """Recovered reward, shape (S,), where there is one."""
    solves: int | None = None
    """Forward solves, where the method counts them."""


Setup = Callable[[Case, np.random.Generator], Answer]


def _answer(found: Recovered) -> Answer:
    return Answer(found.policy, found.reward, found.info.get("solves"))


def _mixture(baseline: Baseline, case: Case, rng: np.random.Generator) -> Answer:
    """The lottery over all policies found, as one stationary policy."""
    is_simplex = baseline in (mwal, lpal)  # they know weights >= 0 only
    world = doubled(case.own_start) if is_simplex else case.own_start
    span = 2 * float(np.abs(world.Phi).max()) / (1 - world.discount)
    run = baseline(
        forward(world),
        case.expert(world),
        rng=rng,
        setting=Setting(span=span, mdp=world),
        tol=1e-4,
        max_solves=100 if baseline is mwal else 40,
    )
    last = list(run)[-1]
    if baseline is lpal:
        return Answer(last.last.policy, None, 0)
    return Answer(last.stationary_policy(world)[0], None, len(last.responses))


def _weights(mdp: FiniteMDP, w: Array, solves: int) -> Answer:
    r = mdp.reward(w)
    return Answer(best_policy(mdp, r).pi, r, solves)


def _ng_russell_3(case: Case, rng: np.random.Generator) -> Answer:
    world = case.own_start
    last = list(ng_russell_3(forward(world), case.expert(), rng=rng))[-1]
    return _weights(world, last.W[-1], len(last.responses))


def _cpirl(case: Case, rng: np.random.Generator) -> Answer:
    """Feature expectations with their error bars, as for any expert known by trajectories."""
    world = case.own_start if case.is_nonnegative else doubled(case.own_start)
    run: Any = cpirl(
        forward(world), case.expert(world), centre="ac", mode="minimise", max_solves=40, rng=rng
    )
    iterations = list(run)
    return _weights(world, iterations[-1].estimate, len(iterations))


COMPLETE: dict[str, Setup] = {
    "Ng-Russell 1": lambda case, rng: _answer(ng_russell_1(case.mdp, case.policy)),
    "Ng-Russell 2, box": lambda case, rng: _answer(
        ng_russell_2(case.mdp, case.policy, rng=rng, n_states=30)
    ),
    "Ng-Russell 2, simplex": lambda case, rng: _answer(
        ng_russell_2(case.mdp, case.policy, rng=rng, n_states=30, is_simplex=True)
    ),
}
"""Methods that see the expert's complete, deterministic policy."""

SETUPS: dict[str, Setup] = {
    "Ng-Russell 3": _ng_russell_3,
    "MMP": lambda case, rng: _answer(mmp(case.mdp, case.demonstrations)),
    "MMPBoost": lambda case, rng: _answer(
        mmp_boost(case.mdp, case.demonstrations, features=case.raw)
    ),
    "Neu-Szepesvari": lambda case, rng: _answer(policy_matching(case.mdp, case.demonstrations)),
    "MaxEnt 2008, algorithm 1": lambda case, rng: _answer(
        maxent(case.mdp, case.demonstrations, visits="dynamics")
    ),
    "MaxEnt 2008, path measure": lambda case, rng: _answer(maxent(case.mdp, case.demonstrations)),
    "MCE likelihood": lambda case, rng: _answer(mce_likelihood(case.mdp, case.demonstrations)),
    "MCE matching": lambda case, rng: _answer(mce_matching(case.own_start, case.expert())),
    "RelEnt": lambda case, rng: _answer(relative_entropy(case.mdp, case.demonstrations, rng=rng)),
    "PolicyWalk": lambda case, rng: _answer(
        policywalk(case.mdp, case.demonstrations, rng=rng, n_samples=1500)
    ),
    "GPIRL": lambda case, rng: _answer(
        gpirl(case.mdp, case.demonstrations, rng=rng, features=case.raw)
    ),
    "projection": partial(_mixture, projection),
    "max-margin": partial(_mixture, max_margin),
    "MWAL": partial(_mixture, mwal),
    "LPAL": partial(_mixture, lpal),
    "CPIRL": _cpirl,
    "CPIRL from actions": lambda case, rng: _answer(
        cpirl_actions(case.mdp, case.demonstrations, rng=rng)
    ),
}
"""Methods that see demonstrations; none sees the true reward."""
