"""Place the plant foot of a kick beside the ball: where the recording has it off the usual range its step goes there.

The foot moves for its whole stance, so that it stays on the ground without sliding; it gets there and back in the air.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...annotation.ball_contact import SENDING, find_striking_part
from ...annotation.vocabulary import SIDES
from ...base.easing import smoothstep
from ...base.time_series import find_runs
from ...motion import quaternion
from ...motion.humanoid import compute_heading_from_positions, identify_joints
from ...motion.plant_place import compute_plant_shift, measure_plant_place
from ...motion.skeleton import Skeleton
from .ball_touch.touch_frames import Touch, find_nearest_frame
from .move_body_part import Body, LimbReference, move_limb
from .strike import StrikeResult

MAX_PLANT_SHIFT = 0.12
"""Metres by which the step onto the plant foot goes elsewhere than recorded."""

_AROUND_SECONDS = (0.5, 0.8)  # s before and after a kick in which its plant foot gets to its place and back
_MARGIN = 0.02  # m inside the range
_LEAST_SECONDS = 0.1  # in the air before and after the stance, in which the foot gets there and back
_SHARES = (1.0, 0.75, 0.5, 0.25)  # of the shift, the first of which the leg follows
_HELD = 0.005  # m by which the foot may miss it
_NEAR_SECONDS = 0.1  # s from the contact with the ball in which the foot may reach the ground or leave it


def place_plant_feet(skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, reached: StrikeResult,
                     contacts: np.ndarray, touches: Sequence[Touch], fps: float) -> np.ndarray:
    """Place the plant feet of all kicks.

    Args:
        skeleton: J joints.
        root: (T, 3) m, world, before the ball is met.
        rotations: (T, J, 4) local.
        reached: the same with the ball met.
        contacts: (T, 2) bool, left and right foot in contact.
        touches: where the ball is met.
        fps: frames per second.
    Returns:
        (T, J, 4) local rotations, the given ones where no foot steps elsewhere.
    """
    out = rotations
    for side, at, low, end in _iter_kicks(touches, len(root), fps):
        met = Body.from_pose(skeleton, reached.root[at : at + 1], reached.rotations[at : at + 1])
        body = Body.from_pose(skeleton, root[low:end], out[low:end])
        standing = contacts[low:end, 0 if side == "right" else 1]
        shift = compute_step_shift(met, side, 0)
        placed = place_plant_foot(body, shift, side, at=at - low, is_standing=standing, fps=fps)
        if placed is not body:
            out = np.concatenate([out[:low], placed.rotations, out[end:]])
    return out


def _iter_kicks(touches: Sequence[Touch], count: int, fps: float) -> Iterator[tuple[str, int, int, int]]:
    """Iterate over kicks: side, frame of the contact, and the frames first .. end around it that no other touch has."""
    frames = sorted(find_nearest_frame(touch.frame, count) for touch in touches)
    for touch in touches:
        side, at = _find_kicking_side(touch), find_nearest_frame(touch.frame, count)
        if not side:
            continue
        before = max((frame for frame in frames if frame < at), default=-1) + 1
        after = min((frame for frame in frames if frame > at), default=count)
        low, end = int(at - _AROUND_SECONDS[0] * fps), int(at + _AROUND_SECONDS[1] * fps) + 1
        yield side, at, max(low, before), min(end, after)


def _find_kicking_side(touch: Touch) -> str:
    """Find the side of the foot that sends a ball, "" where the touch is no kick of one foot."""
    sides = [side for side in SIDES if side in touch.words]
    is_kick = not touch.misses and bool(SENDING & set(touch.words)) and find_striking_part(touch.words) == "foot"
    return sides[0] if is_kick and len(sides) == 1 else ""


def compute_step_shift(body: Body, side: str, at: int) -> np.ndarray:
    """Compute the shift (3,) m, world, of a kick's plant foot into its usual range, at most MAX_PLANT_SHIFT.

    Args:
        body: the body with its foot at the ball, W frames.
        side: of the kicking foot.
        at: frame of the contact with the ball.
    """
    place = measure_plant_place(body.skeleton, body.places[at], side)
    ahead, beside = compute_plant_shift(body.skeleton, place, _MARGIN)
    heading = compute_heading_from_positions(body.skeleton, body.places[at])
    level = np.array([ahead, beside if side == "right" else -beside])
    level *= min(1.0, MAX_PLANT_SHIFT / max(float(np.linalg.norm(level)), 1e-9))
    return np.append(quaternion.rotate_level(level[None], np.atleast_1d(heading))[0], 0.0)


def place_plant_foot(body: Body, shift: np.ndarray, side: str, at: int, is_standing: np.ndarray, fps: float) -> Body:
    """Move the plant foot of a kick for the stance in which it kicks.

    Args:
        body: the body, W frames.
        shift: (3,) m, world.
        side: of the kicking foot.
        at: frame of the contact with the ball.
        is_standing: (W,) bool, the plant foot is in contact with the ground.
        fps: frames per second.
    Returns:
        The body; itself where the foot does not step within these frames, or the leg does not follow.
    """
    share = _compute_share(is_standing, at, fps)
    if share is None or not shift.any():
        return body
    human = identify_joints(body.skeleton)
    limb = LimbReference.from_body(body, (human.right if side == "left" else human.left).leg, soft=1e-3)
    for part in _SHARES:
        moves = part * share[:, None] * shift
        moved = Body.from_pose(body.skeleton, body.root, move_limb(body, limb, moves))
        foot = limb.chain[2]
        if np.linalg.norm(moved.places[:, foot] - body.places[:, foot] - moves, axis=1).max() < _HELD:
            return moved
    return body


def _compute_share(is_standing: np.ndarray, at: int, fps: float) -> np.ndarray | None:
    """Compute the share (W,) of its shift that the foot has: 1 while it stands about frame `at`, 0 in other stances.

    None where it does not stand there, or has no time to get there and back.
    """
    near = _NEAR_SECONDS * fps
    stances = _join_stances(find_runs(is_standing), near)
    mine = next((number for number, (first, end) in enumerate(stances) if first - near <= at < end + near), None)
    if mine is None:
        return None
    first, last = min(stances[mine][0], at), max(stances[mine][1] - 1, at)
    before = stances[mine - 1][1] - 1 if mine else 0
    after = stances[mine + 1][0] if mine + 1 < len(stances) else len(is_standing) - 1
    if min(first - before, after - last) < _LEAST_SECONDS * fps:
        return None
    frames = np.arange(len(is_standing))
    rise, fall = (frames - before) / (first - before), (after - frames) / (after - last)
    return smoothstep(np.clip(np.minimum(rise, fall), 0.0, 1.0))


def _join_stances(stances: list[tuple[int, int]], longest: float) -> list[tuple[int, int]]:
    """Join stances (first frame, end) between which a foot leaves the ground for at most `longest` frames."""
    joined: list[tuple[int, int]] = []
    for first, end in stances:
        if joined and first - joined[-1][1] <= longest:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((first, end))
    return joined
