"""walking_irl: given how a humanoid walks, find out what it walks for.

The objective weights of a walking gait are recovered by Cutting-Plane Inverse Reinforcement
Learning (CPIRL; S. Balloccu, Politecnico di Milano). Start at :mod:`walking_irl.cpirl.loop` for the
algorithm and :mod:`walking_irl.domains.humanoid` for the walker.
"""

__version__ = "0.1.0"
