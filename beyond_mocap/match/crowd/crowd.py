"""Resolve collisions between players after their motions are constructed, as a `Correction` of each.

    corrections = resolve_collisions([take.motion for take in takes], [take.contacts for take in takes], firsts, 30.0)
    motions = [apply_correction(take.motion, c, first) for take, c, first in zip(takes, corrections, firsts)]

Where capsules along the skeletons overlap (`match.crowd.capsules`), arms are rotated away and roots and feet shifted
(`match.crowd.separation`). A foot in contact stays where it is or moves as a whole for the whole contact. Limbs bend
for this, so bodies are not exactly where the curves alone would put them; the next pass starts from where they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...base.time_series import runs
from ...motion.motion import Motion
from .capsules import FAR, capsules, lines, touching
from .correction import CURVES, Correction, carried
from .crowd_body import CrowdBody, moved
from .pushing import ALLOWED, Pressure, pushed
from .spacing import Episode, Span, meetings

REACH = 1.5
"""s before and after an overlap within which motions change."""

PASSES = 5
"""The most passes."""

DONE = 0.015
"""m: after the first pass, only deeper overlaps are resolved again."""


def kept_apart(
    motions: Sequence[Motion], contacts: Sequence[np.ndarray], firsts: Sequence[int], fps: float,
    firm: Sequence[np.ndarray] | None = None,
) -> tuple[Correction, ...]:  # fmt: skip
    """Compute corrections with which no two motions overlap.

    Args:
        motions: placed on the pitch, frames at `fps`.
        contacts: (T, 2) bool each, left and right foot in contact with the ground.
        first_frames: the frame of the match's clock at which each motion starts.
        fps: frames per second.
        firmness: (T,) each, how firmly it keeps its path against others (`spacing.compute_firmness` around ball
            touches); 1 by default.
    Returns:
        One correction per motion. At the ends of a motion it is cut off: pass some seconds more than are used
        (`correction.join_corrections`).
    """
    bodies, start = _on_one_clock(motions, contacts, firsts, firm)
    curves = [np.zeros((len(body.lines), CURVES)) for body in bodies]
    done = [Correction.none(fps)] * len(bodies)
    met: list[Span] = []
    pressures: dict[tuple[int, int], Pressure] = {}
    # Later passes resolve what the bent limbs of the pass before leave. An episode includes everyone the bodies
    # met in earlier passes, so that a body is not pushed into another one that is not part of the solution.
    for turn in range(PASSES):
        placed = [moved(body, own) for body, own in zip(bodies, curves)]
        deep = _touching_spans(bodies, placed, round(REACH * fps), DONE if turn else ALLOWED)
        met += deep
        if not deep:
            break
        for episode in meetings(deep, met):
            _part(episode, bodies, curves, pressures, fps)
        done = [Correction.of(own, start, fps) for own in curves]
        curves = [correction.curves(start, len(body.lines)) for correction, body in zip(done, bodies)]
        bodies = [_as_bent(*each, start) for each in zip(bodies, motions, curves, firsts)]
    return tuple(done)


def overlap_depths(motions: Sequence[Motion], firsts: Sequence[int]) -> list[np.ndarray]:
    """Measure how deep each motion overlaps any other, at each of its frames.

    Args:
        motions: placed on the pitch.
        first_frames: the frame of a common clock at which each starts.
    Returns:
        (T,) m for each motion, 0 where it overlaps none.
    """
    bodies, start = _on_one_clock(motions, [np.zeros((len(motion), 2), bool) for motion in motions], firsts, None)
    deepest = [np.zeros(len(body.lines)) for body in bodies]
    for one, other, frames in _near_pairs([body.lines for body in bodies]):
        mine, its = bodies[one], bodies[other]
        found = touching(mine.lines[frames], its.lines[frames], (mine.radii, its.radii))
        for number in (one, other):
            np.maximum.at(deepest[number], frames[found.frame], found.depth)
    return [own[first - start :][: len(motion)] for own, first, motion in zip(deepest, firsts, motions)]


def _on_one_clock(motions, contacts, firsts, firm) -> tuple[list[CrowdBody], int]:
    """Align the motions as bodies over the frames any of them has; return them and the first frame."""
    start = min(firsts, default=0)
    count = max((first + len(motion) for first, motion in zip(firsts, motions)), default=start) - start
    bodies = []
    for number, (motion, stands, first) in enumerate(zip(motions, contacts, firsts)):
        here = slice(first - start, first - start + len(motion))
        parts = capsules(motion.skeleton)
        ends, firmness = np.full((count, len(parts), 2, 3), np.nan), np.ones(count)
        standing = np.zeros((count, 2), bool)
        ends[here], standing[here] = lines(motion), stands
        if firm is not None:
            firmness[here] = firm[number]
        bodies.append(CrowdBody(parts, ends, np.zeros(ends.shape), standing, firmness))
    return bodies, start


def _near_pairs(placed: Sequence[np.ndarray]) -> list[tuple[int, int, np.ndarray]]:
    """Find pairs of bodies, by their capsule lines (T, C, 2, 3) m, and the frames at which their hips are close."""
    hips = np.array([ends[:, 0].mean(axis=1) for ends in placed])
    found = []
    for one in range(len(hips) - 1):
        off = hips[one + 1 :] - hips[one]
        near = np.einsum("ptk,ptk->pt", off, off) < FAR**2
        found += [(one, one + 1 + int(row), np.flatnonzero(near[row])) for row in np.flatnonzero(near.any(axis=1))]
    return found


def _touching_spans(bodies, placed, reach: int, least: float) -> list[Span]:
    """Find the spans (first frame, end, pair) in which two bodies overlap by `min_depth` m, extended by `reach`
    frames.
    """
    spans = []
    for one, other, frames in _near_pairs(placed):
        found = touching(placed[one][frames], placed[other][frames], (bodies[one].radii, bodies[other].radii), least)
        deep = np.zeros(len(placed[one]), bool)
        deep[frames[found.frame]] = True
        low, high = (max(bodies[n].there[0] for n in (one, other)), min(bodies[n].there[1] for n in (one, other)))
        spans += [(max(a - reach, low), min(b + reach, high), (one, other)) for a, b in runs(deep)]
    return spans


def _part(episode: Episode, bodies: list[CrowdBody], curves: list[np.ndarray], pressures, fps: float) -> None:
    """Separate the bodies of one episode, changing their `curves` in place."""
    low, high = episode.first, episode.end
    number = {body: row for row, body in enumerate(episode.bodies)}
    mine = [bodies[body].frames(low, high) for body in episode.bodies]
    whole = [bodies[body].there for body in episode.bodies]
    # Curves are held at an episode's ends unless the body itself starts or ends there.
    held = [(low + body.there[0] > there[0], low + body.there[1] < there[1]) for body, there in zip(mine, whole)]
    pairs = [(number[one], number[other]) for one, other in episode.pairs]
    pressed = [pressures.setdefault(pair, Pressure()) for pair in episode.pairs]
    now = [curves[body][low:high] for body in episode.bodies]
    for body, own in zip(episode.bodies, pushed(mine, pairs, now, pressures=pressed, held=held, fps=fps, first=low)):
        curves[body][low:high] = own


def _as_bent(body: CrowdBody, motion: Motion, curves: np.ndarray, first: int, start: int) -> CrowdBody:
    """Update how far a body's limbs are from where the curves (T, 12) alone would put them."""
    here = slice(first - start, first - start + len(motion))
    if not curves[here].any():
        return replace(body, bent=np.zeros(body.lines.shape))
    bent = np.zeros(body.lines.shape)
    plain = moved(replace(body, bent=bent), curves)
    bent[here] = lines(carried(motion, curves[here])) - plain[here]
    return replace(body, bent=bent)
