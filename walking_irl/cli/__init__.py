"""The commands, one file each.

``add_parser`` adds the command to the parsers of :mod:`walking_irl.cli.main` and returns its own;
``run`` takes parsed arguments and a console, and returns an exit code.
"""

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
"""Exit codes; see :mod:`walking_irl.cli.main`."""
