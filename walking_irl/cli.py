"""The command line: ``walking-irl recover | gait | inspect | view | domains``.

Exit codes: 0 done, 1 the method ended without success (it says why), 2 bad input or a failed write,
130 interrupted (what was done so far is saved).
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before NumPy: small factorisations are slower on more

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from walking_irl import __version__, commands
from walking_irl.errors import InvalidInputError, WalkingIRLError

EXAMPLES = """
examples:
  walking-irl recover                          the main job: who walks like this, and what for?
  walking-irl recover --seed 7 --rollouts 0    another hidden walker, known exactly
  walking-irl recover --weights 1,1,1,1,1,4    hidden weights of your own
  walking-irl gait --weights 1,2,1,1,1,5 --png gait.png
  walking-irl inspect walking.rrd
  walking-irl view walking.rrd
"""


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands."""
    parser = argparse.ArgumentParser(
        prog="walking-irl",
        description="Given how a humanoid walks, find out what it walks for.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"walking-irl {__version__}")
    sub = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _recover_parser(sub.add_parser("recover", help="recover the hidden weights of a walker"))
    _gait_parser(sub.add_parser("gait", help="solve for the best gait under given weights"))
    inspect = sub.add_parser("inspect", help="print what a recording holds")
    inspect.add_argument("file", type=Path, metavar="FILE.rrd")
    inspect.add_argument("--json", type=Path, metavar="FILE.json", help="write it as JSON, too")
    inspect.set_defaults(run=commands.inspect)
    view = sub.add_parser("view", help="open a recording in the viewer, or render it to a picture")
    view.add_argument("file", type=Path, metavar="FILE.rrd")
    view.add_argument("--png", type=Path, help="render a picture without a screen instead")
    view.add_argument("--frame", type=int, help="frame to render (default: the last)")
    view.set_defaults(run=commands.view)
    domains = sub.add_parser("domains", help="list domains, their objectives and solvers")
    domains.set_defaults(run=commands.domains)
    return parser


def _recover_parser(p: argparse.ArgumentParser) -> None:
    p.add_argument("--domain", default="humanoid", help="see walking-irl domains (%(default)s)")
    p.add_argument("--centre", default="ac", help="query point: ac, cg, mvie or cc (%(default)s)")
    p.add_argument(
        "--mode",
        default="optimal",
        help="optimal: the expert is optimal; set: to a tolerance; minimise: it need not be "
        "(%(default)s)",
    )
    hidden = p.add_mutually_exclusive_group()
    hidden.add_argument(
        "--seed", type=int, default=0, help="draws the hidden weights (%(default)s)"
    )
    hidden.add_argument("--weights", metavar="W1,W2,...", help="hidden weights of your own")
    hidden.add_argument("--demonstration", type=Path, metavar="FILE", help="a gait (.npz or .csv)")
    p.add_argument("--population", default="typical", help="typical or uniform (%(default)s)")
    p.add_argument(
        "--rollouts", type=int, default=20, help="recorded walks; 0: exact (%(default)s)"
    )
    p.add_argument(
        "--noise", type=float, default=0.02, help="s.d. of joint velocities [rad/s] (%(default)s)"
    )
    p.add_argument(
        "--disturbance", default="initial", help="initial, or kicks in every cycle (%(default)s)"
    )
    p.add_argument(
        "--max-solves", type=int, default=20, help="budget of forward solves (%(default)s)"
    )
    p.add_argument(
        "--record",
        type=Path,
        default=Path("walking.rrd"),
        metavar="FILE.rrd",
        help="where the recording goes (%(default)s); the expert's walks go beside it",
    )
    p.add_argument("--no-record", action="store_true", help="write no recording")
    p.add_argument("--json", type=Path, metavar="FILE.json", help="write all figures as JSON")
    p.add_argument("--quiet", action="store_true", help="print the result only")
    p.set_defaults(run=commands.recover)


def _gait_parser(p: argparse.ArgumentParser) -> None:
    p.add_argument("--domain", default="humanoid", help="humanoid or humanoid-planar")
    p.add_argument("--weights", required=True, metavar="W1,W2,...", help="six weights")
    p.add_argument("--seconds", type=float, default=10.0, help="how long to walk in closed loop")
    p.add_argument("--save", type=Path, metavar="FILE.npz|FILE.csv", help="write the gait cycle")
    p.add_argument("--record", type=Path, metavar="FILE.rrd", help="record the walk")
    p.add_argument("--png", type=Path, metavar="FILE.png", help="draw a picture strip")
    p.add_argument("--json", type=Path, metavar="FILE.json", help="write the gait's figures")
    p.add_argument("--quiet", action="store_true", help="print nothing but errors")
    p.set_defaults(run=commands.gait)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code."""
    args = build_parser().parse_args(argv)
    console = Console(highlight=False, soft_wrap=True)
    errors = Console(stderr=True, highlight=False, soft_wrap=True, markup=False)
    try:
        return int(args.run(args, console))
    except KeyboardInterrupt:
        errors.print("walking-irl: interrupted before there was anything to save")
        return 130
    except WalkingIRLError as error:
        kind = "error" if isinstance(error, InvalidInputError) else "failed"
        errors.print(f"walking-irl: {kind}: {error}")
        return 2


if __name__ == "__main__":
    sys.exit(main())
