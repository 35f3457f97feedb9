"""A problem of one's own: what does a shopkeeper care about, seen from the books?

    python demos/own_problem.py [--seed 0] [--years 100]

Every week the shopkeeper looks at the stock and orders anew: goods that wait cost, customers who
leave cost, and so does every delivery. The weights of the three costs are hidden. All that a
learner needs is a solver of the best policy for given weights, here exact dynamic programming, and
the books: no file of the package knows of shops.
"""

from __future__ import annotations

import argparse

import numpy as np

import walking_irl as wi

COSTS = ["holding", "shortage", "delivery"]
ROOM, WEEKS = 12, 52
DEMAND = np.array([0.10, 0.15, 0.20, 0.20, 0.15, 0.10, 0.06, 0.04])
"""Probability that 0, 1, ... 7 crates are asked for in a week."""

sizes = ROOM + 1, ROOM + 1, len(DEMAND)
stock, order, asked = np.meshgrid(*(np.arange(n) for n in sizes), indexing="ij")
left = np.minimum(stock + order, ROOM) - asked
costs = np.stack([np.maximum(left, 0) / 4, 2.0 * np.maximum(-left, 0), 1.0 * (order > 0)], axis=-1)
PHI = -np.einsum("sadk,d->sak", costs, DEMAND)
"""Features of a week, by stock and order: minus its expected costs, for larger is better."""
T = np.zeros((ROOM + 1, ROOM + 1, ROOM + 1))
"""Probability of the next week's stock, by stock and order."""
np.add.at(T, (stock, order, np.maximum(left, 0)), np.broadcast_to(DEMAND, left.shape))


def forward(w: np.ndarray) -> wi.Response:
    """The best policy for a year, by backward induction; its features per week, from no stock."""
    M, policy = np.zeros((ROOM + 1, len(COSTS))), []
    for _ in range(WEEKS):
        Q = PHI + T @ M  # features to come, by stock and order
        best = (Q @ w).argmax(axis=1)
        M = Q[np.arange(ROOM + 1), best]
        policy.insert(0, best)
    return wi.Response(np.array(policy), mu=M[0] / WEEKS)


def one_year(policy: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The books of a year: stock and order of each week, shape (52, 2)."""
    stock, books = 0, []
    for orders, asked in zip(policy, rng.choice(len(DEMAND), WEEKS, p=DEMAND), strict=True):
        books.append((stock, orders[stock]))
        stock = max(min(stock + orders[stock], ROOM) - asked, 0)
    return np.array(books)


def main() -> None:
    """Let a shopkeeper with hidden weights keep books, and find out what for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0, help="draws the shopkeeper and the demand")
    parser.add_argument("--years", type=int, default=100, help="of books")
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    w_hidden = 0.15 + 0.55 * rng.dirichlet(np.ones(len(COSTS)))
    policy = forward(w_hidden).policy
    books = [one_year(policy, rng) for _ in range(args.years)]

    expert = wi.expert_from_trajectories(books, lambda year: PHI[tuple(year.T)].mean(axis=0))
    found = wi.recover(forward, expert, objectives=COSTS)
    print(found)
    print("hidden  ", " ".join(f"{w:8.4f}" for w in w_hidden))
    weeks, (stock, order) = np.tile(np.arange(WEEKS), args.years), np.concatenate(books).T
    alike = np.mean(found.policy[weeks, stock] == order)
    print(f"the policy found orders what the shopkeeper did in {100 * alike:.0f} % of the weeks")


if __name__ == "__main__":
    main()
