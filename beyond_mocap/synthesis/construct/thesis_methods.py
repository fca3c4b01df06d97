"""The ground under Faustino's block searches: the track's place by travelled distance, or the clips' own paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.vectors import unit_vectors
from ...library.library import Library
from ...motion.foot_plant import Planted
from ...motion.humanoid import identify
from ...motion.motion import pose_kinematics
from ...motion.track import SampledTrack
from ..plan import ResolvedPlan
from ..search.footage import Footage
from ..search.locomotion import travelled_distance
from .construction import Construction, apply_heading
from .joining import chained_facing, chained_root, torso_corrections
from .on_track import facing, root_with_sway
from .smoothing import spread_rotations, spread_values
from .steps import Steps


def lay_out_blocks(construction: Construction, travelled: np.ndarray | None) -> tuple[Planted, Steps]:
    """Lay T source frames on the ground as the thesis does: nothing is planted.

    travelled: (T,) m by method "distance", None by "blocks".
    """
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
    place, direction = along(track, travelled)
    speed = np.abs(np.gradient(travelled)) * track.fps if len(travelled) > 1 else np.zeros(1)
    heading = facing(direction, speed, smooth.velocity, smooth.turn)
    return heading, root_with_sway(place, smooth.sway, heading)


def along(track: SampledTrack, travelled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
    torso = places[:, top] - places[:, body.hips]
    return unit_vectors(torso)
