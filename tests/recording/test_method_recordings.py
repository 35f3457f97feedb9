"""What recover --method records: the log, the weights, the posterior, the reward and the policy."""

import numpy as np
import pytest

from walking_irl.recording import style
from walking_irl.recording.method import MOST_ENTRIES
from walking_irl.recording.panels import panels
from walking_irl.recording.reader import Recording, inspect_recording
from walking_irl.run import method_film
from walking_irl.run.by_method import recover_by, scaled
from walking_irl.run.method_film import record_report
from walking_irl.run.setup import Setup

SCALARS = "Scalars:scalars"
CASES = {
    ("gridworld", "mce-likelihood"): 20,
    ("gridworld", "lpal"): None,
    ("objectworld", "ng-russell-1"): None,
    ("objectworld", "policywalk"): 20,
    ("driving", "projection"): None,
    ("random-mdp", "mmp"): 20,
    ("lqr", "policywalk"): None,
    ("lqr", "projection"): None,
    ("lqr", "girl"): None,
}
"""Trajectories that each method sees."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A report and its recording, made once each."""
    known = {}

    def make(domain, method):
        if (domain, method) not in known:
            n = CASES[domain, method]
            seen = {} if n is None else {"n_trajectories": n, "horizon": 30}
            report = recover_by(method, Setup(domain=domain, seed=1), **seen)
            path = tmp_path_factory.mktemp("method") / "a.rrd"
            record_report(report, path)
            known[domain, method] = report, Recording(path)
        return known[domain, method]

    return make


@pytest.mark.parametrize(("domain", "method"), CASES)
def test_what_a_method_found_is_read_back(recorded, domain, method):
    report, recording = recorded(domain, method)
    found = inspect_recording(recording.path)
    assert (found["domain"], found["method"], found["ending"]) == (domain, method, None)
    assert found["status"] == report.found.status.name.lower()
    assert found["iterations"] == len(report.found.objective)
    assert found["has_blueprint"] and found["frames"] > 1
    np.testing.assert_allclose(found["w_expert"], report.problem.w_expert)
    for key, known in (
        ("w", report.weights),
        ("intervals", report.intervals),
        ("loss", report.relative_loss),
    ):
        assert (found[key] is None) == (known is None)
        if known is not None:
            np.testing.assert_allclose(found[key], known)
    for note in (f"**{method}**", report.found.status.value, *report.found.notes):
        assert note in recording.summary


@pytest.mark.parametrize(("domain", "method"), CASES)
def test_every_entry_of_the_log_has_its_frame_and_long_logs_are_thinned_evenly(
    recorded, domain, method
):
    report, recording = recorded(domain, method)
    log = report.found.objective
    if not len(log):
        return
    frames, rows = recording.column("/method/objective", SCALARS)
    entries, same = recording.column("/method/objective", SCALARS, "iteration")
    assert same == rows and len(rows) == min(len(log), MOST_ENTRIES)
    assert np.all(np.diff(frames) > 0) and entries[0] == 0 and entries[-1] == len(log) - 1
    if len(rows) > 1:
        assert np.ptp(np.diff(entries)) <= 1
    is_logarithmic = log.min() > 0 and log.max() > 100 * log.min()
    expected = np.log10(log[entries]) if is_logarithmic else log[entries]
    np.testing.assert_allclose(np.ravel(rows), expected)


@pytest.mark.parametrize(
    ("domain", "method"), [("random-mdp", "mmp"), ("lqr", "policywalk"), ("lqr", "projection")]
)
def test_the_blue_dot_goes_through_the_weights_tried_and_leaves_the_answer(
    recorded, domain, method
):
    report, recording = recorded(domain, method)
    entries, rows = recording.column(
        f"/{panels('abcde' if domain == 'random-mdp' else 'abc')[0].path}/query",
        "Points3D:positions",
        "iteration",
    )
    names = [o.name for o in report.problem.objectives]
    panel = panels(names)[0]
    tried = panel.project(scaled(report.found.iterates))
    lifted = 0.02 if panel.is_flat else 0.0
    known = [k for k in entries if np.isfinite(tried[k]).all()]
    by_entry = dict(zip(entries, rows, strict=True))
    for k in known[:-1]:
        np.testing.assert_allclose(np.ravel(by_entry[k]), tried[k] + [0, 0, lifted], atol=1e-6)
    diamond = recording.column(f"/{panel.path}/estimate", "LineStrips3D:strips").rows[-1]
    middle = np.mean(np.reshape(diamond, (-1, 3)), axis=0)
    np.testing.assert_allclose(middle, panel.project(report.weights) + [0, 0, lifted], atol=1e-6)


@pytest.mark.parametrize("domain", ["lqr", "objectworld"])
def test_samples_of_a_posterior_are_points_in_the_panels(recorded, domain):
    report, recording = recorded(domain, "policywalk")
    panel = panels([o.name for o in report.problem.objectives])[0]
    (points,) = recording.column(f"/{panel.path}/samples", "Points3D:positions").rows
    height = 0.01 if panel.is_flat else 0.0
    drawn = np.array(points) - [0, 0, height]
    samples = panel.project(report.samples)
    distance = np.abs(drawn[:, None] - samples[None, ::7]).max(axis=2).min(axis=1)
    nearest = np.abs(drawn[::50, None] - samples[None]).max(axis=2).min(axis=1)
    assert nearest.max() < 1e-6  # each point is a sample
    assert np.median(distance) < 0.05


