"""A person's walk
===============

Motion-capture programs write joint angles over time: OpenSim's ``.mot``, clinical tables as ``.csv``.
``walking-irl read`` says what it understands of such a file, or in one sentence why it does not.
"""

# %%
# We have no right to ship a person's recording, so this one is made: a model's gait, from a random
# instant on, at 100 Hz, in degrees and with noise, as OpenSim would write it.

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait.curves import PHASES
from walking_irl.domains.humanoid.gait.gait import whole_cycle
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.gait.norm_curves import norm_set
from walking_irl.domains.humanoid.gait.realism import leg_length
from walking_irl.domains.humanoid.recorded.person_curves import person_curves
from walking_irl.domains.humanoid.recorded.reader import read_person

walker, gait = load_walker(), load_gaits()["effort x3"]
rng = np.random.default_rng(0)
cycle, T = whole_cycle(gait, walker.mirror), 2 * gait.half_period
time = np.arange(0, 2.3 * T, 0.01)


def column(joint, unit, noise):
    """A joint over time."""
    q, way = cycle[:, walker.joints.index(joint)], 2 * gait.step_length
    phase = time / T + 0.3
    drift = way * np.arange(len(q)) / len(q) if joint == "root_x" else np.zeros(len(q))
    q = np.append(q - drift, (q - drift)[0])
    values = np.interp(phase % 1 * (len(q) - 1), np.arange(len(q)), q)
    values += way * phase if joint == "root_x" else 0.0
    return unit * values + rng.normal(0, noise, len(time))


columns = {"time": time, "pelvis_tx": column("root_x", 1, 1e-3)}
columns["pelvis_ty"] = column("root_z", 1, 1e-3) + 1.0
columns["pelvis_tz"] = 0 * time
columns["pelvis_tilt"] = -column("root_pitch", np.degrees(1), 0.3)
NAMES = {"hip_flexion": "hip_flexion", "knee": "knee_angle", "ankle": "ankle_angle"}
for side in "rl":
    for joint, name in NAMES.items():
        columns[f"{name}_{side}"] = column(f"{joint}_{side}", np.degrees(1), 0.3)
path = Path(tempfile.mkdtemp()) / "trial1.mot"
head = f"trial1\nversion=1\nnRows={len(time)}\nnColumns={len(columns)}\ninDegrees=yes\nendheader\n"
np.savetxt(
    path, np.transpose(list(columns.values())), fmt="%.6f", delimiter="\t",
    header=head + "\t".join(columns), comments="",
)  # fmt: skip

# %%
# What is understood of it. Joints that the file does not have are named; several files are averaged.

person = read_person([path], walker)
print(f"{person.format}, {person.rate:.0f} Hz, {person.unit}, {person.cycles} cycles")
print(f"{person.speed:.2f} m/s (made with {gait.speed:.2f}), {person.cadence:.0f} steps per minute")
print("not in the file:", ", ".join(person.missing))
assert abs(person.speed - gait.speed) < 0.05

# %%
# Beside the band of healthy adults:

curves, norms = person_curves(person, walker), norm_set("adults", person.speed, leg_length(walker))
fig, axes = plt.subplots(1, 3, figsize=(10, 2.8), constrained_layout=True)
for axis, name in zip(axes, ("hip_flexion", "knee_flexion", "ankle_dorsiflexion"), strict=True):
    norm = norms.curves[name]
    axis.fill_between(PHASES, norm.mean - norm.sd, norm.mean + norm.sd, color="0.85")
    axis.plot(PHASES, curves[name], color="tab:blue")
    axis.set(title=name.replace("_", " "), xlabel="gait cycle [%]", ylabel="degrees")

# %%
# *Grey: mean and one standard deviation of adults.* The same from the command line, and then the
# question what this person walks for::
#
#     walking-irl read trial1.mot --save person.npz --plot person.svg
#     walking-irl recover --demonstration person.npz --mode minimise
