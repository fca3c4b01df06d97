"""The pose in every frame, and the filters behind it (Fredriksson §5.3, §5.4)."""
