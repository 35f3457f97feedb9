"""Normative curves over the gait cycle, from ``models/norms`` (sources and licences there)."""

from __future__ import annotations

import csv
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.files import model_path

PHASES = np.arange(101.0)
"""% of the gait cycle at which curves are compared."""
SETS = ("adults", "children")
GRAVITY = 9.81  # [m/s^2]


class NormCurve(NamedTuple):
    """Mean and standard deviation of a variable at PHASES, shape (101,) each."""

    mean: Array
    sd: Array

    def share(self, curve: Array) -> float:
        """Share of the cycle within one standard deviation.

        >>> NormCurve(np.zeros(101), np.ones(101)).share(np.linspace(0, 2, 101)).__round__(2)
        0.5
        """
        return float(np.mean(np.abs(curve - self.mean) <= self.sd))


class NormSet(NamedTuple):
    """Curves of one population at one speed."""

    name: str
    speed_range: tuple[float, float] | None
    """Dimensionless speeds v / sqrt(g l) that it was measured at, or None: self-selected."""
    curves: dict[str, NormCurve]


def norm_set(name: str, speed: float, leg: float) -> NormSet:
    """The curves of a population, at a speed where the population's are known by speed.

    Args:
        name: One of SETS.
        speed: Of the gait [m/s].
        leg: Length of its legs [m].

    Raises:
        InvalidInputError: If there is no such population.
    """
    if name not in SETS:
        raise InvalidInputError(f"unknown norm {name!r}; choose from {', '.join(SETS)}")
    by_speed = _read(name)
    froude = speed / float(np.sqrt(GRAVITY * leg))
    for bounds, curves in by_speed.items():
        if bounds is None or bounds[0] <= froude < bounds[1]:
            return NormSet(name, bounds, curves)
    raise InvalidInputError(f"a walk's speed is a number >= 0, got {speed}")


@lru_cache
def _read(name: str) -> dict[tuple[float, float] | None, dict[str, NormCurve]]:
    """Curves by range of speed and variable."""
    table: dict[tuple[float, float] | None, dict[str, list[tuple[float, ...]]]] = {}
    with model_path(f"norms/{name}.csv").open(newline="") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            low, high = row["speed_from"], row["speed_to"]
            bounds = (float(low), float(high or "inf")) if low else None
            point = tuple(float(row[k]) for k in ("percent", "mean", "sd"))
            table.setdefault(bounds, {}).setdefault(row["variable"], []).append(point)
    return {
        bounds: {variable: _curve(np.array(points)) for variable, points in curves.items()}
        for bounds, curves in table.items()
    }


def _curve(points: Array) -> NormCurve:
    percent, mean, sd = points.T
    return NormCurve(np.interp(PHASES, percent, mean), np.interp(PHASES, percent, sd))
