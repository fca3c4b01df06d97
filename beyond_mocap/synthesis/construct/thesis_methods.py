"""Root motion of Faustino's block searches and of the plain baseline: the track's place by travelled distance, the
track's own place while the feet slide, or the clips' own paths chained one after the other (§3.2.6).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.vectors import unit_vectors
from ...library.library import Library
from ...motion import quaternion
from ...motion.foot_plant import PlantResult
from ...motion.humanoid import identify_joints
from ...motion.motion import compute_pose
from ...motion.track import SampledTrack
from ..plan import ResolvedPlan
from ..search.locomotion import compute_travelled_distance
from ..search.source_frames import SourceMotion
from .construction import Construction, apply_heading
from .extra_steps import Steps
from .track_following import add_sway, fit_heading
from .transitions import spread_rotations, spread_values

UPRIGHT_COSINE = np.cos(
    np.radians(50.0))  # height of the trunk's unit vector below which a body is not upright (§3.2.6)


def construct_blocks(construction: Construction, travelled: np.ndarray | None) -> tuple[PlantResult, Steps]:
    """Construct the motion of T source frames as the thesis does: no foot is planted.

    Args:
        construction: the source frames and the track.
        travelled: (T,) m by method "distance", the track's own by "fs" and "baseline", None by "blocks".
    """
    track, source = construction.track, construction.source
    smooth = _spread_transitions(construction.plan, replace(source, turn=_turn_torsos(construction.library, source)))
    if travelled is None:
        heading = integrate_heading(float(track.direction[0]), smooth.turn)
        ground = integrate_path(track.positions[0], smooth.velocity, smooth.sway, heading, track.fps)
    else:
        heading, ground = place_root_at_distance(track, smooth, travelled)
    pose, none = apply_heading(smooth.pose, heading), np.zeros((len(ground), 2))
    planted = PlantResult(np.concatenate([ground, smooth.height[:, None]], axis=1), pose, none, none)
    return planted, Steps.empty(pose, source.heel_toe_contacts)


def _spread_transitions(plan: ResolvedPlan, source: SourceMotion) -> SourceMotion:
    """Spread the jump at each transition over the frames around it.

    Source: Faustino 2016, §3.3.1, eq. 25.
    """
    reach = 0.5 * plan.requested.seam_window * plan.fps
    return replace(
        source,
        pose=spread_rotations(source.pose, source.transitions, source.ahead_pose, reach),
        height=spread_values(source.height, source.transitions, source.ahead_height, reach),
        sway=spread_values(source.sway, source.transitions, source.ahead_sway, reach),
    )


def place_root_at_distance(track: SampledTrack, smooth_source: SourceMotion, travelled: np.ndarray) -> tuple[np.ndarray,
        np.ndarray]:
    """Place the root where the track has travelled a given distance.

    Args:
        track: T frames.
        smooth_source: T source frames without jumps.
        travelled: (T,) m.
    Returns:
        Heading (T,) rad and root (T, 2) m, world.
    """
    place, direction = find_places_along(track, travelled)
    speed = np.abs(np.gradient(travelled)) * track.fps if len(travelled) > 1 else np.zeros(1)
    heading = fit_heading(direction, speed, smooth_source.velocity, smooth_source.turn)
    return heading, add_sway(place, smooth_source.sway, heading)


def find_places_along(track: SampledTrack, travelled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the places on the track's path after a travelled distance.

    Beyond the track's end the last direction is kept.

    Args:
        track: the sampled track.
        travelled: (T,) m.
    Returns:
        Places (T, 2) m and direction (T,) rad of the path there, world.
    Source: Faustino 2016, eq. 29, which steps from the present place towards the track's place at the next travelled
        distance; since both lie on the same path, the steps add up to the path itself. (As printed the difference
        points backwards.)
    """
    path = compute_travelled_distance(track) + 1e-6 * np.arange(len(track.times))
    place = np.stack([np.interp(travelled, path, track.positions[:, axis]) for axis in (0, 1)], axis=1)
    direction = np.interp(travelled, path, track.direction)
    beyond = np.maximum(travelled - path[-1], 0.0)[:, None]
    return place + beyond * np.stack([np.cos(direction), np.sin(direction)], axis=1), direction


def _turn_torsos(library: Library, source: SourceMotion) -> np.ndarray:
    """Compute the turning (T,) rad of source frames, with the corrections for torsos that are not upright."""
    turn = source.turn.copy()
    torso, expected = _torso_vectors(library, source.pose), _torso_vectors(library, source.ahead_pose)
    turn[source.transitions] += compute_torso_corrections(torso, source.transitions, expected)
    return turn


def _torso_vectors(library: Library, pose: np.ndarray) -> np.ndarray:
    """Compute the unit vectors (T, 3) from hips to chest or neck in the facing frame."""
    body = identify_joints(library.skeleton)
    top = body.neck if body.neck is not None else body.chest
    places, _ = compute_pose(library.skeleton, np.zeros((len(pose), 3)), pose)
    return unit_vectors(places[:, top] - places[:, body.hips])


def integrate_heading(start: float, turn: np.ndarray) -> np.ndarray:
    """Add up the recorded turning to a heading.

    Args:
        start: rad, heading of the first frame.
        turn: (T,) rad since the frame before; 0 at a transition, so that a piece begins in the direction in which the
            one before ended.
    Returns:
        (T,) rad.
    """
    return start + np.cumsum(turn) - turn[0]


def compute_torso_corrections(up: np.ndarray, transitions: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Compute by how much more a piece has to turn at each transition because the body is not upright there.

    Heading says little about a body that lies or dives: where both torsos lean more than 50 degrees, the piece is
    turned until they lie in the same direction.

    Args:
        up: (T, 3) unit, direction of the torso (hips to neck) in the facing frame.
        transitions: (S,) frames of transitions.
        expected: (S, 3) unit, the same for the frame with which the piece before would continue.
    Returns:
        (S,) rad.
    Source: Faustino 2016, §3.2.6, the extra check on the spine.
    """
    out = np.zeros(len(transitions))
    for number, (after, before) in enumerate(zip(up[transitions], expected)):
        if before[2] < UPRIGHT_COSINE and after[2] < UPRIGHT_COSINE:
            out[number] = quaternion.wrap_angle(np.arctan2(before[1], before[0]) - np.arctan2(after[1], after[0]))
    return out


def integrate_path(
    place: np.ndarray, velocity: np.ndarray, sway: np.ndarray, facing: np.ndarray, fps: float
) -> np.ndarray:
    """Integrate the root on the ground.

    Across a transition the last displacement is repeated, which is what summing velocities does.

    Args:
        place: (2,) m, first place.
        velocity: (T, 2) m/s of the path, facing frame.
        sway: (T, 2) m, facing frame.
        facing: (T,) rad, heading.
        fps: frames per second.
    Returns:
        (T, 2) m, world.
    Source: Faustino 2016, eq. 24.
    """
    turn = quaternion.from_up_angle(facing)
    step, away = (quaternion.rotate(turn, np.pad(flat, ((0, 0), (0, 1))))[:, :2] for flat in (velocity, sway))
    path = place + np.concatenate([np.zeros((1, 2)), np.cumsum(step[:-1] / fps, axis=0)])
    return path + away
