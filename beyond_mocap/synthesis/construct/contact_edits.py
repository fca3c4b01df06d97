"""Contacts as the user wants them: moved, longer, shorter, left out or added, and the legs follow.

Each foot keeps its own path through space. Where a contact begins or ends at another time, the path of that foot alone
is played faster or slower around it (`_warp_frames`); where it is moved, the path is moved, fully while the foot stands
and fading over the swings beside it. A foot whose contact is left out swings on to its next one; one that is added is
set down flat. The pelvis goes half the way with each foot and is lowered where a leg would be too short. All other
frames stay bit for bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.easing import smoothstep
from ...base.time_series import find_runs, hann_smooth, interpolate_columns
from ...motion import quaternion
from ...motion.foot_plant import MAX_DROP, Foot, PlantResult, build_foot, compute_pelvis_drop, limit_to_reach
from ...motion.humanoid import Limb, identify_joints
from ...motion.limb import solve_two_bone
from ...motion.motion import compute_pose
from ...motion.skeleton import Skeleton
from ..contact_edit import ADDED_SECONDS, FEET, ContactEdit
from .extra_steps import Steps

MIN_SWING, MIN_STANCE = 0.1, 0.07  # s that a swing and a contact last at least
REACH_SECONDS = 0.1  # s beside a contact within which an edit still finds it
LIFT = 0.07  # m that a foot is lifted over a contact that is left out
FADE = 0.3  # s over which the pelvis goes with a moved foot, and over which a foot comes from the end of the motion
EDIT_REACH = 0.8  # s beside an edit that a change of it affects
PELVIS_SHARE = 0.5  # of a foot's offset that the pelvis goes too
_SAME = 1e-7  # m, rad or frames below which nothing has changed
_SPREAD = 0.1  # s over which a lowered pelvis is spread


@dataclass(frozen=True)
class _Stance:
    """A contact in frames: first .. end now, and the frames `source` of the unedited path at its first and last one."""

    first: int
    end: int
    source: tuple[float, float]
    offset: tuple[float, float] = (0.0, 0.0)
    is_added: bool = False
    is_deleted: bool = False


@dataclass(frozen=True, eq=False)
class _FootPath:
    """Where a foot goes.

    Attributes:
        stances: its contacts, in order of time.
        source: (T,) frames of the unedited path.
        offset: (T, 2) m, of moved contacts.
        ankle: (T, 3) m, world.
        rotation: (T, 4) of the foot, world.
        toe: (T, 4) of the toe joint, local; None without one.
        contacts: (T, 2) bool, heel and toe.
    """

    stances: list[_Stance]
    source: np.ndarray
    offset: np.ndarray
    ankle: np.ndarray
    rotation: np.ndarray
    toe: np.ndarray | None
    contacts: np.ndarray


def apply_contact_edits(skeleton: Skeleton, planted: PlantResult, steps: Steps, edits: Sequence[ContactEdit],
                        fps: float, start: float) -> tuple[PlantResult, Steps]:
    """Apply contact edits to a body with planted feet.

    Args:
        skeleton: J joints.
        planted: T frames.
        steps: what plants its feet.
        edits: of both feet, offsets in the skeleton's size; those without a contact at their time have no effect.
        fps: frames per second.
        start: s, time of frame 0 on the edits' clock.
    Returns:
        The body and its steps; frames that no edit affects are the same bit for bit.
    """
    if not edits:
        return planted, steps
    body, (places, world) = identify_joints(skeleton), compute_pose(skeleton, planted.root, planted.rotations)
    paths = []
    for side, limb in enumerate((body.left, body.right)):
        own = [edit for edit in edits if edit.foot == FEET[side]]
        stances = plan_stances(steps.heel_toe_contacts[:, side].any(axis=1), own, fps, start)
        foot = build_foot(places, world, limb, steps.heel_toe_contacts[:, side])
        paths.append(_build_path(foot, planted.rotations, stances, steps.heel_toe_contacts[:, side], fps))
    sway = _compute_sway(paths, fps)
    affected = (np.abs(sway) > _SAME).any(axis=1)
    for path, limb in zip(paths, (body.left, body.right)):
        affected |= _find_affected(path, places[:, limb.foot], world[:, limb.foot])
    contacts = np.stack([path.contacts for path in paths], axis=1)
    moved = _follow_paths(skeleton, planted, (places, world), paths=paths, sway=sway, affected=affected,
                          limbs=(body.left, body.right), fps=fps)
    return moved, replace(steps, heel_toe_contacts=contacts, contacts=contacts.all(axis=2))


def find_edited_frames(times: np.ndarray, old: Sequence[ContactEdit], new: Sequence[ContactEdit]) -> np.ndarray:
    """Find the frames that a change of contact edits may affect.

    Args:
        times: (T,) s of the frames.
        old: edits before.
        new: edits after.
    Returns:
        (T,) bool: frames near edits that are only in one of both.
    """
    found = np.zeros(len(times), bool)
    for edit in {*old} ^ {*new}:
        low, high = edit.time + min(edit.start, 0.0) - EDIT_REACH, edit.time + max(edit.end, 0.0) + EDIT_REACH
        found |= (times >= low) & (times <= high)
    return found


def plan_stances(contacts: np.ndarray, edits: Sequence[ContactEdit], fps: float, start: float) -> list[_Stance]:
    """Plan the contacts of one foot.

    Args:
        contacts: (T,) bool, the foot in contact, without edits.
        edits: of this foot.
        fps: frames per second.
        start: s, time of frame 0.
    Returns:
        Its contacts in order of time; those that are left out are marked.
    """
    stances = [_Stance(first, end, (first, end - 1)) for first, end in find_runs(contacts)]
    for edit in sorted(edits, key=lambda edit: (edit.kind == "add", edit.time)):
        at = (edit.time - start) * fps
        if edit.kind == "add":
            half = 0.5 * ADDED_SECONDS * fps
            wanted = _Stance(int(round(at - half)), int(round(at + half)) + 1, (at, at), is_added=True)
            if not 0 <= at <= len(contacts) - 1 or any(s.first <= at < s.end and not s.is_deleted for s in stances):
                continue
            number = sum(stance.first < at for stance in stances)
            stances.insert(number, wanted)
        else:
            number = _find_stance(stances, at, REACH_SECONDS * fps)
            if number is None:
                continue
        stances[number] = _edit_stance(stances, number, edit, fps, len(contacts))
    return [stance for stance in stances if stance.end > stance.first]


def _find_stance(stances: list[_Stance], at: float, reach: float) -> int | None:
    """Find the unedited contact at a frame, or the nearest one within `reach` frames."""
    away = [max(s.source[0] - at, at - s.source[1], 0.0) if not s.is_added else np.inf for s in stances]
    nearest = int(np.argmin(away)) if away else None
    return nearest if nearest is not None and away[nearest] <= reach else None


def _edit_stance(stances: list[_Stance], number: int, edit: ContactEdit, fps: float, count: int) -> _Stance:
    """Apply an edit to a contact; it stays clear of those beside it."""
    stance, gap, least = stances[number], int(round(MIN_SWING * fps)), max(2, int(round(MIN_STANCE * fps)))
    if edit.kind == "delete":
        return replace(stance, is_deleted=True)
    low = max((s.end + gap for s in stances[:number] if not s.is_deleted), default=0)
    high = min((s.first - gap for s in stances[number + 1:] if not s.is_deleted), default=count)
    if not stance.is_added:  # where the recording's own swing is shorter, it may stay as short
        low, high = min(low, stance.first), max(high, stance.end)
    # a contact that reaches the end of the motion has no swing there
    first = stance.first if stance.first <= 0 else stance.first + int(round(edit.start * fps))
    end = stance.end if stance.end >= count else stance.end + int(round(edit.end * fps))
    first, end = max(first, low), min(end, high)
    if end - first < least:
        if stance.is_added:
            return replace(stance, first=0, end=0)  # there is no room
        first = int(np.clip(first, low, max(low, high - least)))
        end = min(first + least, high)
    return replace(stance, first=first, end=end, offset=edit.offset)


def _warp_frames(stances: list[_Stance], count: int) -> np.ndarray:
    """Compute which frame of the unedited path each frame shows (T,): the same one where nothing has changed."""
    knots = [(0.0, 0.0), (count - 1.0, count - 1.0)]
    for stance in stances:
        if not stance.is_deleted:
            knots += [(stance.first, stance.source[0]), (stance.end - 1.0, stance.source[1])]
    if any(stance.first == 0 for stance in stances if not stance.is_deleted):
        knots.remove((0.0, 0.0))
    if any(stance.end == count for stance in stances if not stance.is_deleted):
        knots.remove((count - 1.0, count - 1.0))
    new, old = np.array(sorted(set(knots))).T
    return np.interp(np.arange(count), new, old)


def _interpolate_swings(stances: list[_Stance], values: np.ndarray, count: int, reach: float) -> np.ndarray:
    """Interpolate a value of each contact (S, N) over the swings: (T, N), eased; 0 beyond the outermost ones."""
    at, found = np.arange(count), np.zeros((count, values.shape[1]))
    zero = np.zeros(values.shape[1])
    before_end, before = (max(-1.0, stances[0].first - reach), zero) if stances else (0.0, zero)
    for stance, value in zip(stances, values):
        swing = (at > before_end) & (at < stance.first)
        progress = smoothstep((at[swing] - before_end) / max(stance.first - before_end, 1e-9))
        found[swing] = before + progress[:, None] * (value - before)
        found[stance.first:stance.end] = value
        before_end, before = stance.end - 1.0, value
    last = at > before_end
    found[last] = before * (1.0 - smoothstep(np.clip((at[last] - before_end) / reach, 0.0, 1.0)))[:, None]
    return found


def _build_path(foot: Foot, rotations: np.ndarray, stances: list[_Stance], contacts: np.ndarray,
                fps: float) -> _FootPath:
    """Build the path of a foot from its unedited one."""
    count, limb = len(contacts), foot.limb
    standing = [stance for stance in stances if not stance.is_deleted]
    source = _warp_frames(stances, count)
    frames = np.arange(count, dtype=float)
    heel, toe = (interpolate_columns(source, frames, values) for values in (foot.heel, foot.toe))
    low = np.clip(np.floor(source).astype(int), 0, count - 1)
    high, share = np.minimum(low + 1, count - 1), source - low
    rotation = quaternion.slerp(foot.rotation[low], foot.rotation[high], share)
    left = foot.left[np.round(source).astype(int)]
    offsets = np.array([stance.offset for stance in standing]).reshape(-1, 2)
    offset = _interpolate_swings(standing, offsets, count, FADE * fps)
    settle = _interpolate_swings(standing, _measure_settling(standing, foot), count, FADE * fps)
    tilt = quaternion.from_axis_angle(left, settle[:, 1])
    moved = toe + np.column_stack([offset, settle[:, 0]]) + _glide(stances, toe, fps)
    toes = None
    if limb.toe is not None:
        toes = quaternion.slerp(rotations[low, limb.toe], rotations[high, limb.toe], share)
    return _FootPath(stances, source, offset, moved + quaternion.rotate(tilt, heel - toe),
                     quaternion.multiply(tilt, rotation), toe=toes, contacts=_map_contacts(standing, source, contacts))


def _measure_settling(stances: list[_Stance], foot: Foot) -> np.ndarray:
    """Measure how far added contacts have to be lowered, m, and their heels turned about the toe, rad: (S, 2).

    A foot stands flat as in its other contacts.
    """
    flat, pitch = foot.weight.min(axis=1) > 0.0, _measure_pitch(foot)
    levels = np.column_stack([foot.toe[:, 2], pitch])
    rest = np.median(levels[flat], axis=0) if flat.any() else np.zeros(2)
    found = np.zeros((len(stances), 2))
    for number, stance in enumerate(stances):
        if stance.is_added:
            at = int(round(stance.source[0]))
            found[number] = rest - (foot.toe[at, 2], pitch[at])
    return found


def _measure_pitch(foot: Foot) -> np.ndarray:
    """Measure how far each foot's heel is raised about its toe (T,) rad; 0 without toes."""
    away = foot.heel - foot.toe
    return np.arctan2(away[:, 2], np.maximum(np.linalg.norm(away[:, :2], axis=1), 1e-9))


