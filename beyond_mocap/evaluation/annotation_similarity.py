"""How well the motion matches the requested labels: Faustino's annotation similarity (§3.2.2 eq. 18).

It is measured as printed, and over the requested labels only. Labels are sets per frame; sides are those after
mirroring. Frames without requested labels (a transition, or unknown) are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ..annotation import Timeline, choose_gaits, fill_timeline, labels_per_frame
from ..base.errors import InputError
from ..library.automatic_locomotion import build_automatic_labels
from ..library.keys import Key, select_nearest_keys
from ..motion.track import SampledTrack, sample_track
from ..synthesis.heading_plan import plan_track, rest_track
from ..synthesis.quality.moments import KeyMomentResult, extend_with_synthetic
from .view import View


def measure_annotation_similarity(view: View) -> dict:
    """Measure how well the played labels match the requested ones.

    Args:
        view: the take beside its library and track.
    Returns:
        Means over all frames, over the key moments, and over the key moments' labels that the library has together, for
        requested labels only; the first two also as Faustino's eq. 18 is printed.
    """
    played = view.played
    if view.timeline is None or played.words is None:
        return dict.fromkeys(("all", "keys", "had_keys", "eq18_all", "eq18_keys"))
    requested = list_requested_labels(fill_automatic_spans(view), played.times, view.moments)
    key_requested, key_played = [m.requested.words for m in view.moments], [m.words for m in view.moments]
    library = extend_with_synthetic(view.library, played)
    had = [] if library is None else list_had_labels(view.moments, library.keys)
    return {  # means over the frames that count, as in Faustino Table 2
        "all": compute_mean(measure_similarity(requested, played.words)),
        "keys": compute_mean(measure_similarity(key_requested, key_played)),
        "had_keys": compute_mean(measure_similarity(had, key_played)),
        "eq18_all": compute_mean(measure_similarity(requested, played.words, compute_eq18)),
        "eq18_keys": compute_mean(measure_similarity(key_requested, key_played, compute_eq18)),
        "key_count": len(view.moments), "had_key_count": sum(map(bool, had)),
    }


def list_had_labels(moments: Sequence[KeyMomentResult], keys: tuple[Key, ...]) -> list[frozenset[str] | None]:
    """List the requested labels of each key moment that the nearest keys carry.

    Args:
        moments: the key moments.
        keys: of the library.
    Returns:
        For each moment the labels, None where no key can serve it.
    """
    select_nearest = lru_cache(None)(lambda words: select_nearest_keys(keys, words))  # moments repeat their labels
    return [_select_had_labels(select_nearest(moment.requested.words), moment) for moment in moments]


def _select_had_labels(nearest: tuple[Key, ...], moment: KeyMomentResult) -> frozenset[str] | None:
    """Select the requested labels of a key moment that one of the library's nearest keys carries; None without any.

    Of a key moment that no key serves whole, these are the labels of the nearest ones, so that a substitute counts by
    what it could have shown; of several equally near ones, those that are shown best.
    """
    requested, shown = frozenset(moment.requested.words), frozenset(moment.words)
    carried = {requested & key.labels for key in nearest}
    best = max(carried, key=lambda labels: (len(labels & shown), sorted(labels)), default=frozenset())
    return best or None


def list_requested_labels(
    timeline: Timeline, times: np.ndarray, moments: Sequence[KeyMomentResult] = ()
) -> list[frozenset[str] | None]:
    """List the requested labels at each time.

    Args:
        timeline: the timeline.
        times: (T,) seconds on the track's clock.
        moments: the key moments with the first and last frame of their clips.
    Returns:
        For each time the labels, None where none count: in transitions, at the entry and exit of each key moment's clip
        (Faustino §3.2.2), and where automatic locomotion is not filled in.
    """
    out = [labels or None for labels in labels_per_frame(timeline, times)]
    for moment in moments:
        out[moment.entry : moment.exit + 1] = [None] * (moment.exit + 1 - moment.entry)
    return out


def fill_automatic_spans(view: View) -> Timeline:
    """Fill automatic locomotion into the timeline by the library's gaits (Faustino §3.1.1).

    Synthetic clips count as the library's if one is played.

    Args:
        view: the take beside its library and track.
    Returns:
        The filled timeline; the same one without library or track.
    """
    library = extend_with_synthetic(view.library, view.played)
    if library is None or view.track is None:
        return view.timeline
    try:
        gaits = library.gaits
    except InputError:
        return view.timeline
    sampled = _sample_planned_track(view, library.fps)
    thresholds = library.gait_thresholds
    gait_index = choose_gaits(sampled.speed, sampled.fps, [gait.speed for gait in gaits], thresholds)
    return fill_timeline(view.timeline, sampled.times, build_automatic_labels(library, gait_index, sampled))


def _sample_planned_track(view: View, fps: float) -> SampledTrack:
    """Sample the track with the heading that was planned for the take, else with the track's own plan."""
    sampled = sample_track(view.track, fps)
    heading = view.interpolate_planned_heading(sampled.times)
    return plan_track(sampled) if heading is None else replace(rest_track(sampled), heading=heading)


def compute_eq18(requested: Iterable[str], played: Iterable[str]) -> float:
    """Compute Faustino's eq. 18 for one frame as printed.

    With 1 for a present and -1 for an absent label, it is the negated sum of products over the labels that either frame
    has, divided by their number: a common label counts -1, a label that only one has counts +1.

    Args:
        requested: the requested labels.
        played: the labels of the played clip.
    Returns:
        -1 if all labels agree to 1 if none does; NaN if neither has a label.
    Source: Faustino 2016, section 3.2.2, equation (18).
    """
    requested, played = set(requested), set(played)
    either = requested | played
    return (len(requested ^ played) - len(requested & played)) / len(either) if either else np.nan


def compute_requested_similarity(requested: Iterable[str], played: Iterable[str]) -> float:
    """Compute eq. 18 over the requested labels only; further labels do not count.

    Args:
        requested: the requested labels.
        played: the labels of the played clip.
    Returns:
        -1 if all are played to 1 if none is; NaN without requested labels.
    """
    requested = set(requested)
    return 1.0 - 2.0 * len(requested & set(played)) / len(requested) if requested else np.nan


def measure_similarity(
    requested: Sequence[Iterable[str] | None], played: Sequence[Iterable[str]], measure=compute_requested_similarity
) -> np.ndarray:
    """Measure the similarity at every frame.

    Takes repeat labels, so each pair is measured once.

    Args:
        requested: T sets of labels, None where none count.
        played: T sets of labels.
        measure: the similarity of one pair.
    Returns:
        (T,), NaN where no labels are requested.
    """
    known: dict[tuple, float] = {}
    out = np.full(len(played), np.nan)
    for frame, pair in enumerate(zip(requested, played)):
        if pair[0] is None:
            continue
        if pair not in known:
            known[pair] = measure(*pair)
        out[frame] = known[pair]
    return out


def compute_mean(similarity: np.ndarray) -> float:
    """Compute the mean over the frames or moments that count, NaN without any."""
    known = similarity[np.isfinite(similarity)]
    return float(known.mean()) if len(known) else math.nan
