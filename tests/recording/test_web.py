"""A recording in the browser: from this machine only, while the command runs, and not blank."""

import base64
import contextlib
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from PIL import Image

from walking_irl.cli.main import main
from walking_irl.errors import RecordingError
from walking_irl.recording import web

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRAWN_SECONDS = 150  # of software that draws on a busy machine


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("web") / "lqr.rrd"
    assert main(["recover", "--domain", "lqr", "--record", str(path), "--quiet"]) == 0
    return path


@contextlib.contextmanager
def command(file):
    """``view FILE --web`` and the address that it prints."""
    env = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    process = subprocess.Popen(
        [sys.executable, "-m", "walking_irl", "view", str(file), "--web"],
        env={**env, "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def ports(address):
    """Of the page and of the data behind it."""
    parts = urlsplit(address)
    (source,) = parse_qs(parts.query)["url"]
    assert parts.hostname == "127.0.0.1" and source.startswith("rerun+http://127.0.0.1:")
    return parts.port, urlsplit(source.removeprefix("rerun+")).port


def listeners(port):
    """Local addresses that listen on a port, as the kernel prints them."""
    found = []
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            local, state = line.split()[1], line.split()[3]
            if state == "0A" and int(local.split(":")[1], 16) == port:
                found.append(local.split(":")[0])
    return found


def closed(served):
    """Whether nobody listens any more, waiting a little."""
    deadline = time.monotonic() + 10
    while any(listeners(port) for port in served):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads Linux's table of sockets")
@pytest.mark.parametrize("signal_, code", [(signal.SIGINT, 0), (signal.SIGKILL, -9)])
def test_the_page_is_served_to_this_machine_only_and_ends_with_the_command(
    recording, signal_, code
):
    with command(recording) as (process, address):
        served = ports(address)
        for port in served:
            assert listeners(port) == ["0100007F"], "127.0.0.1 and nothing else"
        with urllib.request.urlopen(address, timeout=10) as page:
            assert page.status == 200 and b"Rerun Viewer" in page.read()
        process.send_signal(signal_)
        assert process.wait(20) == code
        assert closed(served)


def test_what_is_no_recording_is_refused(tmp_path, capsys):
    (tmp_path / "no.rrd").write_bytes(b"no")
    assert main(["view", str(tmp_path / "no.rrd"), "--web"]) == 2
    both = ["view", str(tmp_path / "no.rrd"), "--web", "--png", str(tmp_path / "a.png")]
    assert main(both) == 2
    assert "choose one of --web and --png" in capsys.readouterr().err


def test_a_viewer_that_does_not_start_is_an_error_with_its_reason(recording, monkeypatch):
    monkeypatch.setattr(web, "_viewer", lambda: shutil.which("false"))
    with pytest.raises(RecordingError, match="does not start"), web.serve(recording):
        pass


OPTIONS = (
    "--headless --no-sandbox --disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader "
    "--ignore-gpu-blocklist --disable-background-networking --disable-component-update "
    "--disable-sync --no-first-run --disable-dev-shm-usage --remote-debugging-port=0"
).split()
NO_OTHER_HOST = "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1"


@contextlib.contextmanager
def browser(folder):
    """A tab of headless Chromium that reaches this machine only: a function to command it."""
    from websockets.sync.client import connect  # MuJoCo's Python package brings it

    process = subprocess.Popen(
        [CHROMIUM, *OPTIONS, NO_OTHER_HOST, f"--user-data-dir={folder}", "--window-size=800,600"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        told = folder / "DevToolsActivePort"
        deadline = time.monotonic() + 60
        while not (told.exists() and told.read_text().strip()):
            assert time.monotonic() < deadline, "Chromium does not start"
            time.sleep(0.1)
        port = told.read_text().split()[0]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=30) as tabs:
            (tab,) = [t for t in json.loads(tabs.read()) if t["type"] == "page"]
        with connect(tab["webSocketDebuggerUrl"], max_size=None) as socket:

            def call(method, **parameters):
                socket.send(json.dumps({"id": 1, "method": method, "params": parameters}))
                while True:
                    answer = json.loads(socket.recv(timeout=DRAWN_SECONDS))
                    if answer.get("id") == 1:
                        return answer.get("result", {})

            yield call
    finally:
        process.terminate()
        process.wait()


def colours(call):
    """Picture of the tab (h, w, 3), and how many colours it has."""
    shot = call("Page.captureScreenshot", format="png")
    if "data" not in shot:  # the page is being exchanged
        return np.zeros((1, 1, 3)), 1
    data = base64.b64decode(shot["data"])
    picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
    return picture, len(np.unique(picture.reshape(-1, 3), axis=0))


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="needs a browser: apt-get install chromium")
def test_chromium_draws_the_recording(recording, tmp_path):
    """The empty page has a few dozen colours; learner, expert, set and curves have hundreds."""
    with web.serve(recording) as server, browser(tmp_path) as call:
        call("Page.navigate", url=server.address)
        deadline = time.monotonic() + DRAWN_SECONDS
        while True:
            picture, n_colours = colours(call)
            reds = (picture[..., 0] > 180) & (picture[..., 1] < 80) & (picture[..., 2] < 100)
            if n_colours > 300 and reds.sum() > 100:  # the expert's red
                break
            assert time.monotonic() < deadline, f"{n_colours} colours, {reds.sum()} red pixels"
            time.sleep(1.0)
        title = call("Runtime.evaluate", expression="document.title")["result"]["value"]
        assert title == "Rerun Viewer"
