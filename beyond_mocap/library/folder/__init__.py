"""A library's folder: its recordings, their labels, and what is not used of both."""
