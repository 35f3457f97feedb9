"""What a run's recording shows at its end."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from recordings import run

from walking_irl.recording.views.registry import World
from walking_irl.run.film import Film
from walking_irl.types import Response


class Screen:
    """Keeps what it is shown last."""

    def finale(self, motion: Any) -> None:
        self.motion = motion


def test_the_finale_shows_the_best_policy_found_for_the_recovered_weights():
    _, iterations = run(3, n=3)
    w = iterations[0].w
    # the query at w itself ended in a poor minimum; another query's policy is better there
    near = replace(iterations[0], response=Response("poor", iterations[0].response.mu - 0.5))
    good = replace(iterations[1], response=Response("good", iterations[1].response.mu))
    screen: Any = Screen()
    Film(screen, World(None, lambda policy, weights: (policy, weights))).finale([near, good], w)
    policy, weights = screen.motion
    assert policy == "good"
    np.testing.assert_array_equal(weights, w)


def test_a_domain_without_a_view_ends_with_its_figures_alone():
    _, iterations = run(3, n=2)
    screen: Any = Screen()
    Film(screen, None).finale(iterations, iterations[-1].w)
    assert screen.motion is None
