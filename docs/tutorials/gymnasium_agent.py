"""An agent of reinforcement learning
==================================

Somebody trained an agent in a Gymnasium environment. What was it trained for? Its episodes are
enough: they are collected, their features averaged, and the weights of its reward recovered.
"""

# %%
# The world is a small grid with four patches, each an objective; a move is obeyed in 7 of 10 cases.
# Any environment will do whose ``info["phi"]`` holds the features of a step, or whose reward is a
# vector, as in MO-Gymnasium.

import numpy as np

from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.environments.episodes import collect, expert_from_episodes
from walking_irl.environments.finite import FiniteEnv

domain = Gridworld(size=8, cells=2)
w_true = np.array([0.45, 0.05, 0.1, 0.4])
env = FiniteEnv(domain.mdp, w_true, horizon=60)
discount = domain.mdp.discount

# %%
# The agent learns by tabular Q-learning from the scalar reward alone. Anything with Stable-Baselines3's
# ``predict`` could stand here, or any function from observation to action.

rng = np.random.default_rng(0)
Q, visits = np.zeros((64, 4)), np.zeros((64, 4))
for i in range(1500):
    s, _ = env.reset(seed=0 if i == 0 else None)
    is_over = False
    while not is_over:
        a = int(rng.integers(4)) if rng.random() < 0.3 else int(Q[s].argmax())
        s_next, reward, _, is_over, _ = env.step(a)
        visits[s, a] += 1
        target = reward + discount * Q[s_next].max()
        Q[s, a] += (target - Q[s, a]) / visits[s, a] ** 0.7
        s = s_next

# %%
# From here on its reward is unknown. We watch two thousand episodes. They are cut by the clock, so the
# missing tail of each discounted sum is made up for.

episodes = collect(env, lambda s: int(Q[s].argmax()), episodes=2000, seed=1)
expert = expert_from_episodes(episodes, discount)
print("features", expert.mu.round(2), "+-", expert.error.round(2))

# %%
# A trained agent is seldom exactly optimal. Mode "minimise" does not ask it to be: it looks for the
# weights under which least is lost.

for it in cpirl(domain.forward, expert, mode="minimise", rng=rng):
    print(f"asked {it.w.round(2)}: regret {it.regret:7.4f}, best so far {it.best_regret:7.4f}")
print(it.status.value)

# %%
# In a finite world weights are never known exactly: each of many optimal policies stays optimal for a
# whole set of them. What matters is inside the intervals, and whoever acts for the recovered weights
# does as well:

for (low, high), estimate, true in zip(it.intervals, it.estimate, w_true, strict=True):
    print(f"{estimate:.2f} in {low:.2f} .. {high:.2f}   (truth {true})")
    assert low <= true <= high
best = w_true @ domain.forward(w_true).mu
share = w_true @ domain.forward(it.estimate).mu / best
print(f"a policy for the recovered weights earns {100 * share:.1f} % of the best return")
assert share > 0.95
