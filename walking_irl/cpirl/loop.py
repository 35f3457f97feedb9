"""Cutting-Plane Inverse Reinforcement Learning: whose weights make this behaviour optimal?

Every policy pi satisfies w_E.mu(pi) <= w_E.mu_E for the expert's own weights, so each policy found
cuts the simplex of weights: (mu_i - mu_E).w <= 0. The next query is a centre of what is left, and
near the end, where the domain has sensitivities, a Newton step on the regret
f(w) = max_pi w.mu(pi) - w.mu_E, which is convex and zero at w_E.

Source: S. Balloccu, Cutting-Plane methods for Inverse Reinforcement Learning (Politecnico di
Milano), Algorithms 2 and 3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from walking_irl.cpirl import probes
from walking_irl.cpirl.bundle import Archive
from walking_irl.cpirl.guide import Decision, Guide, Measure, Tolerances
from walking_irl.cpirl.record import snapshot
from walking_irl.cpirl.stopping import StopRule
from walking_irl.errors import InvalidInputError
from walking_irl.expert import check_expert
from walking_irl.geometry.centres import centre_rule
from walking_irl.types import MODES, Expert, Forward, Iteration, Mode, Rule, Status


def cpirl(
    forward: Forward,
    expert: Expert,
    *,
    centre: str = "ac",
    mode: Mode = "optimal",
    tol: float = 1e-6,
    tol_w: float | None = None,
    max_solves: int = 60,
    min_weight: float = 0.0,
    rng: np.random.Generator,
    measure: Measure | None = None,
    executor: Executor | None = None,
    probe: float | None = None,
    stop: Sequence[StopRule] = (),
) -> Iterator[Iteration]:
    """Recover the weights under which an expert is optimal; one iteration per forward solve.

    Args:
        forward: Solves "best policy for w"; picklable where an executor is given.
        expert: What is known of the expert. With a ``covariance`` it counts as estimated.
        centre: Key of the centre: ac, cg, mvie or cc.
        mode: "optimal" keeps weights with f <= 0; "set" those with f <= tol |w.mu_E|; "minimise"
            lowers f as far as it goes, for an expert that need not be optimal.
        tol: Regret that counts as none, relative to |w.mu_E|.
        tol_w: Newton step (L1) that counts as none; 2e-4 (exact) or 1e-3 (estimated) by default.
        max_solves: Budget of forward solves, before probes.
        min_weight: Lower bound of every weight.
        rng: Used by sampling centres, and to move a centre that repeats itself.
        measure: Maps a policy to the mean (K,) and covariance (K, K) of its features when measured
            as an estimated expert's were; the difference to its ``mu`` corrects the expert.
        executor: Solves the probes side by side.
        probe: Relative tolerance whose extreme weights are solved for at the end, or None for no
            probes: one solve for each of the 2K bounds, in "set" mode until each bound is reached.
        stop: Further stop rules.

    Yields:
        Immutable iterations; the last one's status says why the run ended.

    Raises:
        InvalidInputError: If an argument is out of range, or no policy achieves the expert's
            features.
    """
    if mode not in MODES:
        raise InvalidInputError(f"unknown mode {mode!r}; choose from {', '.join(MODES)}")
    if not tol > 0.0 or max_solves < 1 or (probe is not None and not probe > 0.0):
        raise InvalidInputError("tol, max_solves and probe must be positive")
    check_expert(expert)
    is_exact = expert.covariance is None
    archive = Archive(expert, min_weight)
    step = tol_w if tol_w is not None else (2e-4 if is_exact else 1e-3)
    tolerances = Tolerances(tol, step, 1e-7 if is_exact else 3e-3)
    guide = Guide(archive, centre_rule(centre), mode, tolerances, measure, rng)
    history: list[Iteration] = []
    decision = Decision(guide.start(), Rule.CENTRE, np.empty(0), Status.CUT)
    while decision.w is not None:
        w, rule, P = decision.w, decision.rule, guide.polyhedron()
        archive.add(w, forward(w))
        decision = guide.decide(rule)
        if decision.w is not None and len(history) + 1 >= max_solves:
            decision = decision._replace(w=None, status=Status.BUDGET)
        iteration = snapshot(guide, len(history), P, w, rule, decision, None)
        for rule_ in stop:
            status = rule_([*history, iteration])
            if status is not None and decision.w is not None:
                decision = decision._replace(w=None, status=status)
        iteration = replace(iteration, status=decision.status)
        history.append(iteration)
        if decision.w is not None:
            yield iteration
    if probe is None or not probes.may_probe(decision.status):
        yield iteration
    else:
        yield from probes.probe(forward, guide, decision, iteration, probe, executor)
