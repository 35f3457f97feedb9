"""The walking humanoid: body, objectives, optimal gait, closed loop, expert.

Read in this order: :mod:`~.gait` (what a gait is), :mod:`~.objectives` (what it may be optimal
for), :mod:`~.transcription` and :mod:`~.solver` (how the best one is found), :mod:`~.policy` (how
it is walked), :mod:`~.demonstrator` and :mod:`~.protocol` (what is shown of an expert).
"""
