"""A domain as somebody else would add it: a shop that stocks one good, in one file.

Demand is 0 to 4 items a day, equally likely. A policy is the stock to which the shop is filled up
every morning; its features are what the owner may care for, per day.
"""

from dataclasses import replace

import numpy as np

from walking_irl.domains.exact import ExactDomain
from walking_irl.types import Expert, Objective, Response

DEMAND = np.arange(5)
ORDERS = np.linspace(0.0, 4.0, 41)


class Shop(ExactDomain):
    name = "shop"
    objectives = (
        Objective("sales", "items", 1.0, "Sell much."),
        Objective("shelf", "items", 1.0, "Keep little in stock overnight."),
        Objective("order", "items^2", 1.0, "Order little at a time."),
    )

    def forward(self, w):
        sold = np.minimum(ORDERS[:, None], DEMAND).mean(axis=1)
        left = np.maximum(ORDERS[:, None] - DEMAND, 0.0).mean(axis=1)
        mu = np.stack([sold, -left, -(ORDERS**2) / 8], axis=1)
        best = int(np.argmax(mu @ w))
        return Response(ORDERS[best], mu[best])


class NoisyShop(Shop):
    """Whoever watches this shop does not count quite right."""

    name = "noisy-shop"

    def demonstrate(self, request, *, rng, executor=None):
        shown = super().demonstrate(request, rng=rng)
        seen = Expert(shown.expert.mu + [0.01, -0.02, 0.01], np.full(3, 0.05))
        return replace(shown, expert=seen)
