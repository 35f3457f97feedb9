"""Costs are elementwise formulas; the machinery differentiates them once and twice."""

import pickle
from dataclasses import dataclass, replace

import mujoco
import numpy as np
import pytest

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.costs.base import Cost, H, Read, Term, read_joints, read_sensors
from walking_irl.domains.humanoid.costs.defaults import (
    DEFAULT_COSTS,
    OBJECTIVES,
    REFERENCE_WEIGHTS,
    SHARED,
)
from walking_irl.domains.humanoid.costs.effort import Effort
from walking_irl.domains.humanoid.costs.partials import POSITION_SIZE, SIZES, second_partials
from walking_irl.domains.humanoid.costs.smooth import Smoothness
from walking_irl.domains.humanoid.costs.stack import CostStack, cost_stack
from walking_irl.domains.humanoid.costs.time import Time
from walking_irl.domains.humanoid.costs.work import Work
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import InvalidInputError


def off_optimum(body, by):
    """Motion of a gait off every optimum: hinges are open here and closed there."""
    x = load_library(body)["reference"].gait.to_vector()
    x = x + by * np.random.default_rng(0).normal(size=x.size)
    return solver_for(WalkerSpec(body)).problem.evaluate(x).motion


@pytest.fixture(scope="module")
def channels():
    return off_optimum("humanoid", 1e-2)


@pytest.mark.parametrize("body", ["humanoid", "humanoid-planar"])
def test_closed_second_partials_are_those_of_complex_steps(body):
    """Oracle: differences of complex steps of the same residual, good to 1e-7 of the largest."""
    motion, stack = off_optimum(body, 1e-3), cost_stack(load_walker(body))
    for place, block in zip(stack.places, stack.second(motion), strict=True):
        if place.term.second is None:
            continue
        reads = [
            np.full((1, 1), motion.h) if r.channel == "h" else getattr(motion, r.channel)[:, c]
            for r, c in zip(place.term.reads, place.reads, strict=True)
        ]
        sizes = [np.array([SIZES[r.channel]]) for r in place.term.reads]
        if place.cost.name == "skid":
            sizes[:3] = [np.array([POSITION_SIZE])] * 3
        shape = block.shape[2:]
        numeric = second_partials(place.term.residual, reads, sizes, shape)
        scale = np.abs(numeric).max(axis=(2, 3), keepdims=True) + 1e-12
        np.testing.assert_allclose(block / scale, numeric / scale, rtol=0, atol=1e-6)


def quadratic(term, *values):
    """Sum of the squared residuals for numbers that all components share."""
    width = len(term.reads[0].columns)
    return float(np.sum(term.residual(*(np.full((1, width), v) for v in values)) ** 2))


def test_effort_of_the_ankle_is_that_of_motor_and_tendon_together():
    """A motor that only lets go of its stretched tendon rests; alone it would strain."""
    walker = load_walker()
    bare, strung = Effort().terms(walker)
    names = [walker.joints[c] for c in strung.reads[1].columns]
    assert names == ["ankle_r", "ankle_l"]
    assert len(bare.reads[0].columns) == walker.model.nu - 2
    rest = walker.model.joint("ankle_r").qpos_spring[0]
    strength = walker.strength_minus[walker.joints.index("ankle_r") - walker.n_root]
    for dorsiflexion in (5.0, 10.0):
        q = np.deg2rad(dorsiflexion)
        data = mujoco.MjData(walker.model)
        data.qpos[strung.reads[1].columns] = q
        mujoco.mj_forward(walker.model, data)
        linear = walker.model.joint("ankle_r").stiffness[0] * (q - rest)
        tendon = data.qfrc_passive[strung.reads[1].columns[0]] + linear
        assert tendon < 0
        assert quadratic(strung, -tendon, q) == pytest.approx(0, abs=1e-12)
        pushing = quadratic(strung, 0.0, q)
        assert pushing == pytest.approx(2 * (tendon / strength) ** 2, rel=0.01)


