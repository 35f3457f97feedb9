"""Pictures of tables, as SVG: solves or losses by method, and steps against samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from textwrap import wrap
from typing import NamedTuple

from walking_irl.arrays import Array
from walking_irl.experiments.svg import BASELINE, FAINT, INK, OURS
from walking_irl.experiments.svg import line as _line
from walking_irl.experiments.svg import svg as _svg
from walking_irl.experiments.svg import text as _text

ROW, LABELS, PLOT, RESULT = 20, 270, 420, 90
"""Height of a row; widths of labels, of the plot and of the results beside it [px]."""


def solves_chart(title: str, rows: Sequence[Sequence[str]]) -> str:
    """Bars of the mean number of forward solves, with standard errors, on a logarithmic axis.

    Methods that did not succeed on every seed are hollow; cells without a number are left out.

    Args:
        title: Heading.
        rows: Setting, method, solves "mean +- s.e.", success "n/N".
    """
    found = [
        (s, m, *_numbers(solves), success) for s, m, solves, success in rows if solves != "n/a"
    ]
    most = max((mean + error for *_, mean, error, _ in found), default=1.0)
    decades = math.log10(max(most, 10.0)) * 1.05

    def x(value: float) -> float:
        return LABELS + PLOT * math.log10(max(value, 1.0)) / decades

    body, y = [], 50.0
    for setting, group in groupby(found, key=lambda row: row[0]):
        body.append(_text(8, y + 14, setting, weight="bold"))
        y += ROW + 2
        for _, method, mean, error, success in group:
            n, total = success.split("/")
            colour = OURS if method.startswith("CPIRL") else BASELINE
            fill = colour if n == total else "white"
            middle = y + ROW / 2
            body.append(_text(LABELS - 8, middle + 4, method, anchor="end"))
            body.append(
                f'<rect x="{LABELS}" y="{y + 4:g}" width="{max(x(mean) - LABELS, 1.5):.1f}" '
                f'height="{ROW - 8}" fill="{fill}" stroke="{colour}"/>'
            )
            body.append(_line(x(mean - error), middle, x(mean + error), middle, INK))
            label = f"{mean:.1f}" + ("" if n == total else f" ({success})")
            body.append(_text(x(mean + error) + 6, middle + 4, label))
            y += ROW
        y += 8
    ticks = [v for v in (1, 2, 5, 10, 20, 50, 100, 200, 500) if math.log10(v) <= decades]
    axis = [_line(x(v), 44, x(v), y, FAINT) for v in ticks]
    axis += [_text(x(v), 38, str(v), anchor="middle") for v in ticks]
    caption = "forward solves until success, mean and standard error; hollow: not on every seed"
    body.append(_text(8, y + 14, caption, colour="#666666"))
    return _svg(title, LABELS + PLOT + RESULT, y + 26, [*axis, *body])


def steps_chart(title: str, rows: Sequence[Sequence[str]]) -> str:
    """Mean steps and standard deviation against the number of samples, on a logarithmic axis.

    Args:
        title: Heading.
        rows: Samples, mean, standard deviation.
    """
    points = [tuple(map(float, row)) for row in rows]
    left, top, width, height = 60.0, 50.0, 560.0, 240.0
    low, high = math.log10(points[0][0]), math.log10(max(points[-1][0], points[0][0] + 1))
    most = 1.1 * max(mean + spread for _, mean, spread in points)

    def at(samples: float, steps: float) -> tuple[float, float]:
        return (
            left + 30 + (width - 60) * (math.log10(samples) - low) / (high - low),
            top + height * (1 - steps / most),
        )

    body = []
    for step in range(0, int(most) + 1, 2):
        y = at(points[0][0], step)[1]
        body += [_line(left, y, left + width, y, FAINT), _text(left - 8, y + 4, str(step), "end")]
    places = [at(samples, mean) for samples, mean, _ in points]
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
    body.append(f'<polyline points="{path}" fill="none" stroke="{OURS}" stroke-width="2"/>')
    for (samples, mean, spread), (x, y) in zip(points, places, strict=True):
        body.append(_line(x, at(samples, mean - spread)[1], x, at(samples, mean + spread)[1], OURS))
        body.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{OURS}"/>')
        body.append(_text(x, top + height + 18, f"{samples:g}", "middle"))
    body.append(_text(left + width / 2, top + height + 40, "samples of hit-and-run", "middle"))
    body.append(_text(8, top - 12, "steps, mean and standard deviation"))
    return _svg(title, left + width + 20, top + height + 52, body)


class Loss(NamedTuple):
    """One bar of a chart of losses."""

    setting: str
    method: str
    value: float
    low: float
    """Ends of its error bar."""
    high: float


def loss_chart(title: str, bars: Sequence[Loss], caption: str) -> str:
    """Bars of losses on a logarithmic axis from 1e-4 to 1, or as far as the largest goes.

    Args:
        title: Heading.
        bars: From top to bottom; equal settings in a row stand under one heading.
        caption: What value and error bar are.
    """
    least = 1e-4
    most = max([1.0, *(bar.high for bar in bars)])
    decades = math.log10(most / least)

    def x(value: float) -> float:
        return LABELS + PLOT * math.log10(max(value, least) / least) / decades

    body, y = [], 50.0
    for setting, group in groupby(bars, key=lambda bar: bar.setting):
        body.append(_text(8, y + 14, setting, weight="bold"))
        y += ROW + 2
        for bar in group:
            colour = OURS if bar.method.startswith("CPIRL") else BASELINE
            middle = y + ROW / 2
            body.append(_text(LABELS - 8, middle + 4, bar.method, anchor="end"))
            body.append(
                f'<rect x="{LABELS}" y="{y + 4:g}" width="{max(x(bar.value) - LABELS, 1.5):.1f}" '
                f'height="{ROW - 8}" fill="{colour}" stroke="{colour}"/>'
            )
            body.append(_line(x(bar.low), middle, x(bar.high), middle, INK))
            label = "0" if bar.value < 1e-12 else f"{bar.value:.2g}"
            body.append(_text(max(x(bar.high), LABELS + 2) + 6, middle + 4, label))
            y += ROW
        y += 8
    ticks = [10.0**k for k in range(-4, math.floor(math.log10(most)) + 1)]
    axis = [_line(x(v), 44, x(v), y, FAINT) for v in ticks]
    axis += [_text(x(v), 38, f"{v:g}", anchor="middle") for v in ticks]
    body.append(_text(8, y + 14, caption, colour="#666666"))
    return _svg(title, LABELS + PLOT + RESULT, y + 26, [*axis, *body])


def marks_chart(
    title: str,
    columns: Sequence[str],
    rows: Sequence[tuple[str, Sequence[bool]]],
    caption: str,
) -> str:
    """A table of marks: a full dot where something holds, a hollow one where it does not."""
    width, top = 100.0, 50.0
    body = [
        _text(LABELS + (i + 0.5) * width, top, name, "middle", "bold")
        for i, name in enumerate(columns)
    ]
    for row, (name, marks) in enumerate(rows):
        y = top + ROW * (row + 1)
        body.append(_text(LABELS - 8, y + 4, name, anchor="end"))
        for i, is_true in enumerate(marks):
            fill = OURS if is_true else "white"
            body.append(
                f'<circle cx="{LABELS + (i + 0.5) * width:.1f}" cy="{y:.1f}" r="5" '
                f'fill="{fill}" stroke="{BASELINE}"/>'
            )
    bottom = top + ROW * (len(rows) + 2)
    body.append(_text(8, bottom, caption, colour="#666666"))
    return _svg(title, LABELS + width * len(columns) + 20, bottom + 12, body)


def maps_chart(
    title: str, tiles: Sequence[tuple[str, str, Array, bool]], levels: int, caption: str
) -> str:
    """Square maps side by side, five in a row, one path for each shade of a map.

    Args:
        title: Heading.
        tiles: Name, figure below it, shades from 0 to levels - 1 of shape (n, n), and whether the
            map is in our colour or grey.
        levels: Number of shades.
        caption: What the shades mean.
    """
    side, across, pitch = 112.0, 5, (156.0, 166.0)
    body = []
    for i, (name, figure, shades, is_ours) in enumerate(tiles):
        x, y = 12 + (i % across) * pitch[0], 66 + (i // across) * pitch[1]
        cell = side / len(shades)
        body.append(_text(x, y - 18, name, weight="bold"))
        body.append(_text(x, y - 5, figure, colour="#666666"))
        for level in sorted({int(v) for v in shades.ravel()}):
            share = level / max(levels - 1, 1)
            cells = "".join(
                f"M{c * cell:g} {r * cell:g}h{cell:g}v{cell:g}h-{cell:g}z"
                for r, c in zip(*(shades == level).nonzero(), strict=True)
            )
            fill = _shade(OURS if is_ours else BASELINE, share)
            body.append(f'<path transform="translate({x:g} {y:g})" d="{cells}" fill="{fill}"/>')
        body.append(
            f'<rect x="{x:g}" y="{y:g}" width="{side:g}" height="{side:g}" fill="none" '
            f'stroke="{BASELINE}"/>'
        )
    rows = -(-len(tiles) // across)
    bottom = 66 + rows * pitch[1]
    lines = wrap(caption, 120)
    body += [_text(12, bottom + 14 * i, line, colour="#666666") for i, line in enumerate(lines)]
    return _svg(title, 12 + across * pitch[0], bottom + 14 * len(lines), body)


def _shade(colour: str, share: float) -> str:
    """From white (0) to a dark form of the colour (1), as #rrggbb."""
    rgb = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    mixed = [round(255 + (0.7 * c - 255) * share) for c in rgb]
    return "#" + "".join(f"{c:02x}" for c in mixed)


def _numbers(cell: str) -> tuple[float, float]:
    """Mean and standard error of "mean +- s.e." or "mean"."""
    mean, _, error = cell.partition(" +- ")
    return float(mean), float(error or 0.0)
