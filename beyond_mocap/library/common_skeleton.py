"""Brings clips of many bodies to one skeleton: the one with most frames, or the one that the user names.

Every rig is analysed once, from frames of all its clips, so that one actor's clips share one neutral posture.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import InputError, format_count
from ..files.bvh.bvh_write import JointAboveHips
from ..files.clip_file import read_clip
from ..motion import contacts
from ..motion.humanoid import identify_joints
from ..motion.motion import Motion
from ..motion.retargeting.retarget import Retargeter
from ..motion.skeleton import Skeleton
from . import repair
from .folder.conversions import Conversions

if TYPE_CHECKING:
    from .library import Library

BONE_TOLERANCE = 5e-3  # metres between offsets of equal bones
_SAMPLE_COUNT = 400  # frames from which a rig is analysed


def unify_skeletons(
    paths: Sequence[Path], motions: Sequence[Motion], skeleton_example: Motion | None, notes: list[str]
) -> Iterator[tuple[Motion, np.ndarray, bool]]:
    """Bring clips to the library's skeleton.

    Heels and toes are in contact where the recording's own are; where only the new body has toes, contacts are detected
    on it.

    Args:
        paths: the files.
        motions: as read, in the order of `paths`; taken one at a time, since they may lie in a file.
        skeleton_example: a recording with the library's skeleton (default: the skeleton with most frames, the first
            path's among equals).
        notes: gets one line about retargeted clips.
    Returns:
        For each clip the motion, its contacts (T, 2, 2) bool of heels and toes, and whether it came from another body.
    Raises:
        InputError: naming the file, for a clip whose legs cannot be found.
    """
    contact_mask = [_run_for_file(path, lambda: contacts.detect_heel_toe_contacts(motion)) for path,
                    motion in zip(paths, motions)]
    groups = _group_by_skeleton(motions)
    skeleton = skeleton_example.skeleton if skeleton_example is not None else _find_commonest_skeleton(motions, groups)
    own_clips = [i for i, motion in enumerate(motions) if motion.skeleton.has_same_bones(skeleton, BONE_TOLERANCE)]
    example, example_contacts = (_sample_frames(motions, own_clips, contact_mask) if own_clips
                                 else (skeleton_example, None))
    rigs = {}
    for group in groups:
        if group[0] not in own_clips:
            sample, sample_contacts = _sample_frames(motions, group, contact_mask)
            known: dict[str, Any] = {"example": example, "standing": sample_contacts,
                                     "example_standing": example_contacts}
            rig = _run_for_file(paths[group[0]], lambda: Retargeter(sample, skeleton, **known))
            rigs.update(dict.fromkeys(group, rig))
    if rigs:
        others = sum(group[0] in rigs for group in groups)
        notes.append(f"{format_count(len(rigs), 'clip')} of {format_count(others, 'other skeleton')} retargeted to the "
                     f"one with {len(skeleton)} joints")
    return _iter_unified(motions, contact_mask, skeleton, rigs)


def read_joints_above_hips(library: "Library", skeleton: Path | None, unit: float | None) -> tuple[JointAboveHips, ...]:
    """Read the joints above the hips of the recordings with the library's skeleton, from the first of them.

    Args:
        library: the library.
        skeleton: the file with its skeleton, None where a recording has it.
        unit: metres per file unit of its BVH files, None for estimated.
    Raises:
        InputError: if no recording has this skeleton any more.
    """
    folder = Path(library.folder)
    conversions = Conversions(folder, library.cache_location[0] if library.cache_location else folder)
    own = [folder / clip.path for clip in library.clips if not clip.mirrored and not clip.is_synthetic]
    for path in [skeleton] if skeleton else own:
        file = conversions.find_readable_file(path)
        clip = read_clip(file, unit if file == path else None)
        if clip.motion.skeleton.has_same_bones(library.skeleton, BONE_TOLERANCE):
            return clip.form.above
    raise InputError(folder, "no recording with the library's skeleton", "one", "build the library again")


def retarget_clip(motion: Motion, target: Motion, bone_map: dict[str, str] | str | Path | None = None) -> Motion:
    """Retarget one motion to the skeleton of `target`, with its feet planted; same rate and floor.

    On its own skeleton a motion is unchanged.

    Args:
        motion: the motion.
        target: a recording or pose of the target skeleton.
        bone_map: see `motion.retargeting.retarget`.
    Returns:
        The retargeted motion.
    Raises:
        InputError: as `Retargeter`.
    """
    contacts, target_contacts = _detect_contacts_if_known(motion), _detect_contacts_if_known(target)
    rig = Retargeter(
        motion, target.skeleton, bone_map, example=target,
        standing=None if contacts is None else contacts.all(axis=2),
        example_standing=None if target_contacts is None else target_contacts.all(axis=2),
    )
    retargeted = rig.retarget(motion)
    if contacts is None or target_contacts is None or motion.skeleton.has_same_bones(target.skeleton, 1e-6):
        return retargeted
    return repair.plant_contacts(retargeted, _choose_contacts(retargeted, motion.skeleton, contacts))


def _detect_contacts_if_known(motion: Motion) -> np.ndarray | None:
    """Detect contacts (T, 2, 2); None for a skeleton whose joints only a bone map identifies."""
    try:
        return contacts.detect_heel_toe_contacts(motion)
    except InputError:
        return None


def _iter_unified(motions, contacts, skeleton: Skeleton, rigs) -> Iterator[tuple[Motion, np.ndarray, bool]]:
    """Iterate over the clips on the library's skeleton, with contacts and whether they were retargeted."""
    for number, (motion, points) in enumerate(zip(motions, contacts)):
        if number in rigs:
            retargeted = rigs[number].retarget(motion)
            yield retargeted, _choose_contacts(retargeted, motion.skeleton, points), True
        else:
            yield replace(motion, skeleton=skeleton), points, False


