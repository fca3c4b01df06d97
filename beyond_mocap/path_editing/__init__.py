"""A recorded motion on another path (Path editing)."""
