"""The walking humanoid: body, costs, optimal gait, closed loop, expert.

Read in this order: :mod:`~.gait.gait` (what a gait is), :mod:`~.costs.base` (what it may be optimal
for), :mod:`~.optimiser.transcription` and :mod:`~.optimiser.solver` (how the best one is found),
:mod:`~.closed_loop.policy` (how it is walked), :mod:`~.expert_search` and
:mod:`~.closed_loop.trials` (what is shown of an expert).
"""
