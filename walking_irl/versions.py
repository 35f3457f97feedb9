"""Versions of this package and of those that decide its results."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version

PACKAGES = ("walking-irl", "mujoco", "dm-control", "numpy", "scipy", "cvxpy", "rerun-sdk")


def versions() -> dict[str, str]:
    """Version by name, Python's first; "not installed" for what is missing."""
    return dict(_installed())


@cache
def _installed() -> dict[str, str]:
    out = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            out[name] = version(name)
        except PackageNotFoundError:
            out[name] = "not installed"
    return out
