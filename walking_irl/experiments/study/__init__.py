"""Studies: many experts of one kind, recovered side by side, and how often intervals are right."""

from walking_irl.experiments.study.study import Study, run_study

__all__ = ["Study", "run_study"]
