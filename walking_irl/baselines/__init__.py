"""Baseline algorithms behind CPIRL's forward signature: each yields an apprentice per solve."""

from __future__ import annotations

from walking_irl.baselines.apprentice import Apprentice
from walking_irl.baselines.kelley import kelley
from walking_irl.baselines.loop import Baseline, Setting
from walking_irl.baselines.lpal import lpal
from walking_irl.baselines.max_margin import max_margin
from walking_irl.baselines.mwal import mwal
from walking_irl.baselines.projection import projection

__all__ = [
    "BASELINES",
    "Apprentice",
    "Baseline",
    "Setting",
    "kelley",
    "lpal",
    "max_margin",
    "mwal",
    "projection",
]

BASELINES: dict[str, Baseline] = {
    "projection": projection,
    "max-margin": max_margin,
    "mwal": mwal,
    "lpal": lpal,
    "kelley": kelley,
}
"""All of them by name, for tables; a new one is one file and one line here."""
