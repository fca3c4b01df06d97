"""Skeletons, quaternions, motions, tracks, contacts and retargeting. Needs numpy and scipy only."""
