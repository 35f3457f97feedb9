"""One recovery, from what was asked to what was found."""
