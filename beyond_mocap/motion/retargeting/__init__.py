"""Retargeting a motion to other bones: anatomy, neutral stance, bone maps."""
