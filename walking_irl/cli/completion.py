"""``walking-irl --print-completion SHELL``: a script that completes commands, options and files."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from walking_irl.errors import InvalidInputError

SHELLS = ("bash", "zsh", "tcsh")


class PrintCompletion(argparse.Action):
    """Prints the script of the parser that it belongs to, and leaves."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Print and leave.

        Raises:
            InvalidInputError: If the package that writes such scripts is not installed.
        """
        try:
            import shtab
        except ImportError as error:
            raise InvalidInputError(
                "shell completion needs the package shtab: pip install 'walking-irl[completion]'"
            ) from error
        _complete_files(parser, shtab.FILE)
        print(shtab.complete(parser, shell=values))
        parser.exit(0)


def _complete_files(parser: argparse.ArgumentParser, file: Any) -> None:
    """Arguments that are paths are completed as such."""
    for action in parser._actions:
        if action.type is Path:
            action.complete = file  # type: ignore[attr-defined]
        if isinstance(action, argparse._SubParsersAction):
            for sub in action.choices.values():
                _complete_files(sub, file)
