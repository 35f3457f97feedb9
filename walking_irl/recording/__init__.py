"""Recordings for the Rerun viewer; the only package that imports ``rerun``."""

from __future__ import annotations

from walking_irl.recording.experiment import Clock, Experiment, Other
from walking_irl.recording.writer import Recorder, record_motion

__all__ = ["Clock", "Experiment", "Other", "Recorder", "record_motion"]
