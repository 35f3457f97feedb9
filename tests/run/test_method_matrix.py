"""Every method on every domain: it runs, or one sentence says why not before anything is solved."""

import numpy as np
import pytest

from walking_irl.baselines.adapters import DEVIATION
from walking_irl.baselines.registry import FINITE, HUMANOID, LQR, METHODS, PATH, Needs, run_method
from walking_irl.domains import DOMAINS, WALKERS, load
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.domains.mdp.objectworld import Objectworld
from walking_irl.domains.path.walking_path import WalkingPath
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import demonstrate
from walking_irl.run import by_method
from walking_irl.run.by_method import recover_by
from walking_irl.run.setup import Setup
from walking_irl.types import Expert

KIND = {"lqr": LQR, "walking-path": PATH, **dict.fromkeys(WALKERS, HUMANOID)}
"""Column of table 3.1a that a domain belongs to; finite where nothing is said."""
TINY = {
    "policywalk": {"n_samples": 200},
    "gpirl": {"n_starts": 1, "max_iter": 5, "n_inducing": 20},
    "mmp-boost": {"n_rounds": 2},
    "maxent": {"max_iter": 20},
    "relative-entropy": {"n_samples": 100},
    "neu-szepesvari": {"max_solves": 4},
    "bilevel-search": {"max_solves": 8},
    "mmp": {"max_solves": 8},
    **dict.fromkeys(
        ("ng-russell-3", "projection", "max-margin", "mwal", "kelley", "cpirl"), {"max_solves": 4}
    ),
}
ARCHIVED = ("maxent", "mce-matching", "relative-entropy", "policywalk")


class Begun(Exception):
    """The expert would be solved for now."""


@pytest.mark.parametrize("domain", DOMAINS)
@pytest.mark.parametrize("name", METHODS)
def test_the_table_of_where_methods_run_is_the_truth(name, domain, monkeypatch):
    def prepare(*args):
        raise Begun

    monkeypatch.setattr(by_method, "prepare", prepare)
    if KIND.get(domain, FINITE) in METHODS[name].worlds:
        with pytest.raises(Begun):
            recover_by(name, Setup(domain=domain))
    else:
        with pytest.raises(InvalidInputError, match=f"^{name} needs .*{domain}") as told:
            recover_by(name, Setup(domain=domain))
        assert "\n" not in str(told.value) and ". " not in str(told.value)


@pytest.mark.parametrize("name", [m.name for m in METHODS.values() if FINITE in m.worlds])
@pytest.mark.parametrize("world", [Gridworld(8, 2), Objectworld(8)], ids=lambda w: w.name)
def test_methods_of_finite_worlds_run_with_a_tiny_budget(name, world):
    if METHODS[name].extra:
        pytest.importorskip("sklearn")
    rng = np.random.default_rng(0)
    expert = world.expert(np.full(4, 0.25), rng)
    seen = demonstrate(world.mdp, expert.demonstration, 5, 10, rng=rng)
    data = expert if METHODS[name].needs is Needs.POLICY else seen
    found = run_method(name, world, data, rng=rng, **TINY.get(name, {}))
    assert np.isfinite(found.mu).all()
    assert np.isfinite(found.objective).all()


@pytest.mark.parametrize("name", [m.name for m in METHODS.values() if PATH in m.worlds])
def test_methods_of_continuous_worlds_run_on_walking_paths_with_a_tiny_budget(name):
    world, rng = WalkingPath([(2.0, 1.0, 45.0)], n_intervals=6), np.random.default_rng(0)
    w_E = np.array([0.3, 0.2, 0.2, 0.1, 0.2])
    options = TINY.get(name, {})
    if name in ARCHIVED:
        M = np.array([world.forward(w).mu for w in np.vstack([np.eye(5) * 0.5 + 0.1, w_E])])
        options = {"archive": M, **({"n_samples": 200} if name == "policywalk" else {})}
    found = run_method(name, world, world.expert(w_E, rng), rng=rng, **options)
    assert np.isfinite(found.w).all() and found.w.min() >= -1e-12
    assert found.w.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("name", ["girl", "ng-russell-2", "neu-szepesvari"])
def test_methods_run_on_the_planar_walker_with_a_tiny_budget(name):
    world, rng = load("humanoid-planar"), np.random.default_rng(0)
    known = load_library("humanoid-planar")["typical 0"]
    expert = Expert(-known.total_costs, np.zeros(6), demonstration=known.gait)
    options = {"max_solves": 2} if name == "neu-szepesvari" else {}
    found = run_method(name, world, expert, rng=rng, **options)
    assert found.w.shape == (6,) and found.w.sum() == pytest.approx(1.0)
    if name == "girl":  # a shipped gait is optimal to about 1e-5 of its cost
        assert np.abs(found.w - known.w).sum() <= 1e-3
    if name == "ng-russell-2":  # the error is of the order of the deviations' size
        nearer = run_method(name, world, expert, rng=np.random.default_rng(0), size=DEVIATION / 4)
        error, less = (np.abs(f.w - known.w).sum() for f in (found, nearer))
        assert error <= np.abs(np.full(6, 1 / 6) - known.w).sum() / 3, "it knows more than nothing"
        assert less <= error / 2, "a quarter, but for terms of second order"
