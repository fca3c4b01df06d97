"""Optical markers: cleaned, put on a model of the body, and turned into motion (Fredriksson §3.4, §3.5, §5)."""
