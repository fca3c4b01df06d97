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

from ...base.time_series import find_runs
from ...motion.motion import Motion
from .capsules import CONTACT_DISTANCE, build_capsules, compute_capsule_lines, find_capsule_contacts
from .correction import CURVES, Correction, apply_curves
from .crowd_body import CrowdBody, move_capsules
from .separation import ALLOWED_DEPTH, Pressure, solve_separation
from .spacing import Episode, Span, find_meetings

REACH = 1.5
"""s before and after an overlap within which motions change."""

PASSES = 5
"""The most passes."""

REPEAT_DEPTH = 0.015
"""m: after the first pass, only deeper overlaps are resolved again."""


def resolve_collisions(
    motions: Sequence[Motion], contacts: Sequence[np.ndarray], first_frames: Sequence[int], fps: float,
    firmness: Sequence[np.ndarray] | None = None, lines: Sequence[np.ndarray] | None = None,
) -> tuple[Correction, ...]:  # fmt: skip
    """Compute corrections with which no two motions overlap.

    Args:
        motions: placed on the pitch, frames at `fps`.
        contacts: (T, 2) bool each, left and right foot in contact with the ground.
        first_frames: the frame of the match's clock at which each motion starts.
        fps: frames per second.
        firmness: (T,) each, how firmly it keeps its path against others (`spacing.compute_firmness` around ball
            touches); 1 by default.
        lines: of each motion's capsules (`capsules.compute_capsule_lines`), where they are known.
    Returns:
        One correction per motion. At the ends of a motion it is cut off: pass some seconds more than are used
        (`correction.join_corrections`).
    """
    bodies, start = _align_bodies(motions, contacts, first_frames, firmness, lines)
    curves = [np.zeros((len(body.lines), CURVES)) for body in bodies]
    corrections = [Correction.build_empty(fps)] * len(bodies)
    past_spans: list[Span] = []
    pressures: dict[tuple[int, int], Pressure] = {}
    # Later passes resolve what the bent limbs of the pass before leave. An episode includes everyone the bodies
    # met in earlier passes, so that a body is not pushed into another one that is not part of the solution.
    for number in range(PASSES):
        capsule_lines = [move_capsules(body, own) for body, own in zip(bodies, curves)]
        spans = _find_overlap_spans(bodies, capsule_lines, round(REACH * fps), REPEAT_DEPTH if number
                                    else ALLOWED_DEPTH)
        past_spans += spans
        if not spans:
            break
        for episode in find_meetings(spans, past_spans):
            _separate_episode(episode, bodies, curves, pressures, fps)
        corrections = [Correction.from_curves(own, start, fps) for own in curves]
        curves = [correction.build_curves(start, len(body.lines)) for correction, body in zip(corrections, bodies)]
        bodies = [_update_bend(*each, start) for each in zip(bodies, motions, curves, first_frames)]
    return tuple(corrections)


def measure_overlap_depths(motions: Sequence[Motion], first_frames: Sequence[int],
                           lines: Sequence[np.ndarray] | None = None) -> list[np.ndarray]:
    """Measure how deep each motion overlaps any other, at each of its frames.

    Args:
        motions: placed on the pitch.
        first_frames: the frame of a common clock at which each starts.
        lines: as for `resolve_collisions`.
    Returns:
        (T,) m for each motion, 0 where it overlaps none.
    """
    aligned, start = _align_lines(motions, first_frames, lines)
    radii = [np.array([part.radius for part in build_capsules(motion.skeleton)]) for motion in motions]
    deepest = [np.zeros(len(ends)) for ends in aligned]
    for one, other, frames in _find_near_pairs(aligned):
        found = find_capsule_contacts(aligned[one][frames], aligned[other][frames], (radii[one], radii[other]))
        for number in (one, other):
            np.maximum.at(deepest[number], frames[found.frame], found.depth)
    return [own[first - start :][: len(motion)] for own, first, motion in zip(deepest, first_frames, motions)]


def _align_lines(motions, first_frames, lines) -> tuple[list[np.ndarray], int]:
    """Align capsule lines over the frames any motion has, NaN where it has none; return them and the first frame."""
    start = min(first_frames, default=0)
    count = max((first + len(motion) for first, motion in zip(first_frames, motions)), default=start) - start
    aligned = []
    for first, own in zip(first_frames, lines or map(compute_capsule_lines, motions)):
        if len(own) < count:
            ends = np.full((count, *own.shape[1:]), np.nan)
            ends[first - start : first - start + len(own)] = own
            own = ends
        aligned.append(own)
    return aligned, start


