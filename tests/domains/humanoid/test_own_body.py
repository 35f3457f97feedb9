"""A body of one's own: an MJCF file with the shipped names, and no gaits."""

import pickle
from pathlib import Path

import mujoco
import numpy as np
import pytest

from walking_irl.domains.humanoid.body.anatomy import lowest_points
from walking_irl.domains.humanoid.body.load import body_of, load_walker
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.library import load_gaits, load_library, own_gaits
from walking_irl.domains.humanoid.learner import known_gaits, search, solver_for
from walking_irl.domains.humanoid.spec import PLANAR, WalkerSpec
from walking_irl.errors import InvalidInputError
from walking_irl.files import model_path

SCALE, HEAVIER = 1.05, 1.3


def write(path: Path, change=None, text=lambda xml: xml) -> Path:
    """The planar body, changed as a model and as text."""
    spec = mujoco.MjSpec.from_string(model_path("humanoid_planar.xml").read_text())
    if change is not None:
        change(spec)
    spec.compile()
    path.write_text(text(spec.to_xml()))
    return path


def longer_and_heavier(spec):
    """Legs 5 % longer, trunk 30 % heavier."""
    for side in "rl":
        for body in ("shank", "foot"):
            part = spec.body(f"{body}_{side}")
            part.pos = part.pos * SCALE
    for geom in spec.body("torso").geoms:
        geom.mass *= HEAVIER


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    return write(tmp_path_factory.mktemp("body") / "mine.xml", longer_and_heavier)


def test_own_body_is_what_its_file_says(own):
    walker, shipped = load_walker(own), load_walker("humanoid-planar")
    assert walker.name == "mine" and walker.joints == shipped.joints
    assert walker.mass > shipped.mass + 5
    np.testing.assert_array_equal(walker.mirror, shipped.mirror)
    assert load_walker(own) is walker
    spec = WalkerSpec(str(own))
    assert pickle.loads(pickle.dumps(spec)) == spec and hash(spec) == hash(WalkerSpec(str(own)))


def test_own_body_finds_its_gait_from_the_shipped_ones(own):
    """The shipped gait is not physical on it; the one found is, and not on the shipped body."""
    domain = Humanoid(own)
    w = domain.spec.stack.reference_weights
    start = solver_for(domain.spec).problem.evaluate(load_gaits(own)["reference"].to_vector())
    assert np.abs(start.root).max() > 0.05
    response = search(domain.spec, w, starts=1)
    found = solver_for(domain.spec).problem.evaluate(domain.pack(response.policy))
    assert np.abs(found.root).max() < 5e-4  # of body weight, as for the shipped gaits
    assert response.info["decrement"] < 1e-5
    shipped = solver_for(PLANAR).problem.evaluate(domain.pack(response.policy))
    assert np.abs(shipped.root).max() > 0.05, "the gait must be this body's, not the shipped one's"


def test_known_gaits_of_an_own_body_carry_its_own_costs(own):
    spec = WalkerSpec(str(own))
    known, library = known_gaits(spec), load_library(own)
    assert len(known) == len(library)
    made_for = load_library("humanoid-planar").values()
    for start, gait, shipped in zip(known, library.values(), made_for, strict=True):
        np.testing.assert_array_equal(start.x, gait.gait.to_vector())
        low = lowest_points(spec.walker, gait.gait.q).mean()
        assert low == pytest.approx(lowest_points(PLANAR.walker, shipped.gait.q).mean(), abs=1e-9)
        assert start.total_costs.min() > gait.total_costs.max(), "it pays for its root's forces"


def test_gaits_beside_the_model_are_its_own(tmp_path):
    own = write(tmp_path / "other.xml")
    shipped = load_library("humanoid-planar")["work x3"]
    np.savez(
        own_gaits(own),
        name=["only"],
        w=[shipped.w],
        x=[shipped.gait.to_vector()],
        folded=[shipped.total_costs],
    )
    library = load_library(own)
    assert list(library) == ["only"]
    np.testing.assert_array_equal(library["only"].gait.q, shipped.gait.q)


def test_a_copy_of_the_shipped_body_costs_the_same(tmp_path):
    """Writing and reading the model rounds its numbers to six digits."""
    copy = WalkerSpec(str(write(tmp_path / "copy.xml")))
    x = load_gaits("humanoid-planar")["reference"].to_vector()
    ours, shipped = (solver_for(s).problem.evaluate(x).objective_costs for s in (copy, PLANAR))
    np.testing.assert_allclose(ours, shipped, rtol=1e-3)


def remove(kind, name):
    def change(spec):
        spec.delete(next(x for x in getattr(spec, kind) if x.name == name))

    return change


@pytest.mark.parametrize(
    ("change", "text", "says"),
    [
        (remove("sensors", "com"), str, "names of a shipped body; it has no sensor com"),
        (remove("actuators", "knee_r"), str, "needs one motor of gear 1, in the joints' order"),
        (None, lambda s: s.replace('"root_z"', '"up"'), "it has no joint root_z"),
        (None, lambda s: s.replace('"elbow_r"', '"arm_r"'), "it has no joint arm_l"),
        (None, lambda s: "<mujoco><body/>", "is not a readable MJCF file"),
    ],
)
def test_a_body_that_cannot_walk_here_is_named(tmp_path, change, text, says):
    own = write(tmp_path / "bad.xml", change, text)
    with pytest.raises(InvalidInputError, match=says):
        load_walker(own)


def test_an_unknown_body_is_named():
    with pytest.raises(InvalidInputError, match="no body 'dog'; choose from humanoid, humanoid-p"):
        body_of("dog")


def test_a_body_with_other_joints_needs_gaits_of_its_own(tmp_path):
    own = write(tmp_path / "armless.xml", text=lambda s: s.replace('"elbow_', '"forearm_'))
    with pytest.raises(InvalidInputError, match="no gaits to start from.*armless_gaits.npz"):
        load_library(own)
