"""A tracked player: samples as a feed delivers them, corrected, and brought to an even rate.

    track = files.tracking.tracking.read_track_csv("player.csv")
    track, report = clean_track(track)
    sampled = sample_track(track, fps=30)
"""

from .cleaning import FASTEST, DataReport, clean
from .data import BALL_RADIUS, SampledTrack, Track, at_sentinel
from .sampling import SMOOTHING_SECONDS, sample, smoothed, travel_direction, zero_phase_hann

__all__ = [
    "BALL_RADIUS", "FASTEST", "SMOOTHING_SECONDS", "DataReport", "SampledTrack", "Track", "at_sentinel", "clean",
    "sample", "smoothed", "travel_direction", "zero_phase_hann",
]
