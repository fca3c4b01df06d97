"""The planned heading of a player: where the body faces at every moment, decided before any clip is chosen.

Above 3 m/s the body faces its travel, between 1 and 3 m/s it faces between travel and ball and walks backward or
sideways where they differ, and below 1 m/s, where the direction of a creeping track is noise, it faces the ball, or
where the ball goes if that is far. It turns the short way at limited speed, rests within a dead zone, and does not go
sideways for long. What is asked takes part: given headings, pins of the gaze, labels with a direction. All of these
weigh against each other, and the ball comes back; so the plan is the cheapest path through all headings of all moments
(dynamic programming, `heading_path`), not a filter, which cannot look ahead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.easing import smoothstep
from ..base.time_series import find_runs
from ..motion import quaternion
from ..motion.track import SampledTrack
from ..motion.track.resting_place import LEAST_LEEWAY, relax_track
from .heading_costs import weigh_headings
from .heading_path import HeadingPath, find_cheapest_path, replace_part
from .heading_request import GivenHeadings, HeadingKey, HeadingRequest

FPS = 30.0  # at which headings are planned, whatever the rate of the take

_UPDATE_SECONDS = 1.5  # before and after a change in which an update plans again: half a turn takes one second
_NOTICED_COST = 1e-3  # by which a heading's cost at a decision differs where an update plans it again
HOLD_FADE = 0.7
"""Seconds before and after a heading key over which the body comes to hold it."""

_FAR_MISS = np.radians([45.0, 135.0])  # between which a given heading counts as one that the body cannot reach in time


def plan_track(track: SampledTrack) -> SampledTrack:
    """Plan where the body of a track rests and where it faces.

    Args:
        track: the player's track with the ball, T frames.
    Returns:
        The same with the places and headings of the body.
    """
    relaxed = rest_track(track)
    return replace(relaxed, heading=plan_heading(relaxed))


def rest_track(track: SampledTrack, rests: bool = True) -> SampledTrack:
    """Let the body of a track rest where the track hardly moves; with `rests` False it is on the track."""
    return relax_track(track) if rests else replace(track, leeway=np.full(len(track), LEAST_LEEWAY))


def plan_heading(track: SampledTrack, keys: Sequence[HeadingKey] = ()) -> np.ndarray:
    """Plan the heading of a player: (T,) rad from +x, unwrapped, for the arguments of `plan_heading_path`."""
    return sample_heading(plan_heading_path(track, HeadingRequest(keys=tuple(keys))), keys, track)[0]


def plan_heading_path(track: SampledTrack, request: HeadingRequest) -> HeadingPath:
    """Plan the heading of a player.

    Args:
        track: the player's track with the ball, T frames; its positions are where the body will be.
        request: what is asked.
    Returns:
        The planned heading.
    Source: The rules of docs/explanation/heading-plan.md, *What is weighed*.
    """
    weighed = weigh_headings(track, request)
    bins = find_cheapest_path(weighed.plain, weighed.plain_steps)
    for first, end in find_runs(weighed.is_asked):
        bins = replace_part(bins, first, end, weighed.costs, weighed.steps)
    return HeadingPath(weighed.times, bins)


def update_heading_path(path: HeadingPath, track: SampledTrack, request: HeadingRequest, old_track: SampledTrack,
                        old_request: HeadingRequest) -> HeadingPath:
    """Update a planned heading after its track, ball or what is asked has changed: far from it every heading stays.

    Within its dead zone a plan may rest at one of several headings that cost almost the same. Planned from scratch,
    it could rest at another one for minutes because something moved elsewhere.

    Args:
        path: the heading planned before.
        track, request: as for `plan_heading_path`.
        old_track, old_request: those of the path.
    Returns:
        The planned heading; a whole new one where the times differ.
    """
    weighed, old = weigh_headings(track, request), weigh_headings(old_track, old_request)
    if not np.array_equal(weighed.times, old.times) or not np.array_equal(path.times, old.times):
        return plan_heading_path(track, request)
    differs = np.abs(weighed.costs - old.costs).max(axis=1) > _NOTICED_COST
    differs |= np.any(np.isfinite(weighed.steps) != np.isfinite(old.steps), axis=1)
    changed = weighed.times[differs]
    reach = np.searchsorted(changed, weighed.times[:, None] + [-_UPDATE_SECONDS, _UPDATE_SECONDS])
    bins = path.bins
    for first, end in find_runs(reach[:, 1] > reach[:, 0]):
        bins = replace_part(bins, first, end, weighed.costs, weighed.steps)
    return HeadingPath(path.times, bins)


def sample_heading(path: HeadingPath, keys: Sequence[HeadingKey],
                   track: SampledTrack) -> tuple[np.ndarray, np.ndarray | None]:
    """Sample a planned heading, which where keys hold is exactly the one that they give.

    The plan comes near it, in steps of ten degrees and smoothed; what it misses is added back where a key holds, and
    fades out within HOLD_FADE s or until the next key. Much more than that is a heading that the body has not the time
    to reach, and stays.

    Args:
        path: the planned heading.
        keys: headings that are given.
        track: where the body is, T frames.
    Returns:
        The heading (T,) rad from +x, unwrapped, and how far it is given (T,) from 0 to 1, None without keys.
    """
    heading = path.sample(track.times)
    if not keys:
        return heading, None
    given, times = GivenHeadings(keys), track.times
    key = given.find_keys(times)
    after = np.minimum(key + (times >= given.starts[0]), len(given.starts) - 1)  # the next key, at the ends the nearest
    since = np.where(times < given.starts[0], np.inf, np.maximum(times - given.ends[key], 0.0))
    until = np.where(times >= given.starts[-1], np.inf, given.starts[after] - times)
    reach = np.clip(given.gaps, 1e-6, HOLD_FADE)
    misses = [_shrink_far_misses(given.compute_heading(rows, track.positions) - heading) for rows in (key, after)]
    heading = heading + misses[0] * _fade(since / reach[key + 1]) + misses[1] * _fade(until / reach[after])
    return heading, _fade(np.minimum(since, until) / HOLD_FADE)


def _shrink_far_misses(angle: np.ndarray) -> np.ndarray:
    """Shrink angles (T,) rad, wrapped, towards 0 the farther they are."""
    angle = quaternion.wrap_angle(angle)
    return angle * (1.0 - smoothstep(np.abs(angle), *_FAR_MISS))


def _fade(share: np.ndarray) -> np.ndarray:
    """Fade from 1 where a share (T,) is 0 to 0 where it is 1."""
    return 1.0 - smoothstep(share)
