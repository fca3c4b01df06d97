"""A recorded motion on another path."""
