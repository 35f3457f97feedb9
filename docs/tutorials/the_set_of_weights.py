"""The set of weights, cut by cut
==============================

Three weights that sum to one are points of a triangle. Every answer of the forward solver cuts it
by a straight line, and the ground truth is never cut off.
"""

# %%
# An expert with ground-truth weights in a linear-quadratic problem, and the first queries by cuts
# alone (``sensitivity=None`` keeps the Newton phase out).

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.lqr import LQR

domain, rng = LQR(3), np.random.default_rng(0)
w_true = np.array([0.25, 0.6, 0.15])
expert = domain.expert(w_true, rng)
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])


def forward(w):
    """The best controller, without its sensitivities."""
    return replace(domain.forward(w), sensitivity=None)


def drawn(P, axis):
    """Fill a polygon of weights."""
    corners = P.vertices() @ CORNERS
    middle = corners.mean(axis=0)
    turn = np.arctan2(*(corners - middle).T)
    axis.add_patch(plt.Polygon(corners[np.argsort(turn)], color="tab:orange", alpha=0.5, lw=0))


# %%
# Orange: the weights that explain the expert so far. Blue: the query, a centre of that set. Red: the
# ground truth.

iterations = list(cpirl(forward, expert, max_solves=6, rng=rng))[:6]
fig, axes = plt.subplots(1, len(iterations), figsize=(12, 2.6))
for axis, it in zip(axes, iterations, strict=True):
    axis.add_patch(plt.Polygon(CORNERS, fill=False, lw=0.8))
    drawn(it.polyhedron, axis)
    axis.plot(*(it.w @ CORNERS), "o", color="tab:blue", ms=5)
    axis.plot(*(w_true @ CORNERS), "x", color="tab:red", ms=6)
    axis.set(title=f"{it.k + 1}", aspect="equal", xlim=(-0.05, 1.05), ylim=(-0.05, 0.95))
    axis.axis("off")

# %%
# The share of the triangle that is left, and how far the query is from the truth:

for it in iterations:
    share = it.polyhedron.volume() / iterations[0].polyhedron.volume()
    print(f"{it.k + 1}: {100 * share:8.4f} % left, query off by {np.abs(it.w - w_true).sum():.4f}")
    assert it.polyhedron.contains(w_true)
