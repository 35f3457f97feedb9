"""The text beside the pictures, and the properties that travel with the file."""

from __future__ import annotations

import platform
from importlib.metadata import version
from typing import Any

import numpy as np

from walking_irl.recording.experiment import Experiment
from walking_irl.types import Iteration

PACKAGES = ("walking-irl", "rerun-sdk", "mujoco", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Versions of what made the recording."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}


def summary(
    experiment: Experiment, last: Iteration | None, world: str, ending: str | None = None
) -> str:
    """Markdown: what is shown, hidden and recovered weights, how to read it.

    Args:
        experiment: The run.
        last: Its last iteration so far.
        world: What the world's view shows.
        ending: Why the run was cut short, or None.
    """
    parts = [f"# What does the {experiment.domain} walk for?" if "humanoid" in experiment.domain
             else f"# What does the expert of {experiment.domain} want?"]  # fmt: skip
    if ending is not None:
        parts.append(f"**The run was cut short: {ending}.** What was done until then is here.")
    if last is not None:
        parts += [_result(experiment, last), _table(experiment, last)]
    parts += ["## How to read it", _legend(experiment, world)]
    return "\n\n".join(parts)


def _result(experiment: Experiment, last: Iteration) -> str:
    text = f"**{last.k + 1} iterations**: {last.status.value}."
    if experiment.w_expert is not None:
        l1 = float(np.abs(last.estimate - experiment.w_expert).sum())
        text += f" Hidden weights recovered to {l1:.4f} (sum of absolute errors)."
    return text


def _table(experiment: Experiment, last: Iteration) -> str:
    hidden = experiment.w_expert
    rows = ["| objective | hidden | recovered | interval |", "|---|---|---|---|"]
    for j, name in enumerate(experiment.names):
        truth = "?" if hidden is None else f"{hidden[j]:.4f}"
        low, high = last.intervals[j]
        rows.append(f"| {name} | {truth} | {last.estimate[j]:.4f} | {low:.4f} - {high:.4f} |")
    return "\n".join(rows)


def _legend(experiment: Experiment, world: str) -> str:
    lines = [
        "Play, or drag through `frame`: all views move together.",
        f"* **Left**: {world}." if world else "",
        "* **Amber body**: all weights that still explain the expert; what the newest cut took "
        "away glows **red**. The box below magnifies it.",
        "* **Blue** query, **green** estimate"
        + (", **red** hidden truth." if experiment.w_expert is not None else "."),
        "* **Certificate**: no matter which weights are true, a mixture of the policies found "
        "loses at most this much.",
    ]
    meanings = [f"* {o.name}: {o.meaning}" for o in experiment.objectives]
    return "\n".join([text for text in lines if text] + ["", "## Objectives", ""] + meanings)


def properties(
    experiment: Experiment, last: Iteration | None, n_iterations: int, ending: str | None
) -> dict[str, Any]:
    """Values of the property ``experiment``; what is not known is left out."""
    known: dict[str, Any] = {
        "domain": experiment.domain,
        "objectives": experiment.names,
        "centre": experiment.centre,
        "mode": experiment.mode,
        "seed": experiment.seed,
        "w_expert": experiment.w_expert,
        "iterations": n_iterations,
        "ending": ending,
        "versions": [f"{name} {number}" for name, number in versions().items()],
    }
    if last is not None:
        known |= {
            "w": last.estimate,
            "intervals": last.intervals.ravel(),
            "status": last.status.name.lower(),
            "certificate": last.certificate,
        }
    return {key: value for key, value in known.items() if value is not None}
