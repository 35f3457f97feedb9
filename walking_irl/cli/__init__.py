"""The commands, one file each: ``run`` takes parsed arguments and a console, returns a code."""

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
"""Exit codes; see :mod:`walking_irl.cli.main`."""
