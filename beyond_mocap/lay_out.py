"""Footage laid on the ground, step by step: seams, facing and root, leaning, feet, and the ball met.

What `synthesize` does with a whole take and `resynthesize` with a stretch of one; how each step is done stands in
`polish`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .annotation.ball_contact import striking_part
from .annotation.gaze import wanted_offset
from .library.library import Library
from .motion import quaternion
from .motion.humanoid import identify
from .motion.motion import pose_kinematics
from .motion.track import SampledTrack
from .own_size import real_ball, size_of
from .plan import Plan
from .polish.banking import banked, missing_lean
from .polish.cross_fade import faded_rotations, faded_values, share
from .polish.face_ball import turned_to_ball
from .polish.foot_plant import Planted, plant
from .polish.give import give
from .polish.joining import chained_facing, chained_root, torso_corrections
from .polish.on_track import facing, firmness, pulled_to_track, root_with_sway
from .polish.smoothing import spread_rotations, spread_values
from .polish.steps import Steps, steps
from .polish.strike import Struck, Touch, strike
from .synthesis.edit_list import EditList
from .synthesis.footage import Footage, overlap
from .synthesis.locomotion import travelled_distance
from .synthesis.wanted import needed
from .take import KeyResult

OTHERWISE = 0.4
"""Seconds before and after a key moment that nothing in the library shows in which the body comes to the ball and goes
back."""


def smoothed(library: Library, plan: Plan, footage: Footage) -> Footage:
    """The footage without jumps at its seams: faded over by what both recordings show or, by Faustino's methods, spread
    as he does. A fade is half as long as his window."""
    reach = 0.5 * plan.seam_window * plan.fps
    if plan.method != "path":
        return _spread(footage, reach)
    over = overlap(library, footage, 0.5 * reach)
    weight = share(over.through, over.after)
    return replace(
        footage,
        pose=faded_rotations(footage.pose, over.at, over.pose, over.through, over.after),
        height=faded_values(footage.height, over.at, over.height, weight),
        sway=faded_values(footage.sway, over.at, over.sway, weight),
    )


def _spread(footage: Footage, reach: float) -> Footage:
    return replace(
        footage,
        pose=spread_rotations(footage.pose, footage.seams, footage.ahead_pose, reach),
        height=spread_values(footage.height, footage.seams, footage.ahead_height, reach),
        sway=spread_values(footage.sway, footage.seams, footage.ahead_sway, reach),
    )


def on_track(
    library: Library, plan: Plan, track: SampledTrack, footage: Footage, strikes: list[Touch]
) -> tuple[np.ndarray, np.ndarray]:
    """Facing (T,) radians and root (T, 2) m at the track's place at every time; facing the ball at `strikes`."""
    firm = firmness(footage.standing, footage.height, plan.fps)
    angle = facing(track.direction, track.speed, footage.velocity, footage.turn, firm=firm, aim=aimed(track))
    angle = angle + towards_ball(library, track, footage, angle, strikes)
    root = root_with_sway(track.positions, footage.sway, angle)
    return angle, pulled_to_track(root, track.raw, plan.fps, plan.root_window)


def aimed(track: SampledTrack) -> np.ndarray:
    """(T,) radians: where a body that stands or goes slowly turns to."""
    return track.direction + wanted_offset(track)


def towards_ball(
    library: Library, track: SampledTrack, footage: Footage, angle: np.ndarray, strikes: list[Touch]
) -> np.ndarray:
    """(T,) radians by which a body that faces `angle` (T,) turns so that what strikes points at the ball."""
    ground = root_with_sway(track.positions, footage.sway, angle)
    root = np.concatenate([ground, footage.height[:, None]], axis=1)
    return turned_to_ball(library.skeleton, root, faced(footage.pose, angle), track.ball, strikes, track.fps)


