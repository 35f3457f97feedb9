"""Trajectories of your own
========================

An expert is known by trajectories: arrays of states and actions. Here forty runs of a noisy
controller, as some other program may have stored them. What it minimises is recovered with error
bars, without its gains and without a simulator.
"""

# %%
# The controller pushes three carts towards zero; each objective charges one cart's distance and the
# inputs to the others. Its weights are the ground truth that we pretend not to know.

import numpy as np

from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.lqr import LQR
from walking_irl.environments.episodes import expert_from_episodes, from_arrays

domain = LQR(3, policy_noise=0.01)
w_true = np.array([0.2, 0.5, 0.3])
gains, rng = domain.gains(w_true), np.random.default_rng(0)


def run(steps=80):
    """States (81, 3) and actions (80, 3) of one run."""
    x, u = np.full((steps + 1, 3), domain.start), np.empty((steps, 3))
    for t in range(steps):
        u[t] = gains * x[t] + rng.normal(0.0, 0.1, 3)
        x[t + 1] = x[t] + u[t]
    return {"obs": x, "acts": u}


runs = [run() for _ in range(40)]

# %%
# Any of three spellings is read: ``obs``/``acts`` (the ``imitation`` package), or
# ``observations``/``actions`` (Minari), as attributes or as keys. Features are a function of a step.

Q, R = np.eye(3) * 0.8 + 0.1, 0.9 - np.eye(3) * 0.8
episodes = from_arrays(runs, lambda x, u, x_next: -(Q @ x**2 + R @ u**2))
expert = expert_from_episodes(episodes, domain.discount)
print("features  ", expert.mu.round(1))
print("known to  ", expert.error.round(1), "(95 % for all three at once)")

# %%
# The learner asks for best controllers under weights of its choice, and compares features.

for it in cpirl(domain.forward, expert, rng=rng):
    print(f"{it.rule.name.lower():7s} {it.w.round(3)} regret {it.regret:.3f}")
print("recovered", it.estimate.round(3), "truth", w_true)
assert np.abs(it.estimate - w_true).sum() < 0.05
