"""walking_irl: given how a humanoid walks, find out what it walks for.

The objective weights of a walking gait are recovered by Cutting-Plane Inverse Reinforcement
Learning (CPIRL; S. Balloccu, Politecnico di Milano)::

    import walking_irl as wi

    expert = wi.expert_from_trajectories(trajectories, features)
    recovery = wi.recover(forward, expert)      # weights, intervals, status

:mod:`walking_irl.cpirl` holds the algorithm, ``wi.load("humanoid")`` the walker. Importing this
package loads nothing: each public name is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

if TYPE_CHECKING:
    from walking_irl import cpirl, geometry
    from walking_irl.cpirl.probes import Probing
    from walking_irl.cpirl.recovery import Recovery, recover
    from walking_irl.cpirl.summary import Summary, summarise
    from walking_irl.domains import load
    from walking_irl.errors import (
        EmptyPolyhedronError,
        FallError,
        FlatPolyhedronError,
        InvalidInputError,
        RecordingError,
        SolverError,
        WalkingIRLError,
    )
    from walking_irl.expert import expert_from_returns, expert_from_trajectories
    from walking_irl.geometry.polyhedron import WeightPolyhedron
    from walking_irl.types import Expert, Iteration, Mode, Objective, Response, Rule, Status

__all__ = [
    "EmptyPolyhedronError",
    "Expert",
    "FallError",
    "FlatPolyhedronError",
    "InvalidInputError",
    "Iteration",
    "Mode",
    "Objective",
    "Probing",
    "RecordingError",
    "Recovery",
    "Response",
    "Rule",
    "SolverError",
    "Status",
    "Summary",
    "WalkingIRLError",
    "WeightPolyhedron",
    "__version__",
    "cpirl",
    "expert_from_returns",
    "expert_from_trajectories",
    "geometry",
    "load",
    "recover",
    "summarise",
]

_HOMES = {
    "cpirl.probes": ("Probing",),
    "cpirl.recovery": ("Recovery", "recover"),
    "cpirl.summary": ("Summary", "summarise"),
    "domains": ("load",),
    "errors": (
        "EmptyPolyhedronError",
        "FallError",
        "FlatPolyhedronError",
        "InvalidInputError",
        "RecordingError",
        "SolverError",
        "WalkingIRLError",
    ),
    "expert": ("expert_from_returns", "expert_from_trajectories"),
    "geometry.polyhedron": ("WeightPolyhedron",),
    "types": ("Expert", "Iteration", "Mode", "Objective", "Response", "Rule", "Status"),
}
"""Module of each public name."""


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    for module, names in _HOMES.items():
        if name in names:
            value = getattr(import_module(f"walking_irl.{module}"), name)
            globals()[name] = value
            return value
    if name in __all__:
        return import_module(f"walking_irl.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
