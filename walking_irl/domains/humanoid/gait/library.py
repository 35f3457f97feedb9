"""Known gaits of a body, from which searches start (see ``models/README.md``).

Gaits of the shipped bodies lie in ``models/gaits.npz``. A body of your own brings its own in a
file beside its model, ``mine_gaits.npz`` for ``mine.xml`` (arrays ``name``, ``w``, ``x`` and, of
total costs, ``folded``; ``models/make_gaits.py --body`` makes one), or starts from those of the
shipped body with the same joints.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker, lowest_points
from walking_irl.domains.humanoid.body.load import SHIPPED, body_of, load_walker
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.errors import InvalidInputError
from walking_irl.files import model_path

SHIPPED_GAITS = "gaits.npz"
PREFIX = {"humanoid": "spatial_", "humanoid-planar": "planar_"}
"""Of the arrays of the shipped bodies."""


class KnownGait(NamedTuple):
    """An optimal gait and the weights that it is optimal for, on the body that it was made for."""

    w: Array
    gait: Gait
    total_costs: Array
    """Total costs G of the six shipped costs, shape (6,)."""


def load_library(body: str | Path = "humanoid") -> dict[str, KnownGait]:
    """Known gaits of a body by name, the reference first.

    Args:
        body: See :func:`~.body.load.load_walker`. A body without gaits of its own gets those of the
            shipped body with the same joints: they are not optimal on it, nor quite physical.

    Raises:
        InvalidInputError: If there are none.
    """
    return _library(body_of(body))


def load_gaits(body: str | Path = "humanoid") -> dict[str, Gait]:
    """Known gaits by name, the reference first, without their weights."""
    return {name: known.gait for name, known in load_library(body).items()}


def own_gaits(body: str | Path) -> Path:
    """Where the gaits of an own body are looked for."""
    path = Path(body)
    return path.with_name(f"{path.stem}_gaits.npz")


@lru_cache
def _library(body: str) -> dict[str, KnownGait]:
    walker = load_walker(body)
    if body not in SHIPPED and own_gaits(body).is_file():
        return _read(own_gaits(body), "", walker.joints, walker)
    for name, prefix in PREFIX.items():
        joints = load_walker(name).joints
        if set(joints) == set(walker.joints):
            known = _read(model_path(SHIPPED_GAITS), prefix, joints, walker)
            return known if body in SHIPPED else _on_the_ground(known, load_walker(name), walker)
    raise InvalidInputError(
        f"{body} has no gaits to start from: its joints are not those of {' or '.join(SHIPPED)}; "
        f"save some as {own_gaits(body).name}"
    )


def _on_the_ground(
    known: dict[str, KnownGait], made_for: Walker, walker: Walker
) -> dict[str, KnownGait]:
    """Gaits of another body, raised or lowered until the feet are as low as its on average.

    Soles that begin a few centimetres in the ground are thrown up by a hundred body weights, from
    which no search comes back.
    """
    z, order = walker.joints.index("root_z"), [walker.joints.index(j) for j in made_for.joints]
    out = {}
    for name, (w, gait, costs) in known.items():
        low = np.mean(lowest_points(walker, gait.q))
        q = gait.q.copy()
        q[:, z] += np.mean(lowest_points(made_for, gait.q[:, order])) - low
        out[name] = KnownGait(w, Gait(q, gait.step_length, gait.half_period), costs)
    return out


def _read(path: Path, prefix: str, joints: tuple[str, ...], walker: Walker) -> dict[str, KnownGait]:
    order = [joints.index(j) for j in walker.joints]
    keys = [f"{prefix}{key}" for key in ("name", "w", "x", "folded")]
    out = {}
    with np.load(path) as data:
        missing = [key for key in keys if key not in data]
        if missing:
            raise InvalidInputError(f"{path} has no array {missing[0]}")
        for name, w, x, costs in zip(*(data[key] for key in keys), strict=True):
            gait = Gait.from_vector(x, len(joints))
            gait = Gait(gait.q[:, order], gait.step_length, gait.half_period)
            out[str(name)] = KnownGait(w, gait, costs)
    return out
