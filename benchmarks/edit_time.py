"""Edits: processor's seconds from a changed plan to the new take, how much of it is made anew, and what shows at its
ends.

    lines = edit_times(library, [("scenario 3", track, timeline), ...])

The edits are those of ../shared/metrics.md, "edit time": every key moment by 0.2 s, earlier and later, and the track
dragged by half a metre at a quarter, half and three quarters of its time, within a second and a half to either side.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from beyond_mocap.annotation import Timeline
from beyond_mocap.base.easing import smoothstep
from beyond_mocap.library.library import Library
from beyond_mocap.motion.humanoid import identify
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthesis.take import Take

LATER, ASIDE, WIDTH = 0.2, 0.5, 1.5
TARGET = 0.3


def edit_times(library: Library, orders: Iterable[tuple[str, Track, Timeline]], runs: int = 3) -> list[str]:
    """Markdown lines: a row per kind of edit, over all orders (name, track, timeline); seconds are the best of
    `runs`."""
    figures: dict[str, list[tuple[float, ...]]] = {}
    for _, track, timeline in orders:
        before = synthesize(library, Plan(track=track, timeline=timeline, nearest=True))
        for kind, plan in _edits(before.plan):
            best, after = _timed(library, plan, before, runs)
            anew = np.flatnonzero(_changed(before, after))
            if len(anew):
                figures.setdefault(kind, []).append((best, len(anew) / after.motion.fps, *_ends(before, after, anew)))
    return [
        f"| edit | n | median s | 95 % s | within {TARGET:g} s | made anew, median s | "
        "jerk at its ends, before -> after | feet slide there, before -> after |",
        "|---" * 8 + "|",
        *(_row(kind, np.array(found)) for kind, found in figures.items()),
    ]


def _row(kind: str, found: np.ndarray) -> str:
    seconds, anew, jerk, jerk_after, slide, slide_after = found.T
    return (
        f"| {kind} | {len(found)} | {np.median(seconds):.2f} | {np.percentile(seconds, 95):.2f} | "
        f"{np.mean(seconds <= TARGET):.0%} | "
        f"{np.median(anew):.1f} | {np.nanmedian(jerk):.0f} -> {np.nanmedian(jerk_after):.0f} m/s^3 | "
        f"{np.nanmean(slide):.1f} -> {np.nanmean(slide_after):.1f} cm/s |"
    )


def _edits(plan: Plan) -> Iterator[tuple[str, Plan]]:
    keys, times = plan.timeline.keys, plan.track.times
    for number, key in enumerate(keys):
        for moved in (key.time - LATER, key.time + LATER):
            if times[0] < moved < times[-1]:
                others = (*keys[:number], replace(key, time=moved), *keys[number + 1 :])
                yield "key moment moved by 0.2 s", replace(plan, timeline=replace(plan.timeline, keys=others))
    for share in (0.25, 0.5, 0.75):
        at = times[0] + share * (times[-1] - times[0])
        yield "track dragged by 0.5 m", replace(plan, track=dragged(plan.track, at))


def dragged(track: Track, at: float, aside: Sequence[float] = (0.0, ASIDE), width: float = WIDTH) -> Track:
    """The track with a smooth bump of `aside` (2,) m around second `at`, `width` s to each side."""
    bump = smoothstep(1.0 - np.abs(track.times - at) / width)[:, None] * np.asarray(aside)
    return replace(track, positions=track.positions + bump)


def _timed(library: Library, plan: Plan, before: Take, runs: int) -> tuple[float, Take]:
    best, after = np.inf, before
    for _ in range(runs):
        begun = time.process_time()
        after = resynthesize(library, plan, before)
        best = min(best, time.process_time() - begun)
    return best, after


def _changed(before: Take, after: Take) -> np.ndarray:
    """(T,) bool: frames of which any bit is another."""
    a, b = before.motion, after.motion
    return np.any(a.root_positions != b.root_positions, axis=1) | np.any(a.rotations != b.rotations, axis=(1, 2))


def _ends(before: Take, after: Take, anew: np.ndarray) -> tuple[float, ...]:
    """Largest jerk of any joint, m/s^3, and mean speed of standing toes, cm/s, before and after, within the half second
    in which old and new meet; NaN where the whole take is new."""
    count, hand = len(after.motion), int(0.5 * after.motion.fps)
    starts = [anew[0]] * (anew[0] > 0) + [anew[-1] - hand] * (anew[-1] + 1 < count)
    frames = np.unique(np.clip([np.arange(start - 3, start + hand + 3) for start in starts], 0, count - 4))
    return tuple(value for pair in zip(_shown(before, frames), _shown(after, frames)) for value in pair)


def _shown(take: Take, frames: np.ndarray) -> tuple[float, float]:
    if not len(frames):
        return np.nan, np.nan
    places, _ = forward_kinematics(take.motion)
    jerk = np.linalg.norm(np.diff(places, 3, axis=0), axis=2).max(axis=1) * take.motion.fps**3
    body = identify(take.motion.skeleton)
    toes = places[:, [body.left.toe_or_foot, body.right.toe_or_foot], :2]
    speed = 100.0 * np.linalg.norm(np.diff(toes, axis=0), axis=2) * take.motion.fps
    still = (take.contacts[1:] & take.contacts[:-1])[frames]
    return float(jerk[frames].max()), float(speed[frames][still].mean()) if still.any() else np.nan
