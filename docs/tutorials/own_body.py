"""A body of your own
==================

A body is an MJCF file with the joints, motors and sensors of a shipped one. Here the planar walker
gets a longer shank and a heavier trunk; its gaits are found from the shipped ones.
"""

# %%
# Any editor will do; MuJoCo's own is the safest.

import tempfile
from pathlib import Path

import mujoco
import numpy as np

from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.learner import search
from walking_irl.files import model_path

spec = mujoco.MjSpec.from_string(model_path("humanoid_planar.xml").read_text())
for side in "rl":
    foot = spec.body(f"foot_{side}")
    foot.pos = foot.pos * 1.05
for geom in spec.body("torso").geoms:
    geom.mass *= 1.3
spec.compile()
path = Path(tempfile.mkdtemp()) / "mine.xml"
path.write_text(spec.to_xml())

# %%
# The file's path is the name of the body, here as in ``walking-irl recover --body mine.xml``.

domain, shipped = Humanoid(path), Humanoid("humanoid-planar")
print(f"{domain.walker.mass:.1f} kg instead of {shipped.walker.mass:.1f} kg")

# %%
# Its best gait for the reference weights, beside that of the shipped body:

best = search(domain.spec, domain.spec.stack.reference_weights, starts=1)
for label, gait in (
    ("shipped", load_gaits("humanoid-planar")["reference"]),
    ("mine", best.policy),
):
    print(f"{label:8s} {gait.speed:.2f} m/s, {60 / gait.half_period:.0f} steps per minute")
assert np.isfinite(best.mu).all() and best.policy.speed > 0.5

# %%
# Gaits of a body with other joints cannot be found from the shipped ones: put them beside the model as
# ``mine_gaits.npz``, as ``models/make_gaits.py`` makes them.