def test_the_magnified_samples_lie_in_their_box(recorded):
    _, recording = recorded("lqr", "policywalk")
    path = "/polyhedron/all/lens"
    (points,) = recording.column(f"{path}/samples", "Points3D:positions").rows
    strips = recording.column(f"{path}/box", "LineStrips3D:strips").rows[0]
    box = np.reshape(strips[:4], (-1, 3))
    low, high = box.min(axis=0)[:2], box.max(axis=0)[:2]
    at = np.array(points)[:, :2]
    assert len(at) > 100 and np.all(at > low - 1e-3) and np.all(at < high + 1e-3)


@pytest.mark.parametrize("key", [("gridworld", "mce-likelihood"), ("objectworld", "ng-russell-1")])
def test_reward_and_policy_found_are_on_the_grid(recorded, key):
    report, recording = recorded(*key)
    size = report.problem.domain.size
    image = recording.column("/world/learner/reward/cells", "Image:buffer").rows[-1]
    cells = np.array(image).reshape(size, size, 3).astype(int)
    reward = report.found.reward.reshape(size, size)
    order = np.argsort(reward, axis=None)
    assert np.all(np.diff(cells[..., 2].ravel()[order]) <= 0)  # less blue: more amber
    assert tuple(cells[np.unravel_index(order[-1], reward.shape)]) == style.POLYHEDRON
    assert tuple(cells[np.unravel_index(order[0], reward.shape)]) == style.PAPER
    arrows = recording.column("/world/learner/reward/policy", "Arrows2D:vectors").rows[-1]
    picture = report.problem.domain.picture(report.found.policy)
    drawn = np.array(arrows).reshape(size, size, 2)[..., ::-1]
    np.testing.assert_allclose(np.sign(drawn), np.sign(picture.arrows))


def test_a_policy_without_a_reward_leaves_the_grid_of_rewards_empty(recorded):
    report, recording = recorded("gridworld", "lpal")
    assert report.found.reward is None and report.weights is None
    image = recording.column("/world/learner/reward/cells", "Image:buffer").rows[-1]
    assert np.all(np.reshape(image, (-1, 3)) == style.PAPER)
    assert "not with weights" in recording.summary


def test_objects_stand_where_the_world_has_them(recorded):
    report, recording = recorded("objectworld", "ng-russell-1")
    world = report.problem.domain
    at = np.array(recording.static("/world/learner/reward/objects/outer")["Points2D:positions"])
    rows, columns = np.divmod(world.objects.cells, world.size)
    np.testing.assert_allclose(at, np.c_[columns, rows] + 0.5)


def test_a_lottery_over_policies_is_played_one_by_one_and_ends_with_its_likeliest(recorded):
    report, recording = recorded("lqr", "projection")
    policies, mixture = report.found.policy, report.found.info["mixture"]
    entity = "/world/learner/trajectory"
    _, rows = recording.column(entity, "LineStrips2D:strips", "frame")
    assert len(rows) == len(policies) + 1
    shown = [np.array(strip[0]) for strip in rows]
    heights = [1 - s[:, 1] for s in shown]  # of the first axis over time, start 1
    for k in (0, 3, len(policies) - 1):
        states = report.problem.domain.picture(policies[k]).states[:, 0]
        got = heights[k]
        np.testing.assert_allclose(got / got[0], states / states[0], atol=1e-5)
    states = report.problem.domain.picture(policies[int(np.argmax(mixture))]).states[:, 0]
    np.testing.assert_allclose(heights[-1] / heights[-1][0], states / states[0], atol=1e-5)


def test_weights_without_a_policy_are_shown_by_their_best_one(recorded):
    report, recording = recorded("lqr", "girl")
    assert report.found.policy is None
    _, rows = recording.column("/world/learner/trajectory", "LineStrips2D:strips")
    k = report.problem.domain.forward(report.weights).policy
    states = report.problem.domain.picture(k).states[:, 0]
    got = 1 - np.array(rows[-1][0])[:, 1]
    np.testing.assert_allclose(got / got[0], states / states[0], atol=1e-5)


@pytest.mark.parametrize(
    ("trouble", "ending"), [(KeyboardInterrupt, "interrupted"), (OSError, "OSError")]
)
def test_a_recording_that_is_cut_short_is_written_and_says_so(
    recorded, monkeypatch, tmp_path, trouble, ending
):
    report, _ = recorded("lqr", "projection")
    played = []

    def motion_of(report, world):
        def entry(k):
            if len(played) == 5:
                raise trouble
            played.append(k)
            return world.motion(report.found.policy[k])

        return entry

    monkeypatch.setattr(method_film, "_entries", motion_of)
    with pytest.raises(trouble):
        record_report(report, tmp_path / "a.rrd")
    found = inspect_recording(tmp_path / "a.rrd")
    assert found["ending"] == ending
    times = Recording(tmp_path / "a.rrd").column("/method/objective", SCALARS).times
    assert len(times) == 6
