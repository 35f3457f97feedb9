"""``walking-irl view FILE --web``: a recording in the browser, until Ctrl-C."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path

from rich.console import Console

SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")


def show(file: Path, console: Console) -> int:
    """Serve a recording on the loopback address, and open it where there is a screen."""
    from walking_irl.recording.web import serve

    with serve(file) as server:
        try:
            console.print(f"{server.address}\nCtrl-C ends it", soft_wrap=True, markup=False)
            if not sys.platform.startswith("linux") or any(map(os.environ.get, SCREENS)):
                webbrowser.open(server.address)
            server.wait()
        except KeyboardInterrupt:
            console.print("ended")
    return 0
