"""Drill: a domain of one's own is one file and one call; everything else then knows it."""

import json

import numpy as np
import pytest
from own_domain import NoisyShop, Shop

from walking_irl.cli.main import main
from walking_irl.domains import DOMAINS, Entry, load, register
from walking_irl.domains.contract import Domain
from walking_irl.errors import InvalidInputError
from walking_irl.recording.reader import Recording, inspect_recording
from walking_irl.recording.views import registry
from walking_irl.run.checkpoint import load_checkpoint
from walking_irl.run.session import run
from walking_irl.run.setup import Setup


@pytest.fixture(autouse=True)
def own():
    """Domains that are registered for the time of a test."""
    for make in (Shop, NoisyShop):
        register(make.name, Entry(make, "a shop", "looking at all 41 orders"))
    yield
    for make in (Shop, NoisyShop):
        del DOMAINS[make.name]


def promised():
    """Names of everything in the protocol."""
    return {name for name in vars(Domain) if not name.startswith("_")}


@pytest.mark.parametrize("name", [*DOMAINS, "shop"])
def test_every_domain_has_all_that_the_protocol_promises(name):
    domain = load(name)
    assert not [what for what in promised() if not hasattr(domain, what)]


def test_it_is_recovered_and_recorded_without_a_picture(tmp_path):
    setup = Setup("shop", seed=3, record=tmp_path / "a.rrd", checkpoint=tmp_path / "a.npz")
    report = run(setup)
    assert report.is_success and report.contains_expert
    assert report.relative_loss(report.recovered_mu) == pytest.approx(0.0, abs=1e-9)
    entities = Recording(setup.record).entities
    assert "/polyhedron/all/set" in entities
    assert not any(e.startswith("/world") for e in entities)
    assert inspect_recording(setup.record)["domain"] == "shop"
    answers = load_checkpoint(setup.checkpoint).answers
    assert len(answers) == len(report.iterations)


def test_the_command_line_knows_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["recover", "--domain", "shop", "--json", "a.json"]) == 0
    assert "What does the expert of shop want?" in capsys.readouterr().out
    assert json.loads((tmp_path / "a.json").read_text())["objectives"] == [
        "sales",
        "shelf",
        "order",
    ]
    assert main(["domains"]) == 0
    assert "shop" in capsys.readouterr().out


def test_a_view_of_its_own_is_shown(tmp_path, monkeypatch):
    """Here it borrows the charts of another domain, which draw states and inputs over time."""
    monkeypatch.setattr(Shop, "view", "lqr")
    monkeypatch.setattr(Shop, "picture", lambda self, order: Days(order), raising=False)
    report = run(Setup("shop", record=tmp_path / "a.rrd", max_solves=2))
    assert any(e.startswith("/world/learner") for e in Recording(tmp_path / "a.rrd").entities)
    assert report.iterations


class Days:
    """Stock of every item's shelf over a week."""

    def __init__(self, order):
        self.states = np.full((17, 3), 1.0 + order)
        self.inputs = np.full((16, 3), order)


def test_terminal_and_recording_tell_one_loss(tmp_path):
    setup = Setup("noisy-shop", seed=5, record=tmp_path / "a.rrd")
    report = run(setup)
    truth = report.problem.demonstration.truth
    assert np.abs(truth.mu - report.expert.mu).max() >= 0.01, "measured is not true here"
    drawn = np.ravel(Recording(setup.record).column("/cpirl/loss", "Scalars:scalars").rows)
    told = [report.relative_loss(it.response.mu) for it in report.iterations]
    np.testing.assert_allclose(drawn, told, atol=1e-12)


def test_a_name_that_is_taken_is_refused():
    with pytest.raises(InvalidInputError, match="already"):
        register("lqr", Entry(Shop, "", ""))


def test_what_it_does_not_have_is_one_sentence():
    with pytest.raises(InvalidInputError, match="shop has no suboptimal expert"):
        run(Setup("shop", expert="suboptimal"))
    with pytest.raises(InvalidInputError, match="shop takes no rollouts: its experts are known"):
        run(Setup("shop", options={"rollouts": 3}))
    assert registry.world_of(load("shop")) is None
