"""The command line, ``walking-irl COMMAND``: one module of this package a command.

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
from importlib import import_module
from itertools import pairwise
from typing import IO, NoReturn, cast

from walking_irl import __version__
from walking_irl.cli import BAD_INPUT, FAILED, INTERRUPTED
from walking_irl.cli.completion import SHELLS, PrintCompletion
from walking_irl.cli.output import Output
from walking_irl.errors import EmptyPolyhedronError, InvalidInputError, WalkingIRLError
from walking_irl.workers import interrupts_raised

COMMANDS = (
    "recover",
    "gait",
    "read",
    "predict",
    "tables",
    "study",
    "inspect",
    "view",
    "domains",
    "methods",
)
"""One module of this package each, with ``add_parser`` and ``run``."""
EXAMPLES = """
examples:
  walking-irl recover                          the main job: who walks like this, and what for?
  walking-irl recover --seed 7 --rollouts 0    another walker, known exactly
  walking-irl recover --weights 1,1,1,1,1,4    ground-truth weights of your own
  walking-irl recover --resume walking.checkpoint.npz --max-solves 40
  walking-irl gait --weights 1,2,1,1,1,5 --png gait.png
  walking-irl predict --weights 1,2,1,1,1,5 --slope 3 --load 10
  walking-irl read trial1.mot trial2.mot       what a recording of a person says
  walking-irl study --domain lqr --experts 100  how often are the intervals right?
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
        description="Inverse optimal control of walking: given how a humanoid walks, find out what "
        "it walks for.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"walking-irl {__version__}")
    parser.add_argument(
        "--print-completion",
        action=PrintCompletion,
        choices=SHELLS,
        help='print a script for your shell: eval "$(walking-irl --print-completion bash)"',
    )
    sub = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name in COMMANDS:
        command = import_module(f"walking_irl.cli.{name}")  # heavy: Ctrl-C is heard during it
        command.add_parser(sub).set_defaults(run=command.run)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code."""
    try:
        with interrupts_raised():
            return _run(_joined(sys.argv[1:] if argv is None else argv))
    except KeyboardInterrupt:
        return _complain("interrupted before there was a result", INTERRUPTED)
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
    for before, word in pairwise(["", *argv]):
        if not word or (word[:2] == "--" and word.endswith("=")):
            what = word.rstrip("=") or (before if before[:2] == "--" else "an argument")
            raise InvalidInputError(f"{what} is empty; is a variable of the shell not set?")
    args = build_parser().parse_args(argv)
    from rich.console import Console

    out = cast(IO[str], Output(sys.stdout))
    console = Console(file=out, highlight=False, soft_wrap=True)
    return int(args.run(args, console))


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
