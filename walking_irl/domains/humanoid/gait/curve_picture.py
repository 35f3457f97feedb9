"""Curves of walks over the gait cycle on the band of a norm, as one SVG picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.curves import beside
from walking_irl.domains.humanoid.gait.norm_curves import PHASES, NormSet

PANELS: Mapping[str, tuple[str, str]] = {
    "pelvis_tilt": ("pelvic tilt", "deg, forwards +"),
    "pelvis_obliquity": ("pelvic obliquity", "deg, up +"),
    "pelvis_rotation": ("pelvic rotation", "deg, forwards +"),
    "hip_flexion": ("hip flexion", "deg"),
    "hip_adduction": ("hip adduction", "deg"),
    "hip_rotation": ("hip rotation", "deg, internal +"),
    "knee_flexion": ("knee flexion", "deg"),
    "ankle_dorsiflexion": ("ankle dorsiflexion", "deg"),
    "vertical_force": ("vertical force", "body weights"),
    "hip_extension_moment": ("hip extension moment", "Nm/kg"),
    "knee_extension_moment": ("knee extension moment", "Nm/kg"),
    "ankle_plantarflexion_moment": ("ankle plantarflexion moment", "Nm/kg"),
}
"""Variables in the order of their panels, with title and unit."""
AXIS = "against % of the gait cycle, from initial contact"
COLUMNS = 3
WIDTH, HEIGHT = 300.0, 190.0  # of a panel with its margins [px]
LEFT, RIGHT, TOP, BOTTOM = 46.0, 14.0, 34.0, 26.0  # margins of a panel [px]
HEAD = 64.0  # above the panels [px]
COLOURS = ("#c0392b", "#2c6fbb", "#2e8b57", "#8e44ad", "#d68910")
BAND, FAINT, INK, GREY = "#d9d9d9", "#ececec", "#222222", "#666666"


def curves_picture(
    title: str, walks: Mapping[str, Mapping[str, Array]], norms: NormSet, note: str = ""
) -> str:
    """A panel for every variable that some walk has.

    Args:
        title: Heading.
        walks: Curves at PHASES by variable, by what the legend calls each walk.
        norms: Whose band, mean and one standard deviation, lies behind them.
        note: Said at the right of the legend, for instance whose the band is.

    Returns:
        The picture as SVG.
    """
    placed = {name: beside(curves, norms) for name, curves in walks.items()}
    shown = [v for v in PANELS if any(v in curves for curves in placed.values())]
    body = [_text(12, 24, title, size=16, weight="bold"), *_legend(list(walks), note)]
    body.append(_text(COLUMNS * WIDTH - RIGHT, 24, AXIS, "end", colour=GREY))
    for k, variable in enumerate(shown):
        x0, y0 = (k % COLUMNS) * WIDTH, HEAD + (k // COLUMNS) * HEIGHT
        curves = [c.get(variable) for c in placed.values()]
        body += _panel(x0, y0, variable, curves, norms)
    rows = -(-len(shown) // COLUMNS)
    width, height = COLUMNS * WIDTH, HEAD + rows * HEIGHT + 8
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'width="{width:g}" height="{height:g}" font-family="sans-serif" font-size="11">'
    )
    paper = f'<rect width="{width:g}" height="{height:g}" fill="white"/>'
    return "\n".join([head, paper, *body, "</svg>", ""])


def _legend(names: Sequence[str], note: str) -> list[str]:
    out, x = [], 12.0
    for name, colour in zip(names, _colours(len(names)), strict=True):
        out.append(_line(x, 42, x + 24, 42, colour, 2.4))
        out.append(_text(x + 30, 46, name))
        x += 44 + 6.4 * len(name)
    out.append(f'<rect x="{x:.1f}" y="36" width="24" height="12" fill="{BAND}"/>')
    return [*out, _text(x + 30, 46, note or "norm, mean and one standard deviation", colour=GREY)]


def _colours(n: int) -> list[str]:
    return [COLOURS[k % len(COLOURS)] for k in range(n)]


def _panel(
    x0: float, y0: float, variable: str, curves: Sequence[Array | None], norms: NormSet
) -> list[str]:
    title, unit = PANELS[variable]
    norm = norms.curves.get(variable)
    known = [c for c in curves if c is not None]
    band = [] if norm is None else [norm.mean - norm.sd, norm.mean + norm.sd]
    low, high = limits([*known, *band])
    left, top = x0 + LEFT, y0 + TOP
    width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

    def at(percent: Array, values: Array) -> list[tuple[float, float]]:
        x = left + width * percent / 100
        y = top + height * (high - values) / (high - low)
        return list(zip(x.tolist(), y.tolist(), strict=True))

    out = [_text(left, y0 + 24, title, weight="bold")]
    out.append(_text(left + width, y0 + 24, unit, "end", colour=GREY))
    if norm is not None:
        edge = at(PHASES, band[1]) + at(PHASES[::-1], band[0][::-1])
        out.append(f'<polygon points="{_points(edge)}" fill="{BAND}"/>')
        out.append(_path(at(PHASES, norm.mean), "#a8a8a8", 1.2))
    for value in ticks(low, high):
        y = top + height * (high - value) / (high - low)
        out.append(_line(left, y, left + width, y, "#bbbbbb" if value == 0 else FAINT))
        out.append(_text(left - 6, y + 4, f"{value:g}", "end", colour=GREY))
    for percent in (0, 20, 40, 60, 80, 100):
        x = left + width * percent / 100
        out.append(_line(x, top + height, x, top + height + 4, GREY))
        out.append(_text(x, top + height + 16, f"{percent}", "middle", colour=GREY))
    out.append(_line(left, top + height, left + width, top + height, GREY))
    for curve, colour in zip(curves, _colours(len(curves)), strict=True):
        if curve is not None:
            out.append(_path(at(PHASES, curve), colour, 2.0))
    return out


def limits(curves: Sequence[Array]) -> tuple[float, float]:
    """Limits of an axis that holds all curves, with a margin."""
    low, high = float(min(c.min() for c in curves)), float(max(c.max() for c in curves))
    margin = 0.06 * max(high - low, 1e-9)
    return low - margin, high + margin


def ticks(low: float, high: float) -> list[float]:
    """Round numbers within an axis, four or so."""
    step = 10.0 ** np.floor(np.log10((high - low) / 3))
    for factor in (1, 2, 5, 10):
        if (high - low) / (factor * step) <= 5:
            step *= factor
            break
    first = np.ceil(low / step)
    values = step * np.arange(first, np.floor(high / step) + 1)
    return [float(round(v, 9)) + 0.0 for v in values]


def _points(points: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _path(points: Sequence[tuple[float, float]], colour: str, width: float) -> str:
    return (
        f'<polyline points="{_points(points)}" fill="none" stroke="{colour}" '
        f'stroke-width="{width:g}" stroke-linejoin="round"/>'
    )


def _line(x1: float, y1: float, x2: float, y2: float, colour: str, width: float = 1.0) -> str:
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}" '
        f'stroke-width="{width:g}"/>'
    )


def _text(
    x: float,
    y: float,
    text: str,
    anchor: str = "start",
    *,
    size: int = 11,
    weight: str = "normal",
    colour: str = INK,
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" '
        f'font-weight="{weight}" fill="{colour}">{escape(text)}</text>'
    )
