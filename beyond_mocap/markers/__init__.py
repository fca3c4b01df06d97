"""Optical markers become the motion of a skeleton (Fredriksson §3.4, §3.5, §5)."""
