"""What the recordings of a library score themselves, measured once per library and frame rate."""
