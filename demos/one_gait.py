"""Six very different walks of one body: the reference with one objective weighed three times.

    python demos/one_gait.py [--record gaits.rrd] [--png gaits.png]

Needs no screen; the picture needs OpenGL (apt-get install libegl1 or libosmesa6).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import rerun as rr

from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.gait import Gait, whole_cycle
from walking_irl.domains.humanoid.gait.pictures import SIDE, photograph
from walking_irl.files import write_file, write_png
from walking_irl.recording import Clock
from walking_irl.recording.blueprint import motion_blueprint
from walking_irl.recording.stream import FLUSH_SECONDS, open_stream
from walking_irl.recording.views.registry import world_of
from walking_irl.workers import workers

POSTURES = 6
TIMES = 3.0


def main() -> None:
    """Solve for six gaits, record them one after the other, draw them one below the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--record", type=Path, default=Path("gaits.rrd"), metavar="FILE.rrd")
    parser.add_argument("--png", type=Path, default=Path("gaits.png"), metavar="FILE.png")
    parser.add_argument("--planar", action="store_true", help="a smaller body, in a plane")
    args = parser.parse_args()

    domain = Humanoid("humanoid-planar" if args.planar else "humanoid")
    names = [o.name for o in domain.objectives]
    reference = domain.spec.stack.reference_weights
    gaits: dict[str, Gait] = {}
    costs = []
    print("weighed most" + "".join(f"{name:>10s}" for name in names) + "       m/s")
    with workers() as executor:
        for j, name in enumerate(names):
            w = reference * np.where(np.arange(len(names)) == j, TIMES, 1.0)
            response = domain.forward(w / w.sum(), executor)
            gaits[name] = response.policy
            costs.append(-response.mu)
            row = "".join(f"{cost:10.4f}" for cost in costs[-1])
            print(f"{name:12s}{row}{gaits[name].speed:10.3f}", flush=True)
    best = sum(int(np.argmin(column)) == j for j, column in enumerate(np.transpose(costs)))
    print(f"each cost is lowest in the gait that weighs it most: {best} of {len(names)}")

    record(args.record, domain, gaits)
    write_png(args.png, np.vstack([photo_row(domain, gait) for gait in gaits.values()]))
    print(f"wrote {args.record} and {args.png}, rows in the order above")


def record(path: Path, domain: Humanoid, gaits: dict[str, Gait]) -> None:
    """Eight cycles of each gait, one after the other."""
    stream, memory = open_stream()
    view, motion = world_of(domain)
    stream.send_blueprint(motion_blueprint(view, {}))
    stream.send_recording_name("six gaits")
    view.log_static(stream)
    first = 0
    for k, (name, gait) in enumerate(gaits.items()):
        clock = Clock(first, k)
        clock.set(stream)
        text = f"# {name} x {TIMES:g}\n\n{gait.speed:.2f} m/s, steps of {gait.step_length:.2f} m"
        stream.log("summary", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))
        first += view.log_iteration(stream, clock, motion(gait), True)
    stream.flush(timeout_sec=FLUSH_SECONDS)
    write_file(path, memory.drain_as_bytes())


def photo_row(domain: Humanoid, gait: Gait) -> np.ndarray:
    """Postures of a cycle, from the side."""
    q = whole_cycle(gait, domain.walker.mirror)
    at = np.linspace(0, len(q), POSTURES, endpoint=False).astype(int)
    return np.hstack(photograph(domain.walker, [(q[i], SIDE) for i in at], height=260, width=170))


if __name__ == "__main__":  # worker processes import this file
    main()