def _glide(stances: list[_Stance], toe: np.ndarray, fps: float) -> np.ndarray:
    """Compute how a foot moves (T, 3) m over contacts that are left out: on to its next contact, lifted."""
    out, at = np.zeros_like(toe), np.arange(len(toe))
    for number, stance in enumerate(stances):
        if not stance.is_deleted:
            continue
        before = max((s.end - 1 for s in stances[:number] if not s.is_deleted), default=None)
        after = min((s.first for s in stances[number + 1:] if not s.is_deleted), default=None)
        if before is not None and after is not None and after > before:
            inside = (at > before) & (at < after)
            share = smoothstep((at[inside] - before) / (after - before))[:, None]
            out[inside, :2] = toe[before, :2] + share * (toe[after, :2] - toe[before, :2]) - toe[inside, :2]
        ramp = 0.15 * fps
        away = np.maximum(stance.first - at, at - stance.end + 1) / ramp
        out[:, 2] = np.maximum(out[:, 2], LIFT * (1.0 - smoothstep(np.clip(away, 0.0, 1.0))))
    return out


def _map_contacts(stances: list[_Stance], source: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """Compute the contacts (T, 2) of heel and toe now."""
    out = np.zeros_like(contacts)
    for stance in stances:
        at = slice(stance.first, stance.end)
        out[at] = True if stance.is_added else contacts[np.round(source[at]).astype(int)]
        out[at, 1] |= ~out[at].any(axis=1)
    return out


def _compute_sway(paths: list[_FootPath], fps: float) -> np.ndarray:
    """Compute how far the pelvis goes with moved feet, (T, 3) m."""
    wanted = PELVIS_SHARE * sum(path.offset for path in paths)
    reach = int(round(FADE * fps))
    smooth = np.column_stack([hann_smooth(column, reach) for column in wanted.T])
    return np.column_stack([smooth, np.zeros(len(smooth))])


def _find_affected(path: _FootPath, ankle: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Find the frames (T,) in which a foot is elsewhere than without edits."""
    frames = np.arange(len(ankle))
    off = np.abs(path.source - frames) > _SAME
    for stance in path.stances:
        if stance.is_added or stance.is_deleted or stance.offset != (0.0, 0.0):
            off |= (np.linalg.norm(path.ankle - ankle, axis=1) > _SAME)
            off |= np.abs(np.sum(path.rotation * rotation, axis=1)) < 1.0 - _SAME
            break
    return off


def _follow_paths(skeleton: Skeleton, planted: PlantResult, pose, *, paths: list[_FootPath], sway: np.ndarray,
                  affected: np.ndarray, limbs: tuple[Limb, Limb], fps: float) -> PlantResult:
    """Bring the legs of the affected frames (T,) to the paths of their feet; pose: joints' positions and rotations."""
    feet = [_build_moved_foot(pose, limb, path, sway, affected) for limb, path in zip(limbs, paths)]
    drop = compute_pelvis_drop(feet, [path.ankle for path in paths], int(round(_SPREAD * fps)), MAX_DROP)
    rows = affected | (drop > _SAME)
    root = planted.root.copy()
    root[rows] += sway[rows] - drop[rows, None] * [0.0, 0.0, 1.0]
    rotations, miss, correction = planted.rotations[rows], planted.miss.copy(), planted.correction.copy()
    for side, (limb, path, foot) in enumerate(zip(limbs, paths, feet)):
        target = limit_to_reach(foot, path.ankle, drop)[rows]
        solved = solve_two_bone(skeleton, root[rows], rotations, (limb.upper_leg, limb.lower_leg, limb.foot), target,
                                end_rotation=path.rotation[rows], soft=foot.ease_distance[rows])
        rotations = solved.rotations
        if limb.toe is not None:
            rotations[:, limb.toe] = path.toe[rows]
        miss[rows, side] = np.maximum(miss[rows, side], solved.miss)
        correction[rows, side] += np.linalg.norm(target - pose[0][rows, limb.foot], axis=1)
    out = planted.rotations.copy()
    out[rows] = quaternion.match_signs(rotations, out[rows])
    return PlantResult(root, out, correction, miss)


def _build_moved_foot(pose, limb: Limb, path: _FootPath, sway: np.ndarray, affected: np.ndarray) -> Foot:
    """Build a foot under the moved pelvis; in affected frames it counts as firmly in contact from touchdown on."""
    foot = build_foot(*pose, limb, path.contacts)
    return replace(foot, hip=foot.hip + sway, weight=(affected[:, None] & (foot.weight > 0.0)).astype(float))
