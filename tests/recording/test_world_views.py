"""Recordings of the small domains: their worlds are there, move, and show what they should."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from walking_irl.arrays import Array
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains import DOMAINS, load
from walking_irl.recording import Experiment, Recorder, style
from walking_irl.recording.reader import Recording, inspect_recording
from walking_irl.recording.style import PLAYBACK_RATE
from walking_irl.recording.views.driving import FRAMES_PER_STEP, LAST_STEPS, Road
from walking_irl.recording.views.lqr import FRAMES_PER_STEP as LQR_FRAMES
from walking_irl.recording.views.path import LAST_LONGEST, LAST_PACE, PACE
from walking_irl.recording.views.registry import VIEWS, World, world_of
from walking_irl.run.problem import Problem, prepare
from walking_irl.run.setup import Setup
from walking_irl.types import Iteration

MOST_FRAMES, MOST_BYTES = 130, 250_000
"""Of one iteration; a default run has up to 38."""
N_GOALS, N_CELLS = 4, 16
TOYS = ["gridworld", "objectworld", "lqr", "walking-path", "driving"]
MOVING = {
    "lqr": ("/world/{}/now", "Points2D:positions"),
    "walking-path": ("/world/{}/people", "Ellipsoids3D:centers"),
    "driving": ("/world/{}/car/body", "Boxes3D:centers"),
}
"""What has a row in every frame."""
ENTITIES = {
    "gridworld": ["names", *(f"{who}/{what}" for who in ("learner", "expert") for what in (
                             "reward/cells", "visits/cells", "reward/policy", "reward/regions"))],
    "objectworld": ["names", *(f"{who}/{what}" for who in ("learner", "expert") for what in (
                               "reward/cells", "visits/cells", "reward/policy",
                               "reward/objects/inner", "reward/objects/outer"))],
    "lqr": ["names", "frame", "ticks", *(f"{who}/{what}" for who in ("learner", "expert")
                                for what in ("now", "trajectory"))],
    "walking-path": ["goals", "goals/names", *(f"{who}/{what}" for who in ("learner", "expert")
                                               for what in ("people", "path", "heading"))],
    "driving": [f"{who}/{what}" for who in ("learner", "expert")
                for what in ("road", "marks", "car/body", "others/body", "name")],
}  # fmt: skip


@dataclass
class Shown:
    """A short run of a domain and its recording."""

    name: str
    problem: Problem
    world: World
    iterations: list[Iteration]
    recording: Recording

    @property
    def starts(self) -> list[int]:
        """First frame of every iteration; the last one is played twice."""
        column = self.recording.column("/cpirl/regret", "Scalars:scalars")
        return [int(t) for t in column.times]

    def picture(self, policy: Any) -> Any:
        return self.problem.domain.picture(policy)

    def rows(self, who: str) -> tuple[Array, list[Array]]:
        entity, component = MOVING[self.name]
        column = self.recording.column(entity.format(who), component)
        return column.times, [np.array(row) for row in column.rows]


@pytest.fixture(scope="module", params=TOYS)
def shown(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Shown:
    return record(request.param, tmp_path_factory.mktemp(request.param) / "a.rrd")


def record(name: str, path: Path) -> Shown:
    problem = prepare(Setup(domain=name, record=path))
    rng = np.random.default_rng(0)
    expert, truth = problem.expert, problem.demonstration.truth
    assert truth is not None
    iterations = list(cpirl(problem.learner.forward, expert, max_solves=3, rng=rng))
    experiment = Experiment(name, problem.objectives, expert, seed=0, truth=truth)
    world = world_of(problem.domain, problem.demonstration)
    assert world is not None
    with Recorder(path, experiment, world.view) as recorder:
        for it in iterations:
            recorder.iteration(it, world.motion(it.response.policy, it.w))
        recorder.finale(world.motion(expert.demonstration, truth.w))
    return Shown(name, problem, world, iterations, Recording(path))


def only(*names: str) -> pytest.MarkDecorator:
    """For tests of some domains."""
    return pytest.mark.parametrize("shown", names, indirect=True, scope="module")


def test_every_view_is_that_of_a_domain_and_every_domain_names_one_that_exists() -> None:
    assert {load(name).view for name in DOMAINS} - {None} == set(VIEWS)


def test_the_world_is_in_the_recording(shown: Shown) -> None:
    entities = set(shown.recording.entities)
    assert {f"/world/{path}" for path in ENTITIES[shown.name]} <= entities
    assert shown.recording.has_blueprint
    curves = shown.world.view.curves()
    assert curves and set(curves) <= entities
    assert shown.world.view.describe() in shown.recording.summary


def test_what_is_known_of_the_run_is_read_back(shown: Shown) -> None:
    found = inspect_recording(shown.recording.path)
    assert (found["domain"], found["iterations"]) == (shown.name, len(shown.iterations))
    np.testing.assert_allclose(found["w_expert"], shown.problem.w_expert)
    scales = np.array([o.scale for o in shown.problem.domain.objectives])
    physical = shown.iterations[-1].intervals / scales[:, None]
    np.testing.assert_allclose(found["physical_intervals"], physical)
    assert ("per raw unit" in shown.recording.summary) == bool(np.any(scales != 1.0))


def test_iterations_are_short_and_small(shown: Shown) -> None:
    assert len(shown.iterations) > 1
    assert max(np.diff(shown.starts)) <= MOST_FRAMES
    size = shown.recording.path.stat().st_size
    assert size < MOST_BYTES * (len(shown.iterations) + 2)


@only(*MOVING)
def test_worlds_that_move_have_a_row_in_every_frame(shown: Shown) -> None:
    frames = inspect_recording(shown.recording.path)["frames"]
    for who in ("learner", "expert"):
        times, rows = shown.rows(who)
        np.testing.assert_array_equal(times, np.arange(frames))
        first = np.array(rows[: shown.starts[1]])
        assert np.ptp(first, axis=0).max() > 0.1


def test_an_unknown_expert_is_left_out(shown: Shown, tmp_path: Path) -> None:
    world = world_of(shown.problem.domain)
    assert world is not None
    view, motion = world
    experiment = Experiment(shown.name, shown.problem.objectives, shown.problem.expert)
    with Recorder(tmp_path / "a.rrd", experiment, view) as recorder:
        for it in shown.iterations[:1]:
            recorder.iteration(it, motion(it.response.policy, it.w))
    entities = Recording(tmp_path / "a.rrd").entities
    assert any(e.startswith("/world/learner") for e in entities)
    assert not any(e.startswith("/world/expert") for e in entities)
    assert "expert" not in view.describe()


@only("gridworld", "objectworld")
def test_grid_shows_rewards_visits_and_actions(shown: Shown) -> None:
    Phi = shown.problem.domain.mdp.Phi
    most = (Phi @ shown.problem.w_expert).max()
    for it, image, arrows in zip(
        shown.iterations,
        shown.recording.column("/world/learner/reward/cells", "Image:buffer").rows,
        shown.recording.column("/world/learner/reward/policy", "Arrows2D:vectors").rows,
        strict=False,  # the finale has a row more
    ):
        picture = shown.picture(it.response.policy)
        cells = np.array(image).reshape(N_CELLS, N_CELLS, 3).astype(int)
        amount = (Phi @ it.w).reshape(N_CELLS, N_CELLS)
        assert np.all(cells[amount == 0.0] == style.PAPER)
        below = amount < most  # beyond, the colour is full
        order = np.argsort(amount[below])
        assert np.all(np.diff(cells[below][order, 2]) <= 0)  # less blue: more amber
        drawn = np.array(arrows).reshape(N_CELLS, N_CELLS, 2)
        np.testing.assert_allclose(np.sign(drawn[..., ::-1]), picture.arrows)
    expert = shown.picture(shown.problem.expert.demonstration)
    (seen,) = shown.recording.static("/world/expert/visits/cells")["Image:buffer"]
    red = np.array(seen).reshape(N_CELLS, N_CELLS, 3).astype(int)
    assert np.unravel_index(red[..., 1].argmin(), red.shape[:2]) == np.unravel_index(
        expert.visits.argmax(), expert.visits.shape
    )


@only("objectworld")
def test_objects_lie_in_their_cells(shown: Shown) -> None:
    found = shown.problem.domain.objects
    (at,) = [shown.recording.static("/world/learner/reward/objects/inner")["Points2D:positions"]]
    rows, columns = np.divmod(found.cells, N_CELLS)
    np.testing.assert_array_equal(np.floor(np.array(at).reshape(-1, 2)), np.c_[columns, rows])


@only("gridworld", "objectworld")
def test_grid_tells_where_learner_and_expert_differ(shown: Shown) -> None:
    agreement = np.ravel(shown.recording.column("/curves/agreement", "Scalars:scalars").rows)
    pi = shown.problem.expert.demonstration
    expected = [100 * np.mean(it.response.policy == pi) for it in shown.iterations]
    np.testing.assert_allclose(agreement, [*expected, 100.0])
    assert agreement[0] < 100.0
    colours = shown.recording.column("/world/learner/reward/policy", "Arrows2D:colors").rows
    is_blue = [np.array(row) >> 8 == int.from_bytes(bytes(style.LEARNER), "big") for row in colours]
    np.testing.assert_allclose([100 * (1 - row.mean()) for row in is_blue], agreement)


@only("lqr")
def test_lqr_charts_follow_the_closed_loop(shown: Shown) -> None:
    it = shown.iterations[1]  # in the first one all axes are alike
    states = shown.picture(it.response.policy).states
    _, rows = shown.rows("learner")
    corner = np.array(shown.recording.static("/world/frame")["LineStrips2D:strips"])[:, 0]
    for t in (0, 3, 16):
        now = rows[shown.starts[1] + t * LQR_FRAMES] - corner
        x = states[t] / states[0]
        np.testing.assert_allclose(now[:3, 0], t / 16, atol=1e-6)
        np.testing.assert_allclose(1 - now[:3, 1], x, atol=1e-6)
        np.testing.assert_allclose(now[3:, 0], x, atol=1e-6)
        np.testing.assert_allclose(1 - now[3:, 1], np.roll(x, -1), atol=1e-6)
    curve = np.array(shown.recording.column("/curves/axis\\ 1", "Scalars:scalars").rows)
    assert curve[0].tolist() == [10.0, 10.0] and curve[-1, 0] == pytest.approx(curve[-1, 1])


@only("walking-path")
def test_people_walk_from_the_start_to_their_goals(shown: Shown) -> None:
    goals = shown.problem.domain.goals
    turn = shown.recording.column("/world/learner/people", "Ellipsoids3D:quaternions").rows
    _, rows = shown.rows("learner")
    end = shown.starts[1] - 1
    for row, quaternion, poses in ((0, turn[0], np.zeros((4, 3))), (end, turn[end], goals)):
        assert rows[row].shape == (2 * N_GOALS, 3)
        for body in (rows[row][:N_GOALS], rows[row][N_GOALS:]):  # shoulders, heads
            np.testing.assert_allclose(body[:, :2], poses[:, :2], atol=1e-5)
        z, w = np.array(quaternion)[:N_GOALS, 2:].T
        apart = 2 * np.arctan2(z, w) - poses[:, 2]
        np.testing.assert_allclose(np.cos(apart), 1.0, atol=1e-6)
    finale = inspect_recording(shown.recording.path)["frames"] - shown.starts[-1]
    time = shown.picture(shown.problem.expert.demonstration).time
    longest = max(float(t[-1]) for t in time) * PLAYBACK_RATE
    assert finale > min(longest / LAST_PACE, LAST_LONGEST) > 2 * longest / PACE


@only(*MOVING)
def test_the_expert_of_the_finale_walks_with_the_learner(shown: Shown) -> None:
    (_, learner), (_, expert) = shown.rows("learner"), shown.rows("expert")
    apart = [np.ptp(a - b, axis=0)[0] for a, b in zip(learner, expert, strict=True)]
    shift = learner[-1] - expert[-1]
    assert np.abs(shift - shift[0]).max() < 1e-5 and apart[-1] < 1e-5
    if shown.name != "driving":  # its first query drives like the expert at first
        assert np.abs(learner[shown.starts[1] // 2] - expert[shown.starts[1] // 2]).max() > 0.01


@only("driving")
def test_cars_are_where_the_drive_puts_them(shown: Shown) -> None:
    picture = shown.picture(shown.iterations[0].response.policy)
    _, rows = shown.rows("learner")
    road = Road(picture, rows[0][0, 0] - 0.1 * (picture.blue[0, 0] - 160.0))
    for step in (0, 5, 9):
        x = rows[step * FRAMES_PER_STEP][0, 0]
        assert x == pytest.approx(road.x + 0.1 * (picture.blue[step, 0] - 160.0), abs=1e-5)
    others = shown.recording.column("/world/learner/others/body", "Boxes3D:centers").rows
    assert {len(row) for row in others} <= {0, 1, 2}
    for step in (1, 4):
        ahead = 0.1 * (170.0 - picture.red[step, 1])
        assert any(
            np.allclose(centre[:2], [road.x + 0.1 * (picture.red[step, 0] - 160.0), ahead])
            for centre in others[step * FRAMES_PER_STEP]
        )


@only("driving")
def test_colliding_cars_change_colour(shown: Shown) -> None:
    picture = shown.picture(shown.problem.expert.demonstration)
    rows = shown.recording.column("/world/expert/car/body", "Boxes3D:colors").rows
    colours = np.ravel(rows[-LAST_STEPS * FRAMES_PER_STEP :])
    is_orange = colours >> 8 == int.from_bytes(bytes(style.FORCE), "big")
    assert picture.is_colliding[:LAST_STEPS].any()
    np.testing.assert_array_equal(is_orange[::FRAMES_PER_STEP], picture.is_colliding[:LAST_STEPS])


def test_a_domain_without_a_view_has_no_world() -> None:
    assert world_of(replace(Plain(), view=None)) is None and world_of(Plain()) is None


@dataclass(frozen=True)
class Plain:
    view: str | None = "nobody registered this"
