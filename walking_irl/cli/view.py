"""``walking-irl view``: a recording in the viewer, or as a picture where there is no screen."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape

from walking_irl.cli import browser
from walking_irl.errors import InvalidInputError
from walking_irl.files import check_ending, check_outputs

SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser."""
    p: argparse.ArgumentParser = commands.add_parser(
        "view", help="open a recording in the viewer, or render it to a picture"
    )
    p.add_argument("file", type=Path, metavar="FILE.rrd")
    p.add_argument(
        "--png", type=Path, metavar="FILE.png", help="render a picture without a screen instead"
    )
    p.add_argument(
        "--web", action="store_true", help="serve it to a browser on this machine, until Ctrl-C"
    )
    p.add_argument("--frame", type=int, help="frame to render (default: the last)")
    return p


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl view``."""
    from walking_irl.recording.screenshot import open_viewer, save_screenshot

    if args.web:
        if args.png is not None:
            raise InvalidInputError("choose one of --web and --png")
        return browser.show(args.file, console)
    if args.png is None:
        if sys.platform.startswith("linux") and not any(map(os.environ.get, SCREENS)):
            raise InvalidInputError(
                "there is no screen for the viewer; render a picture with --png FILE.png, serve it "
                "to a browser with --web, or copy the file to a machine with a screen"
            )
        open_viewer(args.file)
        console.print("the viewer is opening; move the frame slider to play")
    else:
        check_ending(args.png, ".png")
        check_outputs([args.png], inputs=[args.file])
        save_screenshot(args.file, args.png, frame=args.frame)
        console.print(f"wrote {escape(str(args.png))}")
    return 0
