"""What does the average adult walk for? Normative mean curves, read like any recording.

    python demos/average_adult.py [--starts 3] [--json adult.json] [--save average_adult.csv]

The curves (models/norms/adults.csv, source and licence there) are means over healthy adults at
self-selected speed, angles of one side over the gait cycle; how long a cycle takes is not among
them, so it is the middle of the band of adults' cadence.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from walking_irl.domains.humanoid.gait.norm_curves import PHASES, norm_set
from walking_irl.domains.humanoid.gait.norms import GROUPS
from walking_irl.domains.humanoid.recorded.person import Options
from walking_irl.domains.humanoid.recorded.reader import read_person
from walking_irl.domains.humanoid.spec import HUMANOID
from walking_irl.files import write_file, write_json
from walking_irl.run.walk import explain, nearest, starting_weights
from walking_irl.run.walk_report import explanation_json
from walking_irl.workers import workers

ANGLES = ("pelvis_tilt", "pelvis_obliquity", "pelvis_rotation", "hip_flexion", "hip_adduction",
          "hip_rotation", "knee_flexion", "ankle_dorsiflexion")  # fmt: skip


def main() -> None:
    """Write the curves as a recording, read it, find the nearest gait and the weights."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=3, choices=(1, 2, 3), help="of the search")
    parser.add_argument("--json", type=Path, metavar="FILE.json", help="write the answer")
    parser.add_argument("--save", type=Path, metavar="FILE.csv", help="keep the recording")
    args = parser.parse_args()

    with tempfile.TemporaryDirectory() as folder:
        path = args.save or Path(folder) / "average_adult.csv"
        write_file(path, recording().encode())
        person = read_person([path], HUMANOID.walker, Options(cycle_time=cycle_time()))
    print(f"{person.speed:.2f} m/s, {person.cadence:.0f} steps a minute; not recorded: "
          f"{', '.join(person.missing)}")  # fmt: skip
    walk = person.walk
    reference = HUMANOID.stack.reference_weights
    with workers() as executor:
        near = nearest(HUMANOID, walk, executor)
        print(f"nearest gait of the body: {near.sagittal:.1f} degrees at hips, knees and ankles")
        starts = starting_weights(reference)[: args.starts]
        found = explain(HUMANOID, walk, near, starts=starts, executor=executor)
    low, high = (100 * b for b in found.bracket)
    print(f"walks {low:.1f} to {high:.1f} % dearer than the best gait for these weights:")
    for objective, w, half in zip(HUMANOID.stack.objectives, found.w, found.half, strict=True):
        print(f"  {objective.name:10s} {w:.3f} +- {half:.3f}")
    best = found.end.gait
    print(f"the best gait: {found.sagittal:.1f} degrees from the curves, {best.speed:.2f} m/s, "
          f"steps of {best.step_length:.2f} m ({person.gait.step_length:.2f})")  # fmt: skip
    if args.json is not None:
        write_json(args.json, explanation_json(found, person.gait))


def recording() -> str:
    """The mean curves as a table in percent of the gait cycle, degrees, clinical signs."""
    curves = norm_set("adults", 1.25, 0.9).curves
    rows = np.column_stack([PHASES, *(curves[name].mean for name in ANGLES)])
    lines = [",".join(["percent", *ANGLES]), *(",".join(f"{v:.3f}" for v in row) for row in rows)]
    return "\n".join(lines) + "\n"


def cycle_time() -> float:
    """Duration of a gait cycle at the middle of adults' cadence [s]."""
    bands = {name: band for group in GROUPS.values() for name, band in group.items()}
    return 120.0 / float(np.mean(bands["cadence"][1:3]))


if __name__ == "__main__":
    main()
