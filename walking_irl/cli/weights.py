"""Weights as the command line takes and shows them."""

from __future__ import annotations

from rich.console import Console

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError


def parse_weights(text: str) -> tuple[float, ...]:
    """Weights from the command line.

    >>> parse_weights("1,2.5")
    (1.0, 2.5)
    """
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError as error:
        raise InvalidInputError(
            f"weights must be numbers separated by commas, got {text!r}"
        ) from error


def show_weights(w: Array, console: Console) -> None:
    """Say how weights were understood."""
    console.print("weights normalised to sum 1: " + ", ".join(f"{v:.4f}" for v in w))
