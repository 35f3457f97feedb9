"""What commands that solve for one gait share: whose gait it is, and the files that it goes to."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from rich.console import Console

from walking_irl.arrays import Array
from walking_irl.cli.weights import parse_weights, show_weights
from walking_irl.domains import WALKERS, load_walker_domain
from walking_irl.domains.weights import normalised
from walking_irl.files import check_ending, write_png


def add_walker(p: argparse.ArgumentParser) -> None:
    """Arguments that choose a walker and its weights."""
    p.add_argument("--domain", default=WALKERS[0], help=f"{' or '.join(WALKERS)} (%(default)s)")
    p.add_argument("--weights", required=True, metavar="W1,W2,...", help="one per objective")


def asked_walker(args: argparse.Namespace, console: Console) -> tuple[Any, Array]:
    """The walker's domain and its weights, shape (K,), told unless that is not wanted."""
    domain = load_walker_domain(args.domain)
    w = normalised(parse_weights(args.weights), domain.objectives)
    if not args.quiet:
        show_weights(w, console)
    return domain, w


def add_save(p: argparse.ArgumentParser) -> None:
    """Argument for the gait cycle's file."""
    p.add_argument("--save", type=Path, metavar="FILE.npz|FILE.csv", help="write the gait cycle")


def add_png(p: argparse.ArgumentParser) -> None:
    """Argument for the gait's picture."""
    p.add_argument("--png", type=Path, metavar="FILE.png", help="draw a picture strip")


def check_gait_files(args: argparse.Namespace) -> None:
    """Fail where a file's name has another ending than its content.

    Raises:
        InvalidInputError: If it has.
    """
    check_ending(args.save, ".npz", ".csv")
    check_ending(args.png, ".png")


def write_gait_files(args: argparse.Namespace, walker: Any, gait: Any) -> None:
    """Write the gait cycle and its picture, as far as they are wanted."""
    if args.save is not None:
        from walking_irl.domains.humanoid.gait.files import save_gait

        save_gait(args.save, gait, walker)
    if args.png is not None:
        from walking_irl.domains.humanoid.gait.pictures import strip

        write_png(args.png, strip(walker, gait))
