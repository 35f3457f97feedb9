"""Elements of the experiments' pictures, as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

OURS, BASELINE, FAINT, INK = "#3b6fb6", "#9a9a9a", "#e2e2e2", "#222222"


def svg(title: str, width: float, height: float, body: Sequence[str]) -> str:
    """A whole picture on white paper, its size in pixels."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'width="{width:g}" height="{height:g}" font-family="sans-serif" font-size="12">'
    )
    paper = f'<rect width="{width:g}" height="{height:g}" fill="white"/>'
    return "\n".join([head, paper, text(8, 20, title, weight="bold"), *body, "</svg>", ""])


def text(
    x: float,
    y: float,
    words: str,
    anchor: str = "start",
    weight: str = "normal",
    colour: str = INK,
) -> str:
    """Words that start, end or have their middle at a point."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-weight="{weight}" '
        f'fill="{colour}">{escape(words)}</text>'
    )


def line(x1: float, y1: float, x2: float, y2: float, colour: str) -> str:
    """A straight line."""
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}"/>'
