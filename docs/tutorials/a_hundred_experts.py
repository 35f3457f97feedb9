"""A hundred experts
=================

Are intervals right? A single recovery cannot tell. A study draws experts, recovers each as
``walking-irl recover`` would, and counts.
"""

# %%
# First with experts that are known exactly: no ground truth may lie outside.

import matplotlib.pyplot as plt
import numpy as np

from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.lqr import LQR
from walking_irl.experiments.study import Study, run_study
from walking_irl.experiments.study.files import figures
from walking_irl.expert import expert_from_returns
from walking_irl.run.setup import Setup

exact = run_study(Study(Setup(domain="lqr"), experts=20))
for name, value in figures(exact):
    print(f"{name:40s} {value}")
assert exact.weights_inside.value == 1.0

# %%
# Then a hundred that are known by twenty noisy measurements of what their policy earns. Intervals should
# hold all weights of an expert at once in 95 of a hundred cases; the count itself is uncertain by two or
# three.

domain, rng = LQR(3), np.random.default_rng(0)
error, half = [], []
for _ in range(100):
    w_E = rng.dirichlet([3.0, 3.0, 3.0])
    mu = domain.expert(w_E, rng).mu
    returns = rng.normal(mu, 0.02 * np.abs(mu), size=(20, 3))
    *_, last = cpirl(domain.forward, expert_from_returns(returns), rng=rng)
    error.append(np.abs(last.estimate - w_E))
    half.append(
        np.maximum(last.intervals[:, 1] - last.estimate, last.estimate - last.intervals[:, 0])
    )
strain = np.array(error) / np.array(half)
inside = (strain <= 1).all(axis=1)
print(f"{inside.sum()} of {len(inside)} experts lie inside with all their weights")
assert inside.sum() >= 90

# %%
# How far truths lie from the estimate, in half widths of their interval: beyond one they are outside.

fig, axis = plt.subplots(figsize=(6, 2.6), constrained_layout=True)
axis.hist(strain.ravel(), bins=np.linspace(0, 1.5, 31), color="tab:blue")
axis.axvline(1, color="tab:red")
axis.set(xlabel="error over half width", ylabel="weights")

# %%
# Walkers are studied in the same way, on all processors or on a Dask cluster::
#
#     walking-irl study --domain humanoid-planar --experts 100
