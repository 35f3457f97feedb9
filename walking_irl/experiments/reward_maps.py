"""A picture: what every method takes for the reward of one Objectworld, the truth first."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import WalkingIRLError
from walking_irl.experiments.irl_cases import CASES, Case
from walking_irl.experiments.irl_setups import LINES, answer
from walking_irl.experiments.picture import maps_chart
from walking_irl.files import write_file
from walking_irl.rl.tabular import loss

LEVELS = 24
"""Shades of a map."""
TITLE = "Objectworld, soft expert, {} trajectories of 8 steps: rewards by method"
CAPTION = (
    "blue: recovered reward, from the least to the largest of each map; grey: methods that answer "
    "with a policy alone, share of visits. Below each name the loss under the true reward"
)


class RewardMap(NamedTuple):
    """What a method found, on the grid."""

    label: str
    values: Array
    """Rewards, or visits, of the states, shape (S,)."""
    is_reward: bool
    loss: float


def reward_maps(
    n: int = 32, seed: int = 0, lines: Sequence[str] = tuple(LINES), world: str = "Objectworld"
) -> tuple[RewardMap, ...]:
    """The truth, then every method that can learn from a soft expert's demonstrations.

    Args:
        n: Number of trajectories.
        seed: Of the world, the expert and the methods.
        lines: Rows of table 3.1b.
        world: Key of the cases.
    """
    case = CASES[world](True, n, seed)
    maps = [RewardMap("truth", case.reward, True, 0.0)]
    for label in lines:
        if not LINES[label].method or LINES[label].is_complete:
            continue
        try:
            maps.append(_map(label, case, np.random.default_rng([seed, 41])))
        except WalkingIRLError:  # a map is left out; the table says why
            continue
    return tuple(maps)


def _map(label: str, case: Case, rng: np.random.Generator) -> RewardMap:
    found = answer(LINES[label], case, rng)
    lost = loss(case.mdp, case.reward, found.policy)
    if found.reward is None:
        return RewardMap(label, np.sqrt(case.mdp.visits(found.policy)), False, lost)
    return RewardMap(label, found.reward, True, lost)


def shades(values: Array, size: int) -> Array:
    """Whole numbers from 0 (least) to LEVELS - 1 (largest), shape (size, size)."""
    low, span = values.min(), np.ptp(values)
    share = (values - low) / span if span > 0 else np.zeros_like(values)
    return np.asarray(np.minimum((share * LEVELS).astype(int), LEVELS - 1).reshape(size, size))


def picture(maps: Sequence[RewardMap], n: int) -> str:
    """The maps side by side, as SVG."""
    size = round(len(maps[0].values) ** 0.5)
    tiles = [(m.label, f"{m.loss:.2f}", shades(m.values, size), m.is_reward) for m in maps]
    return maps_chart(TITLE.format(n), tiles, LEVELS, CAPTION)


def main() -> None:
    """Write the picture: ``python -m walking_irl.experiments.reward_maps FILE.svg``."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--trajectories", type=int, default=32)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    maps = reward_maps(args.trajectories, args.seed)
    write_file(args.file, picture(maps, args.trajectories).encode())


if __name__ == "__main__":
    main()
