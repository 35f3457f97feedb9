"""The commands, one file each: ``run`` takes parsed arguments and a console, returns a code."""
