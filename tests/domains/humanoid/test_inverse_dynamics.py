"""Closed-form derivatives of inverse dynamics against MuJoCo's values and finite differences."""

import copy
from functools import lru_cache
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait.gait import cycle_motion
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.optimiser.dynamics.inverse import (
    FiniteDifferences,
    InverseDynamics,
)
from walking_irl.files import model_path

VARIANTS = ("spatial", "planar", "human")
BLOCKS = ("tau_q", "tau_v", "tau_a", "s_q", "s_v", "s_a")
N = 40


def humanlike(model):
    """Cubic springs and dampers, other friction and harder ground: all that users may change."""
    model = copy.copy(model)
    rng = np.random.default_rng(1)
    joints = slice(model.nv - model.nu, None)
    model.jnt_stiffnesspoly[joints] = rng.uniform(0, [30, 2000], (model.nu, 2))
    model.dof_dampingpoly[joints] = rng.uniform(0, [0.2, 0.05], (model.nu, 2))
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    model.geom_friction[touching, 0] = 1.4
    model.geom_solimp[touching, 2] = 0.0147
    return model


@lru_cache
def gait_of(variant):
    """Model and motion of half a cycle near, not on, a shipped gait."""
    body = "humanoid-planar" if variant == "planar" else "humanoid"
    walker = load_walker(body)
    model = humanlike(walker.model) if variant == "human" else walker.model
    gait = load_library(body)["reference"].gait
    rng = np.random.default_rng(0)
    q, v, a = (x[:N] for x in cycle_motion(gait, walker.mirror))
    q = q + rng.normal(size=q.shape) * 1e-3 * (np.arange(q.shape[1]) >= walker.n_root)
    return model, q, v, a


@lru_cache
def differentiated(variant):
    model, q, v, a = gait_of(variant)
    dynamics = InverseDynamics(model)
    assert dynamics.reason is None
    return dynamics, dynamics.at(q, v, a)


@pytest.fixture(params=VARIANTS)
def variant(request):
    return request.param


def median_knot(error):
    """Largest error at the knot in the middle; single knots lie on borders of the cone."""
    return np.median(np.abs(error).reshape(len(error), -1).max(1))


@pytest.mark.parametrize("block", BLOCKS)
def test_first_derivatives_agree_with_mujocos_finite_differences(variant, block):
    model, *motion = gait_of(variant)
    exact = getattr(differentiated(variant)[1], block)
    coarse, fine = (getattr(FiniteDifferences(model, *motion, eps), block) for eps in (1e-6, 1e-7))
    scale = np.abs(fine).max()
    assert median_knot(exact - fine) < 5e-5 * scale  # the differences' own truncation
    if block.endswith("q"):  # where truncation rules, it falls with the step
        assert median_knot(exact - fine) < 0.2 * median_knot(exact - coarse)


def test_every_sensor_is_differentiated(variant):
    model, *motion = gait_of(variant)
    exact, numeric = differentiated(variant)[1], FiniteDifferences(model, *motion, 1e-7)
    for i in range(model.nsensor):
        rows = slice(model.sensor_adr[i], model.sensor_adr[i] + model.sensor_dim[i])
        for block in BLOCKS[3:]:
            e, n = getattr(exact, block)[:, rows], getattr(numeric, block)[:, rows]
            # differences of readings of size 1 carry 1e-16/1e-7, of accelerations more
            tol = 5e-5 * np.abs(n).max() + 1e-5
            assert median_knot(e - n) < tol, (model.sensor(i).name, block)


def test_directional_derivatives_agree_with_mj_inverse(variant):
    """Along the motion itself, straight from mj_inverse: no other derivative code is involved."""
    model, q, v, a = gait_of(variant)
    d = differentiated(variant)[1]
    data = mujoco.MjData(model)
    rng = np.random.default_rng(2)
    dq, dv, da = (rng.normal(size=q.shape) for _ in range(3))

    def forces(t):
        out = np.empty((N, model.nv + model.nsensordata))
        for i in range(N):
            data.qpos[:] = q[i] + t * dq[i]
            data.qvel[:], data.qacc[:] = v[i] + t * dv[i], a[i] + t * da[i]
            mujoco.mj_inverse(model, data)
            out[i] = np.concatenate([data.qfrc_inverse, data.sensordata])
        return out

    numeric = (forces(1e-7) - forces(-1e-7)) / 2e-7
    tau = np.einsum("nij,nj->ni", d.tau_q, dq) + np.einsum("nij,nj->ni", d.tau_v, dv)
    s = np.einsum("nij,nj->ni", d.s_q, dq) + np.einsum("nij,nj->ni", d.s_v, dv)
    tau += np.einsum("nij,nj->ni", d.tau_a, da)
    s += np.einsum("nij,nj->ni", d.s_a, da)
    error = np.hstack([tau, s]) - numeric
    assert median_knot(error) < 1e-6 * np.abs(numeric).max()  # central: truncation ~ eps^2


