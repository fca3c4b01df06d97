"""Solve the pose of every frame, and filter the motion (Fredriksson sections 5.3 and 5.4)."""
