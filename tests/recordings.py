"""A toy run and a toy body to be recorded."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from walking_irl.domains.contract import Truth
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.recording import Experiment, Recorder
from walking_irl.recording.style import PLAYBACK_RATE
from walking_irl.recording.views.gait import WalkerView
from walking_irl.recording.views.motion import periodic_rollout
from walking_irl.types import Bracket, Expert, Iteration, Objective, Response, Rollout, Rule, Status

MJCF = """
<mujoco><option timestep="0.01"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 .1"/>
    <body name="torso" pos="0 0 .6">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom name="trunk" type="capsule" size=".1 .2" group="2" mass="8"/>
      <geom name="physics" type="box" size=".1 .1 .1" group="3" mass="1" contype="0"
        conaffinity="0"/>
      <body name="leg" pos="0 0 -.3">
        <joint name="hip" type="hinge" axis="0 1 0"/>
        <geom name="shin" type="ellipsoid" size=".04 .05 .1" pos="0 0 -.1" group="2" mass="1"/>
        <geom name="foot" type="sphere" size=".05" pos="0 0 -.25" group="2" mass="1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
CYCLE = 0.8  # [s]
STRIDE = 1.0  # [m]


def walk(stride: float = STRIDE, cycle: float = CYCLE, n: int = 40) -> Rollout:
    """One cycle of a body that glides along and swings its leg by 0.3 rad."""
    phase = 2 * np.pi * np.arange(n) / n
    zero = np.zeros(n)
    q = np.c_[stride * np.arange(n) / n, zero - 0.001, 0.3 * np.sin(phase)]
    v = np.c_[zero + stride / cycle, zero, 0.3 * 2 * np.pi / cycle * np.cos(phase)]
    return periodic_rollout(q, v, np.zeros_like(q), cycle / n, stride)


def objectives(K: int) -> list[Objective]:
    """Named, with units and scales of their own."""
    return [Objective(f"part {j}", f"m^{j}", 1.0 + j, f"Meaning {j}.") for j in range(K)]


def run(K: int, n: int = 4, seed: int = 0) -> tuple[Experiment, list[Iteration]]:
    """Cutting planes on the unit sphere, where mu(w) = w / |w| is the best policy for w."""
    w_E = np.random.default_rng(seed).dirichlet(np.full(K, 3.0))
    mu_E = w_E / np.linalg.norm(w_E)
    polyhedron, iterations, best = WeightPolyhedron.simplex(K), [], (np.inf, w_E)
    for k in range(n):
        w = polyhedron.to_weights(polyhedron.chebyshev().z + 0.01 / (k + 1))
        mu = w / np.linalg.norm(w)
        regret = float(w @ (mu - mu_E))
        best = min(best, (regret, w), key=lambda pair: pair[0])
        after = polyhedron.cut(mu - mu_E)
        iterations.append(
            Iteration(
                k, polyhedron, w, Rule.CENTRE, Response(None, mu), regret, best[0], best[0] / 2,
                after.intervals(), best[1], Status.CUT if k < n - 1 else Status.BUDGET,
                bracket=Bracket(-best[0] / 2, best[0]),
            )
        )  # fmt: skip
        polyhedron = after
    expert = Expert(mu_E, np.zeros(K))
    return Experiment("toy", objectives(K), expert, seed=seed, truth=Truth(w_E, mu_E)), iterations


def record(path: Path, model: mujoco.MjModel, K: int = 6) -> list[Iteration]:
    experiment, iterations = run(K)
    with Recorder(path, experiment, WalkerView(model, walk())) as recorder:
        for it in iterations:
            recorder.iteration(it, walk(stride=0.8 + 0.1 * it.k))
        recorder.finale(walk(stride=0.9))
    return iterations


FRAMES_PER_ITERATION = round(2 * CYCLE * PLAYBACK_RATE)
FRAMES = 4 * FRAMES_PER_ITERATION + round(8 * CYCLE * PLAYBACK_RATE)
