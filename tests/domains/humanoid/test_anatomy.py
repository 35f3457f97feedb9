"""The body is what its comments say, and its mirror image moves as it does."""

import pickle

import mujoco
import numpy as np
import pytest

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.body.load import load_walker

DYNAMIC = ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos")
LOOK = ("geom_size", "geom_pos", "geom_quat", "geom_rgba", "geom_group", "geom_type")


@pytest.fixture(params=["humanoid", "humanoid-planar"])
def walker(request: pytest.FixtureRequest) -> Walker:
    return load_walker(request.param)


def random_states(walker: Walker, rng: np.random.Generator, n: int = 40):
    """States (q, v, a), most of them with ground contact."""
    nv = len(walker.joints)
    for _ in range(n):
        q = 0.3 * rng.normal(size=nv)
        q[walker.joints.index("root_z")] = -0.03 + 0.03 * rng.normal()
        yield q, rng.normal(size=nv), 10 * rng.normal(size=nv)


def inverse(walker: Walker, data, q, v, a):
    data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
    mujoco.mj_inverse(walker.model, data)
    return data.qfrc_inverse.copy(), data.sensordata.copy()


def test_mirrored_motion_needs_mirrored_forces_and_reads_mirrored_sensors(walker):
    data = mujoco.MjData(walker.model)
    mirror, contacts = walker.mirror, 0
    for q, v, a in random_states(walker, np.random.default_rng(0)):
        force, sensors = inverse(walker, data, q, v, a)
        contacts += data.ncon
        force_m, sensors_m = inverse(walker, data, mirror @ q, mirror @ v, mirror @ a)
        scale = np.abs(force).max()
        np.testing.assert_allclose(force_m, mirror @ force, atol=1e-9 * scale)
        np.testing.assert_allclose(
            sensors_m, walker.sensor_mirror @ sensors, atol=1e-9 * (1 + np.abs(sensors).max())
        )
    assert contacts > 40, "the states must touch the ground, else the soles are not tested"


def test_mirror_is_its_own_inverse_and_swaps_the_sides(walker):
    identity = np.eye(len(walker.joints))
    np.testing.assert_array_equal(walker.mirror @ walker.mirror, identity)
    np.testing.assert_array_equal(
        walker.sensor_mirror @ walker.sensor_mirror, np.eye(walker.model.nsensordata)
    )
    right, left = walker.joints.index("knee_r"), walker.joints.index("knee_l")
    assert walker.mirror[left, right] == 1


def test_position_sensors_advance_with_the_walker_and_no_others(walker):
    data = mujoco.MjData(walker.model)
    q, v, a = next(random_states(walker, np.random.default_rng(1)))
    before = inverse(walker, data, q, v, a)[1]
    q[0] += 0.7
    after = inverse(walker, data, q, v, a)[1]
    np.testing.assert_allclose(after - before, 0.7 * walker.sensor_advance, atol=1e-8)


def test_body_has_the_sizes_of_its_sources(walker):
    """Winter (2009), 1.75 m and 72 kg: masses within rounding to 0.1 kg a segment."""
    model, height, mass = walker.model, 1.75, 72.0
    assert walker.mass == pytest.approx(mass, abs=0.5)
    shares = {"pelvis": 0.142, "thigh_r": 0.1, "shank_l": 0.0465, "foot_r": 0.0145}
    for body, share in shares.items():
        assert model.body(body).mass[0] == pytest.approx(share * mass, abs=0.1)
    lengths = {"shank_r": 0.245, "foot_r": 0.246, "forearm_l": 0.186}
    for body, share in lengths.items():
        assert -model.body(body).pos[2] == pytest.approx(share * height, abs=2e-3)


def test_strengths_are_near_the_sources_and_order_is_the_joints(walker):
    actuators = [walker.model.actuator(i).name for i in range(walker.model.nu)]
    assert tuple(actuators) == walker.joints[walker.n_root :]
    source = {"hip_flexion_r": (180, 230), "knee_l": (120, 230), "ankle_r": (50, 250)}
    for joint, (plus, minus) in source.items():
        i = actuators.index(joint)
        assert abs(np.log(walker.strength_plus[i] / plus)) < np.log(1.6)
        assert abs(np.log(walker.strength_minus[i] / minus)) < np.log(1.6)


