"""Cutting-Plane Inverse Reinforcement Learning: whose weights make this behaviour optimal?

Every policy pi satisfies w_E.mu(pi) <= w_E.mu_E for the expert's own weights, so each policy found
cuts the simplex of weights. Algorithm 2, for an optimal expert whose features mu_E are known:

1. P_0 is the simplex of all weights.
2. w_k is the centre of P_k.
3. pi_k is the best policy for w_k, with features mu_k.
4. P_{k+1} is P_k cut by (mu_k - mu_E).w <= 0.
5. Stop where pi_k does not beat the expert, w_k.(mu_k - mu_E) <= tol: w_k explains it; or where
   P_{k+1} has no interior. Else go on with 2.

Beyond it, estimated features and tolerances raise the expert by a level in step 4, and an expert
that need not be optimal lowers the level to the least regret found (in place of Algorithm 3, which
:mod:`walking_irl.cpirl.algorithm3` holds for comparison). Near the end, where the domain has
sensitivities, step 2 is a Newton step on the regret f(w) = max_pi w.mu(pi) - w.mu_E, which is
convex and zero at w_E.

Source: S. Balloccu, Cutting-Plane methods for Inverse Reinforcement Learning (Politecnico di
Milano), Algorithms 2 and 3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.endings import Endings, ending, endings_of, told_true
from walking_irl.cpirl.levels import Levels, levels_of
from walking_irl.cpirl.newton_phase import EstimatedNewton, ExactNewton, Measure, NewtonPhase
from walking_irl.cpirl.outlook import Decision, Outlook, Query
from walking_irl.cpirl.probes import Probes, Probing
from walking_irl.cpirl.queries import Centres, kelley
from walking_irl.cpirl.record import record
from walking_irl.cpirl.stops import BudgetSpent, StopRule, stopped
from walking_irl.errors import InvalidInputError
from walking_irl.expert import check_expert
from walking_irl.geometry.centres import OwnCentre, centre_rule
from walking_irl.types import Expert, Forward, Iteration, Mode, Rule, Status


def cpirl(
    forward: Forward,
    expert: Expert,
    *,
    centre: str | OwnCentre = "ac",
    mode: Mode = "optimal",
    tol: float = 1e-6,
    bracket: float | None = None,
    max_solves: int = 60,
    min_weight: float = 0.0,
    rng: np.random.Generator,
    measure: Measure | None = None,
    probe: float | Probing | None = None,
    stop: Sequence[StopRule] = (),
) -> Iterator[Iteration]:
    """Recover the weights under which an expert is optimal; one iteration per forward solve.

    Args:
        forward: Solves "best policy for w"; picklable where probes have an executor.
        expert: What is known of the expert. With a ``covariance`` it counts as estimated.
        centre: Key of the centre (ac, cg, mvie or cc), or a function of the polyhedron and ``rng``
            that returns a point inside it, as :class:`~walking_irl.geometry.centres.Centre` or as
            weights.
        mode: "optimal" keeps weights with f <= 0; "set" those with f <= tol |w.mu_E|; "minimise"
            lowers f as far as it goes, for an expert that need not be optimal.
        tol: Regret that counts as none, relative to |w.mu_E|.
        bracket: In "minimise" mode, go on until the least regret is known within this, relative,
            even where a policy is better than the expert in every feature; None ends there.
        max_solves: Budget of forward solves, before probes.
        min_weight: Lower bound of every weight.
        rng: Used by sampling centres, and to move a centre that repeats itself.
        measure: Maps a policy to the mean (K,) and covariance (K, K) of its features when measured
            as an estimated expert's were; the difference to its ``mu`` corrects the expert.
        probe: Sub-optimality of the expert, relative to |w.mu_E|, whose extreme weights are solved
            for at the end (:class:`Probing` for that which is measured), or None for no probes: one
            solve for each of the 2K bounds, in "set" mode until each bound is reached.
        stop: Further stop rules.

    Yields:
        Immutable iterations; the last one's status says why the run ended.

    Raises:
        InvalidInputError: If an argument is out of range, or no policy achieves the expert's
            features.
    """
    probing = Probing(probe) if isinstance(probe, int | float) else probe
    _check_numbers(mode, tol, bracket, max_solves, probing)
    levels = levels_of(mode, tol)
    check_expert(expert)
    bundle = Bundle.of(expert, min_weight)
    search = _Search(
        levels,
        Centres(centre_rule(centre), rng),
        ExactNewton(levels) if bundle.is_exact else EstimatedNewton(levels, measure),
        endings_of(levels, bundle.is_exact, tol, bracket),
    )
    rules = (BudgetSpent(max_solves), *stop)
    history: list[Iteration] = []
    query: Query | None = search.centres.first(bundle, levels)  # steps 1 and 2
    while query is not None:
        bundle = bundle.add(query.w, forward(query.w))  # steps 3 and 4
        outlook, decision = search.decide(bundle, query.rule)  # step 5, and step 2 of the next
        bundle = outlook.bundle  # a measured defect may have corrected the expert
        iteration = record(len(history), query, outlook, decision)
        decision = told_true(stopped(decision, rules, [*history, iteration]), outlook, tol)
        probes = Probes(outlook, decision, probing, tol)
        if decision.query is None:
            iteration = record(len(history), query, outlook, decision, probes.level)
        query = decision.query
        history.append(replace(iteration, status=decision.status if probes.is_over else Status.CUT))
        yield history[-1]
    yield from probes.run(forward, len(history))


def _check_numbers(
    mode: Mode, tol: float, bracket: float | None, max_solves: int, probing: Probing | None
) -> None:
    """Complain about arguments out of range."""
    if bracket is not None and (mode != "minimise" or not bracket > 0.0):
        raise InvalidInputError("a bracket is a positive number, for the minimise mode only")
    asked = None if probing is None else probing.level
    if not tol > 0.0 or max_solves < 1 or (asked is not None and not asked > 0.0):
        raise InvalidInputError("tol, max_solves and probe must be positive")


@dataclass(frozen=True)
class _Search:
    """The parts that decide: levels, where to ask next, and when to end."""

    levels: Levels
    centres: Centres
    newton: NewtonPhase
    endings: Endings

    def decide(self, bundle: Bundle, rule: Rule) -> tuple[Outlook, Decision]:
        """What is known after an answer to a query by ``rule``, and what to do next."""
        outlook = Outlook(bundle, self.levels, rule, self.newton.fit(bundle))
        end = ending(self.endings.regret, outlook)
        if end is None and outlook.model is not None:
            outlook = self.newton.advance(outlook)
            end = ending(self.endings.newton, outlook)
        if end is None:
            query = self.newton.query(outlook) or kelley(outlook) or self.centres.query(outlook)
            if isinstance(query, Query):
                return outlook, Decision(query, self._estimate(outlook, query), Status.CUT)
            outlook = replace(outlook, dead_end=query)
            end = ending(self.endings.dead_end, outlook)
        assert end is not None, "the last rule always ends the run"
        w = self.newton.estimate(outlook) if end.estimate is None else end.estimate
        return outlook, Decision(None, w, end.status)

    def _estimate(self, outlook: Outlook, query: Query) -> Array:
        """Before there is a model, the centre of the weights left; later its minimum."""
        if query.centre is None or outlook.model is not None or not self.levels.has_known_minimum:
            return self.newton.estimate(outlook)
        return query.centre
