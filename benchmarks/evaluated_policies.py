"""How many forward solves it saves that every evaluated policy is a cut.

The same recoveries with and without policies that cost no solve, by cuts alone (no Newton steps,
no probes). Where such policies come from:

iterates       what the solver passed through on its way: gaits of the planar humanoid, policies of
               policy iteration. A walking path arrives only when SLSQP is done, and the LQR's
               gains are a formula: these two have none
library        best policies for other weights, known from before: ten random weights, for the
               humanoid the shipped gaits
demonstration  policies next to the expert's own, which must be known for that: gains 1 % off,
               another action in one cell, one walk of the four taken from the newest answer, gaits
               shaken by 0.1 degrees

A recovery ends when every weight is known to within the width given, or when the expert is optimal
for the query; in the gridworld, whose policies leave the weights some freedom, by the latter alone.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
from bench import table

from walking_irl.arrays import Array
from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.stops import IntervalsNarrowerThan
from walking_irl.domains.contract import Request
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.learner import known_gaits, solver_for
from walking_irl.domains.humanoid.spec import PLANAR
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.domains.path.walking_path import SCALES, WalkingPath
from walking_irl.geometry.centres import CENTRES
from walking_irl.rl.chain import Chain
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.types import Expert, Forward, Response, Status

MOST = 100
"""Solves of one recovery."""
LIBRARY = 10
GAIN_ERROR, SHAKE = 0.01, np.deg2rad(0.1)
FAINT = 1e-6
"""A policy this near to the expert (relative) is left out: what little it says drowns in the
solvers' tolerances, and policy iteration keeps an action within 1e-10 of the best."""
SAVES = 1.05
"""From which ratio of solves on a source counts as saving some."""

Source = Callable[[Response], Array]
"""Maps the newest answer to feature expectations of further policies, shape (n, K)."""


class Learner(NamedTuple):
    """What the recovery of one expert has: a solver, and sources of policies that cost no solve."""

    forward: Forward
    sources: dict[str, Source]


class Setting(NamedTuple):
    """A domain, its experts, and how well their weights are to be known."""

    name: str
    expert: Callable[[np.random.Generator], Expert]
    learner: Callable[[Expert], Learner]
    width: float | None
    n_experts: int
    min_weight: float = 0.0


class Outcome(NamedTuple):
    """Figures of one recovery."""

    solves: int
    policies: int
    width: float


class Widened:
    """A solver without sensitivities, whose answers carry the policies of some sources."""

    def __init__(self, learner: Learner, names: Sequence[str], mu_E: Array) -> None:
        self.forward, self.mu_E = learner.forward, mu_E
        self.sources = [learner.sources[name] for name in names]
        self.n_policies = 0

    def __call__(self, w: Array) -> Response:
        """The solver's answer, and what it costs nothing to add."""
        answer = self.forward(w)
        more = np.vstack([np.empty((0, len(w))), *(source(answer) for source in self.sources)])
        more = more[np.abs(more - self.mu_E).max(axis=1) > FAINT * np.abs(self.mu_E).max()]
        self.n_policies += len(more)
        return Response(answer.policy, answer.mu, evaluated=more)


def once(policies: Callable[[], Array]) -> Source:
    """A source that gives all it has with the first answer."""
    left = [policies]
    return lambda answer: left.pop()() if left else np.empty((0, len(answer.mu)))


def optima(domain: Any, draw: Callable[[np.random.Generator], Array]) -> Array:
    """Features of the best policies for other random weights, shape (n, K)."""
    rng = np.random.default_rng(10**6)
    return np.array([domain.forward(draw(rng)).mu for _ in range(LIBRARY)])


def regulator() -> Setting:
    domain = LQR(5)
    eye = np.eye(domain.n_objectives)
    library = optima(domain, lambda rng: rng.dirichlet(np.ones(len(eye))))

    def learner(expert: Expert) -> Learner:
        gains = expert.demonstration
        off = [gains * (1 + s * e) for e in eye for s in (GAIN_ERROR, -GAIN_ERROR)]
        sources = {
            "library": once(lambda: library),
            "demonstration": once(lambda: np.array([domain.evaluate(k) for k in off])),
        }
        return Learner(domain.forward, sources)

    return Setting(
        "lqr", lambda rng: domain.expert(rng.dirichlet(np.ones(len(eye))), rng), learner, 0.05, 10
    )


def gridworld() -> Setting:
    domain = Gridworld(cells=3)
    draw = partial(domain.random_weights, "sparse")
    mdp, library = domain.mdp, optima(domain, draw)

    def learner(expert: Expert) -> Learner:
        passed: list[Array] = []

        def forward(w: Array) -> Response:
            passed.clear()
            with mock.patch.object(Chain, "__init__", watched(passed)):
                return domain.forward(w)

        def changed() -> Array:
            pi, cell = expert.demonstration, np.eye(mdp.n_states, dtype=bool)
            turns = range(1, mdp.n_actions)
            others = [np.where(c, (pi + turn) % mdp.n_actions, pi) for c in cell for turn in turns]
            return np.array([mdp.feature_expectations(other) for other in others])

        sources: dict[str, Source] = {
            "iterates": lambda answer: np.array([mdp.feature_expectations(pi) for pi in passed]),
            "library": once(lambda: library),
            "demonstration": once(changed),
        }
        return Learner(forward, sources)

    return Setting("gridworld", lambda rng: domain.expert(draw(rng), rng), learner, None, 10)


