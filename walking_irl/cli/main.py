"""The command line: ``walking-irl recover | gait | read | tables | inspect | view | domains``.

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
from concurrent.futures import BrokenExecutor
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import NoReturn

from walking_irl import __version__
from walking_irl.cli import BAD_INPUT, FAILED, INTERRUPTED
from walking_irl.errors import EmptyPolyhedronError, InvalidInputError, WalkingIRLError

EXAMPLES = """
examples:
  walking-irl recover                          the main job: who walks like this, and what for?
  walking-irl recover --seed 7 --rollouts 0    another hidden walker, known exactly
  walking-irl recover --weights 1,1,1,1,1,4    hidden weights of your own
  walking-irl recover --resume walking.archive.npz --max-solves 40
  walking-irl gait --weights 1,2,1,1,1,5 --png gait.png
  walking-irl read trial1.mot trial2.mot       what a recording of a person says
  walking-irl inspect walking.rrd
  walking-irl view walking.rrd
"""


class Parser(argparse.ArgumentParser):
    """Parser whose errors are one sentence, like all others."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, and leave."""
        self.exit(BAD_INPUT, f"walking-irl: error: {message} (see {self.prog} --help)\n")


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands."""
    parser = Parser(
        prog="walking-irl",
        description="Given how a humanoid walks, find out what it walks for.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"walking-irl {__version__}")
    sub = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _recover_parser(sub.add_parser("recover", help="recover the hidden weights of a walker"))
    _gait_parser(sub.add_parser("gait", help="solve for the best gait under given weights"))
    import_module("walking_irl.cli.read").add_parser(sub)
    tables = sub.add_parser("tables", help="regenerate the thesis's tables and two more")
    tables.add_argument("names", nargs="+", metavar="TABLE", help="7.1 ... 7.12, fig7.1, or all")
    tables.add_argument("--seeds", type=int, help="hidden experts per cell")
    tables.add_argument("--out", type=Path, default=Path("tables"), help="folder (%(default)s)")
    tables.add_argument("--quiet", action="store_true", help="print the files' names only")
    inspect = sub.add_parser("inspect", help="print what a recording holds")
    inspect.add_argument("file", type=Path, metavar="FILE.rrd")
    inspect.add_argument("--json", type=Path, metavar="FILE.json", help="write it as JSON, too")
    view = sub.add_parser("view", help="open a recording in the viewer, or render it to a picture")
    view.add_argument("file", type=Path, metavar="FILE.rrd")
    view.add_argument(
        "--png", type=Path, metavar="FILE.png", help="render a picture without a screen instead"
    )
    view.add_argument("--frame", type=int, help="frame to render (default: the last)")
    sub.add_parser("domains", help="list domains, their objectives and solvers")
    return parser


def _recover_parser(p: argparse.ArgumentParser) -> None:
    setting = partial(p.add_argument, default=argparse.SUPPRESS)  # Setup has the defaults
    setting("--domain", help="see walking-irl domains (humanoid)")
    setting("--centre", help="query point: ac, cg, mvie or cc (ac)")
    setting(
        "--mode",
        help="optimal: the expert is optimal; set: to a tolerance; minimise: it need not be "
        "(optimal; minimise for a suboptimal expert)",
    )
    setting("--expert", help="optimal, or suboptimal: spoilt, known exactly (optimal)")
    hidden = p.add_mutually_exclusive_group()
    own = partial(hidden.add_argument, default=argparse.SUPPRESS)
    own("--seed", type=int, help="draws the hidden weights (0)")
    own("--weights", metavar="W1,W2,...", help="hidden weights of your own")
    own("--demonstration", type=Path, metavar="FILE", help="a gait (.npz or .csv)")
    setting("--population", help="of a humanoid: typical or uniform (typical)")
    setting("--rollouts", type=int, help="recorded walks of a humanoid; 0: exact (20)")
    setting("--noise", type=float, help="their s.d. of joint velocities [rad/s] (0.02)")
    setting("--disturbance", help="initial, or kicks in every cycle (initial)")
    setting("--max-solves", type=int, help="budget of forward solves (20)")
    p.add_argument(
        "--record",
        type=Path,
        default=Path("walking.rrd"),
        metavar="FILE.rrd",
        help="where the recording goes (%(default)s); the expert's walks go beside it",
    )
    p.add_argument("--no-record", action="store_true", help="write no recording")
    p.add_argument(
        "--archive",
        type=Path,
        metavar="FILE.npz",
        help="where the solver's answers go, to resume from (beside the recording)",
    )
    p.add_argument(
        "--resume", type=Path, metavar="FILE.npz", help="go on from such an archive, as it began"
    )
    p.add_argument("--json", type=Path, metavar="FILE.json", help="write all figures as JSON")
    p.add_argument("--quiet", action="store_true", help="print the result only")


def _gait_parser(p: argparse.ArgumentParser) -> None:
    p.add_argument("--domain", default="humanoid", help="humanoid or humanoid-planar")
    p.add_argument("--weights", required=True, metavar="W1,W2,...", help="six weights")
    p.add_argument("--seconds", type=float, default=10.0, help="how long to walk in closed loop")
    p.add_argument("--save", type=Path, metavar="FILE.npz|FILE.csv", help="write the gait cycle")
    p.add_argument("--record", type=Path, metavar="FILE.rrd", help="record the walk")
    p.add_argument("--png", type=Path, metavar="FILE.png", help="draw a picture strip")
    p.add_argument("--plot", type=Path, metavar="FILE.svg", help="draw its curves on the norms")
    p.add_argument("--json", type=Path, metavar="FILE.json", help="write the gait's figures")
    p.add_argument("--quiet", action="store_true", help="print nothing but errors")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code."""
    try:
        return _run(_joined(sys.argv[1:] if argv is None else argv))
    except KeyboardInterrupt:
        return _complain("interrupted before there was a result", INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the reader of our output has left
        return FAILED
    except InvalidInputError as error:
        return _complain(f"error: {error}", BAD_INPUT)
    except EmptyPolyhedronError as error:
        return _complain(f"no weights explain this expert: {error}", FAILED)
    except WalkingIRLError as error:
        return _complain(f"failed: {error}", BAD_INPUT)
    except BrokenExecutor:
        return _complain("failed: a worker process died; is there enough memory?", FAILED)
    except OSError as error:
        return _complain(f"failed: {error}", BAD_INPUT)


def _run(argv: Sequence[str]) -> int:
    args = build_parser().parse_args(argv)
    from rich.console import Console  # heavy imports here: Ctrl-C is heard during them, too

    command = import_module(f"walking_irl.cli.{args.command}")
    return int(command.run(args, Console(highlight=False, soft_wrap=True)))


def _joined(argv: Sequence[str]) -> list[str]:
    """Arguments in which ``--weights -1,2`` is one: argparse would take -1,2 for an option."""
    out: list[str] = []
    for word in argv:
        if out and out[-1] == "--weights" and word[:1] == "-" and word[1:2] in tuple(".0123456789"):
            out[-1] = f"--weights={word}"
        else:
            out.append(word)
    return out


def _complain(sentence: str, code: int) -> int:
    print("walking-irl: " + " ".join(sentence.split()), file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
