"""Players kept out of each other after their motions are made: what is changed on each, as a `Correction`.

    corrections = kept_apart([take.motion for take in takes], [take.contacts for take in takes], firsts, 30.0)
    motions = [applied(take.motion, c, first) for take, c, first in zip(takes, corrections, firsts)]

Where capsules along the skeletons are in each other (`match.crowd.capsules`), arms are turned away and roots and feet
shifted (`match.crowd.pushing`). Feet that stand stay where they stand or are put elsewhere as a whole; so after the
limbs have been bent for it bodies are not quite where the curves say, and the next pass starts from where they are.
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
"""Seconds before and behind an overlap within which something is changed."""

PASSES = 5
"""Times that it is looked for overlaps at most."""

DONE = 0.015
"""Metres of overlap from which on bodies are looked at once more after the first pass."""


def kept_apart(
    motions: Sequence[Motion], contacts: Sequence[np.ndarray], firsts: Sequence[int], fps: float,
    firm: Sequence[np.ndarray] | None = None,
) -> tuple[Correction, ...]:  # fmt: skip
    """What has to be changed on each of the motions so that no two of them are in each other.

    motions: on the pitch, frames at `fps` per second; firsts: the frame of the match's clock at which each begins.
    contacts: (T, 2) bool each, left and right foot that stand. firm: (T,) each, how firmly it keeps its way against
    others (`match.crowd.spacing.keeping` around touches of the ball), 1 by default. Where a correction would reach
    beyond a motion's ends it is cut off there: give some seconds more than what is used (`correction.joined`)."""
    bodies, start = _on_one_clock(motions, contacts, firsts, firm)
    curves = [np.zeros((len(body.lines), CURVES)) for body in bodies]
    done = [Correction.none(fps)] * len(bodies)
    met: list[Span] = []
    pressures: dict[tuple[int, int], Pressure] = {}
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
    """(T,) m for each of the motions: how deep it is in any other at each of its frames, 0 where in none. firsts: the
    frame of a common clock at which each begins."""
    bodies, start = _on_one_clock(motions, [np.zeros((len(motion), 2), bool) for motion in motions], firsts, None)
    deepest = [np.zeros(len(body.lines)) for body in bodies]
    for one, other, frames in _near_pairs([body.lines for body in bodies]):
        mine, its = bodies[one], bodies[other]
        found = touching(mine.lines[frames], its.lines[frames], (mine.radii, its.radii))
        for number in (one, other):
            np.maximum.at(deepest[number], frames[found.frame], found.depth)
    return [own[first - start :][: len(motion)] for own, first, motion in zip(deepest, firsts, motions)]


def _on_one_clock(motions, contacts, firsts, firm) -> tuple[list[CrowdBody], int]:
    """The motions as bodies over the frames that any of them has, and the first of these."""
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
    """Pairs of bodies, by their capsules' lines (T, C, 2, 3), and the frames at which their hips are near."""
    hips = np.array([ends[:, 0].mean(axis=1) for ends in placed])
    found = []
    for one in range(len(hips) - 1):
        off = hips[one + 1 :] - hips[one]
        near = np.einsum("ptk,ptk->pt", off, off) < FAR**2
        found += [(one, one + 1 + int(row), np.flatnonzero(near[row])) for row in np.flatnonzero(near.any(axis=1))]
    return found


def _touching_spans(bodies, placed, reach: int, least: float) -> list[Span]:
    """(first frame, end, pair) of all times at which two bodies are at least so many metres in each other, with `reach`
    frames around."""
    spans = []
    for one, other, frames in _near_pairs(placed):
        found = touching(placed[one][frames], placed[other][frames], (bodies[one].radii, bodies[other].radii), least)
        deep = np.zeros(len(placed[one]), bool)
        deep[frames[found.frame]] = True
        low, high = (max(bodies[n].there[0] for n in (one, other)), min(bodies[n].there[1] for n in (one, other)))
        spans += [(max(a - reach, low), min(b + reach, high), (one, other)) for a, b in runs(deep)]
    return spans


def _part(episode: Episode, bodies: list[CrowdBody], curves: list[np.ndarray], pressures, fps: float) -> None:
    """Puts the bodies of one episode out of each other, changing their `curves`."""
    low, high = episode.first, episode.end
    number = {body: row for row, body in enumerate(episode.bodies)}
    mine = [bodies[body].frames(low, high) for body in episode.bodies]
    whole = [bodies[body].there for body in episode.bodies]
    held = [(low + body.there[0] > there[0], low + body.there[1] < there[1]) for body, there in zip(mine, whole)]
    pairs = [(number[one], number[other]) for one, other in episode.pairs]
    pressed = [pressures.setdefault(pair, Pressure()) for pair in episode.pairs]
    now = [curves[body][low:high] for body in episode.bodies]
    for body, own in zip(episode.bodies, pushed(mine, pairs, now, pressures=pressed, held=held, fps=fps, first=low)):
        curves[body][low:high] = own


def _as_bent(body: CrowdBody, motion: Motion, curves: np.ndarray, first: int, start: int) -> CrowdBody:
    """The body, with how far its limbs are from where the curves (T, 12) alone would have them."""
    here = slice(first - start, first - start + len(motion))
    if not curves[here].any():
        return replace(body, bent=np.zeros(body.lines.shape))
    bent = np.zeros(body.lines.shape)
    plain = moved(replace(body, bent=bent), curves)
    bent[here] = lines(carried(motion, curves[here])) - plain[here]
    return replace(body, bent=bent)
