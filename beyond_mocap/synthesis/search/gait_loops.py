"""The plain baseline: the recording of each gait that is nearest in speed, looped for as long as the gait lasts.

It is what a broadcast without motion synthesis shows: a walk, a jog and a run on the track, and no actions. What the
library leaves out of locomotion is shown only in gaits that have nothing else.
"""

from __future__ import annotations

import numpy as np

from ...annotation import DISCRETE
from ...annotation.vocabulary import DIRECTIONS
from ...base.errors import InputError
from ...base.time_series import find_equal_runs, find_runs
from ...library.coverage import select_calm_frames
from ...library.features import Frames
from ...library.library import Gait, Library
from .block_costs import compute_distances
from .edit_list import EditList, find_transitions
from .request import SearchRequest

LEAST_SECONDS, MOST_SECONDS = 0.6, 10.0
"""Shortest and longest loop: a stride of a sprint takes 0.45 s, so that one loop has a whole stride or two."""


def build_gait_loops(library: Library, request: SearchRequest) -> EditList:
    """Build the edit list that loops a recording for each gait of a request.

    Args:
        library: the clips.
        request: the request; its key moments are ignored.
    """
    loops = {gait: find_gait_loop(library, request, gait) for gait in sorted(set(request.gait.tolist()))}
    clip, frame = np.empty(len(request), int), np.empty(len(request))
    for low, high in find_equal_runs(request.gait):
        first, end = loops[int(request.gait[low])]
        frame[low:high] = first + np.arange(high - low) % (end - first)
        clip[low:high] = library.frames.clip[first]
    return EditList(clip, frame, find_transitions(clip, frame), ())


def find_gait_loop(library: Library, request: SearchRequest, gait: int) -> tuple[int, int]:
    """Find the loop of a gait: in the stretch whose mean speed is nearest to the track's while it has that gait, or
    that is of the requested style.

    Args:
        library: the clips.
        request: the request.
        gait: index into the library's gaits; where it has no stretch, the nearest gait that has.
    Returns:
        First library frame, and the frame after its last, which looks like the first.
    """
    frames, off_style = library.frames, request.style_cost
    belongs = select_calm_frames(library.clips, frames, library.fps, library.strangeness)
    if off_style is not None:
        belongs |= off_style == 0.0  # a requested style belongs, whatever it looks like
    nearest = sorted(range(len(library.gaits)), key=lambda other: (abs(other - gait), other))
    each = (_list_stretches(library, request, library.gaits[other], belongs) for other in nearest)
    stretches = next(filter(None, each), None)
    if stretches is None:
        raise InputError(library.folder, "no clip shows a gait forwards and nothing else",
                         "clips annotated walking, jogging or running", "label the clips that do")
    wanted = float(request.track.speed[request.gait == gait].mean())
    missed = np.array([abs(float(frames.speed[low:high].mean()) - wanted) for low, high in stretches])
    if off_style is not None:
        missed += [float(off_style[low:high].mean()) for low, high in stretches]
    return _cut_loop(library, *stretches[int(np.argmin(missed))])


def _list_stretches(library: Library, request: SearchRequest, gait: Gait, belongs: np.ndarray) -> list[tuple[int, int]]:
    """List the stretches of clips that show a gait forwards and nothing else, as recorded, and long enough to loop.

    These are stretches of frames `belongs` (N,) bool; where none of them is long enough, of any frames; and where all
    are shorter, the longest ones.
    """
    frames, least = library.frames, round(LEAST_SECONDS * library.fps) + 1
    column = [word == gait.label for word in frames.vocabulary]
    other = [word in DISCRETE or word in DIRECTIONS[1:] for word in frames.vocabulary]
    shown = frames.words[:, column].any(axis=1) & ~frames.words[:, other].any(axis=1)
    shown &= (request.allowed & ~np.array([clip.mirrored for clip in library.clips]))[frames.clip]
    if calm := [run for run in _find_clip_runs(frames, shown & belongs) if run[1] - run[0] >= least]:
        return calm
    runs = _find_clip_runs(frames, shown)
    longest = max((high - low for low, high in runs), default=0)
    return [(low, high) for low, high in runs if high - low >= min(least, longest)]


def _find_clip_runs(frames: Frames, shown: np.ndarray) -> list[tuple[int, int]]:
    """Find the runs (first, end) of frames `shown` (N,) bool, each within one clip."""
    return [(low + a, low + b) for low, high in find_equal_runs(frames.clip) for a, b in find_runs(shown[low:high])]


def _cut_loop(library: Library, low: int, high: int) -> tuple[int, int]:
    """Cut the loop out of a stretch: of all that are long enough, the one whose end passes best into its beginning."""
    high = min(high, low + round(MOST_SECONDS * library.fps))
    least = round(LEAST_SECONDS * library.fps)
    if high - low <= least:
        return low, high
    features = library.frames.features[low:high]
    gap = compute_distances(features, features)
    gap[np.tri(len(gap), k=least - 1, dtype=bool)] = np.inf  # the end at least so many frames after the beginning
    first, end = np.unravel_index(int(np.argmin(gap)), gap.shape)
    return low + int(first), low + int(end)
