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

from walking_irl.archive import Archive
from walking_irl.centres import centre_rule
from walking_irl.certificates import game_lp
from walking_irl.errors import InvalidInputError
from walking_irl.guide import Decision, Guide, Measure, Mode, Tolerances
from walking_irl.newton import extremes, standard_errors
from walking_irl.polyhedron import WeightPolyhedron
from walking_irl.stopping import StopRule
from walking_irl.types import Array, Expert, Forward, Iteration, Response, Rule, Status

MODES: tuple[Mode, ...] = ("optimal", "set", "minimise")
MOST_PROBES, REACHED = 15, 1.02
"""Probes of one bound in "set" mode, and the share of the level at which it counts as reached."""
INTERVAL_FLOOR = 0.002
"""Added to the standard errors of estimated weights: what secants leave of the Hessian's error."""


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
        max_solves: Budget of forward solves, before probing.
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
    _check(expert, mode, tol, max_solves, probe)
    is_exact = expert.covariance is None
    archive = Archive(expert, min_weight)
    WeightPolyhedron.simplex(archive.K, min_weight)
    step = tol_w if tol_w is not None else (2e-4 if is_exact else 1e-3)
    tolerances = Tolerances(tol, step, 1e-7 if is_exact else 3e-3)
    guide = Guide(archive, centre_rule(centre), mode, tolerances, measure, rng)
    history: list[Iteration] = []
    decision = Decision(guide.start(), Rule.CENTRE, np.empty(0), Status.CUT)
    while decision.w is not None:
        w, rule, P = decision.w, decision.rule, guide.polyhedron()
        response = forward(w)
        archive.add(w, response)
        decision = guide.decide(rule)
        if decision.w is not None and len(history) + 1 >= max_solves:
            decision = decision._replace(w=None, status=Status.BUDGET)
        iteration = _iteration(guide, len(history), P, w, rule, response, decision, None)
        for rule_ in stop:
            status = rule_([*history, iteration])
            if status is not None and decision.w is not None:
                decision = decision._replace(w=None, status=status)
        history.append(iteration)
        is_last = decision.w is None and (probe is None or not _may_probe(decision.status))
        yield replace(iteration, status=decision.status if is_last else Status.CUT)
    if probe is not None and _may_probe(decision.status):
        if mode == "set":
            yield from _probe_exactly(forward, guide, decision, len(history), probe)
        else:
            yield from _probe(forward, guide, decision, len(history), probe, executor)


def _may_probe(status: Status) -> bool:
    return status in (Status.MATCHED, Status.CONVERGED, Status.GAP_CLOSED)


def _probe(
    forward: Forward,
    guide: Guide,
    decision: Decision,
    k: int,
    probe: float,
    executor: Executor | None,
) -> Iterator[Iteration]:
    """Solve at the extremes of {f <= probe |w.mu_E|}; each is a cut that tightens the intervals."""
    archive, w = guide.archive, decision.estimate
    if guide.model is not None:
        drop = probe * float(archive.scale(w))
        queries = extremes(w, guide.model.B, drop, archive.min_weight)
    else:
        eye = np.eye(archive.K)
        P = archive.polyhedron(probe * np.abs(archive.mu))
        queries = np.array([P.support(s * e)[1] for e in eye for s in (1.0, -1.0)])
    responses = (map if executor is None else executor.map)(forward, list(queries))
    for i, (query, response) in enumerate(zip(queries, responses, strict=True)):
        P = archive.polyhedron(np.maximum(guide.lift(), probe * np.abs(archive.mu)))
        archive.add(query, response)
        status = decision.status if i == len(queries) - 1 else Status.PROBE
        now = decision._replace(status=status)
        yield _iteration(guide, k + i, P, query, Rule.PROBE, response, now, probe)


