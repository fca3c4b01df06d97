"""Brings clips of many bodies to one skeleton: the one with most frames, or the one that the user names.

Every rig is analysed once, from frames of all its clips, so that one actor's clips share one neutral posture.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..motion import contacts
from ..motion.humanoid import identify
from ..motion.motion import Motion
from ..motion.retargeting.retarget import Retargeter
from ..motion.skeleton import Skeleton
from . import repair

SAME_BONES = 5e-3  # metres between offsets of equal bones
_SAMPLE = 400  # frames from which a rig is analysed


def bring(
    paths: Sequence[Path], motions: Sequence[Motion], chosen: Motion | None, notes: list[str]
) -> Iterator[tuple[Motion, np.ndarray, bool]]:
    """Bring clips to the library's skeleton.

    Heels and toes are in contact where the recording's own are; where only the new body has toes, contacts are detected
    on
    it.

    Args:
        paths: the files.
        motions: as read, in the order of `paths`.
        skeleton_example: a recording with the library's skeleton (default: the skeleton with most frames, the first
            path's among equals).
        notes: gets one line about retargeted clips.
    Returns:
        For each clip the motion, its contacts (T, 2, 2) bool of heels and toes, and whether it came from another body.
    Raises:
        InputError: naming the file, for a clip whose legs cannot be found.
    """
    standing = [_named(path, lambda: contacts.points(motion)) for path, motion in zip(paths, motions)]
    groups = _groups(motions)
    skeleton = chosen.skeleton if chosen is not None else _commonest(motions, groups)
    home = [i for i, motion in enumerate(motions) if motion.skeleton.same_bones(skeleton, SAME_BONES)]
    example, feet = _sample([motions[i] for i in home], [standing[i] for i in home]) if home else (chosen, None)
    rigs = {}
    for group in groups:
        if group[0] not in home:
            sample, down = _sample([motions[i] for i in group], [standing[i] for i in group])
            known: dict[str, Any] = {"example": example, "standing": down, "example_standing": feet}
            rig = _named(paths[group[0]], lambda: Retargeter(sample, skeleton, **known))
            rigs.update(dict.fromkeys(group, rig))
    if rigs:
        others = sum(group[0] in rigs for group in groups)
        notes.append(f"{len(rigs)} clips of {others} other skeletons retargeted to the one with {len(skeleton)} joints")
    return _brought(motions, standing, skeleton, rigs)


def bring_one(motion: Motion, target: Motion, bone_map: dict[str, str] | str | Path | None = None) -> Motion:
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
    points, feet = _points_if_named(motion), _points_if_named(target)
    rig = Retargeter(
        motion, target.skeleton, bone_map, example=target,
        standing=None if points is None else points.all(axis=2),
        example_standing=None if feet is None else feet.all(axis=2),
    )
    there = rig.carry(motion)
    if points is None or feet is None or motion.skeleton.same_bones(target.skeleton, 1e-6):
        return there
    return repair.held(there, _standing_there(there, motion.skeleton, points))


def _points_if_named(motion: Motion) -> np.ndarray | None:
    """Detect contacts (T, 2, 2); None for a skeleton whose joints only a bone map identifies."""
    try:
        return contacts.points(motion)
    except InputError:
        return None


def _brought(motions, standing, skeleton: Skeleton, rigs) -> Iterator[tuple[Motion, np.ndarray, bool]]:
    """Iterate over the clips on the library's skeleton, with contacts and whether they were retargeted."""
    for number, (motion, points) in enumerate(zip(motions, standing)):
        if number in rigs:
            there = rigs[number].carry(motion)
            yield there, _standing_there(there, motion.skeleton, points), True
        else:
            yield replace(motion, skeleton=skeleton), points, False


def _standing_there(there: Motion, skeleton: Skeleton, points: np.ndarray) -> np.ndarray:
    """Choose the contacts (T, 2, 2): the recording's own `points`, or new ones where only the new body has toes."""
    return contacts.points(there) if _has_toes(there.skeleton) and not _has_toes(skeleton) else points


def _named(path: Path, work):
    """Run `work`; an error about its skeleton gets the file's name."""
    try:
        return work()
    except InputError as error:
        raise InputError(path, str(error)) from None


def _has_toes(skeleton: Skeleton) -> bool:
    body = identify(skeleton)
    return body.left.toe is not None and body.right.toe is not None


def _groups(motions: Sequence[Motion]) -> list[list[int]]:
    """Group clips by skeleton, in the order of their first."""
    groups: dict[str, list[int]] = {}
    for number, motion in enumerate(motions):
        groups.setdefault(motion.skeleton.fingerprint, []).append(number)
    return list(groups.values())


def _commonest(motions: Sequence[Motion], groups: list[list[int]]) -> Skeleton:
    """Find the skeleton with most frames."""
    best = max(groups, key=lambda group: (sum(len(motions[i]) for i in group), -group[0]))
    return motions[best[0]].skeleton


def _sample(motions: Sequence[Motion], standing: Sequence[np.ndarray]) -> tuple[Motion, np.ndarray]:
    """Sample frames of all clips of one rig above one floor, and which feet (T, 2) are flat on the ground in them.
    """
    ends = np.cumsum([len(motion) for motion in motions])
    frames = np.unique(np.linspace(0, ends[-1] - 1, _SAMPLE).astype(int))
    roots, rotations, feet = [], [], []
    for motion, points, end in zip(motions, standing, ends):
        here = frames[(frames >= end - len(motion)) & (frames < end)] - (end - len(motion))
        if len(here):
            roots.append(motion.root_positions[here] - [0.0, 0.0, contacts.ground_height(motion)])
            rotations.append(motion.rotations[here])
            feet.append(points.all(axis=2)[here])
    sample = Motion(motions[0].skeleton, np.concatenate(roots), np.concatenate(rotations), motions[0].fps)
    return sample, np.concatenate(feet)
