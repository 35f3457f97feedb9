"""Own files give the same expert wherever they start and however they are sampled and rounded."""

import numpy as np
import pytest

from walking_irl.domains.contract import Request
from walking_irl.domains.humanoid.demonstrations import demonstrated
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.cycles import drifting_spline
from walking_irl.domains.humanoid.gait.files import load_gait
from walking_irl.domains.humanoid.gait.gait import whole_cycle
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.spec import PLANAR
from walking_irl.errors import InvalidInputError

WALKER = PLANAR.walker
KNOWN = load_library(PLANAR.body)["reference"]
GAIT = KNOWN.gait


def write(path, *, n=80, start=0.0, rounding=0.0):
    """The reference gait as a file of ``n`` frames that starts at a phase [cycles]."""
    q, L = whole_cycle(GAIT, WALKER.mirror), GAIT.step_length
    drift = np.zeros(q.shape[1])
    drift[0] = 2 * L
    at = start + np.arange(n) / n
    frames = drifting_spline(q, 1.0, drift)(at % 1.0)[0]
    frames[:, 0] += 2 * L * np.floor(at)
    if rounding:
        frames = np.round(frames / rounding) * rounding
    time = np.arange(n) * 2 * GAIT.half_period / n
    np.savez(path, time=time, **dict(zip(WALKER.joints, frames.T, strict=True)))
    return path


def test_costs_do_not_know_where_a_cycle_starts():
    """The same motion from its next knots on, and from another place: rounding error only."""
    problem = solver_for(PLANAR).problem
    q = whole_cycle(GAIT, WALKER.mirror)
    for knots in (1, 7, 20):
        moved = q[knots : knots + len(GAIT.q)].copy()
        moved[:, 0] += 3.0
        x = np.r_[moved.ravel(), GAIT.step_length, GAIT.half_period]
        here = problem.evaluate(GAIT.to_vector()).total_costs()
        np.testing.assert_allclose(problem.evaluate(x).total_costs(), here, rtol=1e-7)


@pytest.mark.parametrize("knots", [0, 1, 10, 40, 55, 79])
def test_a_file_may_start_at_any_frame(tmp_path, knots):
    expert = demonstrated(write(tmp_path / "g.npz", start=knots / 80), PLANAR).expert
    here = demonstrated(write(tmp_path / "h.npz"), PLANAR).expert
    np.testing.assert_allclose(expert.mu, here.mu, rtol=1e-9)
    np.testing.assert_allclose(
        expert.demonstration.to_vector(), here.demonstration.to_vector(), atol=1e-9
    )


@pytest.mark.slow
def test_many_frames_are_taken_as_they_are(tmp_path):
    """Splines through 1000 frames miss the gait by less than its contacts feel."""
    shown = demonstrated(write(tmp_path / "g.npz", n=1000), PLANAR)
    np.testing.assert_allclose(-shown.expert.mu, KNOWN.total_costs, rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "start", "rounding"), [(80, 0.25, 1e-4), (100, 0.61, 0.0), (60, 0.4, 0.0)]
)
def test_rounding_and_other_sampling_are_taken_out(tmp_path, n, start, rounding):
    """Untreated, inverse dynamics makes costs of such a file wrong by a factor of 4 to 10000."""
    path = write(tmp_path / "g.npz", n=n, start=start, rounding=rounding)
    problem = solver_for(PLANAR).problem
    raw = problem.evaluate(load_gait(path, WALKER).to_vector())
    assert np.abs(raw.root).max() > 1e-3
    shown = demonstrated(path, PLANAR)
    assert np.abs(problem.evaluate(shown.gait.to_vector()).root).max() < 1e-4
    np.testing.assert_allclose(-shown.expert.mu @ KNOWN.w, KNOWN.total_costs @ KNOWN.w, rtol=1e-4)
    np.testing.assert_allclose(-shown.expert.mu, KNOWN.total_costs, rtol=0.02)


@pytest.fixture(scope="module")
def recorded():
    """Three recorded rollouts of the reference gait, and what their domain makes of them."""
    domain = Humanoid("humanoid-planar")
    made = domain.demonstrate(
        Request(KNOWN.w, options={"rollouts": 3}), rng=np.random.default_rng(0)
    )
    columns = {
        k: np.array([getattr(r, k) for r in made.trajectories]) for k in ("time", "q", "v", "u")
    }
    return made, {"joints": np.array(WALKER.joints), **columns}


def test_recorded_rollouts_are_an_expert_with_error_bars(tmp_path, recorded):
    made, columns = recorded
    np.savez(tmp_path / "walking.npz", **columns)
    shown = demonstrated(tmp_path / "walking.npz", PLANAR)
    assert len(shown.rollouts) == shown.expert.n_samples == 3
    np.testing.assert_allclose(shown.expert.mu, made.expert.mu, rtol=1e-6)
    np.testing.assert_allclose(shown.expert.error, made.expert.error, rtol=1e-3)
    np.testing.assert_allclose(shown.gait.q, made.expert.demonstration.q, atol=1e-9)
    np.testing.assert_allclose(shown.rollouts[0].a[:-1], made.trajectories[0].a[:-1], atol=1e-4)


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (lambda c: {**c, "q": c["q"][:, :, :-1]}, "shape"),
        (lambda c: {**c, "joints": c["joints"][::-1]}, "another body"),
        (lambda c: {**c, "u": c["u"] * np.nan}, "finite"),
        (lambda c: {**c, "v": c["v"].astype("U9")}, "finite"),
        (lambda c: {**c, "time": c["time"][:, ::-1]}, "time steps"),
        (lambda c: {**c, "joints": np.array([{}])}, "Python objects"),
        (lambda c: {n: v if n == "joints" else v[:1] for n, v in c.items()}, "at least 2"),
        (lambda c: {n: v if n == "joints" else v[:, :90] for n, v in c.items()}, "cycles"),
        (lambda c: {n: v if n == "joints" else v[:, :20] for n, v in c.items()}, "cycles"),
    ],
)
def test_unusable_rollouts_are_refused(tmp_path, recorded, spoil, word):
    np.savez(tmp_path / "walking.npz", **spoil(recorded[1]))
    with pytest.raises(InvalidInputError, match=word) as caught:
        demonstrated(tmp_path / "walking.npz", PLANAR)
    assert "walking.npz" in str(caught.value)
