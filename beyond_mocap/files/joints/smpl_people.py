"""Read motion of SMPL of many people, such as WorldPose's, as joints: those of a body with mean proportions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...base.time_series import find_runs
from ...motion import quaternion
from ...motion.contacts import measure_floor_height
from ...motion.motion import Motion, forward_kinematics
from ..plain_npz import list_arrays, read_named_arrays
from ..smpl.smpl import MAX_METRES, MAX_TURN, RATES, find_rate, find_up_axis, to_core_axes
from ..smpl.smpl_skeleton import JOINTS, PELVIS_AT_REST, TOE_HEIGHT, build_smpl_skeleton, estimate_smpl_stature
from .joint_feed import JointCollector, JointFeed

_KIND = "motion of SMPL of many people: global_orient (P, T, 3), body_pose (P, T, 69), transl (P, T, 3)"
_SPELLINGS = (("global_orient", "body_pose", "transl"), ("global_orients", "body_poses", "transl"))
_TYPES = tuple(np.dtype(kind) for kind in ("<f4", "<f8", "<i4", "<i8"))
_MAX_BYTES = 4 << 30
_USUAL_RATE = 50.0  # frames per second of WorldPose's cameras, which the arrays do not say
_USUAL_STATURE = 1.81  # metres, the mean of professional footballers, where the steps do not tell it
_DEGREES = 2.0  # the middle of a body's rotation vectors is some .1 rad: above, they are degrees
_SHORTEST = 1.0  # seconds of steps that tell a stature
LANDMARKS = tuple(f"{side}_{part}" for side in ("left", "right")
                for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot"))  # fmt: skip
"""The joints of SMPL that are landmarks of the same name."""


def is_people_file(path: Path) -> bool:
    """Return whether a file is an .npz whose arrays have the names of such motion."""
    return _find_names(path) is not None


def _find_names(path: Path) -> tuple[str, str, str] | None:
    """Find the names of root rotations, body rotations and translations in a file; None where it has others."""
    found = list_arrays(path)
    return next((names for names in _SPELLINGS if found.issuperset(names)), None)


def read_smpl_people(path: Path) -> JointFeed:
    """Read the people of a file; NaN where one is absent.

    Args:
        path: the .npz.
    Returns:
        Their shoulders, elbows, wrists, hips, knees, ankles and feet in metres, Z up, the lowest at the ground.
    Raises:
        InputError: if it is not such a file.
    """
    names = _find_names(path) or _SPELLINGS[0]
    arrays = read_named_arrays(path, _KIND, _TYPES, _MAX_BYTES, (*names, *RATES), is_finite=False)
    root, body, trans = (arrays[name] for name in names)
    if root.ndim != 3 or root.shape[2] != 3 or trans.shape != root.shape or body.ndim != 3 or body.shape[
            :2] != root.shape[:2] or body.shape[2] not in (63, 69):
        raise InputError(path, f"arrays of shapes {root.shape}, {body.shape}, {trans.shape}", _KIND,
                         "export them so; one person's motion is a clip of the library")
    if root.size and np.nanmedian(np.abs(body)) > _DEGREES:
        raise InputError(path, f"rotations of {np.nanmedian(np.abs(body)):.3g} in the middle", "radians",
                         "convert degrees to radians")
    found, (fps, notes) = JointCollector(path), find_rate(path, arrays, _USUAL_RATE)
    found.notes += notes
    found.notes.append("joints are those of mean proportions, as tall as the steps fit; shapes need the body model")
    for number in range(len(root)):
        poses = np.concatenate([root[number], body[number, :, :63]], axis=1).astype(float)
        places = trans[number].astype(float)
        seen = (np.abs(poses) < MAX_TURN).all(axis=1) & (np.abs(places) < MAX_METRES).all(axis=1)
        if seen.sum() >= 2:
            _add_person(found, str(number), poses.reshape(len(poses), len(JOINTS), 3), places, seen=seen, fps=fps)
    return found.build(fps)


def _add_person(found: JointCollector, name: str, poses: np.ndarray, trans: np.ndarray, seen: np.ndarray,
                fps: float) -> None:
    """Add the landmarks of a person, poses (T, 22, 3) and trans (T, 3), in the frames (T,) in which they are seen."""
    rotations = quaternion.from_rotation_vector(poses[seen])
    to_world, _ = find_up_axis(rotations[:, 0])
    local, origin = to_core_axes(rotations, trans[seen], to_world)
    stature = _estimate_stature(origin, local, seen, fps)
    pelvis = origin + to_world @ PELVIS_AT_REST
    motion = Motion(build_smpl_skeleton(stature), pelvis, local, fps)
    floor = measure_floor_height(motion) - TOE_HEIGHT * stature
    places = forward_kinematics(motion)[0] - (0.0, 0.0, floor)
    for row, frame in enumerate(np.flatnonzero(seen).tolist()):
        for landmark in LANDMARKS:
            found.add_point(name, frame / fps, landmark, places[row, JOINTS.index(landmark)].tolist())


def _estimate_stature(origin: np.ndarray, local: np.ndarray, seen: np.ndarray, fps: float) -> float:
    """Estimate how tall a person is from the longest stretch in which they are seen."""
    runs = find_runs(seen)
    first, last = max(runs, key=lambda run: run[1] - run[0])
    start = int(seen[:first].sum())
    part = slice(start, start + last - first)
    if (last - first) / fps < _SHORTEST:
        return _USUAL_STATURE
    return estimate_smpl_stature(Motion(build_smpl_skeleton(1.0), origin[part], local[part], fps)) or _USUAL_STATURE
