"""What a method other than a run of CPIRL found, as a recording shows and tells it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.recording.experiment import Experiment
from walking_irl.recording.panels import panels
from walking_irl.versions import versions

MOST_ENTRIES = 300
"""Entries of a log that are played; longer ones are thinned evenly."""


@dataclass(frozen=True)
class Found:
    """A method's answer; all weights are scaled to sum |w| = 1.

    Attributes:
        method: Name of the method.
        source: Where it is from.
        guarantee: What holds of its answer, in one clause.
        seen: What it saw of the expert, in a few words.
        ending: Why it ended, in one sentence.
        status: The same as one word.
        w: Weights, shape (K,), or None where it answers with a policy or a reward of states.
        is_signed: Whether weights may be negative.
        intervals: Intervals of the weights, shape (K, 2), or None.
        samples: Weights drawn from a posterior, shape (m, K), or None.
        objective: The method's objective after each iteration, shape (n,).
        iterates: Weights that each of these is of, shape (n, K), or None.
        loss: (J_E - J) / |J_E| of its policy under the ground-truth weights, or None.
        notes: Sentences that a reader of the answer should know.
    """

    method: str
    source: str
    guarantee: str
    seen: str
    ending: str
    status: str
    w: Array | None = None
    is_signed: bool = False
    intervals: Array | None = None
    samples: Array | None = None
    objective: Array | None = None
    iterates: Array | None = None
    loss: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def log(self) -> Array:
        """Entries of the objective, shape (n,)."""
        return np.empty(0) if self.objective is None else self.objective

    @property
    def shown(self) -> Array:
        """Indices of the entries that are played; one where there is no log."""
        n = max(len(self.log), 1)
        return np.unique(np.linspace(0, n - 1, min(n, MOST_ENTRIES)).round().astype(int))

    @property
    def is_logarithmic(self) -> bool:
        """Whether the objective is plotted as a power of ten: positive, over many of them."""
        log = self.log
        return bool(log.size and log.min() > 0 and log.max() > 100 * log.min())


def summary(experiment: Experiment, found: Found, world: str, ending: str | None) -> str:
    """Markdown: what was found, by what, how sure it is, and how to read the pictures."""
    question = experiment.question or f"What does the expert of {experiment.domain} want?"
    parts = [f"# {question}"]
    if ending is not None:
        parts.append(f"**The recording was cut short: {ending}.**")
    parts += [_result(experiment, found)]
    if found.w is not None:
        parts += [_table(experiment, found)]
    parts += ["\n".join(f"* {note}" for note in found.notes)] if found.notes else []
    parts += ["## How to read it", _legend(experiment, found, world)]
    parts += ["## Objectives", "\n".join(f"* {o.name}: {o.meaning}" for o in experiment.objectives)]
    return "\n\n".join(parts)


def _result(experiment: Experiment, found: Found) -> str:
    text = f"By **{found.method}** ({found.source}), which saw {found.seen}: {found.ending}."
    text += f" What holds of its answer: {found.guarantee}."
    if found.w is None:
        text += " It answers with a policy or a reward for each state, not with weights."
    elif experiment.w_expert is not None:
        l1 = float(np.abs(found.w - experiment.w_expert).sum())
        text += f" Ground-truth weights are {l1:.4f} away (sum of absolute differences)."
    if found.loss is not None:
        text += f" Its policy loses {100 * found.loss:.4f} % under ground truth."
    return text


def _table(experiment: Experiment, found: Found) -> str:
    assert found.w is not None
    columns = [("ground truth", experiment.w_expert), ("recovered", found.w)]
    shown = [(name, values) for name, values in columns if values is not None]
    head = ["objective", *(name for name, _ in shown)]
    head += ["interval"] if found.intervals is not None else []
    rows = [head, ["---"] * len(head)]
    for j, objective in enumerate(experiment.objectives):
        cells = [objective.name, *(f"{values[j]:.4f}" for _, values in shown)]
        if found.intervals is not None:
            cells.append("{:.4f} - {:.4f}".format(*found.intervals[j]))
        rows.append(cells)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in rows)


def _legend(experiment: Experiment, found: Found, world: str) -> str:
    has_panels = bool(panels(experiment.names))
    moves = found.iterates is not None and len(found.log) > 1
    signs = "; negative ones lie outside of the frame" if found.is_signed and has_panels else ""
    lines = [
        "Play, or drag through `frame`: all views move together.",
        f"* **{'Left' if has_panels else 'Above'}**: {world}." if world else "",
        f"* **Weights**: scaled to sum |w| = 1{signs}." if found.w is not None or moves else "",
        "* **Amber points**: samples of the posterior." if found.samples is not None else "",
        "* **Green diamond**: the answer." if found.w is not None else "",
        "* **Blue dot**: the weights at this iteration." if moves else "",
        "* **Red cross**: ground truth." if experiment.w_expert is not None else "",
        "* **Objective**: the method's own, after each iteration." if len(found.log) > 1 else "",
    ]
    return "\n".join(line for line in lines if line)


def properties(experiment: Experiment, found: Found, ending: str | None) -> dict[str, Any]:
    """Values of the property ``experiment``; what is not known is left out."""
    known = {
        "domain": experiment.domain,
        "method": found.method,
        "objectives": experiment.names,
        "units": [o.unit for o in experiment.objectives],
        "seed": experiment.seed,
        "w_expert": experiment.w_expert,
        "w": found.w,
        "intervals": None if found.intervals is None else found.intervals.ravel(),
        "loss": found.loss,
        "status": found.status,
        "iterations": len(found.log),
        "ending": ending,
        "versions": [f"{name} {number}" for name, number in versions().items()],
    }
    return {key: value for key, value in known.items() if value is not None}