def test_the_gaits_meet_every_case_of_the_friction_cone(variant):
    cone = differentiated(variant)[1].contact.cone
    top = ~cone.is_middle & ~cone.is_bottom
    for case in (cone.is_middle, cone.is_bottom, top):
        assert case.sum() > 5


def test_derivatives_at_a_cones_border_are_those_of_either_side():
    """psi is C1: the force is continuous where two cases meet, whatever its derivative does."""
    from walking_irl.domains.humanoid.optimiser.dynamics.cone import Cone

    mu, angle = np.full(64, 0.9), np.linspace(0, 2 * np.pi, 64)
    t = np.column_stack([np.cos(angle), np.sin(angle)])
    for normal in (0.9, -1 / 0.9):  # both borders at T = 1
        sides = [Cone(np.column_stack([t, np.full(64, normal + e)]), mu) for e in (1e-9, -1e-9)]
        assert (sides[0].is_middle != sides[1].is_middle).all()
        np.testing.assert_allclose(sides[0].gradient, sides[1].gradient, atol=1e-8)


@lru_cache
def numeric_curvature(variant):
    """Central differences of all first derivatives: {input: {block: (N, out, in, nv)}}."""
    dynamics, _ = differentiated(variant)
    _, *motion = gait_of(variant)
    nv = motion[0].shape[1]
    out = {}
    for k, by in enumerate("qva"):
        e = 1e-4 if by == "a" else 1e-6
        found = {b: [] for b in BLOCKS}
        for j in range(nv):
            ends = []
            for sign in (e, -e):
                moved = [x.copy() for x in motion]
                moved[k][:, j] += sign
                ends.append(dynamics.at(*moved))
            for b in BLOCKS:
                found[b].append((getattr(ends[0], b) - getattr(ends[1], b)) / (2 * e))
        out[by] = {b: np.stack(x, -1) for b, x in found.items()}
    return out


BY = ("qq", "qv", "qa", "vv", "va", "aa")


def curvature(d, lam, sigma):
    """Second derivatives by blocks: {"qv": (N, nv, nv), ...}."""
    whole, nv = d.curvature(lam, sigma).matrix(), lam.shape[1]
    at = {name: slice(k * nv, (k + 1) * nv) for k, name in enumerate("qva")}
    return {by: whole[:, at[by[0]], at[by[1]]] for by in BY}


def multipliers(model):
    """One class of multipliers at a time: root forces, torques, and each kind of sensor."""
    rng = np.random.default_rng(3)
    nv, ns = model.nv, model.nsensordata
    root = np.arange(nv) < nv - model.nu
    yield "root", rng.normal(size=(N, nv)) * root, np.zeros((N, ns))
    yield "torque", rng.normal(size=(N, nv)) * ~root, np.zeros((N, ns))
    kinds = model.sensor_type.repeat(model.sensor_dim)
    for kind in np.unique(kinds):
        yield f"sensor type {kind}", np.zeros((N, nv)), rng.normal(size=(N, ns)) * (kinds == kind)


def test_second_derivatives_agree_with_differences_of_the_first(variant):
    model = gait_of(variant)[0]
    numeric, d = numeric_curvature(variant), differentiated(variant)[1]
    for name, lam, sigma in multipliers(model):
        exact = curvature(d, lam, sigma)
        largest = 0.0
        for field in BY:
            first, second = field
            n = np.einsum("no,noij->nij", lam, numeric[second][f"tau_{first}"])
            n += np.einsum("no,noij->nij", sigma, numeric[second][f"s_{first}"])
            scale = np.abs(n).max()
            largest = max(largest, scale)
            # rounding of first derivatives, relative to their largest entry, over 2 eps
            noise = 1e-8 * np.abs(getattr(d, f"s_{first}" if sigma.any() else f"tau_{first}")).max()
            error = median_knot(exact[field] - n)
            assert error < 1e-6 * scale + noise, (name, field, error, scale)
        # in one plane, angular velocity is linear; else every class does something
        assert largest > 1e-3 or variant == "planar", name


def test_curvature_is_linear_in_its_multipliers(variant):
    """The packed products mix nothing up between classes."""
    model, d = gait_of(variant)[0], differentiated(variant)[1]
    parts = list(multipliers(model))
    whole = d.curvature(sum(p[1] for p in parts), sum(p[2] for p in parts)).matrix()
    summed = sum(d.curvature(lam, sigma).matrix() for _, lam, sigma in parts)
    np.testing.assert_allclose(whole, summed, atol=1e-11 * np.abs(summed).max())


def with_box_foot(model):
    foot = next(i for i in range(model.ngeom) if model.geom(i).name == "foot_r")
    model.geom_conaffinity[foot] = 1


def with_other_power(model):
    model.geom_solimp[:, 4] = 3


