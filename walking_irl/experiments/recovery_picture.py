"""The picture of a recovery: intervals that close, and certificate and regret that fall."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from walking_irl.arrays import Array
from walking_irl.experiments.svg import BASELINE, FAINT, OURS, line, svg, text
from walking_irl.types import Iteration, Rule

PANEL, ROW, LEFT, TOP, GAP = 420.0, 74.0, 104.0, 58.0, 110.0
"""Width of a panel, height of an objective's row, left and upper edge, between panels [px]."""
LEAST_HEIGHT = 230.0
TRUTH, AMBER, GREEN = "#c81e46", "#f0c070", "#108c6e"
SMALLEST = 1e-8
"""Of what is drawn on the logarithmic axis."""


def recovery_picture(
    title: str, names: Sequence[str], iterations: Sequence[Iteration], w_expert: Array | None
) -> str:
    """Two panels as SVG, over the forward solves.

    Left: what each weight may be (amber), the estimate (blue), the ground truth (red). Right, in
    powers of ten: the certificate, the best regret and the widest interval.

    Args:
        title: Heading.
        names: Of the K objectives.
        iterations: At least one.
        w_expert: Ground-truth weights, shape (K,), or None.
    """
    height = max(ROW * len(names), LEAST_HEIGHT)
    probes = [it.k for it in iterations if it.rule is Rule.PROBE]
    body = []
    for left in (LEFT, LEFT + PANEL + GAP):
        body += _solves(left, height, len(iterations))
        if probes:
            x = _across(left, probes[0] - 0.5, len(iterations))
            body += [
                line(x, TOP, x, TOP + height, BASELINE),
                text(x + 4, TOP - 4, "probes", colour=BASELINE),
            ]
    row = height / len(names)
    for j, name in enumerate(names):
        truth = None if w_expert is None else float(w_expert[j])
        body += _interval(name, TOP + row * j, row, iterations, j, truth)
    body += _falling(LEFT + PANEL + GAP, height, iterations)
    key = "amber: interval, what a weight may be; blue: estimate" + (
        "; red: ground truth" if w_expert is not None else ""
    )
    body.append(text(LEFT, TOP + height + 52, key, colour="#666666"))
    return svg(title, LEFT + 2 * PANEL + GAP + 30, TOP + height + 66, body)


def _across(left: float, k: float, n: int) -> float:
    return left + PANEL * k / max(n - 1, 1)


def _solves(left: float, height: float, n: int) -> list[str]:
    """The axis of forward solves."""
    foot = TOP + height
    step = max(1, math.ceil(n / 8))
    out = [line(left, foot, left + PANEL, foot, BASELINE)]
    for k in range(0, n, step):
        out.append(text(_across(left, k, n), foot + 16, f"{k + 1}", "middle"))
    return [*out, text(left + PANEL / 2, foot + 34, "forward solve", "middle")]


def _interval(
    name: str, top: float, row: float, iterations: Sequence[Iteration], j: int, truth: float | None
) -> list[str]:
    """One weight over the solves, in its own row from 0 to its largest value."""
    bounds = np.array([it.intervals[j] for it in iterations])
    values = np.array([it.estimate[j] for it in iterations])
    most = float(np.nanmax([bounds.max(), values.max(), truth or 0.0, 1e-9]))
    n, room = len(iterations), 0.84 * row

    def at(k: int, value: float) -> str:
        return f"{_across(LEFT, k, n):.1f},{top + 0.08 * row + room * (1 - value / most):.1f}"

    rim = [at(k, b[1]) for k, b in enumerate(bounds)]
    rim += [at(k, bounds[k, 0]) for k in reversed(range(n))]
    foot, head = (float(at(0, v).split(",")[1]) for v in (0.0, most))
    out = [
        line(LEFT, foot, LEFT + PANEL, foot, FAINT),
        text(LEFT - 44, (foot + head) / 2 + 4, name, "end"),
        text(LEFT - 8, foot + 4, "0", "end"),
        text(LEFT - 8, head + 10, f"{most:.2g}", "end"),
        f'<polygon points="{" ".join(rim)}" fill="{AMBER}" stroke="{AMBER}"/>',
    ]
    if truth is not None:
        y = float(at(0, truth).split(",")[1])
        out.append(line(LEFT, y, LEFT + PANEL, y, TRUTH))
    return [*out, _curve([at(k, v) for k, v in enumerate(values)], OURS)]


def _falling(left: float, height: float, iterations: Sequence[Iteration]) -> list[str]:
    """Certificate, best regret and widest interval; what is zero or less ends its curve."""
    curves = {
        "certificate": (GREEN, [it.certificate for it in iterations]),
        "best regret": (OURS, [it.best_regret for it in iterations]),
        "widest interval": ("#d08a10", [it.widest for it in iterations]),
    }
    shown = [v for _, values in curves.values() for v in values if v > SMALLEST]
    low = math.floor(math.log10(min(shown, default=0.1)))
    high = max(low + 1, math.ceil(math.log10(max(shown, default=1.0))))
    n, out = len(iterations), []

    def height_of(value: float) -> float:
        return TOP + height * (high - math.log10(value)) / (high - low)

    for power in range(low, high + 1):
        y = height_of(10.0**power)
        out.append(line(left, y, left + PANEL, y, FAINT))
        out.append(text(left - 8, y + 4, f"1e{power}", "end"))
    for i, (name, (colour, values)) in enumerate(curves.items()):
        part: list[str] = []
        for k, value in enumerate(values):
            if value <= SMALLEST:
                break
            part.append(f"{_across(left, k, n):.1f},{height_of(value):.1f}")
        out.append(_curve(part, colour))
        y = TOP + 16 + 17 * i
        out.append(line(left + PANEL - 126, y - 4, left + PANEL - 106, y - 4, colour))
        out.append(text(left + PANEL - 100, y, name))
    out.append(text(left - 40, TOP - 22, "certificate and regret: return; interval: weight"))
    return out


def _curve(points: Sequence[str], colour: str) -> str:
    return (
        f'<polyline points="{" ".join(points)}" fill="none" stroke="{colour}" stroke-width="1.8"/>'
    )
