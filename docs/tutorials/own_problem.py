"""A problem of your own
=====================

All that the method asks of a problem is a function from weights to the best policy and its
features. Here: how somebody cycles to work. Roads cost time, climbing and traffic; the best way for
given weights is a shortest path. From one way that a cyclist takes we find what it was chosen for.
"""

# %%
# The whole problem in ten lines: a town of 20 x 20 crossings, each road with three costs. Costs enter
# with a minus sign: larger features are better.

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from walking_irl.cpirl.loop import cpirl
from walking_irl.types import Expert, Response

place = np.arange(400).reshape(20, 20)
one = np.r_[place[1:].ravel(), place[:, 1:].ravel()]
other = np.r_[place[:-1].ravel(), place[:, :-1].ravel()]
costs = np.random.default_rng(1).gamma(0.7, size=(len(one), 3))


def forward(w):
    """Best way from the first crossing to the last for weights w, and its features."""
    length = csr_array((costs @ w, (one, other)), shape=(400, 400))
    before = dijkstra(length, directed=False, indices=0, return_predecessors=True)[1]
    way = [399]
    while way[-1] != 0:
        way.append(int(before[way[-1]]))
    steps = {frozenset(step) for step in zip(way[1:], way[:-1], strict=True)}
    roads = [i for i, ends in enumerate(zip(one, other, strict=True)) if frozenset(ends) in steps]
    return Response(policy=way, mu=-costs[roads].sum(axis=0))


# %%
# A cyclist with ground-truth weights. Whoever searches sees only ``expert.mu``: what the way costs.

w_true = np.array([0.2, 0.5, 0.3])
expert = Expert(mu=forward(w_true).mu, error=np.zeros(3))
print("the cyclist's way costs", -expert.mu.round(3))

# %%
# Every way that the search finds is worth no more to the cyclist than the cyclist's own, and so cuts
# the set of weights.

for it in cpirl(forward, expert, rng=np.random.default_rng(0)):
    print(f"asked {it.w.round(3)}: regret {it.regret:.4f}, certificate {it.certificate:.4f}")
print(it.status.value)

# %%
# With finitely many ways, a whole set of weights explains the same choice. What can be said of each
# weight is an interval, and the ground truth lies inside:

for name, (low, high), true in zip(
    ["time", "climbing", "traffic"], it.intervals, w_true, strict=True
):
    print(f"{name:10s} {low:.3f} .. {high:.3f}   (truth {true})")
    assert low <= true <= high
