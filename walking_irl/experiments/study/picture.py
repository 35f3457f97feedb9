"""The picture of a study: measured coverage by nominal level, and how far truths lie out."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.experiments.study.coverage import strain
from walking_irl.experiments.study.result import Result
from walking_irl.experiments.svg import BASELINE, FAINT, OURS, line, svg, text

SIDE, LEFT, TOP, GAP = 280.0, 60.0, 64.0, 90.0
"""Side of a panel, its place, and the room between both [px]."""
LEAST = 0.4
"""Nominal level and coverage where the axes begin."""
WIDEST = 1.5
"""Error in half widths where its axis ends."""


def calibration_picture(result: Result) -> str:
    """Two panels as SVG: the calibration, and the share of truths within a share of half widths."""
    title = f"{result.n} experts of {result.setup.domain}: are the intervals right?"
    caption = "left: bars are 95 % intervals; right: beyond 1 the truth is outside"
    body = [*_calibration(result), *_distances(strain(result.scored).ravel())]
    body.append(text(8, TOP + SIDE + 62, caption, colour="#666666"))
    return svg(title, LEFT + 2 * SIDE + GAP + 30, TOP + SIDE + 76, body)


def _calibration(result: Result) -> list[str]:
    def place(nominal: float, measured: float) -> tuple[float, float]:
        share = [(max(v, LEAST) - LEAST) / (1.0 - LEAST) for v in (nominal, measured)]
        return LEFT + SIDE * share[0], TOP + SIDE * (1.0 - share[1])

    body = []
    for tick in (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0):
        (x, y), (left, low), (right, high) = place(tick, tick), place(LEAST, LEAST), place(1, 1)
        body += [line(left, y, right, y, FAINT), line(x, low, x, high, FAINT)]
        body.append(text(left - 8, y + 4, f"{100 * tick:.0f} %", "end"))
        body.append(text(x, low + 18, f"{100 * tick:.0f} %", "middle"))
    body.append(line(*place(LEAST, LEAST), *place(1.0, 1.0), BASELINE))
    for nominal, share in result.calibration.items():
        if share.value != share.value:
            continue
        x, y = place(nominal, share.value)
        body.append(line(x, place(nominal, share.low)[1], x, place(nominal, share.high)[1], OURS))
        body.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{OURS}"/>')
    body.append(text(LEFT - 40, TOP - 14, "weights inside, measured"))
    body.append(text(LEFT + SIDE / 2, TOP + SIDE + 38, "nominal level", "middle"))
    return body


def _distances(strained: Array) -> list[str]:
    left = LEFT + SIDE + GAP
    body = []
    for tick in (0.0, 0.5, 1.0, 1.5):
        x = left + SIDE * tick / WIDEST
        colour = BASELINE if tick == 1.0 else FAINT
        body += [line(x, TOP, x, TOP + SIDE, colour)]
        body.append(text(x, TOP + SIDE + 18, f"{tick:g}", "middle"))
    for tick in (0.0, 0.25, 0.5, 0.75, 1.0):
        y = TOP + SIDE * (1.0 - tick)
        body.append(line(left, y, left + SIDE, y, FAINT))
        body.append(text(left - 8, y + 4, f"{100 * tick:.0f} %", "end"))
    body.append(text(left - 40, TOP - 14, "weights whose error is at most that"))
    body.append(text(left + SIDE / 2, TOP + SIDE + 38, "error / half width", "middle"))
    if strained.size:
        across = left + SIDE * np.minimum(np.sort(strained), WIDEST) / WIDEST
        up = TOP + SIDE * (1.0 - np.arange(1, strained.size + 1) / strained.size)
        path = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, up, strict=True))
        body.append(f'<polyline points="{path}" fill="none" stroke="{OURS}" stroke-width="2"/>')
    return body
