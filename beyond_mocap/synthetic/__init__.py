"""Synthetic motion: parametric gaits, kicks, throws and other moves; recordings with ground truth."""
