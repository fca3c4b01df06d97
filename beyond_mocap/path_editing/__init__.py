"""Path editing: a recorded motion on another path."""