def with_pyramids(model):
    model.opt.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL


def with_joint_limits(model):
    model.opt.disableflags = 0


def with_friction_loss(model):
    model.dof_frictionloss[10] = 1.0


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (with_box_foot, "'foot_r' can touch"),
        (with_other_power, "solimp"),
        (with_pyramids, "pyramidal"),
        (with_joint_limits, "joint limits"),
        (with_friction_loss, "friction loss"),
    ],
)
def test_models_without_closed_form_fall_back_and_say_why(spoil, reason):
    model, q, v, a = gait_of("spatial")
    model = copy.copy(model)
    spoil(model)
    dynamics = InverseDynamics(model)
    assert reason in dynamics.reason
    d = dynamics.at(q[:2], v[:2], a[:2])
    numeric = FiniteDifferences(model, q[:2], v[:2], a[:2])
    for block in BLOCKS:
        np.testing.assert_array_equal(getattr(d, block), getattr(numeric, block))
    assert d.curvature(np.zeros((2, model.nv)), np.zeros((2, model.nsensordata))) is None


BALL = """<mujoco><worldbody><body><joint type="ball"/><geom size=".1" mass="1"/></body></worldbody>
</mujoco>"""
PENDULUM = """<mujoco><worldbody><body>
<joint name="a" axis="0 1 0" stiffness="3 5 7" damping=".1 .2 .3"/><geom size=".1" pos=".3 0 0"
mass="2" contype="0" conaffinity="0"/><site name="end" pos=".4 0 .1"/>
<body pos=".5 0 0"><joint name="b" axis="0 0 1" armature=".1"/><geom size=".1" pos="0 .2 0"
mass="1" contype="0" conaffinity="0"/></body></body></worldbody>
<sensor><framepos objtype="site" objname="end"/><framexaxis objtype="site" objname="end"/></sensor>
</mujoco>"""


def test_a_ball_joint_falls_back():
    reason = InverseDynamics(mujoco.MjModel.from_xml_string(BALL)).reason
    assert "ball or free joint" in reason


def test_a_pendulum_without_contact_is_covered():
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    rng = np.random.default_rng(4)
    q, v, a = (rng.normal(size=(6, 2)) for _ in range(3))
    dynamics = InverseDynamics(model)
    assert dynamics.reason is None
    exact, numeric = dynamics.at(q, v, a), FiniteDifferences(model, q, v, a)
    for block in BLOCKS:
        np.testing.assert_allclose(getattr(exact, block), getattr(numeric, block), atol=2e-5)


def one_joint_per_body(path):
    """MJCF without geoms, sensors and motors, whose bodies have one joint each (massless between).

    Pinocchio's derivatives hold for joints with constant axes, not for several in one body.
    """
    root = ElementTree.parse(path).getroot()
    for part in ("actuator", "sensor", "asset", "visual"):
        root.remove(root.find(part))
    model = mujoco.MjModel.from_xml_path(str(path))
    for body in list(root.iter("body")):
        inner, joints = body, body.findall("joint")
        rest = [x for x in body if x.tag == "body"]
        for x in list(body):
            body.remove(x)
        for k, joint in enumerate(joints):
            if k:
                inner = ElementTree.SubElement(inner, "body", name=f"{body.get('name')}_{k}")
            inner.append(joint)
        m = model.body(body.get("name"))
        numbers = {"pos": m.ipos, "quat": m.iquat, "mass": m.mass, "diaginertia": m.inertia}
        text = {k: " ".join(map(repr, map(float, x))) for k, x in numbers.items()}
        ElementTree.SubElement(inner, "inertial", text)
        inner.extend(rest)
    for geom in root.find("worldbody").findall("geom"):
        root.find("worldbody").remove(geom)
    return ElementTree.tostring(root, encoding="unicode")


def test_pinocchio_agrees_on_the_rigid_part(tmp_path):
    """An independent oracle for the part without contact, springs and dampers."""
    pin = pytest.importorskip("pinocchio")
    model, q, v, a = gait_of("spatial")
    model = copy.copy(model)
    model.jnt_stiffness[:] = model.dof_damping[:] = 0
    model.geom_conaffinity[:] = 0  # nothing touches
    d = InverseDynamics(model).at(q, v, a)
    (tmp_path / "body.xml").write_text(one_joint_per_body(model_path("humanoid.xml")))
    other = pin.buildModelFromMJCF(str(tmp_path / "body.xml"))
    assert other.nv == model.nv  # in the same order
    other.armature = np.array(model.dof_armature)
    data = other.createData()
    for i in range(0, N, 7):
        derivatives = pin.computeRNEADerivatives(other, data, q[i], v[i], a[i])
        for mine, theirs in zip((d.tau_q, d.tau_v, d.tau_a), derivatives, strict=True):
            np.testing.assert_allclose(mine[i], theirs, atol=1e-9 * np.abs(theirs).max())
