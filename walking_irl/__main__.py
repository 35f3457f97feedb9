"""``python -m walking_irl``: the command line."""

import sys

from walking_irl.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