def _choose_contacts(retargeted: Motion, skeleton: Skeleton, points: np.ndarray) -> np.ndarray:
    """Choose the contacts (T, 2, 2): the recording's own `points`, or new ones where only the new body has toes."""
    return contacts.detect_heel_toe_contacts(retargeted) if _has_toes(retargeted.skeleton) and not _has_toes(
        skeleton) else points


def _run_for_file(path: Path, work):
    """Run `work`; an error about its skeleton gets the file's name."""
    try:
        return work()
    except InputError as error:
        raise InputError(path, str(error)) from None


def _has_toes(skeleton: Skeleton) -> bool:
    body = identify_joints(skeleton)
    return body.left.toe is not None and body.right.toe is not None


def _group_by_skeleton(motions: Sequence[Motion]) -> list[list[int]]:
    """Group clips by skeleton, in the order of their first."""
    groups: dict[str, list[int]] = {}
    for number, motion in enumerate(motions):
        groups.setdefault(motion.skeleton.fingerprint, []).append(number)
    return list(groups.values())


def _find_commonest_skeleton(motions: Sequence[Motion], groups: list[list[int]]) -> Skeleton:
    """Find the skeleton with most frames."""
    best = max(groups, key=lambda group: (sum(len(motions[i]) for i in group), -group[0]))
    return motions[best[0]].skeleton


def _sample_frames(motions: Sequence[Motion], group: Sequence[int],
                   contact_mask: Sequence[np.ndarray]) -> tuple[Motion, np.ndarray]:
    """Sample frames of all clips of one rig above one floor, and which feet (T, 2) are flat on the ground in them.

    group: the rig's clips among `motions`, which may lie in a file: they are taken one after the other.
    """
    ends = np.cumsum([len(motions[i]) for i in group])
    frames = np.unique(np.linspace(0, ends[-1] - 1, _SAMPLE_COUNT).astype(int))
    roots, rotations, foot_contacts = [], [], []
    for i, end in zip(group, ends):
        motion = motions[i]
        here = frames[(frames >= end - len(motion)) & (frames < end)] - (end - len(motion))
        if len(here):
            roots.append(motion.root_positions[here] - [0.0, 0.0, contacts.measure_ground_height(motion)])
            rotations.append(motion.rotations[here])
            foot_contacts.append(contact_mask[i].all(axis=2)[here])
    first = motions[group[0]]
    sample = Motion(first.skeleton, np.concatenate(roots), np.concatenate(rotations), first.fps)
    return sample, np.concatenate(foot_contacts)
