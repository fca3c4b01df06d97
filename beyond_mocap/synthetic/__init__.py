"""Parametric gaits, kicks and throws; recordings with known answers."""