def _align_bodies(motions, contacts, first_frames, firm_frames, lines) -> tuple[list[CrowdBody], int]:
    """Align the motions as bodies over the frames any of them has; return them and the first frame."""
    aligned, start = _align_lines(motions, first_frames, lines)
    bodies = []
    for number, (motion, foot_contacts, first, ends) in enumerate(zip(motions, contacts, first_frames, aligned)):
        here = slice(first - start, first - start + len(motion))
        firmness, in_contact = np.ones(len(ends)), np.zeros((len(ends), 2), bool)
        in_contact[here] = foot_contacts
        if firm_frames is not None:
            firmness[here] = firm_frames[number]
        bodies.append(CrowdBody(build_capsules(motion.skeleton), ends, np.zeros(ends.shape), in_contact, firmness))
    return bodies, start


def _find_near_pairs(capsule_lines: Sequence[np.ndarray]) -> list[tuple[int, int, np.ndarray]]:
    """Find pairs of bodies, by their capsule lines (T, C, 2, 3) m, and the frames at which their hips are close."""
    hips = np.array([ends[:, 0].mean(axis=1) for ends in capsule_lines])
    found = []
    for one in range(len(hips) - 1):
        off = hips[one + 1 :] - hips[one]
        near = np.einsum("ptk,ptk->pt", off, off) < CONTACT_DISTANCE**2
        found += [(one, one + 1 + int(row), np.flatnonzero(near[row])) for row in np.flatnonzero(near.any(axis=1))]
    return found


def _find_overlap_spans(bodies, capsule_lines, reach: int, min_depth: float) -> list[Span]:
    """Find the spans (first frame, end, pair) in which two bodies overlap by `min_depth` m, extended by `reach`
    frames.
    """
    spans = []
    for one, other, frames in _find_near_pairs(capsule_lines):
        found = find_capsule_contacts(capsule_lines[one][frames], capsule_lines[other][frames],
                                      (bodies[one].radii, bodies[other].radii), min_depth)
        deep = np.zeros(len(capsule_lines[one]), bool)
        deep[frames[found.frame]] = True
        low = max(bodies[n].present_span[0] for n in (one, other))
        high = min(bodies[n].present_span[1] for n in (one, other))
        spans += [(max(a - reach, low), min(b + reach, high), (one, other)) for a, b in find_runs(deep)]
    return spans


def _separate_episode(episode: Episode, bodies: list[CrowdBody], curves: list[np.ndarray], pressures,
                      fps: float) -> None:
    """Separate the bodies of one episode, changing their `curves` in place."""
    low, high = episode.first, episode.end
    number = {body: row for row, body in enumerate(episode.bodies)}
    mine = [bodies[body].select_frames(slice(low, high)) for body in episode.bodies]
    whole = [bodies[body].present_span for body in episode.bodies]
    # Curves are held at an episode's ends unless the body itself starts or ends there.
    held_ends = [(low + body.present_span[0] > there[0], low + body.present_span[1] < there[1]) for body,
                 there in zip(mine, whole)]
    pairs = [(number[one], number[other]) for one, other in episode.pairs]
    episode_pressures = [pressures.setdefault(pair, Pressure()) for pair in episode.pairs]
    now = [curves[body][low:high] for body in episode.bodies]
    for body, own in zip(episode.bodies, solve_separation(mine, pairs, now, pressures=episode_pressures,
                                                          held_ends=held_ends, fps=fps, first=low)):
        curves[body][low:high] = own


def _update_bend(body: CrowdBody, motion: Motion, curves: np.ndarray, first: int, start: int) -> CrowdBody:
    """Update how far a body's limbs are from where the curves (T, 12) alone would put them."""
    plain = replace(body, bend_offset=np.zeros(body.lines.shape))
    at = np.flatnonzero(curves.any(axis=1))
    at = at[(at >= first - start) & (at < first - start + len(motion))]
    if not len(at):
        return plain
    rows = at - (first - start)
    here = replace(motion, root_positions=motion.root_positions[rows], rotations=motion.rotations[rows])
    plain.bend_offset[at] = (compute_capsule_lines(apply_curves(here, curves[at]))
                             - move_capsules(plain.select_frames(at), curves[at]))
    return plain
