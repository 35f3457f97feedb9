"""A cost of one's own in one file: it is learnt, solved for, measured and rewarded like the six."""

import pickle
from dataclasses import dataclass

import numpy as np
import pytest

from walking_irl.domains.humanoid.closed_loop.environment import environment, start_of
from walking_irl.domains.humanoid.closed_loop.trials import Trials, measure
from walking_irl.domains.humanoid.costs.base import Cost, Term, read_joints
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.learner import WarmStartSolver, check_weights, search, solver_for
from walking_irl.domains.humanoid.optimiser.linearisation import weighted
from walking_irl.domains.humanoid.population import POPULATIONS
from walking_irl.domains.humanoid.spec import PLANAR
from walking_irl.errors import InvalidInputError

KNEES = ("knee_r", "knee_l")
MOST = np.deg2rad(50.0)


@dataclass(frozen=True)
class KneeFlexion(Cost):
    """What a drill adds: knees do not like to be bent by more than 50 degrees."""

    name: str = "knee"
    unit: str = "rad^2"
    scale: float = 0.01
    meaning: str = "Squared knee flexion beyond 50 degrees."
    formula: str = "|max(0, q - 50 deg)|^2"

    def terms(self, walker):
        def residual(q):
            return np.maximum(0, q - MOST)

        return [Term((read_joints(walker, "q", KNEES),), residual, is_linear=True)]


SEVEN = Humanoid("humanoid-planar", (*DEFAULT_COSTS, KneeFlexion()))
FOUR = Humanoid(
    "humanoid-planar", tuple(c for c in DEFAULT_COSTS if c.name not in ("smooth", "impact"))
)


def reference(domain):
    return load_gaits(domain.spec.body)["reference"]


@pytest.mark.parametrize("domain", [SEVEN, FOUR], ids=["seven", "four"])
def test_gradient_of_a_changed_stack_agrees_with_finite_differences(domain):
    solver = solver_for(domain.spec)
    k = len(domain.objectives)
    w = np.random.default_rng(0).dirichlet(np.ones(k))
    x = reference(domain).to_vector()
    x = x + 1e-3 * np.random.default_rng(1).normal(size=x.size)
    at = solver.linearise(x).at(w, 1.0)
    for seed in range(3):
        dx = np.random.default_rng(seed).normal(size=x.size)
        ends = [
            weighted(
                solver.problem.stack, solver.problem.evaluate(x + s * 1e-7 * dx), w, 1.0
            ).flat()
            for s in (1, -1)
        ]
        numeric = (ends[0] @ ends[0] - ends[1] @ ends[1]) / (4e-7)
        assert at.gradient @ dx == pytest.approx(numeric, rel=1e-4)


def test_own_cost_changes_the_best_gait_as_it_says():
    """With a weight on knee flexion the knee bends less, at the price of the others."""
    domain, start = SEVEN, reference(SEVEN)
    usual = PLANAR.stack.reference_weights
    w = np.append(0.9 * usual, 0.1)
    bent, before = [], solver_for(domain.spec).problem.evaluate(start.to_vector())
    response = search(domain.spec, w, starts=1)
    for gait in (start, response.policy):
        knee = gait.q[:, [domain.walker.joints.index(j) for j in KNEES]]
        bent.append(np.degrees(knee.max()))
    assert bent[0] > 55 and bent[1] < bent[0] - 5
    assert response.mu.shape == (7,) and response.evaluated.shape[1] == 7
    assert response.sensitivity is None or response.sensitivity.shape == (7, 7)
    assert w @ response.mu > -w @ before.total_costs()
    assert usual @ response.mu[:6] < -usual @ before.total_costs()[:6]


@pytest.mark.parametrize("domain", [SEVEN, FOUR], ids=["seven", "four"])
def test_a_changed_stack_goes_through_learner_trials_and_environment(domain):
    k, gait, walker = len(domain.objectives), reference(domain), domain.walker
    w = domain.spec.stack.reference_weights
    learner = WarmStartSolver(gait, domain.spec)
    assert learner.demonstrated.shape == (k,)
    measured = measure(domain.spec, gait, Trials(2, cycles=1, skip=0), np.random.default_rng(0))
    assert measured.total_costs.shape == (2, k) and measured.covariance.shape == (k, k)
    np.testing.assert_allclose(measured.mean, learner.demonstrated, rtol=0.1, atol=0.02)
    env = environment(
        walker,
        start_of(walker, gait),
        rng=np.random.default_rng(0),
        weights=w,
        costs=domain.spec.costs,
    )
    env.reset()
    for _ in range(3):
        step = env.step(np.zeros(walker.model.nu))
    assert env.task.phi.shape == (k,) and step.reward == pytest.approx(w @ env.task.phi)
    for draw in POPULATIONS.values():
        assert draw(np.random.default_rng(0), w).shape == (k,)
    with pytest.raises(InvalidInputError, match=rf"expected {k} weights .*got {k + 1}"):
        check_weights(np.ones(k + 1), domain.spec)


def test_own_costs_travel_to_worker_processes():
    copy = pickle.loads(pickle.dumps(SEVEN.spec))
    assert copy == SEVEN.spec and solver_for(copy) is solver_for(SEVEN.spec)


def test_own_cost_has_the_share_of_a_reference_that_does_not_know_it():
    w = SEVEN.spec.stack.reference_weights
    np.testing.assert_allclose(w[:6] / w[:6].sum(), PLANAR.stack.reference_weights, rtol=1e-12)
    assert w[6] == pytest.approx(0.1 / 1.1)
