"""The model that is fitted to markers: marker set, landmarks, calibration, subject (Fredriksson section 5.2)."""
