"""The same weights elsewhere: physics of slopes and loads, speeds by the price of time."""

import mujoco
import numpy as np
import pytest

from walking_irl.domains.humanoid.body.load import SHIPPED, load_walker
from walking_irl.domains.humanoid.body.physics import inverse_dynamics
from walking_irl.domains.humanoid.body.variants import (
    HEAVIEST,
    STEEPEST,
    Surroundings,
    model_of,
    parted,
    variant,
)
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS, REFERENCE_WEIGHTS
from walking_irl.domains.humanoid.costs.time import Time
from walking_irl.domains.humanoid.gait.gait import cycle_motion
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.prediction import SPEED_ERROR, predict
from walking_irl.domains.humanoid.spec import PLANAR, WalkerSpec
from walking_irl.errors import InvalidInputError
from walking_irl.files import model_path

W = REFERENCE_WEIGHTS
FIVE_PER_CENT = Surroundings(slope=float(np.rad2deg(np.arctan(0.05))))
PACK = Surroundings(load=10.0)


@pytest.fixture(scope="module")
def level():
    return predict(PLANAR, W, Surroundings())


def power_per_metre(found):
    """Net work of all joints a metre [J/m], dampers and springs included."""
    q, v, a = cycle_motion(found.gait, found.spec.walker.mirror)
    force, _ = inverse_dynamics(found.spec.walker, q, v, a)
    n = found.spec.walker.n_root
    return float((force[:, n:] * v[:, n:]).sum(1).mean()) / found.gait.speed


@pytest.mark.parametrize("body", SHIPPED)
def test_a_pack_adds_its_mass_to_the_trunk_and_nothing_else(body):
    plain, packed = load_walker(body), load_walker(variant(body, PACK))
    mass = [float(mujoco.mj_getTotalmass(w.model)) for w in (plain, packed)]
    assert mass[1] - mass[0] == pytest.approx(10.0)
    moved = packed.model.body("torso").mass[0] - plain.model.body("torso").mass[0]
    assert moved == pytest.approx(10.0)
    assert packed.weight == plain.weight and packed.joints == plain.joints
    assert packed.sensor == plain.sensor


@pytest.mark.parametrize("degrees", [-7.0, 4.0])
def test_on_a_slope_gravity_leans_and_upright_is_against_it(degrees):
    walker = load_walker(variant("humanoid", Surroundings(slope=degrees)))
    g, slope = walker.model.opt.gravity, np.deg2rad(degrees)
    assert np.allclose(g / 9.81, [-np.sin(slope), 0, -np.cos(slope)], atol=1e-6)
    data = mujoco.MjData(walker.model)
    data.qpos[walker.joints.index("root_pitch")] = slope  # leans forwards, as it must uphill
    mujoco.mj_forward(walker.model, data)
    up = data.xmat[walker.model.body("torso").id].reshape(3, 3)[:, 2]
    assert np.allclose(up, -g / np.linalg.norm(g), atol=1e-9)
    assert np.allclose(data.sensordata[walker.sensor["trunk_axis"]], [0, 0, 1], atol=1e-9)


def test_level_and_unloaded_is_the_body_itself():
    assert variant("humanoid", Surroundings()) == "humanoid"
    assert parted(variant("humanoid", Surroundings(3, 10))) == ("humanoid", Surroundings(3, 10))
    path = model_path(SHIPPED["humanoid"])
    assert np.array_equal(model_of(path, Surroundings()).body_mass, load_walker().model.body_mass)


@pytest.mark.parametrize("slope", [STEEPEST + 1, np.nan, np.inf])
def test_slopes_have_limits(slope):
    with pytest.raises(InvalidInputError, match="slope lies within"):
        Surroundings(slope=slope)


@pytest.mark.parametrize("load", [-1.0, HEAVIEST + 1, np.nan])
def test_loads_have_limits(load):
    with pytest.raises(InvalidInputError, match="load lies between"):
        Surroundings(load=load)


@pytest.mark.parametrize("body", ["humanoid?slope", "humanoid?wind=3", "humanoid?load=much"])
def test_surroundings_that_cannot_be_read(body):
    with pytest.raises(InvalidInputError, match="slope=3&load=10"):
        load_walker(body)


def test_uphill_the_motors_lift_the_body(level):
    """Net work a metre rises by m g sin(slope): what motors, springs and dampers must deliver."""
    uphill = predict(PLANAR, W, FIVE_PER_CENT, level=level)
    lift = PLANAR.walker.weight * np.sin(np.arctan(0.05))  # N
    more = power_per_metre(uphill) - power_per_metre(level)
    # the rest is what knees and soles brake less or more
    assert more == pytest.approx(lift, rel=0.35)
    assert W @ uphill.total_costs > 1.05 * (W @ level.total_costs)
    assert solver_for(uphill.spec).dual(uphill.gait.to_vector()) is not None


@pytest.mark.slow
@pytest.mark.parametrize("around", [FIVE_PER_CENT, PACK], ids=["slope", "pack"])
def test_weights_that_are_nearly_right_predict_the_expert_elsewhere(level, around):
    """Within 1 % of its cost, from weights that are off as recovered ones are (L1 .03)."""
    w = W * [1.03, 0.97, 1.05, 0.95, 1.05, 1.02]
    w /= w.sum()
    truth = predict(PLANAR, W, around, level=level)
    guess = predict(PLANAR, w, around)
    assert W @ guess.total_costs < 1.01 * (W @ truth.total_costs)
    assert W @ guess.total_costs > 0.999 * (W @ truth.total_costs)


@pytest.mark.slow
def test_a_given_speed_is_the_best_gait_of_that_speed(level):
    """Along the speeds the slope of the cost is the price of time: a Lagrange multiplier."""
    speeds = level.gait.speed * np.array([1.03, 1.06])
    slow, fast = (predict(PLANAR, W, Surroundings(), v, level=level) for v in speeds)
    for found, v in ((slow, speeds[0]), (fast, speeds[1])):
        assert found.gait.speed == pytest.approx(v, rel=SPEED_ERROR)
        assert found.price > level.price
        assert W @ found.total_costs > W @ level.total_costs
    dearer = W @ (fast.total_costs - slow.total_costs)
    time = (1 / fast.gait.speed - 1 / slow.gait.speed) / (0.8 * Time().scale)  # of its unit
    price = (slow.price + fast.price) / 2 - level.price
    assert dearer == pytest.approx(-price * time, rel=0.05)


def test_what_cannot_be_predicted(level):
    with pytest.raises(InvalidInputError, match="positive number"):
        predict(PLANAR, W, Surroundings(), -1.0, level=level)
    elsewhere = WalkerSpec(variant(PLANAR.body, PACK))
    with pytest.raises(InvalidInputError, match="from level ground"):
        predict(elsewhere, W, PACK)
    timeless = tuple(c for c in DEFAULT_COSTS if not isinstance(c, Time))
    with pytest.raises(InvalidInputError, match="without the time"):
        predict(WalkerSpec(PLANAR.body, timeless), np.ones(5), Surroundings(), 1.0)
