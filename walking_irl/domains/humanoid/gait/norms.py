"""Bands of healthy adults that a gait is judged by.

Sources of the bands: joint angles from normal adult curves at self-selected speed (CGM2.3 set; J.
Perry, J. Burnfield 2010, Gait Analysis, 2nd ed.); stance, force peaks, excursions, moments and
powers: D. A. Winter (2009), Biomechanics and Motor Control of Human Movement, 4th ed.; step length
and cadence: D. W. Grieve, R. J. Gear (1966), Ergonomics 9:379; toe clearance: D. A. Winter (1992),
Phys. Ther. 72:45; arm swing in antiphase: S. H. Collins et al. (2009), Proc. R. Soc. B 276:3679.
"""

from __future__ import annotations

from typing import NamedTuple


class Band(NamedTuple):
    """Normal range of a metric, and where its score reaches zero on either side."""

    low: float
    high: float
    zero_low: float
    zero_high: float
    unit: str

    def score(self, value: float) -> float:
        """1 in the band, linear to 0 outside.

        >>> Band(1, 2, 0, 4, "m").score(3.0)
        0.5
        """
        if value < self.low:
            return max(0.0, (value - self.zero_low) / (self.low - self.zero_low))
        if value > self.high:
            return max(0.0, (self.zero_high - value) / (self.zero_high - self.high))
        return 1.0


GROUPS: dict[str, dict[str, Band]] = {
    "temporal": {
        "cadence": Band(105, 122, 90, 137, "1/min"),
        "step_length": Band(0.64, 0.74, 0.54, 0.84, "m"),
        "stance": Band(59, 64, 54, 69, "%"),
        "double_support": Band(18, 27, 8, 37, "%"),
    },
    "vertical_force": {
        "first_peak": Band(1.02, 1.2, 0.97, 1.4, "BW"),
        "second_peak": Band(1.02, 1.2, 0.97, 1.4, "BW"),
        "valley": Band(0.65, 0.85, 0.5, 0.98, "BW"),
        "first_peak_time": Band(18, 32, 8, 42, "% of stance"),
        "second_peak_time": Band(70, 82, 60, 92, "% of stance"),
    },
    "centre_of_mass": {
        "com_vertical": Band(0.025, 0.05, 0, 0.075, "m"),
        "com_lateral": Band(0.02, 0.055, 0, 0.09, "m"),
        "step_width": Band(0.07, 0.14, 0, 0.21, "m"),
    },
    "hip": {
        "hip_max": Band(24, 38, 14, 48, "deg"),
        "hip_min": Band(-20, -4, -30, 6, "deg"),
    },
    "knee": {
        "knee_contact": Band(-2, 11, -10, 21, "deg"),
        "knee_loading": Band(10, 25, 2, 35, "deg"),
        "knee_mid_stance": Band(-2, 12, -10, 22, "deg"),
        "knee_swing": Band(52, 68, 42, 78, "deg"),
    },
    "ankle": {
        "ankle_contact": Band(-6, 6, -14, 14, "deg"),
        "ankle_dorsiflexion": Band(6, 16, 0, 24, "deg"),
        "ankle_plantarflexion": Band(-26, -8, -36, 0, "deg"),
    },
    "foot": {
        "foot_pitch_contact": Band(12, 32, 0, 42, "deg"),
        "toe_clearance": Band(0.008, 0.03, 0, 0.06, "m"),
    },
    "arms": {
        "arm_range": Band(18, 45, 5, 65, "deg"),
        "arm_antiphase": Band(0.8, 1.01, 0.2, 1.02, "1"),
    },
    "trunk": {
        "trunk_pitch": Band(0, 5, -1, 10, "deg"),
        "trunk_roll": Band(0, 8, -1, 15, "deg"),
        "pelvis_yaw": Band(4, 14, 0, 24, "deg"),
        "pelvis_list": Band(4, 12, 0, 20, "deg"),
    },
    "energy": {
        "ankle_power": Band(1.8, 3.8, 0.6, 5.2, "W/kg"),
        "ankle_moment": Band(1.2, 1.8, 0.8, 2.2, "Nm/kg"),
        "positive_work": Band(0.3, 0.65, 0.1, 1.1, "J/kg/m"),
    },
}
"""Metrics and their bands, by group."""

LATERAL = ("com_lateral", "step_width", "trunk_roll", "pelvis_yaw", "pelvis_list")
"""Metrics that a planar walker has not got; its groups leave them out."""
