"""Events of a match: providers' files and plain tables."""
