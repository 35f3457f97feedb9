"""All inverse methods by name: table 3.1, and one way to run any of them.

A new method is one file and one line here (its adapter, if its arguments are unusual, is a
function in :mod:`walking_irl.baselines.adapters`).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from walking_irl.baselines import BASELINES
from walking_irl.baselines import adapters as run
from walking_irl.baselines.archive import archive_maxent, archive_posterior
from walking_irl.baselines.cpirl_actions import cpirl_actions
from walking_irl.baselines.girl import girl
from walking_irl.baselines.given import Given
from walking_irl.baselines.gpirl import gpirl
from walking_irl.baselines.inverse_optimal_control import bilevel_gauss_newton, bilevel_search
from walking_irl.baselines.maxent import maxent
from walking_irl.baselines.mce import mce_likelihood, mce_matching
from walking_irl.baselines.mmp import mmp
from walking_irl.baselines.mmp_boost import mmp_boost
from walking_irl.baselines.ng_russell_1 import ng_russell_1
from walking_irl.baselines.ng_russell_2 import ng_russell_2, ng_russell_2_sampled
from walking_irl.baselines.ng_russell_3 import ng_russell_3
from walking_irl.baselines.policy_matching import policy_matching
from walking_irl.baselines.policywalk import policywalk
from walking_irl.baselines.recovered import Recovered
from walking_irl.baselines.relative_entropy import relative_entropy
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.types import Expert

FINITE, LQR, PATH, HUMANOID = "finite", "LQR", "walking path", "humanoid"
EVERYWHERE = (FINITE, LQR, PATH, HUMANOID)
CONTINUOUS = (LQR, PATH, HUMANOID)


class Needs(Enum):
    """What a method must know of the expert."""

    POLICY = "complete policy"
    FEATURES = "feature expectations"
    ACTIONS = "states and actions"
    GRADIENT = "policy and its derivatives"


class Method(NamedTuple):
    """A line of table 3.1."""

    name: str
    source: str
    needs: Needs
    needs_model: bool
    """Whether it needs the transition probabilities, not only a solver or a simulator."""
    is_linear: bool
    """Whether its rewards are linear in the features."""
    program: str
    """Kind of program that it solves."""
    solves: str
    """How many forward problems it solves."""
    answer: str
    guarantee: str
    """What holds of its answer, in one clause."""
    worlds: tuple[str, ...]
    """Where it can run."""
    run: Callable[..., Recovered]
    """Maps (given, rng, **options) to the answer."""
    function: Callable[..., Any]
    """The algorithm; its keyword-only arguments are the method's options."""
    elsewhere: Callable[..., Any] | None = None
    """What stands for it where there are not finitely many states."""
    extra: str = ""
    """Optional extra of this package that it needs, or none."""
    hook: str = ""
    """What a world must offer where there are not finitely many states, or nothing."""

    def options(self, is_finite: bool) -> tuple[str, ...]:
        """Settings that it takes in a finite world, or elsewhere."""
        has_archive = not is_finite and self.elsewhere is not None
        function = self.elsewhere if has_archive else self.function
        assert function is not None
        names = {
            p.name for p in inspect.signature(function).parameters.values() if p.kind is KEYWORD
        }
        own = OWN.get(function, set()) if has_archive else set()
        return tuple(sorted(names - NOT_OPTIONS | own))


