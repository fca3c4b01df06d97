"""The ground under Faustino's block searches: the track's place by travelled distance, or the clips' own paths put one
behind the other (§3.2.6)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.vectors import unit_vectors
from ...library.library import Library
from ...motion import quaternion
from ...motion.foot_plant import Planted
from ...motion.humanoid import identify
from ...motion.motion import pose_kinematics
from ...motion.track import SampledTrack
from ..plan import ResolvedPlan
from ..search.footage import Footage
from ..search.locomotion import travelled_distance
from .construction import Construction, apply_heading
from .on_track import facing, root_with_sway
from .steps import Steps
from .transitions import spread_rotations, spread_values

UPRIGHT = np.cos(np.radians(50.0))  # height of the trunk's unit vector below which a body lies


def lay_out_blocks(construction: Construction, travelled: np.ndarray | None) -> tuple[Planted, Steps]:
    """Lay T source frames on the ground as the thesis does: nothing is planted.

    travelled: (T,) m by method "distance", None by "blocks"."""
    track, source = construction.track, construction.source
    smooth = _spread_transitions(construction.plan, source)
    if travelled is None:
        heading, ground = root_by_integration(construction.library, source, smooth, track)
    else:
        heading, ground = root_at_distance(track, smooth, travelled)
    pose, none = apply_heading(smooth.pose, heading), np.zeros((len(ground), 2))
    planted = Planted(np.concatenate([ground, smooth.height[:, None]], axis=1), pose, none, none)
    return planted, Steps.none(pose, source.standing)


def _spread_transitions(plan: ResolvedPlan, source: Footage) -> Footage:
    """Spread the jump at each transition over the frames around it. Source: Faustino eq. 25."""
    reach = 0.5 * plan.asked.seam_window * plan.fps
    return replace(
        source,
        pose=spread_rotations(source.pose, source.seams, source.ahead_pose, reach),
        height=spread_values(source.height, source.seams, source.ahead_height, reach),
        sway=spread_values(source.sway, source.seams, source.ahead_sway, reach),
    )


def root_at_distance(track: SampledTrack, smooth: Footage, travelled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heading (T,) rad and root (T, 2) m where the track has come as far as `travelled` (T,) m."""
    place, direction = place_along(track, travelled)
    speed = np.abs(np.gradient(travelled)) * track.fps if len(travelled) > 1 else np.zeros(1)
    heading = facing(direction, speed, smooth.velocity, smooth.turn)
    return heading, root_with_sway(place, smooth.sway, heading)


def place_along(track: SampledTrack, travelled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (T, 2) m on the track's path after `travelled` (T,) m, and the direction (T,) rad of the path there.

    Beyond the track's end the last direction is kept. Source: Faustino eq. 29, which steps from the present place
    towards the track's place at the next travelled distance; since both lie on the same path, the steps add up to the
    path itself. (As printed the difference points backwards.)
    """
    path = travelled_distance(track) + 1e-6 * np.arange(len(track.times))
    place = np.stack([np.interp(travelled, path, track.positions[:, axis]) for axis in (0, 1)], axis=1)
    direction = np.interp(travelled, path, track.direction)
    beyond = np.maximum(travelled - path[-1], 0.0)[:, None]
    return place + beyond * np.stack([np.cos(direction), np.sin(direction)], axis=1), direction


def root_by_integration(
    library: Library, source: Footage, smooth: Footage, track: SampledTrack
) -> tuple[np.ndarray, np.ndarray]:
    """Heading (T,) rad and root (T, 2) m from the track's first place and direction on, wherever the clips lead;
    smooth: `source` without jumps."""
    turn = source.turn.copy()
    torso, expected = _torso(library, source.pose), _torso(library, source.ahead_pose)
    turn[source.seams] += torso_corrections(torso, source.seams, expected)
    heading = chained_facing(float(track.direction[0]), turn)
    return heading, chained_root(track.positions[0], smooth.velocity, smooth.sway, heading, track.fps)


def _torso(library: Library, pose: np.ndarray) -> np.ndarray:
    """(T, 3) unit vector from hips to chest or neck in the facing frame."""
    body = identify(library.skeleton)
    top = body.neck if body.neck is not None else body.chest
    places, _ = pose_kinematics(library.skeleton, np.zeros((len(pose), 3)), pose)
    return unit_vectors(places[:, top] - places[:, body.hips])


def chained_facing(start: float, turn: np.ndarray) -> np.ndarray:
    """(T,) facing in radians from `start` on, turning by `turn` (T,) per frame as recorded; at a seam `turn` is 0, so
    that the next stretch begins in the direction in which the last one ended."""
    return start + np.cumsum(turn) - turn[0]


def torso_corrections(up: np.ndarray, seams: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """(S,) radians by which a stretch has to be turned more at each seam because the body is not upright there.

    up: (T, 3) direction of the torso (hips to neck) in the facing frame; expected: (S, 3) the same for the frame that
    the stretch before would have gone on with. Facing says little about a body that lies or dives: where both torsos
    lean more than 50 degrees, the stretch is turned until they lie the same way (§3.2.6, the extra check on the spine).
    """
    out = np.zeros(len(seams))
    for number, (after, before) in enumerate(zip(up[seams], expected)):
        if before[2] < UPRIGHT and after[2] < UPRIGHT:
            out[number] = quaternion.wrapped(np.arctan2(before[1], before[0]) - np.arctan2(after[1], after[0]))
    return out


def chained_root(
    place: np.ndarray, velocity: np.ndarray, sway: np.ndarray, facing: np.ndarray, fps: float
) -> np.ndarray:
    """(T, 2) root on the ground from `place` (2,) on: the path's velocity (T, 2, m/s, facing frame) summed up, plus
    sway (T, 2). Across a seam the last displacement is repeated (eq. 24), which is what summing velocities does."""
    turn = quaternion.about_up(facing)
    step, away = (quaternion.rotate(turn, np.pad(flat, ((0, 0), (0, 1))))[:, :2] for flat in (velocity, sway))
    path = place + np.concatenate([np.zeros((1, 2)), np.cumsum(step[:-1] / fps, axis=0)])
    return path + away
