"""The text beside the pictures, and the properties that travel with the file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from walking_irl.cpirl.summary import Summary, estimate_name, noise_level, per_unit, volume_left
from walking_irl.recording.experiment import Experiment
from walking_irl.recording.panels import panels
from walking_irl.types import Status
from walking_irl.versions import versions


def summary(
    experiment: Experiment, found: Summary | None, world: str, ending: str | None = None
) -> str:
    """Markdown: what is shown, true and recovered weights, how sure they are, how to read it.

    Args:
        experiment: The run.
        found: What it found so far, or None before its first iteration.
        world: What the world's view shows.
        ending: Why the run was cut short, or None.
    """
    parts = [f"# {experiment.question or f'What does the expert of {experiment.domain} want?'}"]
    if ending is not None:
        parts.append(f"**The run was cut short: {ending}.** What was done until then is here.")
    if experiment.answer:
        parts.append(experiment.answer)
    elif found is not None:
        parts += [_result(experiment, found), _table(experiment, found)]
    parts += ["## How to read it", _legend(experiment, world)]
    if found is not None and not experiment.answer:
        parts += ["## How sure it is", _certainty(experiment, found)]
    parts += ["## Objectives", "\n".join(f"* {o.name}: {o.meaning}" for o in experiment.objectives)]
    return "\n\n".join(parts)


def _result(experiment: Experiment, found: Summary) -> str:
    text = f"**{found.n_solves} iterations**: {found.ending}."
    if found.status in (Status.DOMINATED, Status.MIXTURE_DOMINATES):
        low, high = found.bracket
        is_closed = low > 0.0 and high <= 1.5 * low
        nearest = (
            "those below bring it nearest to it" if is_closed else "none was looked for further"
        )
        return f"{text} No weights make this expert optimal; {nearest}."
    if experiment.w_expert is not None:
        l1 = float(np.abs(found.w - experiment.w_expert).sum())
        found_how = "recovered to" if found.status.has_weights else "missed by"
        text += f" Ground-truth weights {found_how} {l1:.4f} (sum of absolute errors)."
    return text


def _table(experiment: Experiment, found: Summary) -> str:
    w_expert = experiment.w_expert
    head = ["objective", "ground truth", estimate_name(found), "interval"]
    is_scaled = any(o.scale != 1.0 for o in experiment.objectives)
    if is_scaled:
        head.append("per raw unit")
    rows = [head, ["---"] * len(head)]
    for j, objective in enumerate(experiment.objectives):
        truth = "?" if w_expert is None else f"{w_expert[j]:.4f}"
        low, high = found.intervals[j]
        cells = [objective.name, truth, f"{found.w[j]:.4f}", f"{low:.4f} - {high:.4f}"]
        if is_scaled:
            cells.append(per_unit(found.physical_intervals[j], objective.unit))
        rows.append(cells)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in rows)


def _certainty(experiment: Experiment, found: Summary) -> str:
    low, high = found.bracket
    lines = [
        f"The weights shown: {found.rule}.",
        f"The least regret of any weights lies between {low:.1e} and {high:.1e}; "
        "an expert that is optimal for some weights needs 0 in between.",
        f"Half widths of the weights: {found.how_sure}.",
        f"The cuts leave {volume_left(found)} weights.",
    ]
    if found.weakest is not None:
        lines.append(
            f"The behaviour tells least about **{found.weakest}** (condition number "
            f"{found.condition_number:.3g})."
        )
    if found.gauge is not None:
        lines.append(f"Not identifiable: {found.gauge}.")
    lines.append(f"The expert's features are {noise_level(experiment.expert)}.")
    return "\n".join(f"* {text}" for text in lines)


def _legend(experiment: Experiment, world: str) -> str:
    has_body = bool(panels(experiment.names))
    lines = [
        "Play, or drag through `frame`: all views move together.",
        f"* **{'Left' if has_body else 'Above'}**: {world}." if world else "",
        "* **Amber polyhedron**: all weights that still explain the expert; what the newest cut "
        "took away glows **red**. The box below magnifies it."
        if has_body
        else "* **Amber bars**: what is left of each weight's interval.",
        (
            f"* **Points**: {', '.join(experiment.others)}, coloured as their curves are"
            if experiment.others
            else "* **Blue dot** query, **green diamond** estimate"
        )
        + (", **red cross** ground truth." if experiment.w_expert is not None else "."),
        "* **Intervals**: what a weight may be, given everything that was seen. They are no "
        "confidence intervals about an estimate. Right of them the same, magnified.",
        "* **Certificate**: no matter which weights are true, a mixture of the policies found "
        "loses at most this much. The least regret of any weights lies between minus the "
        "certificate and the best *regret*, in the unit of the weighed objectives. What is below "
        "1e-7 leaves the plot.",
        "* At the end **probes** ask for the extreme weights of each interval, so that the query "
        "jumps; the loss is drawn of the queries before. The last frames show the answer.",
    ]
    return "\n".join(text for text in lines if text)


def properties(experiment: Experiment, found: Summary | None, ending: str | None) -> dict[str, Any]:
    """Values of the property ``experiment``; what is not known is left out."""
    known: dict[str, Any] = {
        "domain": experiment.domain,
        "objectives": experiment.names,
        "units": [o.unit for o in experiment.objectives],
        "centre": experiment.centre,
        "mode": experiment.mode,
        "seed": experiment.seed,
        "w_expert": experiment.w_expert,
        "noise": experiment.expert.error,
        "iterations": 0 if found is None else found.n_solves,
        "ending": ending,
        "versions": [f"{name} {number}" for name, number in versions().items()],
    }
    if found is not None:
        known |= {
            "w": found.w,
            "rule": found.rule,
            "intervals": found.intervals.ravel(),
            "physical_intervals": found.physical_intervals.ravel(),
            "status": found.status.name.lower(),
            "certificate": found.certificate,
            "bracket": found.bracket,
            "how_sure": found.how_sure,
            "volume_ratio": found.volume_ratio,
            "condition_number": found.condition_number,
            "weakest": found.weakest,
            "gauge": found.gauge,
        }
    if found is not None and found.certainty is not None:
        for part in ("from_noise", "from_gap", "from_solver"):
            known[part] = getattr(found.certainty, part)
    return {key: value for key, value in known.items() if value is not None}


def motion_properties(name: str, weights: Mapping[str, float]) -> dict[str, Any]:
    """Values of the property ``experiment`` of a recording that shows one motion alone."""
    values = {
        "domain": name,
        "objectives": list(weights),
        "w": list(weights.values()),
        "versions": [f"{package} {number}" for package, number in versions().items()],
    }
    return {key: value for key, value in values.items() if value}
