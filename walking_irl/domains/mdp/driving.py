"""Driving simulator of Syed & Schapire (2007, section 7), as the thesis's code has it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from walking_irl.arrays import Array
from walking_irl.domains.mdp.finite import FiniteDomain
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.types import Objective

POSITIONS = np.arange(120, 201, 5)
"""Centre of the blue car across the road [px]; it steers by one position per step."""
LANES = np.array([140, 160, 180])
"""Centre of the red car's lane [px]."""
ROWS = np.arange(10, 191, 20)
"""Height of the red car [px], from the top; it comes towards the blue one."""
ADVANCE = np.array([20, 40, 80])
"""How far the red car comes per step at each speed [px]."""
WIDTH, LENGTH = 20, 40
"""Size of a car [px]; two overlap closer than that."""
BLUE_ROW = 170
"""Height of the blue car [px]: a red one meets it at the last two rows."""
ROAD = (140, 180)
"""Positions that are on the road [px]."""
DISCOUNT = 0.9
START_FEATURES = (0.75, 0.5, 0.5)

OBJECTIVES = (
    Objective("speed", "share", 1.0, "Drive fast."),
    Objective("collision", "share", 1.0, "Keep clear of the other cars."),
    Objective("off-road", "share", 1.0, "Stay on the road."),
)


class DrivingPicture(NamedTuple):
    """A drive, one row per step after the start, to be drawn as a scene of rectangles [px]."""

    blue: Array
    """Centre (x, y) of the driven car, shape (T, 2)."""
    red: Array
    """Centre (x, y) of the other car, shape (T, 2)."""
    speed: Array
    """Speed 0, 1 or 2, shape (T,)."""
    advance: Array
    """How far the other car comes in the next step [px], shape (T,)."""
    car: Array
    """Width and length of a car, shape (2,)."""
    road: Array
    """Left and right edge of the road, shape (2,)."""
    lanes: Array
    """Centre of each lane, shape (n,)."""
    sides: Array
    """Leftmost and rightmost position of the driven car, shape (2,)."""

    @property
    def is_colliding(self) -> NDArray[np.bool_]:
        """Whether the two cars overlap, shape (T,)."""
        is_near: NDArray[np.bool_] = np.abs(self.blue - self.red) < self.car
        return np.asarray(is_near.all(axis=1))

    @property
    def is_off_road(self) -> NDArray[np.bool_]:
        """Whether the driven car is beyond an edge of the road, shape (T,)."""
        half = self.car[0] / 2
        x = self.blue[:, 0]
        return np.asarray((x - half < self.road[0]) | (x + half > self.road[1]))


class Driving(FiniteDomain):
    """1531 states: a start, then 3 speeds x 17 positions x 3 lanes x 10 rows; three actions.

    At the start the action picks the speed for good; afterwards it steers left, ahead or right.
    The red car comes closer with every step; once passed, another appears in a random lane.

    Args:
        method: Forward solver, see :class:`FiniteDomain`.
    """

    view = "driving"

    def __init__(self, method: str = "policy-iteration") -> None:
        Phi = _features()
        start = np.zeros(len(Phi))
        start[0] = 1.0
        super().__init__(
            "driving", OBJECTIVES, FiniteMDP(_transitions(), Phi, start, DISCOUNT), method
        )

    def picture(self, policy: Array | Actions, n_steps: int = 40, seed: int = 0) -> DrivingPicture:
        """A drive of ``n_steps`` under a policy, (S,) or (S, A); ``seed`` draws lanes, actions."""
        rng = np.random.default_rng(seed)
        state, states = 0, []
        for _ in range(n_steps):
            action = policy[state]
            if policy.ndim == 2:
                action = rng.choice(self.mdp.n_actions, p=action)
            row = self.mdp.T[[int(action) * self.mdp.n_states + state]]
            state = int(rng.choice(row.indices, p=row.data))
            states.append(state)
        speed, x, lane, row = _grid()[:, np.array(states) - 1]
        blue = np.stack([POSITIONS[x], np.full(n_steps, BLUE_ROW)], axis=1)
        red = np.stack([LANES[lane], ROWS[row]], axis=1)
        edges = np.array([ROAD[0] - WIDTH / 2, ROAD[1] + WIDTH / 2])
        size = np.array([WIDTH, LENGTH], dtype=float)
        return DrivingPicture(
            blue.astype(float),
            red.astype(float),
            speed.astype(float),
            ADVANCE[speed].astype(float),
            size,
            edges,
            LANES.astype(float),
            POSITIONS[[0, -1]].astype(float),
        )


def _shape() -> tuple[int, int, int, int]:
    return len(ADVANCE), len(POSITIONS), len(LANES), len(ROWS)


def _grid() -> Actions:
    """Speed, position, lane and row index of every state but the start, shape (4, 1530)."""
    return np.stack(np.unravel_index(np.arange(np.prod(_shape())), _shape())).astype(np.intp)


def _features() -> Array:
    """Speed, no collision, on the road: features (1531, 3) in [0, 1]."""
    speed, x, lane, row = _grid()
    is_beside = np.abs(POSITIONS[x] - LANES[lane]) < WIDTH
    is_level = np.abs(BLUE_ROW - ROWS[row]) < LENGTH
    is_on_road = (POSITIONS[x] >= ROAD[0]) & (POSITIONS[x] <= ROAD[1])
    collision = np.where(is_beside & is_level, 0.0, 0.5)
    Phi = np.stack([(speed / 2 + 1) / 2, collision, np.where(is_on_road, 0.5, 0.0)], axis=1)
    return np.vstack([START_FEATURES, Phi])


def _transitions() -> sparse.csr_array:
    """Sparse (3 * 1531, 1531)."""
    speed, x, lane, row = _grid()
    S, states = 1 + speed.size, 1 + np.arange(speed.size)
    target_row = row + ADVANCE[speed] // (ROWS[1] - ROWS[0])
    is_passed = target_row >= len(ROWS)
    rows, cols, values = [], [], []
    for action in range(3):
        x_next = np.clip(x + action - 1, 0, len(POSITIONS) - 1)
        for new_lane in range(len(LANES)):
            lane_next = np.where(is_passed, new_lane, lane)
            row_next = np.where(is_passed, 0, target_row)
            rows.append(action * S + states)
            cols.append(1 + np.ravel_multi_index((speed, x_next, lane_next, row_next), _shape()))
            values.append(np.full(states.size, 1 / 3))
            first = np.ravel_multi_index((action, len(POSITIONS) // 2, new_lane, 0), _shape())
            rows.append(np.array([action * S]))
            cols.append(np.array([1 + first]))
            values.append(np.array([1 / 3]))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(cols)))
    return sparse.csr_array(entries, shape=(3 * S, S))