def test_positive_work_is_dearer_by_the_ratio_of_the_efficiencies():
    """Far above the smoothing, 1 % of the power is left: p0^2 / 2 p^2 = 2e-3, and its asymmetry."""
    start, _ = Work().terms(load_walker())
    up, down = quadratic(start, 100.0, 5.0), quadratic(start, 100.0, -5.0)
    assert up / down == pytest.approx(1.2 / 0.25, rel=0.01)
    assert (up + down) / 2 == pytest.approx(0.5 * 19 * 500 / 100, rel=0.01)


def test_smoothness_counts_the_rate_of_torques_by_strength():
    walker = load_walker()
    _, rate = Smoothness().terms(walker)
    i, h, step = walker.joints.index("knee_r") - walker.n_root, 0.01, 3.0
    mean = (walker.strength_plus[i] + walker.strength_minus[i]) / 2
    found = rate.residual(np.zeros(walker.model.nu), np.full(walker.model.nu, step), h)[i]
    assert found == pytest.approx(step / h / (Smoothness().rate * mean))


def test_stated_formula_of_smoothness_has_its_units():
    cost = Smoothness()
    assert f"a / ({cost.acceleration:g} rad/s^2)" in cost.formula
    assert f"dtau/dt / ({cost.rate:g} strengths/s)" in cost.formula


def test_second_partials_of_skidding_are_those_of_a_logistic_function(channels):
    stack = cost_stack(load_walker())
    k = next(k for k, p in enumerate(stack.places) if p.cost.name == "skid")
    skid, place = stack.places[k].cost, stack.places[k]
    x, x_next, z = (
        getattr(channels, r.channel)[:, r.columns] for r in place.term.reads if r.channel != "h"
    )
    contact = 1 / (1 + np.exp((z - skid.height) / skid.width))
    d1 = -contact * (1 - contact) / skid.width
    d2 = contact * (1 - contact) * (1 - 2 * contact) / skid.width**2
    h, speed = channels.h, (x_next - x) / channels.h
    zero = np.zeros_like(z)
    exact = (
        np.array(
            [
                [zero, zero, -d1 / h, contact / h**2],
                [zero, zero, d1 / h, -contact / h**2],
                [-d1 / h, d1 / h, speed * d2, -speed * d1 / h],
                [contact / h**2, -contact / h**2, -speed * d1 / h, 2 * speed * contact / h**2],
            ]
        )
        / skid.speed
    )
    found = stack.second(channels)[k]
    for p in range(4):
        for o in range(4):
            scale = np.abs(exact[p, o]).max() + 1.0
            np.testing.assert_allclose(found[p, o], exact[p, o], rtol=0, atol=1e-8 * scale)


def test_second_partials_of_linear_costs_and_of_hinges_vanish(channels):
    stack = cost_stack(load_walker())
    for place, block in zip(stack.places, stack.second(channels), strict=True):
        if place.cost.name in ("stability", "gap", "limits", "time") or place.term.is_linear:
            assert np.abs(block).max(initial=0.0) < 1e-8, place.cost.name


def test_default_stack_states_the_six_objectives():
    stack = cost_stack(load_walker())
    assert stack.objectives == OBJECTIVES
    np.testing.assert_allclose(stack.reference_weights, REFERENCE_WEIGHTS, rtol=1e-14)
    assert stack.size == sum(p.columns.stop - p.columns.start for p in stack.places)


def test_rescaling_a_cost_rescales_its_objective_alone(channels):
    walker = load_walker()
    base = cost_stack(walker).total_costs(channels)
    costs = tuple(replace(c, scale=2 * c.scale) if c.name == "work" else c for c in DEFAULT_COSTS)
    per_metre, fixed = CostStack(walker, costs).costs_of(
        CostStack(walker, costs).residuals(channels), channels.pace
    )
    ours, shared = cost_stack(walker).costs_of(
        cost_stack(walker).residuals(channels), channels.pace
    )
    np.testing.assert_allclose(per_metre, ours / [1, 2, 1, 1, 1, 1], rtol=1e-14)
    assert fixed == shared
    np.testing.assert_allclose(base, ours + shared, rtol=1e-14)


