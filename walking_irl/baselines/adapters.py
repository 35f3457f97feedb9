"""How each method is run on what is given: one function a method, all with one signature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from walking_irl.baselines import BASELINES
from walking_irl.baselines.apprentice import Apprentice
from walking_irl.baselines.archive import archive_maxent, archive_posterior
from walking_irl.baselines.cpirl_actions import cpirl_actions
from walking_irl.baselines.girl import girl
from walking_irl.baselines.given import Given, signed, solver
from walking_irl.baselines.gpirl import gpirl
from walking_irl.baselines.inverse_optimal_control import bilevel_gauss_newton, bilevel_search
from walking_irl.baselines.loop import Baseline, Setting
from walking_irl.baselines.maxent import maxent
from walking_irl.baselines.mce import mce_likelihood, mce_matching
from walking_irl.baselines.mmp import mmp
from walking_irl.baselines.mmp_boost import mmp_boost
from walking_irl.baselines.ng_russell_1 import ng_russell_1
from walking_irl.baselines.ng_russell_2 import ng_russell_2, ng_russell_2_sampled
from walking_irl.baselines.ng_russell_3 import ng_russell_3
from walking_irl.baselines.policy_matching import policy_matching
from walking_irl.baselines.policywalk import policywalk
from walking_irl.baselines.recovered import Recovered, from_weights, positive
from walking_irl.baselines.relative_entropy import relative_entropy
from walking_irl.cpirl import cpirl
from walking_irl.types import Expert

Rng = np.random.Generator
DEVIATION = 0.01
"""Relative size of sampled deviations from the expert's policy."""


