"""The walker as a task for reinforcement learning: dm_control, Gymnasium and MO-Gymnasium.

Importing this package registers, where Gymnasium is installed,

=====================================  ========================  =====================
id                                     body                      reward
=====================================  ========================  =====================
``WalkingIRL/Humanoid-v0``             3-D, 19 torques           progress - w.costs
``WalkingIRL/Humanoid-Planar-v0``      planar, 11 torques        progress - w.costs
``WalkingIRL/mo-Humanoid-v0``          3-D                       phi, six objectives
``WalkingIRL/mo-Humanoid-Planar-v0``   planar                    phi, six objectives
=====================================  ========================  =====================

``gymnasium.make("walking_irl.environments:WalkingIRL/Humanoid-v0")`` imports it by itself.
Without Gymnasium, :func:`load` makes the same tasks for dm_control.
"""

from __future__ import annotations

from importlib.util import find_spec

from walking_irl.environments.suite import BODIES, load, tasks

__all__ = ["BODIES", "IDS", "load", "tasks"]

IDS = {
    f"WalkingIRL/{prefix}Humanoid{suffix}-v0": (kind, f"humanoid{suffix.lower()}")
    for prefix, kind in (("", "WalkerEnv"), ("mo-", "MOWalkerEnv"))
    for suffix in ("", "-Planar")
}
"""Ids of Gymnasium, each with its class in :mod:`walking_irl.environments.walker` and its body."""


def _register() -> None:
    from gymnasium import register, registry

    for name, (kind, body) in IDS.items():
        if name not in registry:
            entry = f"walking_irl.environments.walker:{kind}"
            register(name, entry_point=entry, kwargs={"body": body})


if find_spec("gymnasium") is not None:
    _register()
