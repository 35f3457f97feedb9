"""How a walking expert is drawn and recorded; light, so that ``--help`` loads no physics."""

from __future__ import annotations

from walking_irl.domains.contract import Option

OPTIONS = {
    "population": Option("typical", "how ground-truth weights are drawn", ("typical", "uniform")),
    "rollouts": Option(20, "rollouts recorded of the expert; 0: known exactly"),
    "noise": Option(0.02, "s.d. of the rollouts' random joint velocities [rad/s]"),
    "disturbance": Option(
        "initial",
        "when velocities are disturbed: at the start, or (kicks) in every cycle",
        ("initial", "kicks"),
    ),
}
RECORDING = ("rollouts", "noise", "disturbance")
"""Those that say how an expert is recorded."""
