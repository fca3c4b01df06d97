"""Pictures and videos of a study."""
