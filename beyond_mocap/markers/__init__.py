"""Reconstruct the motion of a skeleton from optical markers (Fredriksson sections 3.4, 3.5 and 5)."""