def test_tendon_leaves_round_strengths():
    """The ankle's control range is its strength and what letting go of the tendon takes."""
    spatial = load_walker()
    i = spatial.joints.index("ankle_r") - spatial.n_root
    assert spatial.strength_plus[i] == pytest.approx(68, rel=1e-6)
    assert spatial.strength_minus[i] == pytest.approx(250, rel=1e-6)


def test_strengths_of_both_sides_are_equal(walker):
    strengths = np.array([walker.strength_plus, walker.strength_minus])
    swapped = np.abs(walker.torque_mirror) @ strengths.T
    np.testing.assert_array_equal(swapped, strengths.T)
    for joint in ("lumbar_bend", "lumbar_rotation"):
        if joint in walker.joints:
            i = walker.joints.index(joint) - walker.n_root
            assert walker.strength_plus[i] == walker.strength_minus[i]


def _geoms_but_shoes(model):
    """Name and row of each geom; a shoe is drawn around the contact of its own body."""
    feet = [model.body(f"foot_{side}").id for side in "rl"]
    is_shoe = (model.geom_group == 2) & np.isin(model.geom_bodyid, feet)
    return [(model.geom(i).name, i) for i in np.flatnonzero(~is_shoe)]


def test_planar_body_has_the_segments_of_the_spatial_one():
    spatial, planar = load_walker().model, load_walker("humanoid-planar").model
    for field in DYNAMIC:
        np.testing.assert_array_equal(getattr(spatial, field), getattr(planar, field), field)
    kept = [_geoms_but_shoes(m) for m in (spatial, planar)]
    assert [n for n, _ in kept[0]] == [n for n, _ in kept[1]]
    rows = [np.array([i for _, i in k]) for k in kept]
    is_seen = [m.geom_group[r] == 2 for m, r in zip((spatial, planar), rows, strict=True)]
    for field in LOOK:
        a, b = (getattr(m, field)[r] for m, r in zip((spatial, planar), rows, strict=True))
        np.testing.assert_array_equal(a[is_seen[0]], b[is_seen[1]], field)
    for field in ("disableflags", "cone", "tolerance", "iterations", "integrator"):
        assert getattr(spatial.opt, field) == getattr(planar.opt, field)
    for field in ("geom_solref", "geom_friction", "geom_margin"):
        a, b = (getattr(m, field)[r] for m, r in zip((spatial, planar), rows, strict=True))
        np.testing.assert_array_equal(a, b, field)
    assert set(load_walker("humanoid-planar").joints) < set(load_walker().joints)
    for joint in load_walker("humanoid-planar").joints:
        a, b = spatial.joint(joint), planar.joint(joint)
        np.testing.assert_array_equal(np.r_[a.axis, a.range], np.r_[b.axis, b.range])
        assert a.armature == b.armature


def test_visible_body_has_no_mass_and_no_contact(walker):
    model = walker.model
    look = np.flatnonzero(model.geom_group == 2)
    assert len(look) > 40
    assert not model.geom_contype[look].any() and not model.geom_conaffinity[look].any()
    spec = mujoco.MjSpec.from_string(_xml(walker))
    for geom in list(spec.geoms):
        if geom.group == 2:
            spec.delete(geom)
    naked = spec.compile()
    np.testing.assert_array_equal(naked.body_mass, model.body_mass)
    np.testing.assert_array_equal(naked.body_inertia, model.body_inertia)


def test_visible_body_is_symmetric_but_for_colour(walker):
    model = walker.model
    for i in np.flatnonzero(model.geom_group == 2):
        right = model.geom(i)
        if right.name.endswith("_r"):
            left = model.geom(right.name[:-2] + "_l")
            np.testing.assert_allclose(left.pos, right.pos * [1, -1, 1], atol=1e-12)
            np.testing.assert_array_equal(left.size, right.size)


def test_walker_survives_pickling(walker):
    copy = pickle.loads(pickle.dumps(walker))
    q, v, a = next(random_states(walker, np.random.default_rng(2)))
    force, sensors = inverse(walker, mujoco.MjData(walker.model), q, v, a)
    force2, sensors2 = inverse(copy, mujoco.MjData(copy.model), q, v, a)
    np.testing.assert_array_equal(np.r_[force, sensors], np.r_[force2, sensors2])


def _xml(walker: Walker) -> str:
    from walking_irl.files import model_path

    return model_path(f"{walker.name}.xml").read_text()
