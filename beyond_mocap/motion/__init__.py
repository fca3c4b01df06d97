"""Skeletons, quaternions, motions, tracks, contacts, retargeting. Needs numpy and scipy only."""
