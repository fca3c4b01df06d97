"""A whole match: everybody's motion from tracking."""
