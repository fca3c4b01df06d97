"""The work of a match in pieces that any number of processes do."""