def as_far(track: SampledTrack, footage: Footage, travelled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Facing (T,) radians and root (T, 2) m where the track has come as far as `travelled` (T,) m."""
    place, direction = along(track, travelled)
    speed = np.abs(np.gradient(travelled)) * track.fps if len(travelled) > 1 else np.zeros(1)
    angle = facing(direction, speed, footage.velocity, footage.turn)
    return angle, root_with_sway(place, footage.sway, angle)


def along(track: SampledTrack, travelled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (T, 2) on the track's path after `travelled` (T,) metres, and the direction (T,) of the path there in
    radians.

    Faustino eq. 29 steps from the present place towards the track's place at the next travelled distance; since both
    lie on the same path, the steps add up to the path itself. (As printed the difference points backwards.) Beyond the
    track's end the last direction is kept.
    """
    way = travelled_distance(track) + 1e-6 * np.arange(len(track.times))
    place = np.stack([np.interp(travelled, way, track.positions[:, axis]) for axis in (0, 1)], axis=1)
    direction = np.interp(travelled, way, track.direction)
    beyond = np.maximum(travelled - way[-1], 0.0)[:, None]
    return place + beyond * np.stack([np.cos(direction), np.sin(direction)], axis=1), direction


def chained(
    library: Library, footage: Footage, smooth: Footage, track: SampledTrack
) -> tuple[np.ndarray, np.ndarray]:
    """Facing (T,) radians and root (T, 2) m from the track's first place and direction on, wherever the clips lead;
    smooth: `footage` without jumps."""
    turn = footage.turn.copy()
    torso, expected = _torso(library, footage.pose), _torso(library, footage.ahead_pose)
    turn[footage.seams] += torso_corrections(torso, footage.seams, expected)
    angle = chained_facing(float(track.direction[0]), turn)
    return angle, chained_root(track.positions[0], smooth.velocity, smooth.sway, angle, track.fps)


def _torso(library: Library, pose: np.ndarray) -> np.ndarray:
    """(T, 3) unit vector from hips to chest or neck in the facing frame."""
    body = identify(library.skeleton)
    top = body.neck if body.neck is not None else body.chest
    places, _ = pose_kinematics(library.skeleton, np.zeros((len(pose), 3)), pose)
    torso = places[:, top] - places[:, body.hips]
    return torso / np.maximum(np.linalg.norm(torso, axis=1, keepdims=True), 1e-9)


def faced(pose: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Poses (T, J, 4) turned about the vertical by `angle` (T,) radians; from the facing frame: facing there."""
    out = pose.copy()
    out[:, 0] = quaternion.multiply(quaternion.about_up(angle), pose[:, 0])
    return out


def leaning(library: Library, plan: Plan, track: SampledTrack, footage: Footage, pose: np.ndarray) -> np.ndarray:
    """Local rotations (T, J, 4) of a body that leans into the track's curves as far as its footage does not."""
    lean = missing_lean(track.speed, track.direction, footage.velocity, footage.turn, footage.seams, plan.fps)
    return banked(library.skeleton, pose, track.direction, lean)


def footed(
    library: Library, plan: Plan, track: SampledTrack, root, pose, standing: np.ndarray, strikes: list[Touch],
    share=0.0, stepped: np.ndarray | None = None,
) -> tuple[Planted, Steps]:
    """A body laid on its track with its feet held where they stand, or stepping where they would be dragged.

    No steps are added where the ball may be met, nor where a share (T,) of the motion is given; stepped (T, 2) bool:
    those that are taken there.
    """
    share, at = np.broadcast_to(share, len(root)), np.arange(len(root))
    free = share == 0.0
    for touch in strikes:
        free &= (at < touch.frame - touch.entry) | (at > touch.frame + touch.leave)
    taken = steps(library.skeleton, root, pose, standing, plan.fps, stepped, free)
    root = root + np.column_stack([(1.0 - share)[:, None] * taken.sway, np.zeros(len(root))])
    root, pose = given(library, plan, track, root, taken.rotations, taken.standing, 1.0 - share)
    return plant(library.skeleton, root, pose, taken.standing, plan.fps, moves=taken.moves), taken


def given(library: Library, plan: Plan, track: SampledTrack, root, pose, standing: np.ndarray, free=1.0):
    """Root (T, 3) m and local rotations (T, J, 4) of a body laid on its track that gives where its feet would slide,
    where it is `free` (T,) to: 1, or nothing at 0."""
    move, turn = give(library.skeleton, root, pose, standing, plan.fps)
    pulled = pulled_to_track(root[:, :2] + move, track.raw, plan.fps, plan.root_window)
    free = np.broadcast_to(free, len(root))
    ground = root[:, :2] + free[:, None] * (pulled - root[:, :2])
    return np.concatenate([ground, root[:, 2:]], axis=1), faced(pose, free * turn)


def touches(library: Library, plan: Plan, edit: EditList, keys: tuple[KeyResult, ...]) -> list[Touch]:
    """Where the body may meet the ball: every key moment that is played, and every one for which the library has no
    clip at all, so that something else is shown: there the asked part of that comes to the ball if it is near enough
    (a runner's head to a header)."""
    found, served = [], set()
    for placed in edit.keys:
        result = keys[placed.wanted]
        entry, leave = np.multiply(needed(library, placed.key), plan.fps / library.fps)
        found.append(Touch(result.frame, result.words, float(entry), float(leave)))
        served.add(placed.wanted)
    alone = OTHERWISE * plan.fps
    for number, result in enumerate(keys):
        lacks = result.used_instead is not None and number not in served and not striking_part(result.words)
        if lacks and all(abs(result.frame - touch.frame) > alone for touch in found):
            found.append(Touch(result.frame, result.asked.words, alone, alone))
    return found


def met(library, plan: Plan, track: SampledTrack, standing: np.ndarray, planted: Planted, found: list[Touch]) -> Struck:
    """The motion and the ball with the striking part of the body on the ball at every touch that was found; standing
    (T, 2, 2) bool."""
    known = plan.track.ball_height_known
    height = np.interp(track.times, plan.track.times, known.astype(float)) > 0.5
    size = size_of(plan, library.skeleton)
    skeleton, root, ball = library.skeleton, planted.root, track.ball
    if size != 1.0:  # the ball is as large for a tall player as for a short one
        skeleton, root, ball = skeleton.scaled(size), root * size, real_ball(ball, size)
    struck = strike(
        skeleton, root, planted.rotations, standing.any(axis=2), ball, found, plan.fps,
        measured=track.ball_measured, height_known=height,
    )
    return struck if size == 1.0 else replace(struck, root=struck.root / size, ball=struck.ball / size)