@dataclass(frozen=True)
class TrunkSway(Cost):
    """Reads one sensor, twice: its rows must not overwrite each other."""

    name: str = "sway"
    unit: str = "rad^2"
    scale: float = 0.01
    meaning: str = "Lateral tilt of the trunk, and its change."

    def terms(self, walker):
        tilt = [("trunk_axis", 1)] * 2
        reads = (read_sensors(walker, "s", tilt), read_sensors(walker, "s_next", tilt))
        return [Term(reads, lambda a, b: np.array([1.0, 0.0]) * a + np.array([0.0, 2.0]) * b)]


@dataclass(frozen=True)
class TorqueRate(Cost):
    name: str = "rate"
    unit: str = "1"
    scale: float = 1.0
    meaning: str = "Squared rate of the joint torques, and of power."

    def terms(self, walker):
        tau, after = (read_joints(walker, c) for c in ("tau", "tau_next"))
        v, q = read_joints(walker, "v"), read_joints(walker, "q")
        return [
            Term((tau, after, H), lambda t, u, h: (u - t) / h / 500),
            Term((after, v, q), lambda u, v, q: np.tanh(u * v / 100) * (1 + q)),
        ]


@pytest.mark.parametrize("own", [TrunkSway(), TorqueRate()], ids=lambda c: c.name)
def test_partials_times_a_change_are_the_change_of_the_residuals(channels, own):
    stack = CostStack(load_walker(), (Effort(), own, *SHARED))
    rng = np.random.default_rng(3)
    d = type(channels)(*(rng.normal(size=np.shape(x)) * 1e-6 for x in channels[:-2]), 1e-8, 0.0)
    partials = stack.first(channels)
    ends = [
        stack.residuals(type(channels)(*(a + s * b for a, b in zip(channels, d, strict=True))))
        for s in (1, -1)
    ]
    numeric = (ends[0] - ends[1]) / 2
    np.testing.assert_allclose(partials.times(d), numeric, atol=1e-6 * np.abs(numeric).max())
    y = rng.normal(size=numeric.shape)
    back = partials.transpose_times(y)
    dot = sum(float(np.sum(a * b)) for a, b in zip(back[:-1], d[:-1], strict=True))
    assert dot == pytest.approx(float(np.sum(y * partials.times(d))), rel=1e-9)


def test_stack_survives_pickling(channels):
    stack = cost_stack(load_walker())
    copy = pickle.loads(pickle.dumps(stack))
    np.testing.assert_array_equal(copy.residuals(channels), stack.residuals(channels))


@dataclass(frozen=True)
class Odd(Cost):
    """A cost that can be asked for nonsense."""

    name: str = "odd"
    unit: str = "1"
    scale: float = 1.0
    meaning: str = "Nonsense."
    kind: str = "abs"

    def terms(self, walker):
        tau = read_joints(walker, "tau")
        if self.kind == "abs":
            return [Term((tau,), lambda t: abs(t) + 0 * t)]
        if self.kind == "channel":
            return [Term((Read("torque", tau.columns),), lambda t: t)]
        if self.kind == "width":
            return [Term((tau, read_joints(walker, "v", ["knee_r"])), lambda t, v: t * v)]
        if self.kind == "joint":
            return [Term((read_joints(walker, "v", ["tail"]),), lambda v: v)]
        return [Term((read_sensors(walker, "s", [("tail", 0)]),), lambda s: s)]


@pytest.mark.parametrize(
    ("costs", "says"),
    [
        ((Odd(),), "residual of odd must be an elementwise, analytic function"),
        ((Odd(kind="channel"),), "odd reads 'torque'; choose from q, v"),
        ((Odd(kind="width"),), "odd reads 1 columns of v for 19 residuals"),
        ((Odd(kind="joint"),), "no joint 'tail' with v; there are"),
        ((Odd(kind="sensor"),), "no sensor 'tail'; there are"),
        ((Time(), Time()), "different names, got time, time"),
        ((Time(scale=0.0),), "scale of time must be > 0, got 0"),
        (SHARED, "at least one cost per metre"),
    ],
)
def test_bad_costs_are_named(costs, says):
    with pytest.raises(InvalidInputError, match=says):
        CostStack(load_walker(), costs)
