"""Blend a constructed stretch with the motion around it, which stays: without a jump, and without a foot that slides.

Around the stretch both motions show the same source frames, but what was solved over all frames (how far a foot is
shifted, how low the pelvis is) may differ there by some centimetres. Root and joints are blended at its ends;
feet change over at once where they are in the air. A foot in contact at the border stays where the old motion has it
until it lifts: its shift is `foot_plant.solve_shift` of a foot that does not move at all. Where both motions
stay in place at different places, the feet step over (`step_over`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.easing import quintic_step_by_powers
from ...motion import quaternion
from ...motion.foot_plant import plant_feet, solve_shift
from ...motion.humanoid import Limb, identify_joints, pose_legs
from ...motion.motion import compute_world_rotation
from ...motion.skeleton import Skeleton
from ...motion.track import SampledTrack
from ...motion.track.sampling import MOVING_SPEED
from .extra_steps import add_steps
from .move_body_part import Body, LimbReference, move_limb
from .track_following import pull_to_track

Pose = tuple[np.ndarray, np.ndarray]

_MAX_TURN = 1.5 * np.pi  # rad, largest turn on the spot to keep the old direction of turning
_OFFSET_SECONDS = 1.0  # s from an end of the stretch over which the root's offset to the old one fades
_AROUND = 0.5  # s on either side of the stretch that are solved with it
_STAYS = 0.999  # share of the old motion from which on, where feet step, they are where it has them: what fades slides
_BLEND_SECONDS = 0.12  # s at either end of the stretch in which the planted motion is blended into the old one


@dataclass(frozen=True, eq=False, kw_only=True)
class OldMotion:
    """The motion that was shown before in the W frames of a window.

    Attributes:
        root: (W, 3) m, world.
        rotation: (W, 4) of the root joint, world.
        stepped: (W, 2) bool, extra steps of the left and right foot.
        share: (W,) of the old motion in the result, 0 where it is replaced.
        stretch: first and end frame of the window between which the new motion is free.
    """

    root: np.ndarray
    rotation: np.ndarray
    stepped: np.ndarray
    share: np.ndarray
    stretch: tuple[int, int]

    @property
    def is_old(self) -> np.ndarray:
        """(W,) bool: frames in which some of the old motion stays."""
        return self.share > 0.0

    def compute_heading(self, pose: np.ndarray) -> np.ndarray:
        """Compute the heading with which poses face as the old motion does.

        Args:
            pose: (W, J, 4) local rotations, the root's in the facing frame.
        Returns:
            (W,) rad, NaN where the new motion is free.
        """
        heading = quaternion.to_yaw(quaternion.multiply(self.rotation, quaternion.inverse(pose[:, 0])))
        heading[~self.is_old] = np.nan
        return heading

    def match_turning(self, track: SampledTrack, heading: np.ndarray) -> SampledTrack | None:
        """Change the track's direction so that a body turns in the same sense as the old one.

        Args:
            track: W frames.
            heading: (W,) rad, unwrapped, the new heading on that track.
        Returns:
            The track with another direction; None where both turn alike, or where the body is nowhere slow enough for
            both directions of turning to be possible.
        """
        old = np.unwrap(quaternion.to_yaw(self.rotation))
        first, end = max(self.stretch[0] - 1, 0), min(self.stretch[1], len(heading) - 1)
        turns = np.round((heading[end] - heading[first] - old[end] + old[first]) / (2.0 * np.pi))
        slow = track.speed < MOVING_SPEED
        middle = first + int(np.argmin(track.speed[first : end + 1]))
        if turns == 0 or not slow[middle]:
            return None
        # the slow stretch around the slowest frame: only there full turns may be added or removed
        fast = np.flatnonzero(~slow[first : end + 1]) + first
        low, high = max(fast[fast < middle], default=first), min(fast[fast > middle], default=end)
        if abs(heading[high] - heading[low] - 2.0 * np.pi * turns) > _MAX_TURN:
            return None
        ramp = quintic_step_by_powers((np.arange(len(heading)) - low) / max(high - low, 1))
        return replace(track, direction=track.direction - 2.0 * np.pi * turns * ramp)

    def pull_to_track(self, ground: np.ndarray, track: SampledTrack, window: float) -> np.ndarray:
        """Pull the constructed root onto the track between the frames that stay.

        Near these it starts from the old root.

        Args:
            ground: (W, 2) m, constructed root, world.
            track: W frames.
            window: s, as for `pull_to_track`.
        Returns:
            (W, 2) m, world.
        """
        old, stays = self.root[:, :2], self.is_old
        first, end = self.stretch
        at, fade = np.arange(len(ground)), max(1.0, min(_OFFSET_SECONDS * track.fps, end - first))
        root = ground.copy()
        # the last old frame before and the first one behind the stretch; the offset there fades over `fade` frames
        for edge in (edge for edge in (first - 1, end) if 0 <= edge < len(ground)):
            near = quintic_step_by_powers(1.0 - np.abs(at - edge) / fade)[:, None]
            root += np.where(stays[:, None], 0.0, near * (old - ground)[edge])
        root = np.where(stays[:, None], old, root)
        pulled = pull_to_track(root, track.raw, track.fps, window)
        return pulled + self.share[:, None] * (old - pulled)

    def select_old_steps(self) -> np.ndarray:
        """Return (W, 2) bool: the steps that are taken, in whole or in part, where the old motion stays."""
        old_steps = np.zeros_like(self.stepped)
        for side in range(old_steps.shape[1]):
            stepped = self.stepped[:, side]
            # number each step of the foot, then keep those numbers that occur where the motion stays
            number = np.cumsum(np.diff(stepped, prepend=False)) * stepped
            old_steps[:, side] = stepped & np.isin(number, number[self.is_old & stepped])
        return old_steps


def compute_old_share(count: int, stretch: tuple[int, int], frames: int) -> np.ndarray:
    """Compute the share (count,) of the old motion: 0 within the stretch, 1 from `frames` around it on.

    Args:
        count: number of frames.
        stretch: first and end frame that are free.
        frames: length of the blend on either side.
    """
    at = np.arange(count)
    away = np.maximum(stretch[0] - at, at - stretch[1] + 1) / (frames + 1.0)
    return quintic_step_by_powers(away)


def blend_with_old(skeleton: Skeleton, new: Pose, old: Pose, share: np.ndarray, heel_toe_contacts: np.ndarray,
                   fps: float, least: float = 0.0) -> Pose:
    """Blend a new motion into an old one without sliding feet.

    Args:
        skeleton: the skeleton.
        new: root (T, 3) m and local rotations (T, J, 4) where the share is 0.
        old: the same where the share is 1; not used where it is 0.
        share: (T,) of the old motion.
        heel_toe_contacts: (T, 2, 2) bool, heel and toe of the left and right foot in contact.
        fps: frames per second.
        least: share above which feet are where the old motion has them.
    Returns:
        Root (T, 3) m and local rotations (T, J, 4).
    """
    root = new[0] + share[:, None] * (old[0] - new[0])
    rotations = quaternion.slerp(_match_signs(new[1], old[1], share), old[1], share[:, None])
    body = Body.from_pose(skeleton, root, rotations)
    new_joints, old_joints = pose_legs(skeleton, *new), pose_legs(skeleton, *old)
    legs = identify_joints(skeleton)
    for side, limb in enumerate((legs.left, legs.right)):
        carries = heel_toe_contacts[:, side].any(axis=1).astype(float)[:, None]
        moved, turned = _solve_foot_offsets([values[:, limb.foot] for values in (*new_joints, *old_joints)],
                                            share > least, carries, fps)
        chain, foot = limb.leg, quaternion.multiply(turned, new_joints[1][:, limb.foot])
        place = new_joints[0][:, limb.foot] + moved
        place[:, 2] += _measure_sinking(skeleton, limb, place, foot=foot, motions=[new_joints[0], old_joints[0]],
                                        share=share)
        away = place - body.places[:, limb.foot]
        rotations = move_limb(body, LimbReference.from_body(body, chain), away, rotations=rotations)
        above = quaternion.inverse(compute_world_rotation(skeleton, rotations, skeleton.parents[limb.foot]))
        rotations[:, limb.foot] = quaternion.match_signs(quaternion.multiply(above, foot), rotations[:, limb.foot])
    return root, rotations


def step_over(skeleton: Skeleton, pose: Pose, heel_toe_contacts: np.ndarray, stretch: tuple[int, int],
              fps: float, is_firm: bool = False) -> tuple[Pose, np.ndarray]:
    """Plant the feet and let them step within a stretch; all other frames stay bit for bit.

    Args:
        skeleton: the skeleton.
        pose: root (T, 3) m and local rotations (T, J, 4).
        heel_toe_contacts: (T, 2, 2) bool, heel and toe contacts of the motion that is shown most.
        stretch: first and end frame.
        fps: frames per second.
        is_firm: feet stand on the ground, and at the stretch's ends where the motion beside it has them; False: at
            their own heights, and as they fade in the motion.
    Returns:
        Root (T, 3) m and local rotations (T, J, 4); and the contacts, without those of feet that step.
    """
    first, end = stretch
    around, joins = int(_AROUND * fps), max(int(round(_BLEND_SECONDS * fps)), 1)
    if end - first < 2 * joins + 3:
        return pose, heel_toe_contacts
    low, high = max(first - around, 0), min(end + around, len(pose[0]))
    root, rotations = pose[0][low:high], pose[1][low:high]
    inside = (np.arange(low, high) >= first) & (np.arange(low, high) < end)
    steps_taken = add_steps(skeleton, root, rotations, heel_toe_contacts[low:high], fps, free=inside)
    swayed = root + np.column_stack([steps_taken.sway, np.zeros(len(root))])
    found = plant_feet(skeleton, swayed, steps_taken.rotations, steps_taken.heel_toe_contacts, fps,
                       foot_moves=steps_taken.moves, level_feet=is_firm)
    share = compute_old_share(high - low, (first + joins - low, end - joins - low), joins)
    share[~inside] = 1.0
    new = blend_with_old(skeleton, (found.root, found.rotations), (root, rotations), share=share,
                         heel_toe_contacts=steps_taken.heel_toe_contacts, fps=fps,
                         least=_STAYS if is_firm else 0.0)
    changed = pose[0].copy(), pose[1].copy()
    for whole, part in zip(changed, new):
        whole[first:end] = part[first - low : end - low]
    contacts = heel_toe_contacts.copy()
    contacts[first:end] = steps_taken.heel_toe_contacts[first - low : end - low]
    return changed, contacts


def _measure_sinking(skeleton: Skeleton, limb: Limb, place, foot, motions: list[np.ndarray], share) -> np.ndarray:
    """Compute how far (T,) m a foot's joints lie below the ground (height 0) and below where either motion has them.

    The shift and turn of a foot in contact fade as it lifts, and may take its toes down.
    place (T, 3) m and foot (T, 4): of the ankle, world; motions: joint positions (T, J, 3) m of the new and the old
    one.
    """
    toes = [limb.toe] if limb.toe is not None and skeleton.parents[limb.toe] == limb.foot else []
    new, old = (places[:, [limb.foot, *toes], 2].min(axis=1) for places in motions)
    allowed = np.minimum(np.where(share > 0.0, np.minimum(new, old), new), 0.0)
    ends = [place[:, 2], *(place[:, 2] + quaternion.rotate(foot, skeleton.offsets[toe])[:, 2] for toe in toes)]
    return np.maximum(allowed - np.min(ends, axis=0), 0.0)


def _solve_foot_offsets(feet: list[np.ndarray], known: np.ndarray, is_planted: np.ndarray, fps: float) -> Pose:
    """Compute the shift (T, 3) m and turn (T, 4) that bring a new foot to where the old one is, wherever that is known.

    feet: place and rotation of the new foot and of the old one.
    """
    place, turn, old_place, old_turn = feet
    away = quaternion.to_rotation_vector(quaternion.multiply(old_turn, quaternion.inverse(turn)))
    known_offsets = np.where(known[:, None], np.column_stack([old_place - place, away]), np.nan)
    # six columns, metres and radians, solved together: they stay constant while the foot is in contact
    found = solve_shift(np.zeros((len(place) - 1, 6)), is_planted, 30.0 / fps, known_offsets)
    found[known] = known_offsets[known]
    return found[:, :3], quaternion.from_rotation_vector(found[:, 3:])


def _match_signs(rotations: np.ndarray, old: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Make rotations (T, J, 4) continuous in sign, with the sign of the old ones where these begin to count."""
    rotations = quaternion.unify_signs(rotations)
    known = np.flatnonzero(share > 0.0)
    if not len(known):
        return rotations
    at = known[0]
    return rotations * np.where(np.sum(rotations[at] * old[at], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
