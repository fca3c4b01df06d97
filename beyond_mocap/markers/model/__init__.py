"""The model that is fitted to markers: set, landmarks, calibration, subject (Fredriksson §5.2)."""