def _probe_exactly(
    forward: Forward, guide: Guide, decision: Decision, k: int, probe: float
) -> Iterator[Iteration]:
    """Cut at each end of each interval until the weights there are as good as the tolerance says.

    The intervals are then those of {f <= probe |w.mu_E|}, not only of planes around it.
    """
    archive = guide.archive
    lift = np.maximum(guide.lift(), probe * np.abs(archive.mu))
    held: Iteration | None = None
    for direction in np.vstack([np.eye(archive.K), -np.eye(archive.K)]):
        for _ in range(MOST_PROBES):
            P = archive.polyhedron(lift)
            w = P.support(direction)[1]
            if np.abs(archive.W - w).max(axis=1).min() <= 1e-9:
                break
            response = forward(w)
            archive.add(w, response)
            if held is not None:
                yield replace(held, status=Status.PROBE)
            held = _iteration(guide, k, P, w, Rule.PROBE, response, decision, probe)
            k += 1
            if held.regret <= REACHED * probe * float(archive.scale(w)):
                break
    if held is not None:
        yield held


def _iteration(
    guide: Guide,
    k: int,
    P: WeightPolyhedron,
    w: Array,
    rule: Rule,
    response: Response,
    decision: Decision,
    probe: float | None,
) -> Iteration:
    archive = guide.archive
    f = archive.regrets(archive.W)
    return Iteration(
        k=k,
        polyhedron=P,
        w=w,
        rule=rule,
        response=response,
        regret=float(f[-1]),
        best_regret=float(f.min()),
        certificate=game_lp(archive.differences()).value,
        intervals=_intervals(guide, decision, probe),
        estimate=decision.estimate,
        status=decision.status,
    )


def _intervals(guide: Guide, decision: Decision, probe: float | None) -> Array:
    """Cut-based bounds; for an estimated expert at the end t standard errors + a floor."""
    archive = guide.archive
    if guide.is_exact or guide.model is None or decision.status is Status.CUT:
        lift = guide.lift()
        if probe is not None:
            lift = np.maximum(lift, probe * np.abs(archive.mu))
        return archive.intervals(lift, decision.estimate)
    assert archive.covariance is not None
    half = archive.quantile(1) * standard_errors(guide.model.B, archive.covariance)
    w = decision.estimate
    bounds = np.c_[w - half - INTERVAL_FLOOR, w + half + INTERVAL_FLOOR]
    clipped: Array = np.clip(bounds, archive.min_weight, 1.0)
    return clipped


def _check(expert: Expert, mode: str, tol: float, max_solves: int, probe: float | None) -> None:
    if mode not in MODES:
        raise InvalidInputError(f"unknown mode {mode!r}; choose from {', '.join(MODES)}")
    mu, error = np.asarray(expert.mu), np.asarray(expert.error)
    if mu.ndim != 1 or error.shape != mu.shape or not np.isfinite(np.r_[mu, error]).all():
        raise InvalidInputError(
            f"the expert needs finite mu and error of one shape (K,), got {mu.shape}, {error.shape}"
        )
    if error.min() < 0.0 or expert.suboptimality < 0.0:
        raise InvalidInputError("the expert's error and suboptimality must not be negative")
    if expert.covariance is not None:
        _check_covariance(np.asarray(expert.covariance), error)
    if not tol > 0.0 or max_solves < 1 or (probe is not None and not probe > 0.0):
        raise InvalidInputError("tol, max_solves and probe must be positive")


def _check_covariance(C: Array, error: Array) -> None:
    K = len(error)
    if C.shape != (K, K) or not np.isfinite(C).all():
        raise InvalidInputError(f"the expert's covariance needs finite shape ({K}, {K})")
    size = max(float(np.abs(C).max()), 1e-300)
    if np.abs(C - C.T).max() > 1e-9 * size or np.linalg.eigvalsh(C)[0] < -1e-9 * size:
        raise InvalidInputError("the expert's covariance must be symmetric without negative values")
    if np.any(error < (1.0 - 1e-9) * np.sqrt(np.maximum(np.diag(C), 0.0))):
        raise InvalidInputError(
            "the expert's error bars are narrower than one standard error of its covariance; give "
            "half-widths of a confidence interval, or no covariance for an exact expert"
        )
