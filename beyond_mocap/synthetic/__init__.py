"""Parametric motion: gait, kicks, throws, gestures of synthetic performers."""