def run_ng_russell_1(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Complete policy, tabular reward."""
    return ng_russell_1(given.mdp, given.policy, **options)


def run_ng_russell_2(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Complete policy, linear reward; sampled deviations outside of finite worlds."""
    if not given.is_finite:
        size = options.pop("size", DEVIATION)
        positive(size=size)
        advantages = given.offered("advantages")(given.shown, size=size, rng=rng)
        return ng_russell_2_sampled(advantages, **options)
    return ng_russell_2(given.mdp, given.policy, rng=rng, **options)


def run_ng_russell_3(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Features alone; the answer is the last program's weights, or the mixture elsewhere."""
    return _apprenticeship(ng_russell_3, given, rng, **options)


def run_mmp(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Maximum margin planning."""
    return mmp(given.mdp, given.demonstrations, **options)


def run_mmp_boost(given: Given, rng: Rng, **options: Any) -> Recovered:
    """MMPBoost."""
    return mmp_boost(given.mdp, given.demonstrations, **options)


def run_policy_matching(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Neu & Szepesvari; outside of finite worlds policies are compared by their parameters."""
    if not given.is_finite:
        return _bilevel(bilevel_gauss_newton, given, **options)
    return policy_matching(given.mdp, given.demonstrations, **options)


def run_bilevel_search(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Mombaur's bilevel method, without derivatives."""
    return _bilevel(bilevel_search, given, **options)


def _bilevel(method: Callable[..., Recovered], given: Given, **options: Any) -> Recovered:
    solve = given.offered("nearest")(given.shown)
    return method(solve, len(given.exact.mu), **{"min_weight": given.least, **options})


def run_girl(given: Given, rng: Rng, **options: Any) -> Recovered:
    """GIRL, where policies have parameters."""
    return girl(given.policy_gradient, **options)


def run_mce_likelihood(given: Given, rng: Rng, **options: Any) -> Recovered:
    """MCE by the likelihood of actions."""
    return mce_likelihood(given.mdp, given.demonstrations, **options)


def run_mce_matching(given: Given, rng: Rng, **options: Any) -> Recovered:
    """MCE by features; over an archive of policies outside of finite worlds."""
    if not given.is_finite:
        return _over_archive(archive_maxent, given, rng, options)
    found = mce_matching(given.planned, given.exact, **options)
    return replace(found, mu=given.mdp.feature_expectations(found.policy))


def run_maxent(given: Given, rng: Rng, **options: Any) -> Recovered:
    """MaxEnt 2008; over an archive of policies, which stand for paths, elsewhere."""
    if not given.is_finite:
        return _over_archive(archive_maxent, given, rng, options)
    return maxent(given.mdp, given.demonstrations, **options)


def run_relative_entropy(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Relative entropy; the archive stands for samples outside of finite worlds."""
    if not given.is_finite:
        return _over_archive(archive_maxent, given, rng, options)
    return relative_entropy(given.mdp, given.demonstrations, rng=rng, **options)


def run_policywalk(given: Given, rng: Rng, **options: Any) -> Recovered:
    """PolicyWalk; over an archive of policies outside of finite worlds."""
    if not given.is_finite:
        return _over_archive(partial(archive_posterior, rng=rng), given, rng, options)
    return policywalk(given.mdp, given.demonstrations, rng=rng, **options)


def run_gpirl(given: Given, rng: Rng, **options: Any) -> Recovered:
    """GPIRL."""
    return gpirl(given.mdp, given.demonstrations, rng=rng, **options)


def run_cpirl(
    given: Given, rng: Rng, *, mode: str = "minimise", centre: str = "ac", max_solves: int = 40
) -> Recovered:
    """CPIRL from features with their error bars."""
    run = list(
        cpirl(
            given.forward,
            given.expert,
            centre=centre,
            mode=mode,  # type: ignore[arg-type]  # checked by cpirl
            max_solves=max_solves,
            min_weight=0.0 if given.is_finite else given.least,
            rng=rng,
        )
    )
    last = run[-1]
    log: dict[str, Any] = {
        "objective": np.array([it.best_regret for it in run]),
        "iterates": np.array([it.estimate for it in run]),
    }
    info = {
        "solves": last.k + 1,
        "intervals": last.intervals,
        "certificate": last.certificate,
        "regret": last.best_regret,
    }
    if given.is_finite:
        return from_weights(
            given.mdp, last.estimate, "simplex", status=last.status, info=info, **log
        )
    answer = given.forward(last.estimate)
    return Recovered(
        w=last.estimate,
        space="simplex",
        policy=answer.policy,
        mu=answer.mu,
        status=last.status,
        info=info,
        **log,
    )


def run_cpirl_actions(given: Given, rng: Rng, **options: Any) -> Recovered:
    """CPIRL that reads actions."""
    return cpirl_actions(given.mdp, given.demonstrations, rng=rng, **options)


def run_projection(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Abbeel & Ng's projection."""
    return _apprenticeship(BASELINES["projection"], given, rng, **options)


def run_max_margin(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Abbeel & Ng's maximum margin."""
    return _apprenticeship(BASELINES["max-margin"], given, rng, **options)


def run_kelley(given: Given, rng: Rng, **options: Any) -> Recovered:
    """Kelley's cutting planes, on the simplex."""
    return _apprenticeship(BASELINES["kelley"], given, rng, **options)


def run_mwal(given: Given, rng: Rng, *, max_solves: int = 100, **options: Any) -> Recovered:
    """Multiplicative weights, with signed features in finite worlds."""
    return _game("mwal", given, rng, max_solves=max_solves, **options)


def run_lpal(given: Given, rng: Rng, **options: Any) -> Recovered:
    """The linear program, with signed features."""
    return _game("lpal", given, rng, **options)


def _over_archive(
    method: Callable[..., Recovered], given: Given, rng: Rng, options: dict[str, Any]
) -> Recovered:
    """Compare the expert with policies: the option ``archive`` (n, K), or those of a CPIRL run."""
    known = options.pop("archive", None)
    if known is not None:
        return method(known, given.exact.mu, **options)
    M, n_solves = given.archive(rng)
    found = method(M, given.exact.mu, **options)
    note = f"it compares the expert with {len(M)} policies that CPIRL evaluated by cuts alone"
    return replace(found, info={**found.info, "solves": n_solves}, notes=(note, *found.notes))


def _apprenticeship(
    method: Baseline, given: Given, rng: Rng, *, max_solves: int = 40, tol: float = 1e-4
) -> Recovered:
    """A mixture of policies: signed weights in finite worlds, the simplex elsewhere."""
    is_signed = given.is_finite and method is not BASELINES["kelley"]
    run = method(
        given.oracle,
        given.exact,
        rng=rng,
        setting=Setting(is_signed=is_signed),
        tol=tol,
        max_solves=max_solves,
    )
    return _mixed(given, list(run), is_signed)


def _game(name: str, given: Given, rng: Rng, **options: Any) -> Recovered:
    """Methods whose weights live on the simplex by their nature: signs become features."""
    if not given.is_finite:
        if name == "lpal":
            given.mdp  # noqa: B018  # says why not
        corners = np.eye(len(given.exact.mu))
        span = max(float(np.abs(given.oracle(w).mu - given.exact.mu).max()) for w in corners)
        setting = Setting(False, span)
        run = BASELINES[name](given.oracle, given.exact, rng=rng, setting=setting, **options)
        return _mixed(given, list(run), False)
    mdp = signed(given.planned)
    expert = Expert(np.r_[given.exact.mu, -given.exact.mu], np.zeros(2 * len(given.exact.mu)))
    span = 2 * float(np.abs(mdp.Phi).max()) / (1 - mdp.discount)
    run = BASELINES[name](
        solver(mdp), expert, rng=rng, setting=Setting(False, span, mdp), **options
    )
    return _mixed(given, list(run), True)


def _mixed(given: Given, run: list[Apprentice], is_signed: bool) -> Recovered:
    """The mixture as one stationary policy where there are states, else as it is.

    The log is the distance of the mixture's features to the expert's after each solve.
    """
    last, K = run[-1], len(given.exact.mu)
    info = {"solves": len(last.W), "mixture": last.mixture}
    log: dict[str, Any] = {
        "objective": np.array([np.linalg.norm((a.mu - a.mu_E)[:K]) for a in run]),
        "iterates": last.W if last.W.shape[1] == K else last.W[:, :K] - last.W[:, K:],
    }
    if given.is_finite:
        policy, _ = given.planned.stationary_policy(
            [r.policy for r in last.responses], last.mixture
        )
        mu = given.mdp.feature_expectations(policy)
        return Recovered(policy=policy, mu=mu, status=last.status, info=info, **log)
    return Recovered(
        w=last.W[-1],
        space="box" if is_signed else "simplex",
        policy=tuple(r.policy for r in last.responses),
        mu=last.mu,
        status=last.status,
        info=info,
        **log,
    )