def watched(passed: list[Array]) -> Callable[[Chain, FiniteMDP, Any], None]:
    """The making of a :class:`Chain`, which keeps every policy that it is asked for."""
    make = Chain.__init__

    def keep(chain: Chain, mdp: FiniteMDP, policy: Any) -> None:
        passed.append(policy)
        make(chain, mdp, policy)

    return keep


def walking_path() -> Setting:
    domain = WalkingPath()
    draw = partial(domain.random_weights, "interior")
    library = optima(domain, draw)

    def learner(expert: Expert) -> Learner:
        own = np.array([path.F for path in expert.demonstration])

        def one_changed(answer: Response) -> Array:
            F = np.array([path.F for path in answer.policy])
            return np.asarray(expert.mu - (F - own) / (len(own) * SCALES))

        sources = {"library": once(lambda: library), "demonstration": one_changed}
        return Learner(domain.forward, sources)

    return Setting("walking-path", lambda rng: domain.expert(draw(rng), rng), learner, 0.05, 5)


def humanoid() -> Setting:
    domain, solver = Humanoid("humanoid-planar"), solver_for(PLANAR)

    def learner(expert: Expert) -> Learner:
        x, rng = expert.demonstration.to_vector(), np.random.default_rng(0)

        def shaken() -> Array:
            starts = [solver.perturb(x, SHAKE, rng) for _ in range(LIBRARY)]
            return -np.array([solver.problem.evaluate(v).total_costs() for v in starts])

        sources: dict[str, Source] = {
            "iterates": lambda answer: answer.evaluated,
            "library": once(lambda: -np.array([g.total_costs for g in known_gaits(PLANAR)])),
            "demonstration": once(shaken),
        }
        tools = domain.learner(expert, {}, rng=rng)
        return Learner(tools.forward, sources)

    def expert(rng: np.random.Generator) -> Expert:
        request = Request(options={"rollouts": 0})
        return domain.demonstrate(request, rng=rng).expert

    return Setting("humanoid-planar", expert, learner, 0.1, 3, domain.defaults.min_weight)


def recover(setting: Setting, expert: Expert, centre: str, names: Sequence[str]) -> Outcome:
    """One recovery with the policies of some sources."""
    forward = Widened(setting.learner(expert), names, expert.mu)
    steps = cpirl(
        forward,
        expert,
        centre=centre,
        max_solves=MOST,
        min_weight=setting.min_weight,
        rng=np.random.default_rng(0),
        stop=() if setting.width is None else (IntervalsNarrowerThan(setting.width),),
    )
    last = list(steps)[-1]
    if last.status not in (Status.MATCHED, Status.CONVERGED):
        raise RuntimeError(f"{setting.name}, {' + '.join(names)}: {last.status.value}")
    return Outcome(last.k + 1, forward.n_policies, last.widest)


def compare(setting: Setting, centre: str, n_experts: int) -> tuple[list[list[str]], str]:
    """Rows of the table, and the headline of one domain."""
    experts = [setting.expert(np.random.default_rng(seed)) for seed in range(n_experts)]
    names = list(setting.learner(experts[0]).sources)
    rows, ratios, alone = [], {}, 0
    for chosen in ([], *([name] for name in names), names):
        found = [recover(setting, expert, centre, chosen) for expert in experts]
        solves = sum(outcome.solves for outcome in found)
        alone = alone or solves
        ratios[label(chosen, names)] = alone / solves
        rows.append(
            [
                f"{setting.name}, {label(chosen, names)}",
                f"{sum(outcome.policies for outcome in found) / n_experts:.0f}",
                f"{solves / n_experts:.1f}",
                f"{alone / solves:.2f}",
                f"{np.median([outcome.width for outcome in found]):.3f}",
            ]
        )
    return rows, headline(setting, ratios)


def label(chosen: Sequence[str], names: Sequence[str]) -> str:
    if len(chosen) == 1:
        return chosen[0]
    return "all" if len(chosen) == len(names) else "queries alone"


def headline(setting: Setting, ratios: dict[str, float]) -> str:
    """What each source saves by itself, and all together."""
    *single, everything = list(ratios.items())[1:]
    saving = [f"{ratio:.2f} x with {name}" for name, ratio in single if ratio >= SAVES]
    nothing = [name for name, ratio in single if ratio < SAVES]
    parts = [f"{everything[1]:.2f} x fewer solves with all", *saving]
    if nothing:
        parts.append(f"nothing saved by {', '.join(nothing)}")
    return f"{setting.name}: {'; '.join(parts)}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--experts", type=int, help="of each domain; by default 3 to 10")
    parser.add_argument("--centre", default="ac", choices=list(CENTRES))
    parser.add_argument(
        "--quick", action="store_true", help="the regulator and the gridworld only, one expert each"
    )
    args = parser.parse_args()
    makers = (
        (regulator, gridworld) if args.quick else (regulator, gridworld, walking_path, humanoid)
    )
    rows, headlines = [], []
    for make in makers:
        setting = make()
        n_experts = 1 if args.quick else args.experts or setting.n_experts
        more, text = compare(setting, args.centre, n_experts)
        rows += more
        headlines.append(f"{text} ({n_experts} experts)")
    print(table(["domain, further policies", "policies", "solves", "ratio", "width"], rows) + "\n")
    print("\n".join(headlines))


if __name__ == "__main__":
    main()
