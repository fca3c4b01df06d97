"""A tracked player: samples as a feed delivers them, corrected, and brought to an even rate.

    track = files.tracking.tracking.read_track_csv("player.csv")
    track, report = clean_track(track)
    sampled = sample_track(track, fps=30)
"""

from .cleaning import MAX_SPEED, DataReport, clean_track
from .data import BALL_RADIUS, SampledTrack, Track, is_ball_sentinel
from .sampling import (
    SMOOTHING_SECONDS,
    compute_travel_direction,
    sample_track,
    smooth_positions,
    smooth_zero_phase_hann,
)

__all__ = [
    "BALL_RADIUS", "MAX_SPEED", "SMOOTHING_SECONDS", "DataReport", "SampledTrack", "Track", "is_ball_sentinel",
    "clean_track", "sample_track", "smooth_positions", "compute_travel_direction", "smooth_zero_phase_hann",
]
