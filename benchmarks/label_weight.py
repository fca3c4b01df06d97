"""The weight of labels against continuity in the searches `blocks` and `distance`, fitted to the rescaled cost.

The thesis found 0.2 by experiment for its own continuity cost. Here that cost is divided by a library's typical
distance, so the weight has to be found again (`search.block_costs.FITTED_ALPHA`). It is fitted on recordings and a
match that no other section reports on: the libraries FIT_LIBRARIES, and windows of another match's players. Labels come
from the speed alone, as in most of a match.

The fitted weight is the smallest at which the labels are met within SLACK of the best that any weight reaches, mean
over both methods, libraries and windows: labels as well as the library has them, and no cut harder than that needs.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks import effort
from benchmarks.places import DATA, link_recordings
from beyond_mocap.annotation import labels_per_frame
from beyond_mocap.evaluation.annotation_similarity import measure_similarity
from beyond_mocap.files.tracking.tracking import read_match
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track, clean_track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.quality.movement import TRANSITION_TO_JERK, compute_jerk, compute_window_maxima
from beyond_mocap.synthesis.search.block_costs import FITTED_ALPHA, rescale_alpha
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthesis.take import Take

FIT_LIBRARIES = (("bandai", "lmd/Player2"), ("lmd/Player4", "lmd/Player6", "getup"))
FIT_MATCH = DATA / "tracking" / "match" / "dutch_6min.dat"
WINDOWS, SECONDS = (30.0, 120.0, 210.0, 300.0), 15.0  # s at which windows of players begin, and their length
EVERY = 6  # players between two windows
WEIGHTS = (0.1, 0.2, 0.35, 0.5, 0.6, 0.7, 0.8, 0.9)
METHODS = ("blocks", "distance")
SLACK = 0.05  # of the similarity, from -1 to 1


def section() -> list[str]:
    """Build the lines for results.md."""
    if not FIT_MATCH.is_file():
        return [f"{FIT_MATCH.name} is missing; skipped"]
    found = {(method, weight): [] for method in METHODS for weight in WEIGHTS}
    with tempfile.TemporaryDirectory() as place:
        tracks = read_tracks(place)
        for kinds in FIT_LIBRARIES:
            folder = link_recordings(kinds, Path(place) / kinds[0].replace("/", "_"))
            library = build_library(folder, cache_dir=Path(place) / "cache")
            for (method, weight), rows in found.items():
                rows += [measure_take(library, track, method, weight) for track in tracks]
    return format_fit(found)


def read_tracks(place: str) -> list[Track]:
    """Read the windows of the match, each of another player."""
    match = read_match(FIT_MATCH, cache_dir=place)
    players = match.players[::EVERY]
    return [clean_track(match.track(player.id, start, start + SECONDS))[0] for player, start in zip(players, WINDOWS)]


def measure_take(library: Library, track: Track, method: str, weight: float) -> tuple[float, float, float]:
    """Measure a take: how its labels are met (-1 to 1), cuts per minute, and median jerk at cuts, m/s^3."""
    plan = Plan(track=track, library=library.folder, method=method, alpha=find_setting_of(weight))
    take = synthesize(library, plan)
    times = take.start_time + np.arange(len(take.motion)) / take.motion.fps
    similarity = np.nanmean(measure_similarity(labels_per_frame(take.timeline, times), take.words))
    return float(similarity), 60.0 * len(take.seams) / take.motion.duration, measure_cut_jerk(take)


def find_setting_of(weight: float) -> float:
    """Find the setting alpha that becomes a weight: the inverse of `rescale_alpha`, whose ratio is constant."""
    ratio = FITTED_ALPHA / (1.0 - FITTED_ALPHA) * (1.0 - Plan.alpha) / Plan.alpha
    setting = weight / (weight + ratio * (1.0 - weight))
    assert abs(rescale_alpha(setting) - weight) < 1e-9
    return setting


def measure_cut_jerk(take: Take) -> float:
    """Measure the median of the largest jerk around each cut, m/s^3; NaN without a cut."""
    positions, _ = forward_kinematics(take.motion)
    jerk = compute_window_maxima(compute_jerk(positions, take.motion.fps))
    return float(np.median(jerk[np.clip(take.seams - TRANSITION_TO_JERK, 0, len(jerk) - 1)])) if len(take.seams) \
        else np.nan


def format_fit(found: Mapping[tuple[str, float], list[tuple[float, float, float]]]) -> list[str]:
    """Format a row for each weight, and the fitted one.

    Args:
        found: (method, weight) -> figures of each take, as `measure_take` returns them.
    """
    means = {of: np.nanmean(np.array(rows), axis=0) for of, rows in found.items()}
    columns = ["similarity", "cuts a minute", "jerk at cuts, m/s^3"]
    lines = effort.format_head(["weight", "setting", *(f"{method}: {name}" for method in METHODS for name in columns)])
    for weight in WEIGHTS:
        cells = [f"{value:.{digits}f}" for method in METHODS for value, digits in zip(means[method, weight], (2, 0, 0))]
        lines.append(effort.format_row([f"{weight:g}", f"{find_setting_of(weight):.2f}", *cells]))
    fitted = fit_weight({weight: np.mean([means[method, weight][0] for method in METHODS]) for weight in WEIGHTS})
    return [*lines, "", f"Fitted: {fitted:g}; the program has {FITTED_ALPHA:g} (setting {Plan.alpha:g})."]


def fit_weight(similarity: Mapping[float, float]) -> float:
    """Find the smallest weight whose similarity is within SLACK of the best."""
    best = min(similarity.values())
    return min(weight for weight, value in similarity.items() if value <= best + SLACK)