KEYWORD = inspect.Parameter.KEYWORD_ONLY
NOT_OPTIONS = {"rng", "setting"}
OWN: dict[Callable[..., Any], set[str]] = {
    archive_maxent: {"archive"},
    archive_posterior: {"archive"},
    ng_russell_2_sampled: {"size"},
}
"""Options of adapters outside of finite worlds."""
P, F, A, G = Needs
METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            "ng-russell-1", "Ng & Russell 2000, section 3", P, True, False, "linear", "none",
            "reward, policy", "the expert is optimal for the reward", (FINITE,),
            run.run_ng_russell_1, ng_russell_1,
        ),
        Method(
            "ng-russell-2", "Ng & Russell 2000, section 4", P, True, True, "linear", "none",
            "weights", "none: a heuristic penalty at sampled states", EVERYWHERE,
            run.run_ng_russell_2, ng_russell_2, ng_russell_2_sampled, "", "advantages",
        ),
        Method(
            "ng-russell-3", "Ng & Russell 2000, section 5", F, False, True, "linear", "3 to 10",
            "weights, mixture", "none: it stalls", EVERYWHERE, run.run_ng_russell_3, ng_russell_3,
        ),
        Method(
            "projection", "Abbeel & Ng 2004", F, False, True, "projections", "10 to 60",
            "mixture", "features within eps after O(K / eps^2) solves", EVERYWHERE,
            run.run_projection, BASELINES["projection"],
        ),
        Method(
            "max-margin", "Abbeel & Ng 2004", F, False, True, "quadratic", "10 to 60",
            "mixture", "features within eps after O(K / eps^2) solves", EVERYWHERE,
            run.run_max_margin, BASELINES["max-margin"],
        ),
        Method(
            "mmp", "Ratliff, Bagnell & Zinkevich 2006", A, True, True, "quadratic, cuts",
            "20 to 300", "weights", "least regret with margin, to a stated gap", (FINITE,),
            run.run_mmp, mmp,
        ),
        Method(
            "mmp-boost", "Ratliff et al. 2007", A, True, False, "quadratic, trees", "50 to 250",
            "reward that transfers", "the cost falls every round", (FINITE,), run.run_mmp_boost,
            mmp_boost, None, "methods",
        ),
        Method(
            "neu-szepesvari", "Neu & Szepesvari 2007", A, True, True, "least squares, not convex",
            "10 to 60", "weights", "a local minimum of the distance of policies", EVERYWHERE,
            run.run_policy_matching, policy_matching, bilevel_gauss_newton, "", "nearest",
        ),
        Method(
            "girl", "Pirotta & Restelli 2016", G, False, True, "non-negative least squares",
            "none", "weights", "exact for an optimal expert with exact gradients", CONTINUOUS,
            run.run_girl, girl, None, "", "policy_gradient",
        ),
        Method(
            "bilevel-search", "Mombaur, Truong & Laumond 2010", G, False, True,
            "trust region without derivatives", "30 to 100", "weights",
            "a local minimum of the distance of policies", CONTINUOUS,
            run.run_bilevel_search, bilevel_search, None, "", "nearest",
        ),
        Method(
            "mwal", "Syed & Schapire 2007", F, False, True, "multiplicative weights", "100",
            "mixture", "as good as the expert within O(sqrt(ln K / T))", EVERYWHERE,
            run.run_mwal, BASELINES["mwal"],
        ),
        Method(
            "lpal", "Syed, Bowling & Schapire 2008", F, True, True, "linear", "none",
            "policy", "best worst-case margin over the expert, exactly", (FINITE,),
            run.run_lpal, BASELINES["lpal"],
        ),
        Method(
            "maxent", "Ziebart et al. 2008", A, True, True, "convex", "10 to 400",
            "weights", "features of paths matched; exact for deterministic worlds", EVERYWHERE,
            run.run_maxent, maxent, archive_maxent,
        ),
        Method(
            "mce-likelihood", "Ziebart 2010", A, True, True, "concave", "10",
            "weights", "most likely weights of a soft expert", (FINITE,),
            run.run_mce_likelihood, mce_likelihood,
        ),
        Method(
            "mce-matching", "Ziebart 2010", F, True, True, "convex", "15 to 50",
            "weights", "features matched; regret within tau ln A / (1 - gamma)", EVERYWHERE,
            run.run_mce_matching, mce_matching, archive_maxent,
        ),
        Method(
            "relative-entropy", "Boularias, Kober & Peters 2011", A, False, True, "convex", "none",
            "weights", "features of the samples matched; see the effective sample size",
            EVERYWHERE, run.run_relative_entropy, relative_entropy, archive_maxent,
        ),
        Method(
            "policywalk", "Ramachandran & Amir 2007", A, True, True, "Markov chain", "50 to 2000",
            "posterior", "the posterior as the chain grows", EVERYWHERE,
            run.run_policywalk, policywalk, archive_posterior,
        ),
        Method(
            "gpirl", "Levine, Popovic & Koltun 2011", A, True, False, "not convex", "300 to 600",
            "reward that transfers", "a local maximum of the posterior", (FINITE,),
            run.run_gpirl, gpirl,
        ),
        Method(
            "kelley", "Kelley 1960 (our addition)", F, False, True, "linear", "10 to 60",
            "weights, mixture", "least regret, to a stated gap", EVERYWHERE,
            run.run_kelley, BASELINES["kelley"],
        ),
        Method(
            "cpirl", "Balloccu, Algorithms 2 and 3", F, False, True, "cutting planes", "5 to 40",
            "weights, set, certificate", "the set holds the expert's weights; least regret",
            EVERYWHERE, run.run_cpirl, run.run_cpirl,
        ),
        Method(
            "cpirl-actions", "ours", A, True, True, "cutting planes in convex-concave rounds",
            "10 to 60", "weights, intervals", "the shortfall never rises; 0: all is optimal",
            (FINITE,), run.run_cpirl_actions, cpirl_actions,
        ),
    )
}  # fmt: skip
"""All of them, in the order of the thesis's table."""


def run_method(
    name: str,
    world: Any,
    data: Demonstrations | Expert,
    *,
    rng: np.random.Generator,
    **options: Any,
) -> Recovered:
    """Run a method by name on any world where it can run.

    Outside of finite worlds mce-matching, relative-entropy and policywalk take the policies that
    a run of CPIRL evaluates (or the option ``archive``, features (n, K)) for all policies.

    Args:
        name: Key of :data:`METHODS`.
        world: A :class:`~walking_irl.rl.finite_mdp.FiniteMDP`, a domain that has one as ``mdp``,
            or a domain with ``forward`` (and ``policy_gradient`` for GIRL).
        data: Demonstrations, or an expert's features; an ``Expert`` whose ``demonstration`` is a
            complete policy (S,) serves the methods that need one.
        rng: Whatever is drawn is drawn from it.
        options: The method's own settings.

    Raises:
        InvalidInputError: If there is no such method, it takes no such option, the world is none
            on which it runs or the data lack what it needs: one sentence says what.
        SolverError: If a program or a forward problem cannot be solved.
    """
    if name not in METHODS:
        raise InvalidInputError(f"unknown method {name!r}; choose from {', '.join(METHODS)}")
    method, given = METHODS[name], Given(name, world, data)
    known = method.options(given.is_finite)
    unknown = [option for option in options if option not in known]
    if unknown:
        raise InvalidInputError(
            f"{name} takes no option {', '.join(unknown)}; choose from {', '.join(known) or 'none'}"
        )
    return method.run(given, rng, **options)
