"""The shipped gaits, from which searches start (``models/gaits.npz``; see ``models/README.md``)."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.files import model_path


class ShippedGait(NamedTuple):
    """An optimal gait and the weights that it is optimal for."""

    w: Array
    gait: Gait
    folded: Array
    """Folded costs G, shape (6,)."""


@lru_cache
def load_library(planar: bool = False) -> dict[str, ShippedGait]:
    """Shipped gaits by name, the reference first."""
    body = "planar" if planar else "spatial"
    joints = 14 if planar else 25
    with np.load(model_path("gaits.npz")) as data:
        rows = zip(*(data[f"{body}_{key}"] for key in ("name", "w", "x", "folded")), strict=True)
        return {str(n): ShippedGait(w, Gait.from_vector(x, joints), g) for n, w, x, g in rows}


def load_gaits(planar: bool = False) -> dict[str, Gait]:
    """Shipped gaits by name, the reference first, without their weights."""
    return {name: s.gait for name, s in load_library(planar).items()}
